"""Momentum of wheels and body, body rates and attitude at instants that all channels share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.rotations import rotation, turned_by
from ...kit.timeline import NS, cadence_ns
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ...telemetry.telemetry import BRIDGED, Channel, Telemetry
from .actuation import actuators
from .grid import grid_for, splined

if TYPE_CHECKING:
    from .subject import Subject


@dataclass(frozen=True)
class Samples:
    """What all channels say at common instants: momentum of each wheel (N, n, 3) and of the body (N, 3), body axes; body
    rates (N, 3) or None; attitude, body to inertial, or None."""

    tai_ns: np.ndarray
    each: np.ndarray
    body: np.ndarray
    rates: np.ndarray | None
    attitude: scipy.spatial.transform.Rotation | None
    doubts: Doubts
    splined_s: float = 0.0  # the coarsest cadence, where channels had to be splined to common instants

    @property
    def seconds(self) -> np.ndarray:
        """From the first."""
        return (self.tai_ns - self.tai_ns[0]) / NS

    @property
    def stored(self) -> np.ndarray:
        return self.each.sum(axis=1)

    @property
    def momentum(self) -> np.ndarray:
        return self.stored + self.body

    @property
    def turned(self) -> scipy.spatial.transform.Rotation:
        """From body axes to those the body had at the first instant: by attitude, else by rates; no turn where neither is known."""
        if self.attitude is not None:
            return self.attitude[0].inv() * self.attitude
        return (
            scipy.spatial.transform.Rotation.identity(len(self.tai_ns))
            if self.rates is None
            else turned_by(self.seconds, self.rates)
        )


#: Instants that a fit takes at least.
FEWEST = 8

SPLINED = Kind(
    "subject.splined", Severity.NOTE, "the channels are sampled at different instants: they are splined to common ones"
)
QUATERNION_IN_PARTS = Kind(
    "subject.quaternion-in-parts", Severity.CAUTION,
    "the components of the quaternion are never known at the same instant: it is not used",
)  # fmt: skip
BODY_LEFT_OUT = Kind(
    "subject.body-left-out",
    Severity.CAUTION,
    "{why}: the body's own momentum is left out",
    "Add body_rate_x, _y, _z, or --inertia.",
)
GAPS_IN_MOMENTUM = Kind(
    "subject.gaps-in-momentum", Severity.NOTE,
    "{count} gaps, {total_s:.0f} s in all, the longest at {start}: the torque is assumed to be the same in them",
)  # fmt: skip


def samples_of(subject: Subject) -> Samples:
    """Everything at instants that all channels share; splined onto a grid where they do not."""
    tlm, I_B = subject.telemetry, subject.inertia_kgm2
    stored, pushed, doubts = actuators(subject)
    if pushed:
        raise BadInput(
            "only the actuators' torque is in the telemetry, not the momentum they hold",
            remedy="This needs wheel_rate_<WHEEL> or wheel_momentum_x|y|z; asflown torque takes control_torque.",
        )
    rates = [tlm.channel(f"body_rate_{a}") for a in AXES] if tlm.has_axes("body_rate") else []
    names = [f"quaternion_{m}" for m in "wxyz"]
    quaternion = names if all(n in tlm for n in names) else []
    channels = [*(c for c, _ in stored), *rates]
    tai_ns, values = together(tlm, [*(c.name for c in channels), *quaternion])
    splined_s = 0.0
    if len(tai_ns) > 0.5 * len(stored[0][0].usable.tai_ns):
        attitude = rotation(values[:, len(channels) :]) if quaternion else None
    else:
        doubts = [*doubts, SPLINED()]
        tai_ns, values, attitude = _splined(channels, together(tlm, quaternion) if quaternion else None)
        splined_s = max(c.usable.cadence_ns for c in channels) / NS
        if quaternion and attitude is None:
            doubts.append(QUATERNION_IN_PARTS())
    if len(tai_ns) < FEWEST:
        raise BadInput(
            f"{len(tai_ns)} instants at which all channels are known are too few",
            remedy=f"At least {FEWEST} are needed: take a longer record.",
        )
    each = values[:, : len(stored), None] * np.array([d for _, d in stored])
    w = values[:, len(stored) : len(channels)] if rates else None
    body = np.zeros((len(tai_ns), 3))
    if w is not None and I_B is not None:
        body = w @ I_B
    else:
        missing = "body rates are not in the telemetry" if w is None else "the craft's inertia is not known"
        doubts = [*doubts, BODY_LEFT_OUT(why=missing)]
    return Samples(tai_ns, each, body, w, attitude, Doubts([*doubts, *_gaps(tlm, tai_ns)]), splined_s)


def _splined(channels: list[Channel], quaternion):
    """Instants, values (N, channels) and attitude on an even grid at the coarsest cadence, where all are known.

    ``quaternion``: instants and values (M, 4), or None."""
    grid = grid_for(channels, max(c.usable.cadence_ns for c in channels) / NS)
    values = np.stack([splined(c, grid) for c in channels], axis=1)
    known = np.isfinite(values).all(axis=1)
    attitude = None
    if quaternion is not None and len(quaternion[0]) > 0.25 * grid.count:
        t = grid.of(quaternion[0])
        known &= (grid.seconds >= t[0]) & (grid.seconds <= t[-1])
        attitude = scipy.spatial.transform.Slerp(t, rotation(quaternion[1]))(grid.seconds[known])
    tai_ns = grid.start_ns + np.rint(grid.seconds * NS).astype(np.int64)
    return tai_ns[known], values[known], attitude


def _gaps(tlm: Telemetry, tai_ns: np.ndarray) -> list[Doubt]:
    step = np.diff(tai_ns)
    long = np.flatnonzero(step > (BRIDGED + 1.5) * cadence_ns(tai_ns))
    if not len(long):
        return []
    worst = long[int(np.argmax(step[long]))]
    return [
        GAPS_IN_MOMENTUM(
            count=len(long), total_s=float(step[long].sum() / NS), start=tlm.describe_time(int(tai_ns[worst]))
        )
    ]
