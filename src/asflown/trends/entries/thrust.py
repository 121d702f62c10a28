"""The entry of a thrust: its mean over the blow-down prediction, and each thruster over the mean.

Two effects change the thrust.  All thrusters weaken as the tank empties: ``thrust_over_prediction`` removes the predicted part.  A
thruster whose bed or valve degrades weakens against the others: ``thrust_<NAME>_over_mean``, in which the fall time and all else that the
thrusters of one record share cancels, is far better known than its thrust.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..entry import Entry, Value
from .of_record import record_entry

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...estimate.thrust import ThrustResult
    from ...telemetry.telemetry import Telemetry

KIND = "thrust"
#: A thrust is judged by the joint method; others are kept under their own name.
_JOINT = "telemetry"


def thrust_entry(result: ThrustResult, telemetry: Telemetry, craft: Craft, event_id: str | None = None) -> Entry:
    """The entry of one result, on the date of its first record.  Raises BadInput for telemetry without an epoch."""
    return record_entry(KIND, tuple(_values(result)), result.doubts, telemetry, craft, event_id, result.provenance)


def _values(r: ThrustResult):
    basis = _JOINT if r.method == "joint" else f"{r.method}, {r.variant}"
    yield Value("thrust_mean", basis, r.mean_thrust_N, r.mean_thrust_sigma_N, "N")
    yield Value("thrust_fall_time", basis, r.fall_time_s, r.fall_time_sigma_s, "s")
    if r.predicted_thrust_N is not None:
        sigma = None if r.mean_thrust_sigma_N is None else r.mean_thrust_sigma_N / r.predicted_thrust_N
        yield Value("thrust_over_prediction", basis, r.mean_thrust_N / r.predicted_thrust_N, sigma, "")
    for name, (ratio, sigma) in r.over_mean.items():
        yield Value(f"thrust_{name}_over_mean", basis, ratio, sigma, "")
