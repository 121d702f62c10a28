"""Whether the momentum gained while thrusters fire is what the ordered pulses should give.

The monitor looks for one thruster that errs.  Where all err alike (units, thrust, places, spin inertia) the common thrust takes it up,
and no thruster stands out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ..firing import thrust_slip

if TYPE_CHECKING:
    from .diagnosis import Diagnosis
    from .firing import Geometry
    from .residual import Steps

#: Steps with firing that tell.
_FEWEST = 8
#: Share, and sigmas, by which the momentum may miss what is ordered: 2.5 sigma of the thrust that is taken as known.
_OFF, _SIGMAS = 0.25, 4.0

NOT_AS_ORDERED = Kind(
    "leak.not-as-ordered", Severity.SUSPECT,
    "the momentum gained in steps with firing is {ratio:.3g} ± {ratio_sigma:.1g} times what the ordered pulses should give{guess}",
    "Check units and names of the on-times, the thrust (--thrust), the wheels' senses and spin inertia, and the thrusters' places.",
)  # fmt: skip
NEVER_ORDERED = Kind(
    "leak.never-ordered", Severity.SUSPECT,
    "{thruster} is named as leaking, and is never ordered to fire in a record in which others do: its on-times may be missing (a column of "
    "zeros)",
    "Check that column; the firing of a thruster that is not counted looks like a leak.",
)  # fmt: skip
ONLY_WHILE_FIRING = Kind(
    "leak.only-while-firing", Severity.SUSPECT,
    "the momentum that {thruster} is said to leak is gained at {rate_Nm:.2g} N m in steps with firing and at {idle_Nm:.2g} ± "
    "{idle_sigma_Nm:.1g} N m in the others, where a leak does not care: pulses that are not counted, or on-times under wrong names",
    "Check the names and units of the on-time columns, and whether one is all zeros.",
)  # fmt: skip


def as_ordered(steps: Steps, geometry: Geometry, found: Diagnosis) -> list[Doubt]:
    """Doubts of a record in which thrusters fire; nothing of one in which none does."""
    ordered, doubts = steps.ordered.copy(), []
    if not ordered.any():
        return []
    if (
        found.kind == "leak"
        and found.thruster is not None
        and not ordered[:, geometry.names.index(found.thruster)].any()
    ):
        doubts.append(NEVER_ORDERED(thruster=found.thruster))
    if found.kind == "leak":
        doubts += _while_firing(steps, found)
    middle = 0.5 * (steps.turned[1:] + steps.turned[:-1])

    def given(by):  # (K, 3), inertial axes
        return np.einsum("nij,nj->ni", middle, by[1:] @ geometry.columns.T)

    gained = np.diff(steps.residual, axis=0) + given(ordered)
    if found.kind == "weak" and found.loss is not None:
        ordered[:, geometry.names.index(found.thruster)] *= max(1 - found.loss, 0.0)
    should = given(ordered)
    used = (np.linalg.norm(should, axis=1) > 0) & ~steps.lost[1:]
    if used.sum() < _FEWEST:
        return doubts
    x, y = should[used], gained[used]
    power = float(np.sum(x**2))
    ratio = float(np.sum(x * y)) / power
    left = np.sum(x * (y - ratio * x), axis=1)
    sigma = float(np.sqrt(np.sum(left**2))) / power
    if abs(ratio - 1) > max(_OFF, _SIGMAS * sigma):
        doubts.append(NOT_AS_ORDERED(ratio=ratio, ratio_sigma=sigma, guess=thrust_slip(ratio)))
    return doubts


def _while_firing(steps: Steps, found: Diagnosis) -> list[Doubt]:
    """Whether a leak goes on while nothing fires; what is gained along its torque since its onset, in steps of both kinds."""
    torque = found.torque_Nm
    if torque is None or found.onset_ci95_s is None:
        return []
    along = steps.turned[1:] @ (torque / np.linalg.norm(torque))
    gained, span = np.sum(np.diff(steps.residual, axis=0) * along, axis=1), np.diff(steps.seconds)
    fires = steps.ordered[1:].any(axis=1)
    since = np.cumsum(span) > found.onset_ci95_s[1]
    used = since & ~steps.lost[1:]
    parts = [used & fires, used & ~fires]
    if min(p.sum() for p in parts) < _FEWEST:
        return []
    (rate, sigma), (idle, idle_sigma) = (_rate(gained[p], span[p]) for p in parts)
    if rate - idle < max(0.5 * rate, _SIGMAS * np.hypot(sigma, idle_sigma)):
        return []
    return [ONLY_WHILE_FIRING(thruster=found.thruster, rate_Nm=rate, idle_Nm=idle, idle_sigma_Nm=idle_sigma)]


def _rate(gained: np.ndarray, span_s: np.ndarray) -> tuple[float, float]:
    """Mean rate of steps, and its sigma from their scatter."""
    rate = float(gained.sum() / span_s.sum())
    return rate, float(np.sqrt(np.sum((gained - rate * span_s) ** 2)) / span_s.sum())
