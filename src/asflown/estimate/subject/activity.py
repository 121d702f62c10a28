"""What the craft does in a record: whether it slews, which thrusters fire."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.errors import BadInput
from ...kit.scatter import difference_sigma
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Channel, Telemetry

#: A body rate that changes by more than both is that of a slew (studies/slew_threshold.py): a rate [rad/s],
#: and so many sigma of its noise.
_SWING, _SIGMAS = 5e-4, 20.0
#: A craft turns where a body rate's median is more than this. [rad/s]
_TURN = 1e-4


def without_spikes(rates: np.ndarray) -> np.ndarray:
    """Rates (N,) or (N, k) through a running median of five samples."""
    return scipy.ndimage.median_filter(rates, (5,) + (1,) * (rates.ndim - 1), mode="nearest")


def changes_as_in_a_slew(rates: np.ndarray, *, count_size: float = 0.0) -> bool:
    """Whether any of the body's rates (N, k) [rad/s] changes more than holds let it; how fast it turns does not matter."""
    if len(rates) < 5:
        return False
    noise = max(np.nan_to_num(difference_sigma(rates, 3)), count_size / 12**0.5)
    least = max(_SWING, _SIGMAS * noise)
    # a median never changes by more than its samples do
    return bool(np.ptp(rates, axis=0).max() > least and np.ptp(without_spikes(rates), axis=0).max() > least)


def slews(telemetry: Telemetry) -> bool:
    """Whether the craft slews: a steady turn, as of a craft that points to the Earth, is none."""
    return any(changes_as_in_a_slew(c.values[:, None], count_size=c.count_size) for c in _rates(telemetry))


def turns(telemetry: Telemetry) -> bool:
    """Whether the craft turns steadily, or for most of the record."""
    return any(len(c.values) and abs(np.median(c.values)) > _TURN for c in _rates(telemetry))


def _rates(telemetry: Telemetry) -> list[Channel]:
    return [telemetry.channel(f"body_rate_{a}").usable for a in AXES if f"body_rate_{a}" in telemetry]


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
