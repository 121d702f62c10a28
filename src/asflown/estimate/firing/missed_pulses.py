"""Momentum that comes as from pulses while no on-time rises: thrusters that fire uncounted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import Valve, moment_matrix
from ...kit.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft, Thruster

#: So many pulses' worth of momentum within one span in which no on-time rises are more than what pulses still owe.
PULSES = 4.0
#: Instants at either end over which momentum is averaged, and share by which the inertia may be off.
_ENDS, _INERTIA = 3, 0.1


def uncounted(gained_Nms: float, pulses: float, when: str, source: str) -> BadInput:
    return BadInput(
        f"momentum changes by {gained_Nms:.3g} N m s {when}, as by {pulses:.0f} pulses, while no on-time rises: thrusters fire that "
        "are not counted, those of the other branch, or one leaks",
        file=source or None,
        remedy="Give the on-times of the branch that fires, or narrow the span; `asflown leak` looks for a leak.",
    )


def gained_idle(momentum: np.ndarray, body: np.ndarray) -> float:
    """Change of momentum (N, 3) from the first instants to the last, in axes that do not turn, beyond what an inertia not quite
    right makes of the body's own (N, 3). [N m s]"""

    def change(v) -> float:
        return float(np.linalg.norm(v[-_ENDS:].mean(axis=0) - v[:_ENDS].mean(axis=0)))

    return max(change(momentum) - _INERTIA * change(body), 0.0)


def pulse_Nms(craft: Craft, thrusters: Sequence[Thruster], step_s: float, tai_ns: int | None) -> float:
    """What a pulse of one control step turns the craft by, of the thruster with the longest arm. [N m s]"""
    thrust = craft.believed_thrust(tai_ns)
    arms = np.linalg.norm(
        moment_matrix([t.position for t in thrusters], [t.direction for t in thrusters], craft.likely_center), axis=0
    )
    mean = Valve(*(float(np.mean([getattr(t, k) for t in thrusters])) for k in ("delay", "rise", "fall")))
    own = Valve(mean.delay_s, mean.rise_s or 1e-6, mean.fall_s)
    return float(thrust * arms.max() * own.effective(max(step_s, 2 * own.delay_s)))
