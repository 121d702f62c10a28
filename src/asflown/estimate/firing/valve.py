"""The valve that all thrusters of a craft share: delay, rise and fall."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import Valve

if TYPE_CHECKING:
    from ...craft.model import Thruster


def valve_of(thrusters: tuple[Thruster, ...], fall_s: float) -> Valve:
    """Delay and rise in the mean of the craft's thrusters; fall as said."""
    return Valve(
        float(np.mean([t.delay for t in thrusters])), float(np.mean([t.rise for t in thrusters])) or 1e-6, fall_s
    )
