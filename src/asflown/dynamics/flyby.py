"""A flyby on a straight line at constant speed, and the flybys, jets and peaks published in the plume paper (Tables 1 to 4).

Titan is there too, with an exponential atmosphere whose figures are assumed.

Time counts from closest approach.  Gravity bends the path by 2 mu / (v^2 r): 2.3e-4 rad for E3, 1e-3 for the slow E9; over
the minute in which a plume acts the position is off by some 100 m.  Past Titan it is 0.14 rad, and the path a hyperbola.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from ..kit.doubts import Doubts
from ..kit.errors import BadInput, some_of
from ..kit.quantities import quantity
from .atmosphere import Exponential
from .environment import magnetic_torque_bound

_BODIES = ("enceladus", "titan")
_ROUNDS = 8  # of Newton's method


@dataclass(frozen=True)
class Moon:
    """A body passed: radius [m], gravitational parameter [m3/s2], the magnetic field there and its change by the plume."""

    radius_m: float
    mu_m3_s2: float
    field_T: float
    field_change: float
    name: str = "Enceladus"
    atmosphere: Exponential | None = None  # None: what gas there is comes in jets

    @property
    def small_torques_Nm(self) -> float:
        """Bound of what sunlight, power generators and the magnetic field do to Cassini there. [N m]   plume paper section V, eq 20"""
        row = tables()["small_torques"]
        magnetic = magnetic_torque_bound(quantity(row["dipole"], "A m2"), self.field_T, self.field_change)
        return quantity(row["sunlight"], "N m") + quantity(row["power_generators"], "N m") + magnetic


@dataclass(frozen=True)
class Flyby:
    """A straight path past a moon at constant speed.  Time counts from closest approach, in seconds.

    Parameters
    ----------
    name : str
        'E3' is the third flyby of Enceladus.
    moon : Moon
        The body passed.
    altitude_m, speed_m_s : float
        Above the moon's sphere [m], and relative to it [m/s], at closest approach.
    latitude_south_rad, longitude_west_rad : float, optional
        Of closest approach [rad]; None where they are not known.
    date : str
        Day of closest approach, as in '2008-03-12'; '' where it is not known.
    noticed_s : (float, float), optional
        When the control loop first and last noticed the plume (points P and R of the plume paper) [s].
    source : str
        Where these numbers were published."""

    name: str
    moon: Moon
    altitude_m: float
    speed_m_s: float
    latitude_south_rad: float | None = None
    longitude_west_rad: float | None = None
    date: str = ""
    noticed_s: tuple[float, float] | None = None
    source: str = ""

    @property
    def doubts(self) -> Doubts:
        """Doubts about the path; a straight line from the tables has none."""
        return Doubts()

    def record(self) -> dict:
        """What identifies the flyby, for a result's options."""
        return {"name": self.name, "body": self.moon.name, "altitude_m": self.altitude_m, "speed_m_s": self.speed_m_s}

    @property
    def closest_m(self) -> float:
        """Least distance from the moon's centre."""
        return self.moon.radius_m + self.altitude_m

    def path(self, time_s) -> tuple[np.ndarray, np.ndarray]:
        """From the moon's centre: along the vertical of closest approach, and along the velocity there. [m]"""
        along = self.speed_m_s * np.asarray(time_s, float)
        return np.full(along.shape, self.closest_m), along

    def distance(self, time_s) -> np.ndarray:
        """From the moon's centre. [m]"""
        return np.hypot(*self.path(time_s))

    def altitude(self, time_s) -> np.ndarray:
        """Above the moon's sphere. [m]   plume paper section V: 322.3 km at +34 s of E3"""
        return self.distance(time_s) - self.moon.radius_m

    def climb_rate(self, time_s) -> np.ndarray:
        """d altitude / dt. [m/s]"""
        return self.speed_m_s**2 * np.asarray(time_s, float) / self.distance(time_s)

    def speed(self, time_s) -> np.ndarray:
        """Relative to the body. [m/s]"""
        return np.full(np.shape(time_s), self.speed_m_s)

    def from_source(self, jet, time_s) -> tuple[np.ndarray, np.ndarray]:
        """Position from a jet's source (N, 3) [m] and the jet's axis (3,), in the axes of ``in_plane`` and across that plane.   plume paper eq 23

        The axis is taken to lie in the plane, as in the paper."""
        along = np.array([np.sin(jet.tilt_rad), np.cos(jet.tilt_rad), 0.0])
        place = self.in_plane(time_s)
        across = np.full((*place.shape[:-1], 1), jet.offset_m)
        return np.concatenate([place - self.moon.radius_m * along[:2], across], axis=-1), along

    def in_plane(self, time_s) -> np.ndarray:
        """From the moon's centre, in the plane of trajectory and spin axis: away from the axis on the side of closest
        approach, and towards the south pole. (N, 2) [m]   plume paper eq 23

        Raises BadInput for a flyby whose latitude is not known."""
        if self.latitude_south_rad is None:
            raise BadInput(
                f"the latitude of {self.name}'s closest approach is not known, and a jet's distance needs it",
                remedy="Use a flyby of the plume paper's Table 1 (E3, E4, E9).",
            )
        out, along = self.path(time_s)
        south = self.latitude_south_rad
        return np.stack(
            [out * np.cos(south) - along * np.sin(south), out * np.sin(south) + along * np.cos(south)], axis=-1
        )

    def from_south(self, time_s) -> np.ndarray:
        """Seen along the spin axis from the south: towards 0 and towards 90 degrees west. (..., 2) [m]

        Raises BadInput for a flyby whose latitude or longitude is not known."""
        west = self.known_longitude_rad()
        return self.in_plane(time_s)[..., :1] * np.array([np.cos(west), np.sin(west)])

    def known_longitude_rad(self) -> float:
        """West longitude of closest approach. [rad]  Raises BadInput where it is not known."""
        if self.longitude_west_rad is None:
            raise BadInput(
                f"the longitude of {self.name}'s closest approach is not known, and a jet's offset needs it",
                remedy="Use a flyby of the plume paper's Table 1 (E3, E4, E9).",
            )
        return self.longitude_west_rad

    def position(self, time_s, up_B, velocity_B) -> np.ndarray:
        """Of the craft from the moon's centre, in body axes; the body does not turn. (N, 3) [m]

        ``up_B``: direction from the moon's centre to the craft at closest approach; ``velocity_B``: direction of the craft's
        motion there, both in body axes.  Raises BadInput where they are not perpendicular to 1 degree."""
        up, velocity = (np.asarray(v, float) / max(float(np.linalg.norm(v)), 1e-300) for v in (up_B, velocity_B))
        if min(np.linalg.norm(up), np.linalg.norm(velocity)) < 0.5 or abs(up @ velocity) > np.sin(np.radians(1)):
            raise BadInput(
                "the velocity and the vertical at closest approach must be perpendicular, and the directions given are not",
                remedy="Give both in body axes: the vertical from the moon's centre to the craft, and the direction of flight.",
            )
        out, along = self.path(time_s)
        return out[..., None] * up + along[..., None] * velocity


