"""The arc whitened: momentum of an unexplained slow torque, noise of the readings, and their sizes by likelihood.

u' = R tau,   tau' = -tau / L + noise  (size s),   y = Z theta + R^T u + e
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.regressed import Filtered, Steps, run, smooth

if TYPE_CHECKING:
    from .gather import Arc

#: The slow torque is at least this share of the torque seen: no model of field, light and air is better. Assumed.
_LEAST = 0.003
#: Bounds of its time constant. [s]
_SHORTEST_S = 30.0
#: A reading this many sigmas from the rest is left out.
_OUT = 6.0


@dataclass(frozen=True)
class Levels:
    """Noise over that of single samples' differences, by axis (3,); the slow torque's size [N m] and time constant [s]."""

    white: np.ndarray
    slow_Nm: float
    slow_s: float


@dataclass(frozen=True)
class Whitened:
    """Readings and columns in units of their own noise, independent of each other.

    ``E`` (M, 1 + p): y and the columns per sigma of each unknown; three rows a block, x y z; ``information``: E^T E, without prior."""

    arc: Arc
    levels: Levels
    steps: Steps
    filtered: Filtered
    kept: np.ndarray

    @cached_property
    def E(self) -> np.ndarray:
        return self.filtered.innovation / np.sqrt(self.filtered.variance)[:, None]

    @cached_property
    def information(self) -> np.ndarray:
        return self.E.T @ self.E

    @property
    def log_size(self) -> float:
        return float(0.5 * np.sum(np.log(2 * np.pi * self.filtered.variance)))

    @cached_property
    def cost(self) -> float:
        """Minus the log restricted likelihood."""
        return _restricted(self.filtered)

    def slow_torque(self, theta: np.ndarray) -> np.ndarray:
        """The unexplained torque at the blocks' middles, body axes (K, 3)."""
        return smooth(self.steps, self.filtered, theta).mean[:, 3:]


def whitened(arc: Arc, near: Levels | None = None) -> Whitened:
    """At the levels of the largest restricted likelihood, looked for from ``near``; without outliers."""
    kept = np.ones((len(arc.time_s), 3), bool)
    near = near or Levels(np.ones(3), 0.1 * arc.size_Nm, 0.1 * float(np.ptp(arc.time_s)))
    levels = _likeliest(arc, kept, near)
    for _ in range(3):
        whole = _at(arc, levels, kept)
        theta = _solve(whole.filtered.information)
        off = np.abs(whole.E[:, 0] - whole.E[:, 1:] @ theta).reshape(-1, 3)
        again = kept & (off < _OUT)
        if np.array_equal(again, kept) or (~again).sum() > 0.05 * again.size:
            return whole
        kept = again
        levels = _likeliest(arc, kept, levels)
    return _at(arc, levels, kept)


def _at(arc: Arc, levels: Levels, kept: np.ndarray) -> Whitened:
    steps = _steps(arc, levels, kept)
    return Whitened(arc, levels, steps, run(steps), kept)


def _steps(arc: Arc, levels: Levels, kept: np.ndarray) -> Steps:
    K, p = len(arc.time_s), len(arc.columns)
    h, L, s = np.diff(arc.time_s, prepend=arc.time_s[0]), levels.slow_s, levels.slow_Nm
    f = np.exp(-h / L)
    A = np.zeros((K, 6, 6))
    A[:, :3, :3] = np.eye(3)
    A[:, :3, 3:] = (L * (1 - f))[:, None, None] * arc.turn
    A[:, 3:, 3:] = f[:, None, None] * np.eye(3)
    # integral of an Ornstein-Uhlenbeck torque over a step, with itself and with its end
    uu = L**2 * (2 * h / L - 3 + 4 * f - f**2)
    ut = L * (1 - f) ** 2
    driven = np.zeros((2, K, 6, 6))
    driven[0, :, :3, :3] = np.maximum(uu, 0)[:, None, None] * np.eye(3)
    driven[0, :, :3, 3:] = ut[:, None, None] * arc.turn
    driven[0, :, 3:, :3] = np.swapaxes(driven[0, :, :3, 3:], 1, 2)
    driven[0, :, 3:, 3:] = (1 - f**2)[:, None, None] * np.eye(3)
    driven[1, :, :3, :3] = np.eye(3)
    H = np.zeros((K, 3, 6))
    H[:, :, :3] = np.swapaxes(arc.turn, 1, 2)
    variance = (levels.white * arc.white) ** 2 / arc.count[:, None]
    return Steps(
        A=A, b=np.zeros((K, 6)), driven=driven, kind=np.arange(K), scale=np.column_stack([np.full(K, s**2), arc.jump]),
        start=3 * np.arange(K + 1), H=H.reshape(-1, 6), y=arc.momentum.ravel(), Z=arc.Z.reshape(-1, p),
        R=np.where(kept, variance, 1e8 * variance).ravel(), covariance=np.diag([0.0, 0, 0, s**2, s**2, s**2]),
    )  # fmt: skip


def _solve(information: np.ndarray) -> np.ndarray:
    """Unknowns in their own sigmas, with the unit prior of each."""
    N = information[1:, 1:] + np.eye(len(information) - 1)
    return np.linalg.solve(N, information[1:, 0])


def _cost(arc: Arc, levels: Levels, kept: np.ndarray) -> float:
    return _restricted(run(_steps(arc, levels, kept)))


def _restricted(filtered: Filtered) -> float:
    """Minus the log restricted likelihood: of the readings with the unknowns integrated out under their priors."""
    info = filtered.information
    N = info[1:, 1:] + np.eye(len(info) - 1)
    least = info[0, 0] - info[1:, 0] @ np.linalg.solve(N, info[1:, 0])
    return float(0.5 * (least + np.sum(np.log(filtered.variance)) + np.linalg.slogdet(N)[1]))


def _likeliest(arc: Arc, kept: np.ndarray, first: Levels) -> Levels:
    span = float(np.ptp(arc.time_s))

    def levels(x):
        return replace(first, white=np.exp(x[:3]), slow_Nm=float(np.exp(x[3])), slow_s=float(np.exp(x[4])))

    longest = max(span / 3, 2 * _SHORTEST_S)
    low = np.log([0.5, 0.5, 0.5, _LEAST * arc.size_Nm, max(_SHORTEST_S, 2 * arc.step_s)])
    high = np.log([100, 100, 100, 10 * arc.size_Nm, max(longest, 4 * arc.step_s)])
    start = np.clip(np.log([*first.white, first.slow_Nm, first.slow_s]), low, high)
    found = scipy.optimize.minimize(
        lambda x: _cost(arc, levels(x), kept), start, method="L-BFGS-B", bounds=list(zip(low, high, strict=True)),
        options={"maxiter": 25, "ftol": 1e-7, "eps": 1e-3},
    )  # fmt: skip
    return levels(found.x)
