"""Torque of a thin gas that a craft flies through (plume paper eqs 21, 22): molecules far apart, drag at the centre of pressure."""

from __future__ import annotations

import numpy as np

#: Torque per density of Cassini at E3 about z, as printed. [N m / (kg/m3)]   plume paper eq 22
PRINTED_E3 = 3.422e9


def torque_per_density(drag_coefficient, speed_m_s, area_m2, arm_m):
    """1/2 C_D V^2 A l, l = u x (r_CP - r_CM). [N m / (kg/m3)]   plume paper eq 21

    ``arm_m``: l about one axis, or (..., 3) in body axes as ``arm`` gives it; the others broadcast against it."""
    factor = 0.5 * np.asarray(drag_coefficient, float) * np.square(speed_m_s) * np.asarray(area_m2, float)
    arm_m = np.asarray(arm_m, float)
    return (factor[..., None] if arm_m.ndim and factor.ndim else factor) * arm_m


def arm(velocity_B, pressure_centre_B, mass_centre_B) -> np.ndarray:
    """u x (r_CP - r_CM), u the direction of flight through the gas; drag points along -u. (..., 3) [m]   plume paper eq 21"""
    u = np.asarray(velocity_B, float)
    u = u / np.linalg.norm(u, axis=-1, keepdims=True)
    return np.cross(u, np.asarray(pressure_centre_B, float) - np.asarray(mass_centre_B, float))
