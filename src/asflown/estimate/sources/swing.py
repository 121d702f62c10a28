"""Posterior of the unknowns where drag is among them: its density swings over the orbit by one amplitude and one phase.

    drag = lever (1 + a cos u + b sin u) x (-v/|v|),   u the way round the orbit

For given (a, b) all is linear and Gaussian; (a, b) lies in a disc, a uniform amplitude and phase beforehand.  So the posterior is a
mixture of Gaussians over a grid of (a, b), which is refined until it resolves the data's own uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from .gather import Arc
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
            return float(
                scipy.optimize.brentq(
                    lambda x: float(self.weight @ scipy.special.ndtr((x - m) / s)) - q,
                    low,
                    high,
                    xtol=1e-10 * (high - low),
                )
            )

        return quantile(tail), quantile(1 - tail)

    def whole(self, white: Whitened) -> np.ndarray:
        """Mean of every column of the arc, (columns,): those of the swing and those that are not looked for among them."""
        arc = white.arc
        full = np.zeros((len(self.weight), len(arc.columns)))
        full[:, self.kept] = self.mean
        if self.kept[arc.of("drag")].any():
            for part, share in zip(("drag cos", "drag sin"), self.swing.T, strict=True):
                full[:, arc.of(part)] = share[:, None] * full[:, arc.of("drag")]
        mean = self.weight @ full
        rest = ~looked_for(arc)
        N = white.information[1:, 1:]
        mean[rest] = np.linalg.solve(
            N[np.ix_(rest, rest)] + np.eye(int(rest.sum())),
            white.information[1:, 0][rest] - N[np.ix_(rest, ~rest)] @ mean[~rest],
        )
        return mean


def looked_for(arc: Arc) -> np.ndarray:
    """Which columns belong to a source or to the inertia; the others have a prior and are solved for on the way."""
    return np.array([bool(c.source) for c in arc.columns])


def _reduced(white: Whitened) -> tuple[np.ndarray, np.ndarray]:
    """Information of the readings and of the columns looked for once all others are solved for, and the places of those columns."""
    of = looked_for(white.arc)
    rest, held = np.flatnonzero(~of) + 1, np.r_[0, np.flatnonzero(of) + 1]
    info = white.information
    across = info[np.ix_(rest, held)]
    inner = np.linalg.solve(info[np.ix_(rest, rest)] + np.eye(len(rest)), across)
    return info[np.ix_(held, held)] - across.T @ inner, np.flatnonzero(of)


def posterior(white: Whitened, sources: tuple[str, ...], cells: int = _GRID) -> Posterior:
    """With the unknowns of ``sources``, those of the inertia, and those of no source.

    ``cells``: of the grid in amplitude and in phase; it is refined until a third of them count either way."""
    info, places = _reduced(white)
    columns = white.arc.columns
    names = np.array([columns[c].source for c in places])
    use = np.isin(names, ["inertia", *sources])
    kept = np.zeros(len(columns), bool)
    kept[places[use]] = True
    if not ("drag" in sources and (names == "drag").any()):
        x, N, best, _ = _solved(info, use, names, np.zeros((1, 2)))
        return Posterior(kept, np.ones(1), x, np.linalg.inv(N), np.zeros((1, 2)), float(best[0]) - white.log_size)
    (a0, a1), (f0, f1) = (0.0, _MOST), (0.0, 2 * np.pi)
    for _ in range(6):
        (A, step), (F, turn) = _even(a0, a1, cells), _even(f0, f1, cells)
        amplitude, phase = (v.ravel() for v in np.meshgrid(A, F, indexing="ij"))
        swing = np.column_stack([amplitude * np.cos(phase), amplitude * np.sin(phase)])
        x, N, best, evidence = _solved(info, use, names, swing)
        counted = evidence > evidence.max() - _FAINT
        if min(len(np.unique(amplitude[counted])), len(np.unique(phase[counted]))) > cells / 3:
            break
        a0, a1 = max(amplitude[counted].min() - step, 0.0), min(amplitude[counted].max() + step, _MOST)
        f0, f1 = _narrowed(phase[counted], turn, (f0, f1))
    w = np.exp(evidence[counted] - evidence.max())
    covariance = np.linalg.inv(N[counted])
    return Posterior(kept, w / w.sum(), x[counted], covariance, swing[counted], float(best.max()) - white.log_size)


def _even(low: float, high: float, cells: int) -> tuple[np.ndarray, float]:
    """Middles of even cells, and their width."""
    step = (high - low) / cells
    return low + step * (np.arange(cells) + 0.5), step


def _narrowed(phase: np.ndarray, turn: float, was: tuple[float, float]) -> tuple[float, float]:
    """The span of phases that count; on a whole circle the complement of the widest stretch without any."""
    if was[1] - was[0] < 2 * np.pi - 1e-9:
        return phase.min() - turn, phase.max() + turn
    at = np.unique(phase)
    gaps = np.diff(np.r_[at, at[0] + 2 * np.pi])
    widest = int(np.argmax(gaps))
    if gaps[widest] < 3 * turn:
        return was
    start = at[(widest + 1) % len(at)]
    stop = at[widest] + (2 * np.pi if at[widest] < start else 0.0)
    return start - turn, stop + turn


def _solved(info: np.ndarray, use: np.ndarray, names: np.ndarray, swing: np.ndarray):
    """Of every (a, b) (C, 2): means (C, p), their information (C, p, p), and log of the best and of the integral over the unknowns."""
    p, columns = int(use.sum()), len(use)
    T = np.zeros((len(swing), columns, p))
    T[:, np.flatnonzero(use), np.arange(p)] = 1.0
    if use[names == "drag"].any():
        within = np.searchsorted(np.flatnonzero(use), np.flatnonzero(names == "drag"))
        for part, share in zip(("drag cos", "drag sin"), swing.T, strict=True):
            for row, column in zip(np.flatnonzero(names == part), within, strict=True):
                T[:, row, column] = share
    N = np.swapaxes(T, 1, 2) @ (info[1:, 1:] @ T) + np.eye(p)
    g = info[1:, 0] @ T
    root = np.linalg.cholesky(N)
    x = np.linalg.solve(N, g[:, :, None])[:, :, 0]
    best = -0.5 * (info[0, 0] - np.sum(g * x, axis=1))
    return x, N, best, best - np.sum(np.log(np.diagonal(root, axis1=1, axis2=2)), axis=1)
