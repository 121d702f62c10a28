"""Momentum that changes as by pulses while no on-time rises: thrusters that fire uncounted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import Valve, moment_matrix
from ...kit.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft, Thruster

#: A change of momentum beyond that of so many pulses, within a span in which no on-time rises, is not the tail of earlier pulses.
PULSES = 4.0
#: Instants at either end over which momentum is averaged, and share by which the inertia may be off.
_ENDS, _INERTIA = 3, 0.1


def uncounted(gained_Nms: float, pulses: float, when: str, source: str) -> BadInput:
    """The error to raise; ``when``: such as 'in this record'."""
    return BadInput(
        f"momentum changes by {gained_Nms:.3g} N m s {when}, as by {pulses:.0f} pulses, while no on-time rises: thrusters fire that "
        "are not counted, those of the other branch, or one leaks",
        file=source or None,
        remedy="Give the on-times of the branch that fires, or narrow the span; `asflown leak` looks for a leak.",
    )


def gained_idle(momentum: np.ndarray, body: np.ndarray) -> float:
    """Change of momentum (N, 3) from the first instants to the last, in inertial axes, beyond what an error of the inertia can
    make of the body's own (N, 3). [N m s]"""

    def change(v) -> float:
        return float(np.linalg.norm(v[-_ENDS:].mean(axis=0) - v[:_ENDS].mean(axis=0)))

    return max(change(momentum) - _INERTIA * change(body), 0.0)


def pulse_Nms(craft: Craft, thrusters: Sequence[Thruster], step_s: float, tai_ns: int | None) -> float:
    """Angular impulse of a pulse of one control step, of the thruster with the longest arm. [N m s]"""
    thrust = craft.believed_thrust(tai_ns)
    arms = np.linalg.norm(
        moment_matrix([t.position for t in thrusters], [t.direction for t in thrusters], craft.likely_center), axis=0
    )
    mean = Valve(*(float(np.mean([getattr(t, k) for t in thrusters])) for k in ("delay", "rise", "fall")))
    own = Valve(mean.delay_s, mean.rise_s or 1e-6, mean.fall_s)
    return float(thrust * arms.max() * own.effective(max(step_s, 2 * own.delay_s)))
