"""Torques that the surroundings exert on a body of known place and attitude."""

from __future__ import annotations

import numpy as np

from .rigid_body import BASIS

#: Gravitational parameter of the Earth, with its atmosphere (EGM2008). [m3/s2]
MU_EARTH = 3.986004418e14


def gravity_gradient_regressor(position_B: np.ndarray, mu: float = MU_EARTH) -> np.ndarray:
    """T = G pi with pi the tensor's six elements (001's order): 3 mu / r^5  r x (I r), body axes.

    position_B (N, 3): of the centre of mass from the planet's, body axes [m] -> (N, 3, 6) [1/s2]"""
    r = np.asarray(position_B, float)
    moment = np.einsum("kij,nj->nki", BASIS, r)  # I r for each element alone
    size = np.linalg.norm(r, axis=1)[:, None, None]
    return np.swapaxes(3 * mu * np.cross(r[:, None, :], moment) / size**5, 1, 2)


def gravity_gradient(I_B: np.ndarray, position_B: np.ndarray, mu: float = MU_EARTH) -> np.ndarray:
    """3 mu / r^5  r x (I r), body axes. (N, 3) [N m]"""
    r = np.asarray(position_B, float)
    return 3 * mu * np.cross(r, r @ I_B) / np.linalg.norm(r, axis=1, keepdims=True) ** 5


def gravity_gradient_bound(I_B: np.ndarray, distance_m, mu: float = MU_EARTH) -> np.ndarray:
    """3/2 mu (I_max - I_min) / r^3, the largest there is at any attitude. [N m]   plume paper eq 19

    I_max, I_min: principal moments; the plume paper takes the tensor's diagonal, 0.7 % less for Cassini."""
    moments = np.linalg.eigvalsh(I_B)
    return 1.5 * mu * (moments[-1] - moments[0]) / np.asarray(distance_m, float) ** 3


def magnetic_torque_bound(dipole_Am2: float, field_T: float, field_change: float = 0.0) -> float:
    """m B (1 + change), the largest at any attitude. [N m]   plume paper eq 20, whose "moment arm" is the dipole moment"""
    return dipole_Am2 * field_T * (1 + field_change)
