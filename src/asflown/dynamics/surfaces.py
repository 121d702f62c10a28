"""Torques of sunlight and thin air on a craft, by its lever or its flat plates, as the estimators take them.

The plates do not shade each other, and each lies wholly in the light or the stream.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..craft.model import Craft

#: Pressure of sunlight at one astronomical unit: 1361 W/m2 (Kopp and Lean 2011, doi:10.1029/2010GL045777) over the speed of light.
#: The Earth's distance from the Sun changes it by 3.4 % either way over the year. [N/m2]
SUN_PRESSURE_PA = 1361.0 / 2.99792458e8


def sunlight_torque(craft: Craft, sun_B: np.ndarray) -> np.ndarray:
    """Torque of full sunlight about the centre of mass; times the lit share it is that in the Earth's shadow.

    lever x s, or of each plate in light with c = n . s > 0
    F = -P A c ((1 - specular) s + 2 (specular c + diffuse / 3) n)    Montenbruck and Gill, Satellite Orbits, eq 3.73, with a
    part that scatters by Lambert's law; the re-emitted heat is left out.

    Parameters
    ----------
    craft : Craft
        With ``sunlight``.
    sun_B : ndarray, shape (N, 3)
        Unit vectors to the Sun, body axes.  A zero vector is shadow and gives none.

    Returns
    -------
    ndarray, shape (N, 3)
        [N m], body axes.  Zero for a craft without ``sunlight``.
    """
    s = np.atleast_2d(np.asarray(sun_B, float))
    light = craft.sunlight
    if light is None:
        return np.zeros_like(s)
    if light.lever_Nm is not None:
        return np.cross(light.lever_Nm, s)
    total = np.zeros_like(s)
    for f in light.facets:
        n = np.array(f.normal) / np.linalg.norm(f.normal)
        c = np.maximum(s @ n, 0.0)[:, None]
        force = -SUN_PRESSURE_PA * f.area * c * ((1 - f.specular) * s + 2 * (f.specular * c + f.diffuse / 3) * n)
        total += np.cross(_arm(craft, f), force)
    return total


def drag_torque(craft: Craft, velocity_B: np.ndarray, density_kgm3: np.ndarray) -> np.ndarray:
    """Torque of the air stream about the centre of mass.

    lever x (-v/|v|) rho / rho_0, or of each plate that faces the stream
    F = -1/2 rho v^2 C_D A (n . v/|v|) v/|v|      the air is taken up whole; no lift

    Parameters
    ----------
    craft : Craft
        With ``aerodynamics`` for an orbit (a lever or facets).
    velocity_B : ndarray, shape (N, 3)
        Of the craft, body axes. [m/s]  The air is taken to be at rest in inertial space: its turning with the Earth changes the
        speed by up to 7 % and the direction by up to 4 deg.
    density_kgm3 : ndarray, shape (N,)
        Of the air.

    Returns
    -------
    ndarray, shape (N, 3)
        [N m], body axes.  Zero for a craft without such ``aerodynamics``.
    """
    v, rho = np.atleast_2d(np.asarray(velocity_B, float)), np.asarray(density_kgm3, float).reshape(-1, 1)
    air = craft.aerodynamics
    if air is None or not air.in_orbit:
        return np.zeros_like(v)
    speed = np.linalg.norm(v, axis=1, keepdims=True)
    u = v / speed
    if air.lever_Nm is not None:
        return np.cross(air.lever_Nm, -u) * rho / air.reference_density
    pressure = 0.5 * rho * speed**2 * air.drag_coefficient
    total = np.zeros_like(v)
    for f in air.facets:
        n = np.array(f.normal) / np.linalg.norm(f.normal)
        facing = np.maximum(u @ n, 0.0)[:, None]
        total += np.cross(_arm(craft, f), -pressure * f.area * facing * u)
    return total


def _arm(craft: Craft, facet) -> np.ndarray:
    """From the centre of mass to the plate; where no centre of mass is stated, the facets count from it. [m]"""
    return np.array(facet.center) - np.array(craft.stated_center or (0.0, 0.0, 0.0))
