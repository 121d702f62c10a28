"""Samples of drag against speed: a line without outliers, and the outliers that are drag spikes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.scatter import robust_sigma
from .doubts import MAGNITUDE, ON_THE_WHEEL

if TYPE_CHECKING:
    from ...kit.doubts import Kind

#: A spike stands out by this many robust sigma.
_SPIKE = 6.0


def opposing(rate, drag, slow: float) -> tuple[np.ndarray, Kind | None]:
    """Drag as a size that opposes the rate, whichever of three conventions it came in, and the doubt of another one.

    ``slow``: below this |rate| a sample says nothing of the convention."""
    ways = [w * float(np.median(drag[w * rate > slow])) for w in (1, -1) if (w * rate > slow).sum() > 2]
    if not ways or min(ways) >= 0:
        return drag * np.sign(rate), None
    if max(ways) <= 0:
        return -drag * np.sign(rate), ON_THE_WHEEL
    return drag * np.sign(np.median(drag)), MAGNITUDE


def find_spikes(time_s, excess, drag, moving, used) -> list[tuple[float, float, float, float]]:
    """(time, drag, excess, duration) of excesses above _SPIKE robust sigma of the others, while the wheel turns.

    Runs with one sample between them are one spike."""
    sigma = robust_sigma(excess[used]) if used.any() else 0.0
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
