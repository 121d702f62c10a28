"""What surrounds a craft at any instants: field, Sun and shadow, air stream, each from the best that is known, with where it is from.

A channel is preferred to a model; ``subject_of`` has judged it by then.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.orbit import BODIES
from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput
from ...kit.rotations import rotation
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ...dynamics.orbit import Orbit
    from ...telemetry.telemetry import Telemetry

#: Fewest samples of a vector that are used.
_FEWEST = 8
#: Beyond it the measured Sun does not stand still. [rad]  A coarse sun sensor errs by a few degrees.
_SUN_OFF = np.radians(15)
#: Shadow by the sun sensor and by geometry may differ for so long at an edge. [s]
_EDGE_S = 60.0
#: Longest stretch over which the Sun stands still: it moves by 1 degree a day. [s]
_SUN_STANDS_S = 6 * 3600.0

SUN_TURNS = Kind(
    "environment.sun-turns", Severity.SUSPECT,
    "the measured Sun does not stay where it is in inertial axes: it wanders by {off_deg:.0f} degrees (rms)",
    "Check the body axes of the sun sensor against those of the quaternion.",
)  # fmt: skip


@dataclass(frozen=True)
class Place:
    """Instants (N,) [ns TAI], whether their date is known, the attitude there (N, 3, 3) body to inertial or None, position and velocity
    (N, 3), inertial axes, or None, and the body orbited."""

    tai_ns: np.ndarray
    dated: bool
    R_NB: np.ndarray | None
    orbit: Orbit | None
    position_N: np.ndarray | None
    velocity_N: np.ndarray | None
    body: str

    @property
    def tai_s(self) -> np.ndarray:
        return self.tai_ns / NS

    @property
    def at_earth(self) -> bool:
        return self.position_N is not None and self.body == BODIES[0].name

    @property
    def position(self) -> np.ndarray:
        """``position_N`` where the craft is known to be at the Earth."""
        assert self.position_N is not None
        return self.position_N

    @property
    def phase(self) -> np.ndarray:
        """Angle gone round the orbit since the first instant, where position and velocity are known. (N,) [rad]"""
        assert self.velocity_N is not None
        r = self.position
        rate = np.linalg.norm(np.cross(r, self.velocity_N), axis=1) / np.sum(r * r, axis=1)
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(self.tai_ns) / NS
        return np.concatenate([[0.0], np.cumsum(steps)])

    def to_body(self, v_N: np.ndarray) -> np.ndarray:
        assert self.R_NB is not None
        return np.einsum("nji,nj->ni", self.R_NB, v_N)


@dataclass(frozen=True)
class Seen:
    """A vector in body axes (N, 3), its source in words, and a share (N,): of the Sun that is lit."""

    u_B: np.ndarray
    source: str
    share: np.ndarray


def attitude_at(telemetry: Telemetry, tai_ns: np.ndarray) -> np.ndarray | None:
    """Body to inertial at instants, (N, 3, 3), between samples of the quaternion; None without one.  Held beyond its ends."""
    names = [f"quaternion_{m}" for m in "wxyz"]
    if not all(n in telemetry for n in names):
        return None
    at, q = together(telemetry, names)
    if len(at) < 2:
        return None
    t = (at - at[0]) / NS
    return scipy.spatial.transform.Slerp(t, rotation(q))(np.clip((tai_ns - at[0]) / NS, t[0], t[-1])).as_matrix()


def field_at_craft(telemetry: Telemetry, place: Place) -> tuple[Seen | None, str]:
    """Magnetic field in body axes [T]; or None and what is missing."""
    found = _channel(telemetry, "magnetic_field")
    if found is not None:
        u = _between(*found, place.tai_ns)
        return Seen(u, "field from the magnetometer", np.ones(len(u))), ""
    model = _igrf(place)
    if isinstance(model, str):
        return None, f"magnetic_field_x, _y, _z ({model})"
    return Seen(model, "field from IGRF-14 at the orbit's position (ppigrf)", np.ones(len(model))), ""


def _igrf(place: Place) -> np.ndarray | str:
    """IGRF in body axes, or what is missing for it."""
    if not place.at_earth or place.R_NB is None or not place.dated:
        return "or an orbit of the Earth, a quaternion and an epoch"
    from ...dynamics.magnetic_field import field_at

    try:
        return place.to_body(field_at(place.position, place.tai_s))
    except BadInput as why:
        return str(why.what)


def sun_at_craft(telemetry: Telemetry, place: Place) -> tuple[Seen | None, str, list[Doubt]]:
    """Direction to the Sun in body axes and the share of it that is lit; or None and why; doubts."""
    found = _channel(telemetry, "sun_direction")
    if found is None:
        model = _modelled_sun(place)
        if isinstance(model, str):
            return None, f"sun_direction_x, _y, _z ({model})", []
        from ...dynamics.sun import sunlit

        lit = sunlit(place.position, model)
        return Seen(place.to_body(model), "Sun from its ephemeris (ERFA), shadow from the orbit", lit), "", []
    t, s = found
    on = np.linalg.norm(s, axis=1) > 0.1
    lit = np.interp(_s(place.tai_ns, t[0]), _s(t, t[0]), on.astype(float))
    if on.sum() < _FEWEST:
        return Seen(np.zeros((len(lit), 3)), "Sun from the sun sensor: shadow throughout", np.zeros(len(lit))), "", []
    t_on, s_on = t[on], s[on] / np.linalg.norm(s[on], axis=1, keepdims=True)
    whole = "Sun and shadow from the sun sensor"
    if place.R_NB is None:
        return Seen(_unit(_between(t_on, s_on, place.tai_ns)), whole, lit), "", []
    sun_N, doubts = _steady_sun(telemetry, t_on, s_on, place)
    if place.at_earth:
        lit, whole = _shadow(sun_N, lit, whole, place)
    return Seen(place.to_body(sun_N), whole, lit), "", doubts


def _modelled_sun(place: Place) -> np.ndarray | str:
    if not place.at_earth or place.R_NB is None or not place.dated:
        return "or an orbit of the Earth, a quaternion and an epoch"
    from ...dynamics.sun import sun_direction

    return sun_direction(place.tai_s)


def _steady_sun(telemetry: Telemetry, t: np.ndarray, s_B: np.ndarray, place: Place) -> tuple[np.ndarray, list[Doubt]]:
    """The measured Sun in inertial axes at the instants of ``place``, (N, 3): means of hours, which have hardly any noise."""
    R = attitude_at(telemetry, t)
    assert R is not None
    s_N = np.einsum("nij,nj->ni", R, s_B)
    count = max(int(np.ceil((t[-1] - t[0]) / NS / _SUN_STANDS_S)), 1)
    parts = np.array_split(np.arange(len(t)), count)
    means = _unit(np.array([s_N[p].mean(axis=0) for p in parts]))
    middles = np.array([t[p].mean() for p in parts])
    off = float(
        np.sqrt(np.mean(np.concatenate([_angle(s_N[p], m[None]) ** 2 for p, m in zip(parts, means, strict=True)])))
    )
    doubts: list[Doubt] = [SUN_TURNS(off_deg=float(np.degrees(off)))] if off > _SUN_OFF else []
    return _unit(_between(middles, means, place.tai_ns)), doubts


def _shadow(sun_N: np.ndarray, lit: np.ndarray, whole: str, place: Place) -> tuple[np.ndarray, str]:
    """The orbit's shadow with its penumbra where the sensor's agrees with it at the edges, else the sensor's.

    The Sun is where the sensor has it: the date need not be known."""
    from ...dynamics.sun import sunlit

    geometric = sunlit(place.position, sun_N)
    step = np.gradient(_s(place.tai_ns, place.tai_ns[0])) if len(lit) > 1 else np.ones(1)
    by_orbit, by_sensor = geometric > 0.5, lit > 0.5
    dark, light = (float(np.sum(step[m])) for m in (by_orbit & ~by_sensor, ~by_orbit & by_sensor))
    edges = max(int(np.sum(np.diff(by_sensor))), int(np.sum(np.diff(by_orbit))), 1)
    if max(dark, light) <= _EDGE_S * edges:
        return geometric, "Sun from the sun sensor, shadow from the orbit"
    return lit, whole


def _channel(telemetry: Telemetry, stem: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Instants and values (N, 3) of a vector, None where it is missing."""
    if not telemetry.has_axes(stem):
        return None
    found = together(telemetry, [f"{stem}_{a}" for a in AXES])
    return found if len(found[0]) >= _FEWEST else None


def rods_at(telemetry: Telemetry, tai_ns: np.ndarray) -> np.ndarray | None:
    """Dipole of the torque rods at instants, body axes (N, 3) [A m2]; None without the channel.  Held from sample to sample."""
    found = _channel(telemetry, "torque_rod_dipole")
    if found is None:
        return None
    t, m = found
    return m[np.clip(np.searchsorted(t, tai_ns, side="right") - 1, 0, len(t) - 1)]


def _between(t_ns: np.ndarray, values: np.ndarray, tai_ns: np.ndarray) -> np.ndarray:
    t, at = _s(t_ns, t_ns[0]), _s(tai_ns, t_ns[0])
    return np.stack([np.interp(at, t, column) for column in values.T], axis=1)


def _s(tai_ns, zero_ns) -> np.ndarray:
    return (np.asarray(tai_ns) - zero_ns) / NS


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12)


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
