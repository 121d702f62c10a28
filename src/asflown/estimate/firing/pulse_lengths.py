"""How long pulses were, from on-times and numbers of pulses.  A pulse keeps its error of size while it lasts, even for minutes.

Pulses that begin in one interval of the counters are taken as equally long in it; the last of them goes on through intervals in
which none begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

#: A pulse that lasts for at least so many further intervals of the counters has a parameter of its own; at most so many a record.
_INTERVALS, _MOST = 2, 60
#: A thruster burns where it is on for more than this share of the time, if that holds for most of its on-time; below the second
#: share of time off it counts as never off.
_BURNING, _NEVER_OFF = 0.5, 0.005


@dataclass(frozen=True)
class Lengths:
    """At the counters' instants (M,).  ``squares`` (M, j): sum of the squares of all pulses' lengths [s2]; ``short``: the same of
    pulses that have no parameter of their own.  ``long`` (M, L): on-time so far of each that has one [s]; ``thruster`` (L,): whose."""

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
    """Share by which the impulse of a thruster in a burn may lie below the mean of its pulses, (j,).

    From on-times (M, j) in intervals (M,) [s].  A thruster off for a share x of the burn is the stronger one of its pair by x.  A
    pulse stronger by d lasts in proportion to 1 / (x + d), so that the mean of d weighted by length is -scatter^2 / x, for
    scatter well below x.  A thruster that is never off has one pulse, with a parameter of its own."""
    on, room = np.asarray(on_time_s, float), np.asarray(interval_s, float)[:, None]
    burning = on > _BURNING * room
    burnt, span = (on * burning).sum(axis=0), (room * burning).sum(axis=0)
    burns = burnt > _BURNING * on.sum(axis=0)
    off = 1 - burnt / np.maximum(span, 1e-300)
    weak = np.where(burns & (off > _NEVER_OFF), scatter**2 / np.hypot(off, max(scatter, 1e-12)), 0.0)
    return weak * burnt / np.maximum(on.sum(axis=0), 1e-300)


def _so_far(steps) -> np.ndarray:
    return np.vstack([np.zeros(steps.shape[1]), np.cumsum(steps, axis=0)])
