"""An orbit as a table of positions: which body it is about, told from its own acceleration, and where the craft is between rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from ..kit.scatter import difference_sigma
from .environment import MU_EARTH


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
    def _curve(self) -> CubicSpline:
        return CubicSpline(self.time_s, self.position_N)

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
        pull = CubicSpline(t, -r / np.linalg.norm(r, axis=1, keepdims=True) ** 3).antiderivative(2)

        def second(curve):
            return curve(at + s) - 2 * curve(at) + curve(at - s)

        D, E = second(self._curve), second(pull)
        mu = float(np.sum(D * E) / np.sum(E * E))
        size = float(np.sqrt(np.mean(np.sum((mu * E) ** 2, axis=1))))
        left = float(np.sqrt(np.mean(np.sum((D - mu * E) ** 2, axis=1))))
        noise = float(np.sqrt(3 * 6) * difference_sigma(r, 3))
        return Acceleration(mu, left / max(size, 1e-300), noise / max(size, 1e-300))
