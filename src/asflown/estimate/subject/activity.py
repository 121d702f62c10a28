"""What the craft does in a record: whether it slews, which thrusters fire."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from ...kit.errors import BadInput
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

#: A body rate that changes by more than this is that of a slew. [rad/s]
_SWING_OF_A_SLEW = 2e-4


def slews(telemetry: Telemetry) -> bool:
    """Whether the body's rate changes as it does in a slew, never in a hold; single spikes do not count."""
    rates = [telemetry.channel(f"body_rate_{a}").usable.values for a in AXES if f"body_rate_{a}" in telemetry]
    return any(len(r) and np.ptp(ndimage.median_filter(r, 5)) > _SWING_OF_A_SLEW for r in rates)


def thrusters_firing(telemetry: Telemetry) -> list[str]:
    """Thrusters whose cumulative on-time or pulse count rises in the record."""
    channels = [c for c in telemetry.channels.values() if c.kind.stem in ("on_time", "pulse_count")]
    return list(dict.fromkeys(c.member for c in channels if (np.diff(c.usable.values) > 0).any()))


def check_on_times(telemetry: Telemetry, craft: Craft) -> None:
    """Raises BadInput where the control mode says that thrusters hold the craft, and what they did is not in the record."""
    mode = telemetry.channels.get("control_mode")
    if mode is None or "RCS" not in mode.usable.values or thrusters_firing(telemetry):
        return
    first = craft.thrusters[0].name if craft.thrusters else "<THRUSTER>"
    raise BadInput(
        "thrusters hold the craft in this record, and how long each fired is not in it: their torque cannot be told from the surroundings'",
        file=telemetry.source or None,
        channel=f"on_time_{first}",
        remedy=f"Add on_time_{first} and those of the others, cumulative in seconds (and pulse_count_{first}, … where they are known).",
    )
