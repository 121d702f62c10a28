"""Where the Sun stands, and how much of it a craft in the Earth's shadow still sees."""

from __future__ import annotations

import numpy as np

from .frames import terrestrial_time
from .nodes import through_nodes
from .orbit import EARTH_POLAR_RADIUS_M, EARTH_RADIUS_M

#: IAU 2015 nominal solar radius, and the astronomical unit. [m]
SUN_RADIUS_M, ASTRONOMICAL_UNIT_M = 6.957e8, 1.495978707e11
_LIGHT_AU_PER_DAY = 173.1446327
_SCHWARZSCHILD_SUN_AU = 1.97412574336e-8

#: The Sun moves by 15 arcmin in 6 h; a spline through such nodes leaves less than 0.001 arcsec. [s]
_STEP_S = 6 * 3600.0


def sun_direction(tai_s: np.ndarray) -> np.ndarray:
    """Direction to the Sun as it is seen from the Earth's centre, aberration of the Earth's motion included.

    Parameters
    ----------
    tai_s : ndarray, shape (N,)
        TAI since 2000-01-01T00:00:00 TAI. [s]

    Returns
    -------
    ndarray, shape (N, 3)
        Unit vectors, inertial (GCRS).  ERFA's ``epv00`` (VSOP2000, simplified) is good to 5 km of the Sun's place from 1900 to
        2100; the craft's own place and speed are left out: 10 arcsec of parallax and 5 of aberration in low orbit, 60 in a
        geostationary one.
    """
    import erfa

    tai_s = np.atleast_1d(np.asarray(tai_s, float))

    def seen(at):
        heliocentric, barycentric = erfa.epv00(*terrestrial_time(tai_s[at]))
        distance = np.linalg.norm(heliocentric["p"], axis=-1)
        speed = barycentric["v"] / _LIGHT_AU_PER_DAY
        slowing = np.sqrt(1 - np.sum(speed**2, axis=-1))
        return erfa.ab(-heliocentric["p"] / distance[:, None], speed, distance, slowing)

    s = through_nodes(tai_s, _STEP_S, seen)
    return s / np.linalg.norm(s, axis=1, keepdims=True)


def sunlit(position_N: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """Share of the Sun's disc that the Earth leaves visible: 1 in light, 0 in the umbra, between them in the penumbra.

    The discs of Sun and Earth as the craft sees them overlap (Montenbruck and Gill, Satellite Orbits, eqs 3.85 to 3.94).  The
    flattened Earth is made a sphere by stretching all lengths along its axis: rays stay straight.  As a sphere it would bring
    the shadow's edges 6 s too early and too late in a typical low orbit, 40 s where the orbit grazes the shadow.

    Parameters
    ----------
    position_N : ndarray, shape (N, 3)
        From the Earth's centre, inertial (GCRS): z is the Earth's axis to 0.15 deg. [m]
    sun : ndarray, shape (N, 3) or (3,)
        Unit vectors to the Sun, same axes.

    Returns
    -------
    ndarray, shape (N,)
        0 to 1.  Left out: refraction and absorption of the air, which dim the edge's last seconds, the darkening of the Sun's
        limb, and the 1.7 % by which the Sun's distance, and so the penumbra, varies.
    """
    stretched = np.array([1.0, 1.0, EARTH_RADIUS_M / EARTH_POLAR_RADIUS_M])
    r, s = np.atleast_2d(np.asarray(position_N, float)) * stretched, np.asarray(sun, float) * stretched
    distance = np.linalg.norm(r, axis=1)
    a = np.arcsin(SUN_RADIUS_M / ASTRONOMICAL_UNIT_M)
    b = np.arcsin(np.minimum(EARTH_RADIUS_M / distance, 1.0))
    c = np.arctan2(np.linalg.norm(np.cross(-r, s), axis=1), -np.sum(r * s, axis=1))
    lit = np.where(c >= a + b, 1.0, np.where(c <= b - a, 0.0, 1 - np.minimum(b / a, 1.0) ** 2))
    part = (c < a + b) & (c > np.abs(a - b))
    lit[part] = 1 - _overlap(a, b[part], c[part]) / (np.pi * a**2)
    return lit


def _overlap(a: float, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Area that two discs of radii a and b, their centres c apart, have in common. [rad2]"""
    x = (c**2 + a**2 - b**2) / (2 * c)
    y = np.sqrt(np.maximum(a**2 - x**2, 0.0))
    return a**2 * np.arccos(np.clip(x / a, -1, 1)) + b**2 * np.arccos(np.clip((c - x) / b, -1, 1)) - c * y
