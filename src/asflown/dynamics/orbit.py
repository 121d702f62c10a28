"""An orbit: as a table of positions (which body it is about, and where the craft is between rows), or flown from a state or elements."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..kit.errors import BadInput
from ..kit.scatter import difference_sigma
from ..kit.timeline import NS, utc_label
from .environment import MU_EARTH

if TYPE_CHECKING:
    from ..craft.surroundings import OrbitElements

#: Equatorial and polar radius of the Earth (WGS84) [m], and its second zonal harmonic (EGM2008).
EARTH_RADIUS_M, EARTH_POLAR_RADIUS_M, J2_EARTH = 6.378137e6, 6.3567523e6, 1.08262668e-3
#: The Earth turns at this rate. [rad/s]   IERS Conventions 2010, table 1.2
EARTH_RATE_RAD_S = 7.292115e-5


@dataclass(frozen=True)
class Body:
    """A central body: gravitational parameter [m3/s2] and mean radius [m]."""

    name: str
    mu: float
    radius_m: float


#: JPL's planetary constants (ssd.jpl.nasa.gov/astro_par.html and its tables of satellites), rounded.
BODIES = (
    Body("the Earth", MU_EARTH, 6.371e6),
    Body("the Sun", 1.32712440e20, 6.957e8),
    Body("Mercury", 2.2031868e13, 2.4394e6),
    Body("Venus", 3.2485859e14, 6.0518e6),
    Body("the Moon", 4.9028e12, 1.7374e6),
    Body("Mars", 4.2828375e13, 3.3895e6),
    Body("Jupiter", 1.26686531e17, 6.9911e7),
    Body("Saturn", 3.7931206e16, 5.8232e7),
    Body("Titan", 8.9781e12, 2.5747e6),
    Body("Uranus", 5.7939513e15, 2.5362e7),
    Body("Neptune", 6.8365271e15, 2.4622e7),
    Body("Vesta", 1.7288e10, 2.627e5),
    Body("Ceres", 6.26274e10, 4.697e5),
)

#: An orbit's acceleration is compared over steps of at most this. [s]
_STEP_S = 600.0
_COMPARED = 60
#: Noise of the positions may hide this share of the acceleration; free fall holds to this share of it (the Earth's flattening
#: makes a tenth of it); a body is the one whose parameter is this near.
TOLD, FREE, NEAR = 0.02, 0.02, 0.03


@dataclass(frozen=True)
class Acceleration:
    """What the positions say of the central body.

    ``mu``: of the parameter that fits best [m3/s2]; ``misfit``: what is left of the acceleration, as a share of it;
    ``noise``: what the scatter of the positions makes of it."""

    mu: float
    misfit: float
    noise: float

    @property
    def told(self) -> bool:
        """Whether the positions are good enough to tell."""
        return self.noise < TOLD

    @property
    def free_fall(self) -> bool:
        """Whether one central body explains the motion."""
        return self.mu > 0 and self.misfit < FREE

    @property
    def body(self) -> Body | None:
        return next((b for b in BODIES if abs(self.mu / b.mu - 1) < NEAR), None)


@dataclass(frozen=True)
class Orbit:
    """Positions (N, 3) from the central body, inertial axes [m], at instants (N,) [s], and the body's parameter [m3/s2]."""

    time_s: np.ndarray
    position_N: np.ndarray
    mu: float = MU_EARTH

    @cached_property
    def _curve(self) -> scipy.interpolate.CubicSpline:
        return scipy.interpolate.CubicSpline(self.time_s, self.position_N)

    def at(self, time_s) -> np.ndarray:
        """Position at any instants within the table. (M, 3)"""
        return self._curve(time_s)

    def velocity_at(self, time_s) -> np.ndarray:
        """Slope of the positions. (M, 3) [m/s]"""
        return self._curve(time_s, 1)

    @property
    def nearest_m(self) -> float:
        return float(np.linalg.norm(self.position_N, axis=1).min())

    def acceleration(self) -> Acceleration:
        """Second differences of the positions against those that a unit mass at the centre asks for.

        r(t + s) - 2 r(t) + r(t - s) is the integral of (s - |u|) r''(t + u) exactly, so that a long step costs no accuracy."""
        t = self.time_s
        s = min((t[-1] - t[0]) / 3, _STEP_S)
        at = np.linspace(t[0] + s, t[-1] - s, _COMPARED)
        r = self.position_N
        pull = scipy.interpolate.CubicSpline(t, -r / np.linalg.norm(r, axis=1, keepdims=True) ** 3).antiderivative(2)

        def second(curve):
            return curve(at + s) - 2 * curve(at) + curve(at - s)

        D, E = second(self._curve), second(pull)
        mu = float(np.sum(D * E) / np.sum(E * E))
        size = float(np.sqrt(np.mean(np.sum((mu * E) ** 2, axis=1))))
        left = float(np.sqrt(np.mean(np.sum((D - mu * E) ** 2, axis=1))))
        noise = float(np.sqrt(3 * 6) * difference_sigma(r, 3))
        return Acceleration(mu, left / max(size, 1e-300), noise / max(size, 1e-300))

    def misreading(self) -> str:
        """How else the positions must be meant to be an orbit about a known body, in words: 'in kilometres'; '' where as they stand
        they are one, or where nothing else makes them one.  Positions too coarse to tell are left alone."""
        as_it_stands = self.acceleration()
        if not as_it_stands.told or (as_it_stands.free_fall and as_it_stands.body is not None):
            return ""
        for words, scale, earth_fixed in _READINGS:
            position_N = scale * (self._turned_back() if earth_fixed else self.position_N)
            other = Orbit(self.time_s, position_N)
            found = other.acceleration()
            body = found.body
            if found.free_fall and body is not None and other.nearest_m > 0.99 * body.radius_m:
                return words
        return ""

    def _turned_back(self) -> np.ndarray:
        """The positions (N, 3) as they are in axes that do not turn, if these turn with the Earth."""
        angle = EARTH_RATE_RAD_S * (self.time_s - self.time_s[0])
        return scipy.spatial.transform.Rotation.from_rotvec(angle[:, None] * [0.0, 0.0, 1.0]).apply(self.position_N)


