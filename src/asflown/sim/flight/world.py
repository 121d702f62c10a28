"""The world along the orbit of a flight: where the craft is, the field, the Sun, the air, and what of the craft they act on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn, cast

import numpy as np
import scipy

from ...dynamics.environment import MU_EARTH
from ...dynamics.magnetic_field import field_at
from ...dynamics.orbit import EARTH_RADIUS_M, check_above_earth, flown, propagate, state_of
from ...dynamics.sun import sun_direction, sunlit
from ...dynamics.thermosphere import density_at, exponential_density
from ...kit.errors import BadInput
from ...kit.timeline import NS
from ..tables import read_table
from .plant import AIR, LIT, World

if TYPE_CHECKING:
    from ...craft.model import CraftAt
    from ...craft.surroundings import OrbitElements
    from ..scenario import Environment, Scenario

#: Sunlight's pressure on what absorbs it, at one astronomical unit: 1361 W/m2 over the speed of light. [Pa]
SUN_PRESSURE = 1361.0 / 299_792_458.0
#: Rate at which the Earth turns. [rad/s]
EARTH_RATE = 7.292115e-5
#: From knot to knot at least: the curves are cubics, the Sun's share straight lines. [s]
_KNOT_S = 0.25
#: Density of the air where neither craft nor scenario gives one: some 500 km high. Assumed. [kg/m3]
_DENSITY_KGM3 = 5e-13
_ORBITAL = ("orbit_position", "orbit_velocity", "magnetic_field", "sun_direction", "torque_rod_dipole")


@dataclass(frozen=True)
class Along:
    """The world at knots along the orbit, from before the flight to after it; inertial axes (GCRS), SI."""

    time_s: np.ndarray  # (k,), evenly spaced, from the scenario's epoch
    position_N: np.ndarray  # (k, 3), from the Earth's centre
    velocity_N: np.ndarray
    wind_N: np.ndarray  # (k, 3), velocity through the air
    field_N: np.ndarray  # (k, 3)
    sun_N: np.ndarray  # (k, 3), unit vectors
    lit: np.ndarray  # (k,), share of the Sun's disc that is seen
    density_kgm3: np.ndarray  # (k,)
    epoch_tai_s: float
    mean_density_kgm3: float  # over the flight, the swing of day and night aside

    @cached_property
    def place(self) -> scipy.interpolate.CubicSpline:
        """Position and velocity at any instant: (M, 6)."""
        return scipy.interpolate.CubicSpline(self.time_s, np.hstack([self.position_N, self.velocity_N]))

    @cached_property
    def curves(self) -> np.ndarray:
        """As the kernel takes them (plant.World)."""
        parts = [self.position_N, self.velocity_N, self.wind_N, self.field_N, self.sun_N]
        columns = np.column_stack([*parts, self.lit, self.density_kgm3])
        c = scipy.interpolate.CubicSpline(self.time_s, columns).c
        # the penumbra has corners, about which a spline would swing
        c[:2, :, LIT] = 0.0
        c[2, :, LIT] = np.diff(self.lit) / self.step_s
        c[3, :, LIT] = self.lit[:-1]
        return np.ascontiguousarray(c)

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    def at(self, time_s) -> Along:
        """The same at other instants within; what the kernel sees there."""
        k = np.clip(((time_s - self.time_s[0]) // self.step_s).astype(int), 0, len(self.time_s) - 2)
        u = (time_s - self.time_s[k])[:, None]
        a, b, c, d = self.curves[:, k]
        row = ((a * u + b) * u + c) * u + d
        return Along(time_s, row[:, :3], row[:, 3:6], row[:, 6:9], row[:, 9:12], row[:, 12:15], row[:, LIT], row[:, AIR],
                     self.epoch_tai_s, self.mean_density_kgm3)  # fmt: skip

    def shadows(self, start_s: float, stop_s: float) -> list[dict]:
        """Every passage through the shadow between two instants: begin and end of penumbra and umbra; null outside the span. [s]"""
        inside = (self.time_s >= start_s) & (self.time_s <= stop_s)
        t, lit = self.time_s[inside], self.lit[inside]
        edges = np.flatnonzero(np.diff(np.concatenate([[0], lit < 1, [0]]).astype(int)))
        passages = []
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            dark = a + np.flatnonzero(lit[a:b] <= 0)
            passages.append({
                "penumbra_begins_s": float(t[a]) if a > 0 else None,
                "umbra_begins_s": float(t[dark[0]]) if len(dark) and dark[0] > 0 else None,
                "umbra_ends_s": float(t[dark[-1]]) if len(dark) and dark[-1] + 1 < len(t) else None,
                "penumbra_ends_s": float(t[b - 1]) if b < len(t) else None,
            })  # fmt: skip
        return passages


def along_orbit(scenario: Scenario, now: CraftAt, start_s: float, stop_s: float, period_s: float) -> Along | None:
    """The world between two instants and a little beyond; None for a flight that needs no orbit.

    Raises BadInput where an orbit is needed and not known, or passes below the surface."""
    if not _asked(scenario):
        return None
    step = period_s * max(np.ceil(_KNOT_S / period_s), 1)
    t = start_s + step * np.arange(-4, int(np.ceil((stop_s - start_s) / step)) + 5)
    tai_s = scenario.epoch_ns / NS + t
    r, v = _path(scenario, now, t)
    check_above_earth(r)
    sun = sun_direction(tai_s)
    environment = scenario.environment
    air, swing = np.zeros(len(t)), np.ones(len(t))
    if environment is not None:
        air, swing = _density(scenario, environment, now, r, v, t, tai_s)
    wind = v
    if environment is not None and environment.corotation:
        wind = v - np.cross([0.0, 0.0, EARTH_RATE], r)
    during = (t >= 0) & (t <= scenario.duration)
    mean = float((air / swing)[during].mean())
    return Along(t, r, v, wind, field_at(r, tai_s), sun, sunlit(r, sun), air, scenario.epoch_ns / NS, mean)


def world_of(scenario: Scenario, now: CraftAt, along: Along | None) -> World:
    """What the kernel integrates.  Raises BadInput where a torque is asked for that the craft is not described for."""
    if along is None:
        return World()
    given: dict[str, Any] = {"first": float(along.time_s[0]), "step": along.step_s, "curves": along.curves}
    e = scenario.environment
    if e is None:
        return World(**given)
    if e.gravity_gradient:
        given["mu"] = MU_EARTH
    if (dipole := acting_dipole(e, now)) is not None:
        given["dipole"] = dipole
    lever, facets = acting_sunlight(e, now)
    if lever is not None:
        given["sunlight_lever"] = lever
    given["sunlit_facets"] = facets
    lever, facets = acting_drag(e, now)
    if lever is not None:
        given["drag_lever"] = lever / reference_density(e, now)
    given["air_facets"] = facets
    return World(**given)


def acting_dipole(e: Environment, now: CraftAt) -> np.ndarray | None:
    """True residual dipole, None where none acts. (3,) [A m2]"""
    known = now.craft.magnetics
    truly = e.residual_dipole if e.residual_dipole is not None or known is None else known.residual_dipole
    if truly is None and e.dipole:
        _refuse_undescribed(now, "dipole", "[magnetics]", "residual_dipole")
    return None if truly is None or e.dipole is False else np.array(truly, float)


def acting_sunlight(e: Environment, now: CraftAt) -> tuple[np.ndarray | None, np.ndarray]:
    """True lever of sunlight (3,) [N m], and facets (f, 9) as plant.World has them; where they act."""
    known, none = now.craft.sunlight, np.empty((0, 9))
    lever = e.sunlight_lever or (None if known is None else known.lever)
    if known is None and lever is None and e.sunlight:
        _refuse_undescribed(now, "sunlight", "[sunlight]", "sunlight_lever")
    if e.sunlight is False:
        return None, none
    if lever is not None or known is None:
        return None if lever is None else np.array(lever, float), none
    rows = [
        [SUN_PRESSURE * f.area, *_unit(f.normal), *_from_cm(f.center, now), f.specular, f.diffuse] for f in known.facets
    ]
    return None, np.array(rows, float)


def acting_drag(e: Environment, now: CraftAt) -> tuple[np.ndarray | None, np.ndarray]:
    """True lever of drag at the reference density (3,) [N m], and facets (f, 7) as plant.World has them; where they act."""
    air, none = now.craft.aerodynamics, np.empty((0, 7))
    known = air if air is not None and air.in_orbit else None
    lever = e.drag_lever or (None if known is None else known.lever)
    if known is None and lever is None and e.drag:
        _refuse_undescribed(now, "drag", "[aerodynamics]", "drag_lever")
    if e.drag is False:
        return None, none
    if lever is not None or known is None:
        return None if lever is None else np.array(lever, float), none
    rows = [[known.drag_coefficient * f.area, *_unit(f.normal), *_from_cm(f.center, now)] for f in known.facets]
    return None, np.array(rows, float)


def reference_density(e: Environment, now: CraftAt) -> float:
    """For which the drag's lever counts, and which the exponential air has at its reference height. [kg/m3]"""
    air = now.craft.aerodynamics
    return e.reference_density or (None if air is None else air.reference_density) or _DENSITY_KGM3


