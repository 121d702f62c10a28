"""Peaks of a sampled curve, and the excursions of a torque."""

from __future__ import annotations

import numpy as np

#: Half of a peak's surroundings in which each drawn torque's own extremum is looked for: room for a doubtful corner's
#: time.  Further out the highest of a rough torque's many is too high (of a cover's, by 5 % at 5 s, 0.6 % at 2.5 s). [s]
PEAK_REACH_S = 2.5
#: An excursion stands out from its surroundings by this share of the largest torque.
_STANDS_OUT = 0.25
#: And its height is this many of its sigmas.
_SURE = 4.0


def peaks(x, *, height: float, prominence: float, distance: int = 1) -> np.ndarray:
    """Indices of the local maxima of x (N,), without NaN, that are at least so high and stand out so far.

    Of those closer than ``distance`` samples the higher one is kept.  The middle of a flat top counts.  As scipy.signal's
    find_peaks, whose package takes longer to load than most estimates take."""
    x = np.asarray(x, float)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(x)) + 1))
    level = x[starts]
    middle = (starts + np.append(starts[1:], len(x)) - 1) // 2
    rises = np.concatenate(([False], level[1:] > level[:-1]))
    falls = np.concatenate((level[1:] < level[:-1], [False]))
    top = np.flatnonzero(rises & falls & (level >= height))
    if len(top) == 0:
        return np.empty(0, np.intp)
    lowest = np.maximum(_lowest_since_higher(level), _lowest_since_higher(level[::-1])[::-1])
    top = _apart(top, middle, level, distance)
    return middle[top[level[top] - lowest[top] >= prominence]]


def _lowest_since_higher(level: np.ndarray) -> np.ndarray:
    """The lowest value since the last one that was higher, for each value."""
    lowest = np.empty(len(level))
    open_ones: list[tuple[float, float]] = []  # higher and higher, each with the lowest value since the one before
    for i, value in enumerate(level.tolist()):
        low = value
        while open_ones and open_ones[-1][0] <= value:
            low = min(low, open_ones.pop()[1])
        open_ones.append((value, low))
        lowest[i] = low
    return lowest


def _apart(top, middle, level, distance: int) -> np.ndarray:
    """The peaks that no higher one is near to, the highest first."""
    kept = np.ones(len(top), bool)
    for i in np.argsort(level[top], kind="stable")[::-1].tolist():
        if kept[i]:
            near = np.abs(middle[top] - middle[top[i]]) < distance
            near[i] = False
            kept &= ~near
    return top[kept]


def excursions(torque: np.ndarray, sigma: np.ndarray | None = None) -> np.ndarray:
    """Indices of the excursions of either sign of a torque (M,), NaN where unknown. [N m]

    They are above four times their sigma (M,), if there is one, and stand out from their surroundings by a share of the largest of these."""
    known = np.isfinite(torque)
    sure = known if sigma is None else known & (np.abs(torque) > _SURE * sigma)
    if known.sum() < 3 or not np.any(torque[sure]):
        return np.empty(0, np.intp)
    least, filled = _STANDS_OUT * np.max(np.abs(torque[sure])), np.where(known, torque, 0.0)
    found = [peaks(sign * filled, height=least, prominence=least) for sign in (1, -1)]
    at = np.sort(np.concatenate(found))
    return at[sure[at]]


def heights(time_s: np.ndarray, torques: np.ndarray, at_s: float, reach_s: float, sign: float) -> np.ndarray:
    """Each torque's own extremum (...) of a sign within reach of a time; ``torques``: (..., M). [N m]"""
    near = np.abs(time_s - at_s) <= reach_s + 1e-9
    return sign * np.max(sign * torques[..., near], axis=-1)
