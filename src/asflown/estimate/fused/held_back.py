"""Predict what was held back: whether the fused method's bands hold on samples it never saw.

Samples of one axis are held back, the levels fitted without them, and each is predicted from the rest.  Under
the model a pull, (measured - predicted) / sqrt(h' P h + R), is unit normal, R being the channel's own noise.

Pulls of neighbours are nearly equal: in a block of 60 they are worth a few, and their scatter says little.
``whitened`` pulls are worth one each: every held-back sample's error over its sigma, given the rest *and the
held-back samples before it*.  Both come from one filter pass over everything.  With W the filter (W y is white,
of unit size) and X its columns for the held-back samples, the errors' joint precision given the rest is X' X, and
the errors are (X' X)^-1 X' W y: the conditional of a Gaussian, read off its inverse covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from ...kit.ensemble import gains, whiten
from .body import AxisData, Body, Levels
from .levels import fit_levels
from .series import ROWS, Series, arrange, step_of

#: Length of a block held back, and how many blocks apart those held back at the same time are. [s]
BLOCK_S, APART = 60.0, 4


@dataclass(frozen=True)
class HeldBack:
    """Held-back samples of one axis in order of time: what was measured, over how sure it was beforehand."""

    row: np.ndarray  # (n,), in series.ROWS
    seconds: np.ndarray  # (n,)
    pull: np.ndarray  # (n,), given the rest
    whitened: np.ndarray  # (n,), given the rest and the held-back samples before it


def predict(body: Body, levels: Levels, series: list[Series], held: list[np.ndarray]) -> HeldBack:
    """Predict the samples where ``held``, (N,) bool for each series, from all others, at given ``levels``."""
    axis = AxisData.of(body, levels, series)
    data = axis.data
    # carried through the same sorting as the values are
    _, marked = arrange([replace(s, values=h.astype(float)) for s, h in zip(series, held, strict=True)])
    which = np.flatnonzero(marked.value)[::-1]  # latest first: the Cholesky factor takes the last column first
    step = step_of(data)[which]
    columns = np.zeros((len(data.row), len(which)))
    columns[which, np.arange(len(which))] = 1
    g = gains(axis.model, data)
    X = whiten(g, columns)
    L = scipy.linalg.cholesky(X.T @ X, lower=True)
    white = scipy.linalg.solve_triangular(L, X.T @ g.own, lower=True)
    root = scipy.linalg.solve_triangular(L, np.eye(len(which)), lower=True)  # covariance = root' root
    error, sigma = root.T @ white, np.sqrt(np.sum(root**2, axis=0))
    return HeldBack(axis.channel[which][::-1], axis.time_s[step][::-1], (error / sigma)[::-1], white[::-1])


def hold_back(body: Body, series: list[Series], held: list[np.ndarray], levels: Levels | None = None) -> HeldBack:
    """Predict the samples where ``held``, (N,) bool for each series, with ``levels``, or levels fitted to the others.

    Samples which that fit leaves out as outliers do not predict; held-back ones are all judged."""
    rest = [s.where(~h) for s, h in zip(series, held, strict=True)]
    asked = [s.where(h) for s, h in zip(series, held, strict=True) if h.any()]
    if levels is None:
        fit = fit_levels(body, rest)
        levels, rest = fit.levels, list(fit.series)
        late = {ROWS.index(n): o.seconds for n, o in fit.offsets.items() if o.corrected}
        asked = [s.later(-late.get(s.row, 0.0)) for s in asked]
    marks = [np.zeros(len(s.values), bool) for s in rest] + [np.ones(len(s.values), bool) for s in asked]
    return predict(body, levels, [*rest, *asked], marks)


def blocks(series: list[Series], rows, turn: int) -> list[np.ndarray]:
    """Marks every APART-th block of BLOCK_S seconds of some rows, from block ``turn`` on; all turns cover the record."""
    first = min(s.seconds[0] for s in series)
    return [np.isin(s.row, rows) & ((s.seconds - first) // BLOCK_S % APART == turn) for s in series]


def between_ends(series: list[Series], row: int, first_s: float, last_s: float = 0.0) -> list[np.ndarray]:
    """Marks a whole channel but its first and last seconds, without which a constant would be free."""
    return [
        (s.row == row) & (s.seconds - s.seconds[0] >= first_s) & (s.seconds[-1] - s.seconds >= last_s) for s in series
    ]