def _asked(scenario: Scenario) -> bool:
    """Whether anything in the scenario needs an orbit."""
    sent = any(getattr(scenario.telemetry, stem) > 0 for stem in _ORBITAL)
    pointed = any(p.frame != "inertial" for p in scenario.pointings)
    return (
        sent
        or pointed
        or scenario.environment is not None
        or scenario.unloading is not None
        or scenario.orbit is not None
    )


def _path(scenario: Scenario, now: CraftAt, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities, (k, 3) each."""
    orbit = scenario.orbit
    if orbit is None:
        if now.craft.orbit is None:
            raise BadInput(
                f"{scenario.name} needs an orbit, and neither it nor {now.craft.name} has one",
                remedy="Add an [orbit] with its elements to the scenario or to the craft file.",
            )
        return flown(now.craft.orbit, scenario.epoch_ns / NS + t)
    if orbit.file is None:
        return propagate(*state_of(cast("OrbitElements", orbit)), t)  # the same elements, of the scenario's epoch
    times, places = read_table(scenario.folder / orbit.file, "position", "m")
    if times[0] > t[0] or times[-1] < t[-1]:
        raise BadInput(
            f"the orbit's table runs from {times[0]:g} to {times[-1]:g} s, the flight needs {t[0]:g} to {t[-1]:g} s",
            file=scenario.folder / orbit.file,
            remedy="Give positions from before the settling until after the end.",
        )
    curve = scipy.interpolate.CubicSpline(times, places)
    return curve(t), curve(t, 1)


def _density(scenario: Scenario, e: Environment, now: CraftAt, r, v, t, tai_s) -> tuple[np.ndarray, np.ndarray]:
    """Density at every knot, and its swing of day and night, which is in it: (k,) each."""
    if e.air == "msis":
        rho = density_at(r, tai_s, e.f107, e.f107_mean, e.ap)
    else:
        height, reference = np.linalg.norm(r, axis=1) - EARTH_RADIUS_M, reference_density(e, now)
        rho = exponential_density(height, reference, e.reference_height or 0.0, e.scale_height)
        if e.reference_height is None:
            rho *= reference / rho[(t >= 0) & (t <= scenario.duration)].mean()
    # the mean motion of the orbit through the first place: vis viva
    a = 1 / (2 / np.linalg.norm(r[0]) - v[0] @ v[0] / MU_EARTH)
    swing = 1 + e.density_swing * np.cos(np.sqrt(MU_EARTH / a**3) * t + e.density_phase)
    return e.density_factor * swing * rho, swing


def _refuse_undescribed(now: CraftAt, what: str, table: str, key: str) -> NoReturn:
    raise BadInput(
        f"{what} is asked for, and {now.craft.name} is not described for it",
        remedy=f"Give the craft file {table}, or the scenario's [environment] a {key}.",
    )


def _unit(v) -> np.ndarray:
    return np.asarray(v, float) / np.linalg.norm(v)


def _from_cm(center, now: CraftAt) -> np.ndarray:
    """A facet's centre counted from the centre of mass. [m]"""
    cm = now.craft.center_of_mass
    return np.asarray(center, float) - (np.zeros(3) if cm is None else np.asarray(cm, float))
