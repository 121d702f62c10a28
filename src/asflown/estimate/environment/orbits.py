"""The orbit that telemetry gives as positions: about which body it is, and whether it can be believed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.environment import MU_EARTH, gravity_gradient_bound
from ...dynamics.orbit import BODIES, J2_EARTH, Orbit, bridged
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...telemetry.telemetry import Telemetry

#: Fewest positions that tell an orbit.
FEWEST = 8
#: The longest gap that is flown through, as a share of a revolution.
_FLOWN = 0.4
#: Velocities differ from the slope of the positions by less than this share.
_UNLIKE = 0.05

BODY_ASSUMED = Kind(
    "environment.body-assumed", Severity.CAUTION,
    "the positions are too few or too coarse to tell which body they are about: the Earth is assumed",
    "Add orbit_position_x, _y, _z over a longer span or with more digits.",
)  # fmt: skip
BODY_UNKNOWN = Kind(
    "environment.body-unknown", Severity.SUSPECT,
    "the orbit's own acceleration asks for a central body of {mu_m3_s2:.4g} m3/s2 at a distance of {nearest_km:.4g} km, which is no "
    "known one: the gravity gradient is taken from that acceleration",
    "Check the unit of orbit_position (km labelled m?) and the time stamps.",
)  # fmt: skip
BELOW_SURFACE = Kind(
    "environment.below-surface", Severity.SUSPECT,
    "the orbit passes {nearest_km:.4g} km from the centre of {body}, below its surface",
    "Check the unit and the origin of orbit_position.",
)  # fmt: skip
NOT_FREE_FALL = Kind(
    "environment.orbit-not-free-fall", Severity.SUSPECT,
    "the positions do not follow an orbit about one body (they miss it by {percent:.0f} % of the acceleration): the gravity gradient "
    "is left out, {left_out}",
    "Give orbit_position in inertial axes (not Earth-fixed ones), with its unit.",
)  # fmt: skip
NOT_PLAUSIBLE = Kind(
    "environment.orbit-not-plausible", Severity.SUSPECT,
    "the positions are {nearest_km:.4g} km from the centre, too few or too coarse to tell of which body, and no orbit of the Earth: the "
    "gravity gradient is left out",
    "Check the unit and the origin of orbit_position.",
)  # fmt: skip
NO_FIX = Kind(
    "environment.no-fix", Severity.NOTE,
    "orbit_position is zero in {count} of its samples, as a receiver without a fix writes it: these are left out",
)  # fmt: skip
MISREAD = Kind(
    "environment.positions-misread", Severity.SUSPECT,
    "orbit_position is an orbit about a known body only if its values are {reading}",
    "Label them with the unit they have, and give them in inertial axes (GCRS, J2000).",
)  # fmt: skip
CARRIED = Kind(
    "environment.orbit-carried", Severity.CAUTION,
    "the positions are those of [orbit], carried over {days:.1f} days with the Earth's flattening alone: drag moves a craft in low orbit "
    "along it by kilometres in a day and by hundreds in ten",
    "Give elements of that day in the craft file, or orbit_position_x, _y, _z in the telemetry.",
)  # fmt: skip
VELOCITY_APART = Kind(
    "environment.velocity-apart", Severity.CAUTION,
    "orbit_velocity differs from the change of orbit_position by {percent:.0f} %: the positions are used",
    "Check units and axes of both.",
)  # fmt: skip

GAPS_FLOWN = Kind(
    "environment.gaps-flown", Severity.NOTE,
    "orbit_position is missing {count} times, for up to {longest_s:.0f} s: between, the craft is taken to fall freely from the last to the "
    "next position",
)  # fmt: skip

_STEMS = [f"orbit_position_{a}" for a in AXES]


def orbit_in(
    telemetry: Telemetry, start_ns: int, left_out: Callable[[Orbit], str]
) -> tuple[Orbit | None, str, Doubts, int]:
    """The orbit of orbit_position, its seconds from ``start_ns`` (TAI); the body's name; doubts; how many positions there are.

    None where there are too few positions (no doubt says so) or where they cannot be believed.  ``left_out``: words for the
    torque that is then left out."""
    if not telemetry.has_axes("orbit_position"):
        return None, "", Doubts(), 0
    tai_ns, position = together(telemetry, _STEMS)
    fixed = np.linalg.norm(position, axis=1) > 1.0  # a receiver without a fix writes zeros
    lost = NO_FIX(count=int(np.sum(~fixed))) if not fixed.all() else None
    tai_ns, position = tai_ns[fixed], position[fixed]
    if len(tai_ns) < FEWEST:
        return None, "", Doubts([] if len(tai_ns) else [lost]), len(tai_ns)
    orbit, body, doubts = _about(Orbit((tai_ns - start_ns) / NS, position), left_out)
    doubts.append(lost)
    if orbit is not None:
        doubts.append(_velocity(telemetry, start_ns, orbit))
    return orbit, body, Doubts(doubts), len(tai_ns)


def _about(orbit: Orbit, left_out: Callable[[Orbit], str]) -> tuple[Orbit | None, str, list[Doubt | None]]:
    """The orbit about the body that its acceleration tells, None where it cannot be believed, and doubts."""
    nearest_km = orbit.nearest_m / 1e3
    found = _without_gaps(orbit).acceleration()
    earth = BODIES[0]
    if not found.told:
        if not earth.radius_m < orbit.nearest_m < 1e9:
            return None, "", [NOT_PLAUSIBLE(nearest_km=nearest_km)]
        return orbit, earth.name, [BODY_ASSUMED()]
    if not found.free_fall:
        return None, "", [_misread(orbit), NOT_FREE_FALL(percent=100 * found.misfit, left_out=left_out(orbit))]
    body = found.body
    if body is None:
        unknown = BODY_UNKNOWN(mu_m3_s2=found.mu, nearest_km=nearest_km)
        return replace(orbit, mu=found.mu), "that body", [_misread(orbit), unknown]
    # of a planet with moons the table's own acceleration serves as well; the constant has less noise
    below = BELOW_SURFACE(body=body.name, nearest_km=nearest_km) if orbit.nearest_m < 0.99 * body.radius_m else None
    return replace(orbit, mu=body.mu), body.name, [below]


def _misread(orbit: Orbit) -> Doubt | None:
    words = orbit.misreading()
    return MISREAD(reading=words) if words else None


def carried(epoch_ns: int, tai_ns: np.ndarray) -> Doubt | None:
    """A doubt about elements that are more than a day from the instants (N,) they are used at."""
    days = float(np.abs(tai_ns - epoch_ns).max()) / (86_400 * NS)
    return CARRIED(days=days) if days > 1 else None


def refuse_contradictions(telemetry: Telemetry, doubts: Doubts) -> None:
    """Raise BadInput where positions contradict themselves: field, Sun and air at such a place would say nothing."""
    for d in doubts.of(MISREAD, BELOW_SURFACE, NOT_PLAUSIBLE):
        raise BadInput(
            str(d).removesuffix(": the gravity gradient is left out"), file=telemetry.source or None,
            channel="orbit_position", remedy=d.remedy,
        )  # fmt: skip


def _without_gaps(orbit: Orbit) -> Orbit:
    """The longest stretch without a gap: a curve through positions far apart has another acceleration."""
    t = orbit.time_s
    cuts = np.flatnonzero(np.diff(t) > 20 * float(np.median(np.diff(t)))) + 1
    part = max(np.split(np.arange(len(t)), cuts), key=len)
    return orbit if len(part) < FEWEST else Orbit(t[part], orbit.position_N[part], orbit.mu)


def gravity_words(I_B: np.ndarray | None, span_s: float) -> Callable[[Orbit], str]:
    """Words for the largest gravity gradient there can be on a tensor (3, 3) [kg m2], and the momentum it brings over a span."""

    def words(orbit: Orbit) -> str:
        if I_B is None or orbit.nearest_m < 1e3:
            rate = 1.5 * MU_EARTH / max(orbit.nearest_m, 1e3) ** 3
            each = "for each kg m2 between the principal moments"
            return f"up to {rate:.2g} N m, or {rate * span_s:.2g} N m s over the record, {each}"
        torque = float(gravity_gradient_bound(I_B, orbit.nearest_m, orbit.mu))
        return f"up to {torque:.2g} N m, or {torque * span_s:.2g} N m s over the record"

    return words


def flown_through(orbit: Orbit, body: str) -> tuple[Orbit, Doubt | None]:
    """The orbit with gaps of up to ``_FLOWN`` of a revolution flown, and a note of them."""
    round_s = 2 * np.pi * np.sqrt(orbit.nearest_m**3 / orbit.mu)
    whole, gaps = bridged(orbit, _FLOWN * round_s, J2_EARTH if body == BODIES[0].name else 0.0)
    return (whole, GAPS_FLOWN(count=len(gaps), longest_s=max(gaps))) if gaps else (orbit, None)


def longest_gap(orbit: Orbit, first_s: float, last_s: float) -> float:
    """Longest stretch between two instants without a position. [s]"""
    t = orbit.time_s
    inside = t[(t > first_s) & (t < last_s)]
    ends = max(t[0] - first_s, last_s - t[-1], 0.0)
    steps = np.diff(np.concatenate([[max(t[0], first_s)], inside, [min(t[-1], last_s)]]))
    return float(max(ends, steps.max()))


def _velocity(telemetry: Telemetry, start_ns: int, orbit: Orbit) -> Doubt | None:
    if not telemetry.has_axes("orbit_velocity"):
        return None
    tai_ns, v = together(telemetry, [f"orbit_velocity_{a}" for a in AXES])
    t = (tai_ns - start_ns) / NS
    inside = (t >= orbit.time_s[0]) & (t <= orbit.time_s[-1])
    if inside.sum() < FEWEST:
        return None
    slope = orbit.velocity_at(t[inside])
    off = np.median(np.linalg.norm(v[inside] - slope, axis=1)) / max(np.median(np.linalg.norm(slope, axis=1)), 1e-12)
    return VELOCITY_APART(percent=100 * off) if off > _UNLIKE else None
