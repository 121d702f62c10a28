"""Samples of drag against speed: a line without outliers, and the outliers that are drag spikes."""

from __future__ import annotations

import numpy as np

from ..kit.regression import memory

#: A spike stands out by this many robust sigma.
_SPIKE = 6.0
#: Samples beyond this many robust sigma do not count for the line.
_OUTLYING = 4.0


def opposing(rate, drag, slow: float) -> tuple[np.ndarray, str]:
    """Drag as a size that opposes the rate, whichever of three conventions it came in, and what was found of that.

    ``slow``: below this |rate| a sample says nothing of the convention."""
    ways = [w * float(np.median(drag[w * rate > slow])) for w in (1, -1) if (w * rate > slow).sum() > 2]
    if not ways or min(ways) >= 0:
        return drag * np.sign(rate), ""
    if max(ways) <= 0:
        return -drag * np.sign(rate), "has the sign opposite to the rate: taken as the torque on the wheel"
    return drag * np.sign(np.median(drag)), "has one sign for both senses of rotation: taken as a size"


def robust_line(u, y) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """y = c0 + c1 u by repeated least squares without outliers: values (2,), covariance, which samples were used.

    Samples in order of time: where their errors follow each other, the covariance is wider.  Where all u are one
    the slope is taken as zero with a sigma that says it is not known, and the value at u stands."""
    u, y = np.asarray(u, float), np.asarray(y, float)
    scatter = 1.4826 * float(np.median(np.abs(y - np.median(y))))
    used = np.abs(y - np.median(y)) <= 20 * scatter if scatter > 0 else np.ones(len(y), bool)
    for _ in range(20):
        centre, middle = float(u[used].mean()), float(y[used].mean())
        spread = float(np.sum((u[used] - centre) ** 2))
        narrow = spread <= 1e-12 * float(np.sum(u[used] ** 2))
        slope = 0.0 if narrow else float((u[used] - centre) @ y[used]) / spread
        left = y - middle - slope * (u - centre)
        scatter = 1.4826 * float(np.median(np.abs(left[used])))
        again = np.abs(left) <= _OUTLYING * scatter
        if scatter == 0 or again.sum() < 4 or np.array_equal(again, used):
            break
        used = again
    count = int(used.sum())
    variance = float(np.sum(left[used] ** 2)) / max(count - 2, 1) * memory(left[used])
    of_slope = (100 * middle / centre) ** 2 if narrow else variance / spread
    J = np.array([[1.0, -centre], [0.0, 1.0]])
    return np.array([middle - slope * centre, slope]), J @ np.diag([variance / count, of_slope]) @ J.T, used


def find_spikes(time_s, excess, drag, moving, used) -> list[tuple[float, float, float, float]]:
    """(time, drag, excess, duration) of excesses above _SPIKE robust sigma of the others, while the wheel turns.

    Runs with one sample between them are one spike."""
    sigma = 1.4826 * float(np.median(np.abs(excess[used]))) if used.any() else 0.0
    at = np.flatnonzero(moving & (excess > _SPIKE * sigma))
    if sigma == 0 or not len(at):
        return []
    step = float(np.median(np.diff(time_s)))
    found = []
    for part in np.split(at, np.flatnonzero((np.diff(at) > 2) | (np.diff(time_s[at]) > 6.5 * step)) + 1):
        size, top = float(excess[part].max()), part[int(np.argmax(excess[part]))]
        if len(part) >= 3:  # the highest of noisy samples is too high
            middles = np.median(np.lib.stride_tricks.sliding_window_view(excess[part], 3), axis=1)
            size, top = float(middles.max()), part[1 + int(middles.argmax())]
        first, last = part[excess[part] >= 0.5 * size][[0, -1]]
        start = _cut(time_s, excess, first - 1, first, 0.5 * size, step)
        stop = _cut(time_s, excess, last + 1, last, 0.5 * size, step)
        found.append((start, float(drag[top] - excess[top]) + size, size, stop - start))
    return found


def _cut(t, y, outside: int, inside: int, level: float, step: float) -> float:
    """When a rising or falling edge is at a level; half a step out where there is no neighbour to tell."""
    if 0 <= outside < len(t) and abs(t[outside] - t[inside]) < 6.5 * step and y[outside] < level:
        x = (y[inside] - level) / (y[inside] - y[outside])
        return float(t[inside] + x * (t[outside] - t[inside]))
    return float(t[inside] + 0.5 * step * np.sign(outside - inside))
