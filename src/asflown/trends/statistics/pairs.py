"""Cold against warm: is a mechanism different after a long rest?

An equivalence test: is the difference smaller than a margin?  Two one-sided tests of paired relative differences
(Schuirmann 1987) answer, with the scatter of all events pooled, since three pairs give a poor estimate of it.  The
smallest margin that these data could prove is stated.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..entry import MOVES, Entry
from .curves import TORQUE, distance

if TYPE_CHECKING:
    from .slope import Trend

#: A rest of this long makes an actuation cold; the next one is warm when it follows within this time.  Those of the paper's cold starts:
#: not ``STALE_NS``, after which what is known of a craft is doubted. [days]
COLD_DAYS, WARM_DAYS = 200.0, 100.0
#: Relative difference within which both count as equivalent.
MARGIN = 0.15


@dataclass(frozen=True)
class Pair:
    """A cold actuation and the warm one after it."""

    cold: Entry
    warm: Entry
    rest_days: float  # before the cold one


@dataclass(frozen=True)
class Equivalence:
    """Warm less cold of one figure, relative; equivalent where both one-sided tests say so at 5 %."""

    figure: str
    difference_percent: float
    ci90: tuple[float, float]
    margin_percent: float
    p_value: float
    provable_percent: float  # smallest margin these pairs could prove
    pairs: int
    freedom: int

    @property
    def equivalent(self) -> bool:
        return self.p_value < 0.05


@dataclass(frozen=True)
class Distances:
    """Whole curves: each cold one against its warm one, compared with neighbours in date that are not pairs."""

    pairs: tuple[float, ...]
    others: tuple[float, ...]
    p_value: float | None  # that pairs are no further apart than others (rank test, one-sided)


def rests(entries: list[Entry]) -> dict[str, float]:
    """Days since the motor's last actuation of any kind, by event; the first of each motor has none.

    Computed from the dates, not taken from a list.  Events without a motor's name count as one motor."""
    found: dict[str, float] = {}
    latest: dict[str | None, float] = {}
    for e in sorted(entries, key=lambda e: e.day):
        if e.motor in latest:
            found[e.event] = e.day - latest[e.motor]
        latest[e.motor] = e.day
    return found


def whole_days(rest: float) -> int:
    """Days between calendar dates: the clock within the day is not counted."""
    return round(rest)


def cycles(entries: list[Entry]) -> float:
    """Full cycles used: a deploy and a stow make one."""
    return sum(e.kind in MOVES for e in entries) / 2


def find_pairs(entries: list[Entry], kind: str = "deploy") -> list[Pair]:
    """Cold and warm actuations of one kind, from the dates; both need figures."""
    rest = rests(entries)
    of_kind = [e for e in sorted(entries, key=lambda e: e.day) if e.kind == kind]
    return [
        Pair(a, b, rest[a.event])
        for a, b in pairwise(of_kind)
        if rest.get(a.event, 0) >= COLD_DAYS and rest.get(b.event, np.inf) <= WARM_DAYS and a.values and b.values
        and a.motor == b.motor
    ]  # fmt: skip


def equivalence(figure: str, pairs: list[Pair], trend: Trend, margin: float = MARGIN) -> Equivalence | None:
    """Warm against cold of a figure; None without pairs that have it on both sides, with one sign.

    The scatter is that of all events about their trend, relative; the slope between the two dates is subtracted."""
    found = []
    for p in pairs:
        a, b = (v.value if (v := e.best(figure)) is not None else None for e in (p.cold, p.warm))
        if a is not None and b is not None and a * b > 0:
            lines = trend.at(np.array([p.cold.day, p.warm.day]))
            found.append(np.log(b / a) - (np.log(lines[1] / lines[0]) if lines[0] * lines[1] > 0 else 0.0))
    y = trend.values.value
    if not found or trend.start == 0 or not np.all(np.sign(y) == np.sign(y[0])) or len(y) < 5:
        return None
    left = np.round(y / trend.at(trend.values.day) - 1, 12)
    freedom = len(y) - 2
    scatter = float(np.sqrt(np.sum(left**2) / freedom))
    mean, n = float(np.mean(found)), len(found)
    error = scatter * np.sqrt(2 / n)
    reach = float(scipy.stats.t.ppf(0.95, freedom)) * error
    edges = np.log1p(margin)
    if error == 0:
        p_value = 0.0 if abs(mean) < edges else 1.0
    else:
        p_value = float(
            max(scipy.stats.t.sf((mean + edges) / error, freedom), scipy.stats.t.cdf((mean - edges) / error, freedom))
        )
    low, high = 100 * np.expm1(mean - reach), 100 * np.expm1(mean + reach)
    return Equivalence(
        figure, 100 * float(np.expm1(mean)), (float(low), float(high)), 100 * margin, p_value,
        100 * float(np.expm1(abs(mean) + reach)), n, freedom,
    )  # fmt: skip


def curve_distances(entries: list[Entry], pairs: list[Pair], kind: str = "deploy") -> Distances | None:
    """Registered distances of the pairs' torques, and of neighbours in date that are not pairs; None without pairs."""
    named = {(p.cold.event, p.warm.event) for p in pairs}
    with_curve = [
        (e.event, c)
        for e in sorted(entries, key=lambda e: e.day)
        if e.kind == kind and (c := e.curve(TORQUE)) is not None
    ]
    ours: list[float] = []
    others: list[float] = []
    for (a, one), (b, other) in pairwise(with_curve):
        (ours if (a, b) in named else others).append(distance(one, other))
    if not ours:
        return None
    p = float(scipy.stats.mannwhitneyu(ours, others, alternative="greater").pvalue) if len(others) >= 3 else None
    return Distances(tuple(ours), tuple(others), p)