#: What positions are taken for by mistake: their scale in metres, and whether the axes turn with the Earth.
_READINGS = (
    ("in kilometres, labelled metres", 1e3, False),
    ("in metres, labelled kilometres", 1e-3, False),
    ("in feet, labelled metres", 0.3048, False),
    ("in Earth-fixed axes", 1.0, True),
    ("in Earth-fixed axes and in kilometres, labelled metres", 1e3, True),
    ("in Earth-fixed axes and in metres, labelled kilometres", 1e-3, True),
)


def check_above_earth(position_N: np.ndarray) -> None:
    """Raise BadInput where a position (N, 3) [m] is below the Earth's surface, or not a number."""
    nearest = float(np.min(np.linalg.norm(position_N, axis=-1), initial=np.inf))
    if not nearest > EARTH_POLAR_RADIUS_M:  # also NaN
        raise BadInput(
            f"the orbit passes {nearest / 1e3:.4g} km from the Earth's centre, below its surface",
            remedy="Check the unit (km labelled m?) and the origin of the positions: they count from the Earth's centre.",
        )


def gravity_at(position_N: np.ndarray, mu: float = MU_EARTH, j2: float = J2_EARTH) -> np.ndarray:
    """Acceleration by a flattened planet.

    -mu r / r^3 (1 + 3/2 J2 (R/r)^2 (1 - 5 z^2/r^2 + (0, 0, 2)))     Montenbruck and Gill, Satellite Orbits, section 3.2

    Parameters
    ----------
    position_N : ndarray, shape (..., 3)
        From the centre, inertial axes whose z is the pole. [m]  GCRS z serves: the pole is 0.15 deg from it in 2026.
    mu : float
        Gravitational parameter. [m3/s2]
    j2 : float
        Second zonal harmonic, for the Earth's equatorial radius; 0 for a point mass.

    Returns
    -------
    ndarray, shape (..., 3)
        [m/s2]
    """
    r = np.asarray(position_N, float)
    size2 = np.sum(r * r, axis=-1, keepdims=True)
    flat = 1.5 * j2 * EARTH_RADIUS_M**2 / size2
    return -mu * r / size2**1.5 * (1 + flat * (1 - 5 * r[..., 2:] ** 2 / size2 + np.array([0.0, 0.0, 2.0])))


