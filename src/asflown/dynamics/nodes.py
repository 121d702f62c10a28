"""A smooth but slow function of time, evaluated at a few of the instants asked for and joined by cubic splines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from collections.abc import Callable

#: A spline through fewer nodes says little.
_FEWEST = 6


def through_nodes(time_s: np.ndarray, step_s: float, evaluate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The values at all instants, of a function that hardly changes over ``step_s``.

    Parameters
    ----------
    time_s : ndarray, shape (N,)
        Instants in any order. [s]  Where one comes twice (several places at one instant) each is evaluated.
    step_s : float
        Largest distance of two nodes. [s]  Nothing is joined across a longer gap.
    evaluate : callable
        Takes indices (K,) into ``time_s`` and returns the values there, (K,) or (K, M).

    Returns
    -------
    ndarray, shape (N,) or (N, M)
        A cubic spline between nodes that lie h apart errs by 5/384 h^4 times the fourth derivative.
    """
    t, first, back = np.unique(np.asarray(time_s, float), return_index=True, return_inverse=True)
    if len(t) < max(_FEWEST, len(back)) or np.median(np.diff(t)) > step_s / 2:
        return evaluate(np.arange(len(back)))
    cuts = np.flatnonzero(np.diff(t) > step_s) + 1
    parts = np.split(np.arange(len(t)), cuts)
    nodes = [_nodes(t, part, step_s) for part in parts]
    known = np.split(evaluate(first[np.concatenate(nodes)]), np.cumsum([len(n) for n in nodes])[:-1])
    joined = [
        values if len(at) == len(part) else scipy.interpolate.CubicSpline(t[at], values)(t[part])
        for part, at, values in zip(parts, nodes, known, strict=True)
    ]
    return np.concatenate(joined)[back]


def _nodes(t: np.ndarray, part: np.ndarray, step_s: float) -> np.ndarray:
    """Indices of the instants of one stretch that serve as nodes: its ends, and about every ``step_s`` between them."""
    start, stop = t[part[0]], t[part[-1]]
    grid = np.linspace(start, stop, max(int(np.ceil((stop - start) / step_s)) + 1, _FEWEST))
    at = np.unique(part[0] + np.searchsorted(t[part], grid).clip(max=len(part) - 1))
    return at if len(at) >= _FEWEST else part
