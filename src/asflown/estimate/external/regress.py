"""A start momentum and a constant torque, by least squares with noise that has a size and a memory about each body axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ...kit.regression import memory
from ...kit.scatter import robust_sigma
from ..subject import FEWEST

#: An instant further off than this many robust sigma does not count.
OUTLYING = 5.0


@dataclass(frozen=True)
class Fit:
    """Start momentum and torque (6,), their covariance, and which samples counted (N,).

    ``worth``: how many independent samples those are, by which Student's distribution sets ``reach``, 95 % in sigma; ``normal`` (6, 6) and ``weighted`` (N, 3, 6): the equations solved."""

    values: np.ndarray
    covariance: np.ndarray
    used: np.ndarray
    worth: float
    normal: np.ndarray
    weighted: np.ndarray  # (N, 3, 6)

    @property
    def torque(self) -> np.ndarray:
        return self.values[3:]

    @property
    def sigma(self) -> np.ndarray:
        return np.sqrt(np.diag(self.covariance)[3:])

    @property
    def reach(self) -> float:
        return float(scipy.special.stdtrit(max(self.worth - 2, 1.0), 0.975))

    def shift(self, change) -> np.ndarray:
        """What a change (N, 3) of the momentum does to the torque, (3,)."""
        return np.linalg.solve(self.normal, np.einsum("nij,ni->j", self.weighted, change))[3:]


def regress(rows, y) -> Fit:
    """y (N, 3) = rows (N, 3, 6) [start, torque] + noise, whose size and memory are those of the residuals.

    Each axis is weighted by its long-run variance.  Instants with a residual beyond OUTLYING robust sigma do not count."""
    scale = np.r_[np.ones(3), 1 / np.abs(rows[:, :, 3:]).max() * np.ones(3)]  # seconds beside ones
    X = rows * scale
    used, variance = np.ones(len(y), bool), np.ones(3)
    for _ in range(8):
        weighted = np.where(used[:, None, None], X / variance[:, None], 0.0)
        normal = np.einsum("nij,nik->jk", weighted, X)
        values = np.linalg.solve(normal, np.einsum("nij,ni->j", weighted, y))
        left = y - X @ values
        robust = robust_sigma(left[used], axis=0)
        again = (np.abs(left) <= np.maximum(OUTLYING * robust, 1e-12 * np.abs(y).max())).all(axis=1)
        if again.sum() < FEWEST:
            again = used
        alike = np.array([memory(left[again, j]) for j in range(3)])
        count = again.sum()
        spread = np.sum(left[again] ** 2, axis=0) / np.maximum(count - 2 * alike, count / 4)
        was, variance = variance, np.maximum(spread * alike, 1e-24 * np.max(y**2) + 1e-300)
        if np.array_equal(again, used) and np.allclose(was, variance, rtol=1e-6):
            break
        used = again
    covariance = np.linalg.inv(normal)
    back = np.outer(scale, scale)
    return Fit(scale * values, back * covariance, used, float(count / alike.max()), normal / back, weighted / scale)
