"""How long pulses were, from on-times and numbers of pulses: what scatters from pulse to pulse keeps through one of minutes.

Pulses that begin in one interval of the counters are alike in it; the last of them goes on through intervals in which none
begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

#: A pulse that goes on through so many intervals of the counters after its own is followed by itself; of a record, so many.
_INTERVALS, _MOST = 2, 60


#: A thruster burns where it is on for more than this share of the time, if most of its on-time is so; never off is below this share.
_BURNING, _NEVER_OFF = 0.5, 0.005


@dataclass(frozen=True)
class Lengths:
    """At the counters' instants (M,).  ``squares`` (M, j): of all pulses' lengths, added up [s2]; ``short``: of those that are not
    followed one by one.  ``long`` (M, L): on-time so far of each that is [s], and ``thruster`` (L,) it is of."""

    squares: np.ndarray
    short: np.ndarray
    long: np.ndarray
    thruster: np.ndarray


def lengths_of(on_time_s, pulses) -> Lengths:
    """From counters (M, j), both cumulative."""
    steps, begun = np.diff(on_time_s, axis=0), np.diff(pulses, axis=0)
    added, gone_on = np.zeros_like(steps), []
    for j, (T, n) in enumerate(zip(steps.T, begun.T, strict=True)):
        starts = np.flatnonzero((T > 0) & ((n >= 0.5) | np.r_[True, T[:-1] <= 0]))
        for a, b in pairwise([*starts, len(T)]):
            count = max(n[a], 1.0)
            own = T[a] / count
            last = own + T[a + 1 : b].sum()
            added[a, j] = (count - 1) * own**2 + own * last
            added[a + 1 : b, j] = T[a + 1 : b] * last
            if np.count_nonzero(T[a + 1 : b]) >= _INTERVALS:
                gone_on.append((last, j, a, b, own))
    short, long, thruster = added.copy(), [], []
    for last, j, a, b, own in sorted(gone_on, reverse=True)[:_MOST]:
        course = np.zeros(len(steps))
        course[a], course[a + 1 : b] = own, steps[a + 1 : b, j]
        short[a:b, j] -= course[a:b] * last
        long.append(course)
        thruster.append(j)
    return Lengths(
        _so_far(added),
        _so_far(np.maximum(short, 0.0)),
        _so_far(np.array(long).reshape(len(long), len(steps)).T),
        np.array(thruster, int),
    )


def weak_because_lasting(on_time_s, interval_s, scatter: float) -> np.ndarray:
    """By how much what a thruster gave in a burn may lie below the mean of its pulses, as a share of all it gave, (j,).

    From on-times (M, j) in intervals (M,) [s].  A thruster off for a share x of the burn is the stronger one of its pair by x; a pulse
    stronger by d lasts as 1 / (x + d), so that weighted by length the mean of d is - scatter^2 / x, as long as x is the larger.
    One that is never off is followed as one pulse."""
    on, room = np.asarray(on_time_s, float), np.asarray(interval_s, float)[:, None]
    burning = on > _BURNING * room
    burnt, span = (on * burning).sum(axis=0), (room * burning).sum(axis=0)
    burns = burnt > _BURNING * on.sum(axis=0)
    off = 1 - burnt / np.maximum(span, 1e-300)
    weak = np.where(burns & (off > _NEVER_OFF), scatter**2 / np.hypot(off, max(scatter, 1e-12)), 0.0)
    return weak * burnt / np.maximum(on.sum(axis=0), 1e-300)


def _so_far(steps) -> np.ndarray:
    return np.vstack([np.zeros(steps.shape[1]), np.cumsum(steps, axis=0)])