class Hyperbola(Flyby):
    """A flyby whose path the moon's gravity bends; ``speed_m_s`` is that of closest approach.

    M = e sinh F - F,  r = a (e cosh F - 1), with a = mu / v_infinity^2 and e = 1 + r_0 / a (Kepler)."""

    @property
    def _axis_m(self) -> float:
        excess = self.speed_m_s**2 - 2 * self.moon.mu_m3_s2 / self.closest_m
        if excess <= 0:
            raise BadInput(
                f"a craft at {self.speed_m_s:g} m/s does not pass {self.moon.name}: it stays with it",
                remedy=f"Give a speed above {np.sqrt(2 * self.moon.mu_m3_s2 / self.closest_m):.0f} m/s.",
            )
        return self.moon.mu_m3_s2 / excess

    def path(self, time_s) -> tuple[np.ndarray, np.ndarray]:
        a = self._axis_m
        e = 1 + self.closest_m / a
        mean = np.sqrt(self.moon.mu_m3_s2 / a**3) * np.asarray(time_s, float)
        F = np.arcsinh(mean / e)
        for _ in range(_ROUNDS):
            F = F - (e * np.sinh(F) - F - mean) / (e * np.cosh(F) - 1)
        return a * (e - np.cosh(F)), a * np.sqrt(e**2 - 1) * np.sinh(F)

    def speed(self, time_s) -> np.ndarray:
        falls = 2 * self.moon.mu_m3_s2 * (1 / self.distance(time_s) - 1 / self.closest_m)
        return np.sqrt(self.speed_m_s**2 + falls)

    def climb_rate(self, time_s) -> np.ndarray:
        across = self.closest_m * self.speed_m_s / self.distance(time_s)
        return np.sign(time_s) * np.sqrt(np.maximum(self.speed(time_s) ** 2 - across**2, 0.0))