def propagate(
    position_N, velocity_N, since_s: np.ndarray, mu: float = MU_EARTH, j2: float = J2_EARTH
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of a body that falls freely about a flattened Earth.

    Parameters
    ----------
    position_N, velocity_N : array_like, shape (3,)
        State at time zero, inertial (GCRS). [m], [m/s]
    since_s : ndarray, shape (N,)
        Seconds from that state, in any order, negative ones too.
    mu, j2 : float
        As ``gravity_at`` takes them.

    Returns
    -------
    position_N, velocity_N : ndarray, shape (N, 3)
        [m], [m/s].  Integrated to 5 cm a day.  Left out: higher harmonics (kilometres a day along a low orbit), drag (3 km along
        the orbit in the first day at 500 km, 100 km at 300 km, growing as time squared), Sun and Moon.
    """
    from scipy.integrate import solve_ivp

    since_s = np.atleast_1d(np.asarray(since_s, float))
    start = np.concatenate([np.asarray(position_N, float), np.asarray(velocity_N, float)])
    states = np.tile(start, (len(since_s), 1))

    def slope(_, x):
        return np.concatenate([x[3:], gravity_at(x[:3], mu, j2)])

    for side in (since_s > 0, since_s < 0):
        if not side.any():
            continue
        at, back = np.unique(np.abs(since_s[side]), return_inverse=True)
        sign = np.sign(since_s[side][0])
        flown = solve_ivp(slope, (0, sign * at[-1]), start, "DOP853", t_eval=sign * at, rtol=1e-11, atol=1e-6)
        states[side] = flown.y.T[back]
    return states[:, :3], states[:, 3:]


def state_of(elements: OrbitElements, mu: float = MU_EARTH) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and velocity [m/s] at the elements' epoch, (3,) each, inertial axes (GCRS).

    The elements are osculating: those of the Kepler orbit through the state itself, not mean elements."""
    a, e = elements.semi_major_axis, elements.eccentricity
    E = _eccentric_anomaly(elements.mean_anomaly, e)
    b = a * np.sqrt(1 - e * e)
    rate = np.sqrt(mu / a**3) / (1 - e * np.cos(E))
    plane = np.array([[a * (np.cos(E) - e), b * np.sin(E), 0.0], [-a * rate * np.sin(E), b * rate * np.cos(E), 0.0]])
    turn = scipy.spatial.transform.Rotation.from_euler(
        "ZXZ", [elements.ascending_node, elements.inclination, elements.argument_of_perigee]
    )
    position, velocity = turn.apply(plane)
    return position, velocity


def _eccentric_anomaly(mean_anomaly: float, e: float) -> float:
    """E with E - e sin E = M.  The difference E - M is at most e, which brackets it."""
    from scipy.optimize import brentq

    M = float(np.remainder(mean_anomaly + np.pi, 2 * np.pi) - np.pi)
    return float(brentq(lambda E: E - e * np.sin(E) - M, M - e - 1e-9, M + e + 1e-9, xtol=1e-15, rtol=1e-15))


#: Elements are not carried further than this: drag alone has then moved a craft in low orbit along it by a good part. [s]
_FURTHEST_S = 60 * 86_400.0


def flown(elements: OrbitElements, tai_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities along the orbit of a craft file.

    Parameters
    ----------
    elements : OrbitElements
        ``craft.orbit``.
    tai_s : ndarray, shape (N,)
        TAI since 2000-01-01T00:00:00 TAI. [s]

    Returns
    -------
    position_N, velocity_N : ndarray, shape (N, 3)
        Inertial (GCRS). [m], [m/s]  As ``propagate`` does it.

    Raises
    ------
    BadInput
        For times further than 60 days from the elements' epoch.
    """
    since_s = np.atleast_1d(np.asarray(tai_s, float)) - elements.epoch / NS
    furthest = float(np.abs(since_s).max(initial=0.0))
    if not furthest <= _FURTHEST_S:
        raise BadInput(
            f"[orbit] is given for {utc_label(elements.epoch)[:10]}, {furthest / 86_400:.0f} days from the time asked for",
            remedy="Give elements of a date within 60 days, or orbit_position_x, _y, _z in the telemetry.",
        )
    return propagate(*state_of(elements), since_s)
