"""Which sources are there: every set of them against the others, by BIC and by what each foretells of blocks held back."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from .swing import looked_for, posterior

if TYPE_CHECKING:
    from .whitened import Whitened

#: Cells of the swing's grid: the best is wanted, not its surroundings.
_CELLS = 12
#: Stretches that are held back in turn.
_FOLDS = 8


@dataclass(frozen=True)
class Model:
    """A set of sources: BIC above the best set's, and how much less likely it makes what was held back, in log odds."""

    sources: tuple[str, ...]
    bic_above_best: float
    held_back_below_best: float


def compare(white: Whitened, sources: tuple[str, ...]) -> tuple[Model, ...]:
    """All subsets, the best BIC first."""
    subsets = [s for n in range(len(sources) + 1) for s in combinations(sources, n)]
    names = [c.source for c in white.arc.columns]
    n = int(white.kept.sum())
    bic, foretold = [], []
    for subset in subsets:
        best = posterior(white, subset, _CELLS)
        free = sum(names.count(s) for s in subset) + 2 * ("drag" in subset)
        bic.append(-2 * best.log_best + free * np.log(n))
        foretold.append(
            _foretold(white, subset, best.swing[int(np.argmax(best.weight))], best.kept | ~looked_for(white.arc))
        )
    order = np.argsort(bic)
    return tuple(Model(subsets[k], float(bic[k] - min(bic)), float(max(foretold) - foretold[k])) for k in order)


def _foretold(white: Whitened, subset: tuple[str, ...], swing: np.ndarray, kept: np.ndarray) -> float:
    """Log probability of each stretch given the others, the swing held."""
    names = np.array([c.source for c in white.arc.columns])
    X = white.E[:, 1:].copy()
    if "drag" in subset:
        X[:, names == "drag"] += X[:, names == "drag cos"] * swing[0] + X[:, names == "drag sin"] * swing[1]
    X, y = X[:, kept], white.E[:, 0]
    total, N, g = 0.0, X.T @ X + np.eye(X.shape[1]), X.T @ y
    for rows in np.array_split(np.arange(len(y)), _FOLDS):
        Xr, yr = X[rows], y[rows]
        C = np.linalg.inv(N - Xr.T @ Xr)
        off = yr - Xr @ (C @ (g - Xr.T @ yr))
        # of unit noise plus Xr C Xr^T, by the matrix inversion lemma
        inner = np.linalg.inv(np.linalg.inv(C) + Xr.T @ Xr)
        pulled = Xr.T @ off
        total -= 0.5 * (off @ off - pulled @ inner @ pulled + np.linalg.slogdet(np.eye(len(C)) + C @ (Xr.T @ Xr))[1])
    return float(total)
