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
#: One sigma of a constant torque about an axis, over the widest: next to none, and sizes half a decade apart; the chance of each
#: beforehand.  Few crafts have one.
SIZES = (1e-3, 0.01, 0.03, 0.1, 0.3, 1.0)
CHANCES = (0.7, 0.06, 0.06, 0.06, 0.06, 0.06)
#: Where a component of the mixture is looked at, in its sigmas, and how many places of the whole.
_SPOTS, _PLACES = np.linspace(-3.5, 3.5, 29), 300
#: What weighs less than this beside the heaviest is left out.
_RARE = 1e-5
#: Grid points this far below the best, in log probability, do not count.
_FAINT = 15.0


@dataclass(frozen=True)
class Posterior:
    """A mixture of C Gaussians of the p unknowns that are kept, per sigma of each.

    ``log_best``: the largest of log likelihood and prior of the unknowns; ``log_evidence``: their integral, but for a constant of the arc;
    ``swing`` (C, 2): a, b of each, zero without drag."""

    kept: np.ndarray  # (columns,) bool: which of the whitened arc's columns
    weight: np.ndarray  # (C,)
    mean: np.ndarray  # (C, p)
    covariance: np.ndarray  # (C, p, p)
    swing: np.ndarray
    log_best: float
    log_evidence: float

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
        """The shortest interval of one unknown that holds ``share``."""
        m, s = self.mean[:, k], np.sqrt(self.covariance[:, k, k])
        # places as dense as the mixture itself, its distribution at each
        spots, weight = (m[:, None] + s[:, None] * _SPOTS).ravel(), np.repeat(self.weight, len(_SPOTS))
        order = np.argsort(spots)
        gone = np.cumsum(weight[order]) / weight.sum()
        x = spots[order][np.searchsorted(gone, np.linspace(0, 1, _PLACES)[:-1])]
        x = np.unique(np.r_[(m - 6 * s).min(), x, (m + 6 * s).max()])
        below = scipy.special.ndtr((x[:, None] - m) / s) @ self.weight
        first = np.linspace(0, 1 - share, 101)
        low, high = np.interp(first, below, x), np.interp(first + share, below, x)
        shortest = int(np.argmin(high - low))
        return float(low[shortest]), float(high[shortest])

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


def posterior(white: Whitened, sources: tuple[str, ...], cells: int = _GRID, constant: float = 1.0) -> Posterior:
    """With the unknowns of ``sources``, those of the inertia, and those of no source.

    ``cells``: of the grid in amplitude and in phase; it is refined until a third of them count either way.  ``constant``: sigma of
    the constant torque beforehand, over that of its columns."""
    info, places = _reduced(white)
    columns = white.arc.columns
    names = np.array([columns[c].source for c in places])
    use = np.isin(names, ["inertia", *sources])
    kept = np.zeros(len(columns), bool)
    kept[places[use]] = True
    prior = np.where(names[use] == "constant", constant**-2.0, 1.0)
    if not ("drag" in sources and (names == "drag").any()):
        x, N, best, evidence = _solved(info, use, names, np.zeros((1, 2)), prior)
        return Posterior(
            kept, np.ones(1), x, np.linalg.inv(N), np.zeros((1, 2)), float(best[0]) - white.log_size, float(evidence[0])
        )
    (a0, a1), (f0, f1) = (0.0, _MOST), (0.0, 2 * np.pi)
    for _ in range(6):
        (A, step), (F, turn) = _even(a0, a1, cells), _even(f0, f1, cells)
        amplitude, phase = (v.ravel() for v in np.meshgrid(A, F, indexing="ij"))
        swing = np.column_stack([amplitude * np.cos(phase), amplitude * np.sin(phase)])
        x, N, best, evidence = _solved(info, use, names, swing, prior)
        counted = evidence > evidence.max() - _FAINT
        if min(len(np.unique(amplitude[counted])), len(np.unique(phase[counted]))) > cells / 3:
            break
        a0, a1 = max(amplitude[counted].min() - step, 0.0), min(amplitude[counted].max() + step, _MOST)
        f0, f1 = _narrowed(phase[counted], turn, (f0, f1))
    w = np.exp(evidence[counted] - evidence.max())
    covariance = np.linalg.inv(N[counted])
    whole = float(evidence.max() + np.log(w.sum() * step * turn / (2 * np.pi * _MOST)))
    return Posterior(
        kept, w / w.sum(), x[counted], covariance, swing[counted], float(best.max()) - white.log_size, whole
    )


@dataclass(frozen=True)
class Averaged:
    """The posterior over how large a constant torque may be; the chance that it is more than next to none; and the posteriors with next
    to none and with the widest prior."""

    whole: Posterior
    chance: float
    none: Posterior
    widest: Posterior


def averaged(white: Whitened, sources: tuple[str, ...]) -> Averaged:
    """With a constant torque of unknown size among ``sources``.

    It favours no axis: where the arc would show one about x and shows none, a large one about y is unlikely too."""
    made = [posterior(white, sources, constant=size) for size in SIZES]
    odds = np.array([m.log_evidence for m in made]) + np.log(CHANCES)
    share = np.exp(odds - odds.max())
    log_evidence = float(odds.max() + np.log(share.sum()))
    share /= share.sum()
    weight = np.concatenate([s * m.weight for s, m in zip(share, made, strict=True)])
    counts = weight > _RARE * weight.max()

    def of(name: str) -> np.ndarray:
        return np.concatenate([getattr(m, name) for m in made])[counts]

    whole = Posterior(
        made[0].kept, weight[counts] / weight[counts].sum(), of("mean"), of("covariance"), of("swing"),
        max(m.log_best for m in made), log_evidence,
    )  # fmt: skip
    return Averaged(whole, float(1 - share[0]), made[0], made[-1])


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


def _solved(info: np.ndarray, use: np.ndarray, names: np.ndarray, swing: np.ndarray, prior: np.ndarray):
    """Of every (a, b) (C, 2): means (C, p), their information (C, p, p), and log of the best and of the integral over the unknowns.

    ``prior`` (p,): information of each beforehand."""
    p, columns = int(use.sum()), len(use)
    T = np.zeros((len(swing), columns, p))
    T[:, np.flatnonzero(use), np.arange(p)] = 1.0
    if use[names == "drag"].any():
        within = np.searchsorted(np.flatnonzero(use), np.flatnonzero(names == "drag"))
        for part, share in zip(("drag cos", "drag sin"), swing.T, strict=True):
            for row, column in zip(np.flatnonzero(names == part), within, strict=True):
                T[:, row, column] = share
    N = np.swapaxes(T, 1, 2) @ (info[1:, 1:] @ T) + np.diag(prior)
    g = info[1:, 0] @ T
    root = np.linalg.cholesky(N)
    x = np.linalg.solve(N, g[:, :, None])[:, :, 0]
    best = -0.5 * (info[0, 0] - np.sum(g * x, axis=1))
    beforehand = 0.5 * float(np.sum(np.log(prior)))
    return x, N, best, best + beforehand - np.sum(np.log(np.diagonal(root, axis1=1, axis2=2)), axis=1)