@dataclass(frozen=True)
class PublishedPeak:
    """A row of the plume paper's Table 4: by which instrument, when and how dense; ``density_kgm3`` is (low, high)."""

    instrument: str
    flyby: str
    time_s: float
    altitude_m: float
    density_kgm3: tuple[float, float]
    sigma_kgm3: float | None

    @property
    def middle_kgm3(self) -> float:
        return float(np.mean(self.density_kgm3))

    @property
    def half_width_kgm3(self) -> float:
        """Its published sigma, else half of its range."""
        return self.sigma_kgm3 or 0.5 * (self.density_kgm3[1] - self.density_kgm3[0])


@cache
def tables(body: str = "enceladus") -> dict:
    """The tables as they stand in a body's file, values with their units."""
    return tomllib.loads((resources.files("asflown.dynamics") / f"{body}.toml").read_text(encoding="utf-8"))


@cache
def moon(body: str) -> Moon:
    m = tables(body)["moon"]
    air = m.get("atmosphere")
    return Moon(
        quantity(m["radius"], "m"),
        quantity(m["gravitational_parameter"], "m3/s2"),
        quantity(m["field"], "T"),
        quantity(m["field_change"], ""),
        body.capitalize(),
        None if air is None else Exponential(
            quantity(air["density"], "kg/m3"), quantity(air["altitude"], "m"), quantity(air["scale_height"], "m")
        ),
    )  # fmt: skip


def enceladus() -> Moon:
    return moon("enceladus")


@cache
def flybys() -> tuple[Flyby, ...]:
    """Every flyby of the tables."""
    return tuple(_flyby(row, moon(body)) for body in _BODIES for row in tables(body)["flyby"])


def flyby_called(name: str) -> Flyby:
    """'E3', 'e3', 'enceladus-3', 'Titan'.  Raises BadInput for one that is not there."""
    short = name.strip().upper().replace("ENCELADUS-", "E")
    for f in flybys():
        if f.name.upper() == short:
            return f
    raise BadInput(f"flyby {name!r} is not known", remedy=f"Choose one of: {some_of(f.name for f in flybys())}.")


@cache
def published_peaks() -> tuple[PublishedPeak, ...]:
    """Table 4 of the plume paper."""
    peaks = []
    for row in tables()["peak"]:
        density = [quantity(v, "kg/m3") for v in row["density"]]
        sigma = quantity(row["sigma"], "kg/m3") if "sigma" in row else None
        peaks.append(
            PublishedPeak(
                row["instrument"], row["flyby"], quantity(row["time"], "s"), quantity(row["altitude"], "m"),
                (density[0], density[-1]), sigma,
            )
        )  # fmt: skip
    return tuple(peaks)


def _flyby(row: dict, passed: Moon) -> Flyby:
    kind = Flyby if passed.atmosphere is None else Hyperbola
    noticed = [quantity(t, "s") for t in row.get("noticed", ())]
    south, west = (quantity(row[k], "rad") if k in row else None for k in ("latitude_south", "longitude_west"))
    return kind(
        row["name"], passed, quantity(row["altitude"], "m"), quantity(row["speed"], "m/s"), south, west,
        row.get("date", ""), (noticed[0], noticed[1]) if noticed else None, row["source"],
    )  # fmt: skip
