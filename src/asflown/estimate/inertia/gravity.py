"""The orbit of a slew record: where the gravity gradient comes from, and whether its positions can be believed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.environment import MU_EARTH, gravity_gradient_bound
from ...dynamics.orbit import BODIES, Orbit
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from .surroundings import surroundings_of

if TYPE_CHECKING:
    from ...telemetry.telemetry import Telemetry
    from .record import SlewRecord

#: Fewest positions that tell an orbit, and the longest stretch without one, as a share of an orbit (by circular motion).
_FEWEST, _GAP = 8, 0.1
#: Velocities differ from the slope of the positions by less than this share.
_UNLIKE = 0.05

GRAVITY = Kind(
    "inertia.gravity-gradient", Severity.NOTE,
    "the gravity gradient of {body} is in the model: it is linear in the tensor, and position and attitude give it",
)  # fmt: skip
BODY_ASSUMED = Kind(
    "inertia.body-assumed", Severity.CAUTION,
    "the positions are too few or too coarse to tell which body they are about: the Earth is assumed",
    "Add orbit_position_x, _y, _z over a longer span or with more digits.",
)  # fmt: skip
BODY_UNKNOWN = Kind(
    "inertia.body-unknown", Severity.SUSPECT,
    "the orbit's own acceleration asks for a central body of {mu_m3_s2:.4g} m3/s2 at a distance of {nearest_km:.4g} km, which is no "
    "known one: the gravity gradient is taken from that acceleration",
    "Check the unit of orbit_position (km labelled m?) and the time stamps.",
)  # fmt: skip
BELOW_SURFACE = Kind(
    "inertia.below-surface", Severity.SUSPECT,
    "the orbit passes {nearest_km:.4g} km from the centre of {body}, below its surface",
    "Check the unit and the origin of orbit_position.",
)  # fmt: skip
NOT_FREE_FALL = Kind(
    "inertia.orbit-not-free-fall", Severity.SUSPECT,
    "the positions do not follow an orbit about one body (they miss it by {percent:.0f} % of the acceleration): the gravity gradient "
    "is left out, {left_out}",
    "Give orbit_position in inertial axes (not Earth-fixed ones), with its unit.",
)  # fmt: skip
NOT_PLAUSIBLE = Kind(
    "inertia.orbit-not-plausible", Severity.SUSPECT,
    "the positions are {nearest_km:.4g} km from the centre, too few or too coarse to tell of which body, and no orbit of the Earth: the "
    "gravity gradient is left out",
    "Check the unit and the origin of orbit_position.",
)  # fmt: skip
VELOCITY_APART = Kind(
    "inertia.velocity-apart", Severity.CAUTION,
    "orbit_velocity differs from the change of orbit_position by {percent:.0f} %: the positions are used",
    "Check units and axes of both.",
)  # fmt: skip
ORBIT_TOO_SHORT = Kind(
    "inertia.orbit-too-short", Severity.CAUTION,
    "orbit_position does not cover the wheels' readings ({why}): the gravity gradient is left out, {left_out}",
    "Give positions over the whole span.",
)  # fmt: skip
NO_ATTITUDE_FOR_GRAVITY = Kind(
    "inertia.gravity-left-out", Severity.CAUTION,
    "there is an orbit but no quaternion: the gravity gradient is left out, {left_out}",
    "Add the quaternion.",
)  # fmt: skip

_STEMS = [f"orbit_position_{a}" for a in AXES]


def with_orbit(record: SlewRecord, telemetry: Telemetry, start_ns: int, I_B: np.ndarray | None) -> SlewRecord:
    """The record with the orbit that the telemetry has, where it can be used, and doubts about it.

    ``start_ns``: the record's start (TAI); ``I_B`` (3, 3): the craft's own tensor, which tells the size of what is left out."""
    if not telemetry.has_axes("orbit_position"):
        return record
    tai_ns, position = together(telemetry, _STEMS)
    if len(tai_ns) < _FEWEST:
        return _without(record, ORBIT_TOO_SHORT(why=f"{len(tai_ns)} positions", left_out="by an unknown amount"))
    orbit, doubts = _about(Orbit((tai_ns - start_ns) / 1e9, position), _size(record, I_B))
    if orbit is None:
        return _without(record, *doubts)
    doubts.append(_velocity(telemetry, start_ns, orbit))
    left_out = _size(record, I_B)(orbit)
    if not record.has_attitude:
        return _without(record, *doubts, NO_ATTITUDE_FOR_GRAVITY(left_out=left_out))
    gap = _gap(record, orbit)
    if gap > _GAP * 2 * np.pi * np.sqrt(orbit.nearest_m**3 / orbit.mu):
        return _without(record, *doubts, ORBIT_TOO_SHORT(why=f"{gap:.0f} s without one", left_out=left_out))
    around = surroundings_of(telemetry, start_ns, orbit)
    return replace(record, orbit=orbit, surroundings=around, doubts=record.doubts + Doubts(doubts))


def _without(record: SlewRecord, *doubts: Doubt | None) -> SlewRecord:
    return replace(record, doubts=record.doubts + Doubts(doubts))


def _about(orbit: Orbit, size) -> tuple[Orbit | None, list[Doubt | None]]:
    """The orbit about the body that its acceleration tells, None where it cannot be believed, and doubts."""
    nearest_km = orbit.nearest_m / 1e3
    found = orbit.acceleration()
    earth = BODIES[0]
    if not found.told:
        if not earth.radius_m < orbit.nearest_m < 1e9:
            return None, [NOT_PLAUSIBLE(nearest_km=nearest_km)]
        return orbit, [BODY_ASSUMED(), GRAVITY(body=earth.name)]
    if not found.free_fall:
        return None, [NOT_FREE_FALL(percent=100 * found.misfit, left_out=size(orbit))]
    body = found.body
    if body is None:
        unknown = BODY_UNKNOWN(mu_m3_s2=found.mu, nearest_km=nearest_km)
        return replace(orbit, mu=found.mu), [unknown, GRAVITY(body="that body")]
    # of a planet with moons the table's own acceleration serves as well; the constant has less noise
    below = BELOW_SURFACE(body=body.name, nearest_km=nearest_km) if orbit.nearest_m < 0.99 * body.radius_m else None
    return replace(orbit, mu=body.mu), [below, GRAVITY(body=body.name)]


def _size(record: SlewRecord, I_B: np.ndarray | None):
    """Words for the largest gravity gradient there can be, and the momentum it would bring over the record."""
    span = max(b for _, b in record.arcs) - min(a for a, _ in record.arcs)

    def words(orbit: Orbit) -> str:
        if I_B is None or record.relative or orbit.nearest_m < 1e3:
            rate = 1.5 * MU_EARTH / max(orbit.nearest_m, 1e3) ** 3
            each = "for each kg m2 between the principal moments"
            return f"up to {rate:.2g} N m, or {rate * span:.2g} N m s over the record, {each}"
        torque = float(gravity_gradient_bound(I_B, orbit.nearest_m, orbit.mu))
        return f"up to {torque:.2g} N m, or {torque * span:.2g} N m s over the record"

    return words


def _velocity(telemetry: Telemetry, start_ns: int, orbit: Orbit) -> Doubt | None:
    if not telemetry.has_axes("orbit_velocity"):
        return None
    tai_ns, v = together(telemetry, [f"orbit_velocity_{a}" for a in AXES])
    t = (tai_ns - start_ns) / 1e9
    inside = (t >= orbit.time_s[0]) & (t <= orbit.time_s[-1])
    if inside.sum() < _FEWEST:
        return None
    slope = orbit.velocity_at(t[inside])
    off = np.median(np.linalg.norm(v[inside] - slope, axis=1)) / max(np.median(np.linalg.norm(slope, axis=1)), 1e-12)
    return VELOCITY_APART(percent=100 * off) if off > _UNLIKE else None


def _gap(record: SlewRecord, orbit: Orbit) -> float:
    """Longest stretch of the wheels' readings without a position. [s]"""
    t, wheels = orbit.time_s, record.momentum.time_s
    inside = t[(t > wheels.min()) & (t < wheels.max())]
    ends = max(t[0] - wheels.min(), wheels.max() - t[-1], 0.0)
    steps = np.diff(np.concatenate([[max(t[0], wheels.min())], inside, [min(t[-1], wheels.max())]]))
    return float(max(ends, steps.max()))
