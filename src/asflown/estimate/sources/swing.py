"""Posterior of the unknowns where drag is among them: its density swings over the orbit by one amplitude and one phase.

    drag = lever (1 + a cos u + b sin u) x (-v/|v|),   u the way round the orbit

For given (a, b) all is linear and Gaussian; (a, b) lies in a disc, a uniform amplitude and phase beforehand.  So the posterior is a
mixture of Gaussians over a grid of (a, b), which is refined until it resolves the data's own uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import optimize
from scipy.special import ndtr

if TYPE_CHECKING:
    from .whitened import Whitened

#: The largest swing: a density is never negative.
_MOST = 0.95
_GRID = 28
#: Grid points this far below the best, in log probability, do not count.
_FAINT = 15.0


@dataclass(frozen=True)
class Posterior:
    """A mixture of C Gaussians of the p unknowns that are kept, per sigma of each.

    ``log_best``: the largest of log likelihood and prior of the unknowns; ``swing`` (C, 2): a, b of each, zero without drag."""

    kept: np.ndarray  # (columns,) bool: which of the whitened arc's columns
    weight: np.ndarray  # (C,)
    mean: np.ndarray  # (C, p)
    covariance: np.ndarray  # (C, p, p)
    swing: np.ndarray
    log_best: float

    @property
    def at(self) -> np.ndarray:
        """Mean of the mixture, (p,)."""
        return self.weight @ self.mean

    @property
    def spread(self) -> np.ndarray:
        """Covariance of the mixture, (p, p)."""
        off = self.mean - self.at
        return np.einsum("c,cij->ij", self.weight, self.covariance) + np.einsum("c,ci,cj->ij", self.weight, off, off)

    def interval(self, k: int, share: float = 0.95) -> tuple[float, float]:
        """Equal-tailed interval of one unknown."""
        m, s = self.mean[:, k], np.sqrt(self.covariance[:, k, k])
        low, high = float((m - 9 * s).min()), float((m + 9 * s).max())
        tail = (1 - share) / 2

        def quantile(q):
            return float(optimize.brentq(lambda x: float(self.weight @ ndtr((x - m) / s)) - q, low, high, xtol=1e-10 * (high - low)))

        return quantile(tail), quantile(1 - tail)

    def whole(self, columns: int, drag: np.ndarray, cos: np.ndarray, sin: np.ndarray) -> np.ndarray:
        """Mean of every column of the arc (columns,), those of the swing among them; masks of drag's columns."""
        full = np.zeros((len(self.weight), columns))
        full[:, self.kept] = self.mean
        if drag.any():
            full[:, cos] = self.swing[:, :1] * full[:, drag]
            full[:, sin] = self.swing[:, 1:] * full[:, drag]
        return self.weight @ full


def posterior(white: Whitened, sources: tuple[str, ...], rows: np.ndarray | None = None) -> Posterior:
    """With the unknowns of ``sources`` and those of no source; ``rows``: which readings count."""
    arc = white.arc
    E = white.E if rows is None else white.E[rows]
    info = E.T @ E
    names = np.array([c.source for c in arc.columns])
    kept = np.isin(names, ["", "inertia", *sources])
    if not ("drag" in sources and (names == "drag").any()):
        x, C, log = _solved(info, kept, *_no_swing(names), np.zeros((1, 2)))
        return Posterior(kept, np.ones(1), x, C, np.zeros((1, 2)), float(log[0][0]) - white.log_size)
    masks = names == "drag", names == "drag cos", names == "drag sin"
    (a0, a1), (f0, f1) = (0.0, _MOST), (0.0, 2 * np.pi)
    for round_ in range(6):
        A, step = _even(a0, a1)
        F, turn = _even(f0, f1)
        amplitude, phase = (v.ravel() for v in np.meshgrid(A, F, indexing="ij"))
        swing = np.column_stack([amplitude * np.cos(phase), amplitude * np.sin(phase)])
        x, C, (best, evidence) = _solved(info, kept, *masks, swing)
        counted = evidence > evidence.max() - _FAINT
        a0, a1 = max(amplitude[counted].min() - step, 0.0), min(amplitude[counted].max() + step, _MOST)
        new = phase[counted].min() - turn, phase[counted].max() + turn
        wide = len(np.unique(amplitude[counted])) > _GRID / 3 and len(np.unique(phase[counted])) > _GRID / 3
        if wide or round_ == 5:
            break
        f0, f1 = _narrowed(phase[counted], turn, (f0, f1), new)
    w = np.exp(evidence[counted] - evidence.max())
    return Posterior(kept, w / w.sum(), x[counted], C[counted], swing[counted], float(best.max()) - white.log_size)


def _even(low: float, high: float) -> tuple[np.ndarray, float]:
    """Middles of even cells."""
    step = (high - low) / _GRID
    return low + step * (np.arange(_GRID) + 0.5), step


def _narrowed(phase: np.ndarray, turn: float, was: tuple[float, float], new: tuple[float, float]) -> tuple[float, float]:
    """The span of phases that count, on a circle: the complement of the widest stretch without any."""
    if was[1] - was[0] < 2 * np.pi - 1e-9:
        return new
    at = np.unique(phase)
    gaps = np.diff(np.r_[at, at[0] + 2 * np.pi])
    widest = int(np.argmax(gaps))
    if gaps[widest] < 3 * turn:
        return was
    start = at[(widest + 1) % len(at)]
    stop = at[widest] + (2 * np.pi if at[widest] < start else 0.0)
    return start - turn, stop + turn


def _no_swing(names: np.ndarray):
    nothing = np.zeros(len(names), bool)
    return nothing, nothing, nothing


def _solved(info: np.ndarray, kept: np.ndarray, drag, cos, sin, swing: np.ndarray):
    """Of every (a, b) (C, 2): means (C, p), covariances, and log of the best and of the integral over the unknowns."""
    p, columns = int(kept.sum()), len(kept)
    T = np.zeros((len(swing), columns, p))
    T[:, np.flatnonzero(kept), np.arange(p)] = 1.0
    within = np.searchsorted(np.flatnonzero(kept), np.flatnonzero(drag))
    for part, share in ((cos, swing[:, 0]), (sin, swing[:, 1])):
        for row, column in zip(np.flatnonzero(part), within, strict=True):
            T[:, row, column] = share
    N = np.swapaxes(T, 1, 2) @ info[1:, 1:] @ T + np.eye(p)
    g = info[1:, 0] @ T
    root = np.linalg.cholesky(N)
    x = np.linalg.solve(N, g[:, :, None])[:, :, 0]
    best = -0.5 * (info[0, 0] - np.sum(g * x, axis=1))
    evidence = best - np.sum(np.log(np.diagonal(root, axis1=1, axis2=2)), axis=1)
    return x, np.linalg.inv(N), (best, evidence)
