"""Which of several wheels that slow at the same time coasts.

With more than three wheels the body's attitude is held by the others while one coasts: they follow it in the null space, on
courses that are the coast's own with what the controller does on top.  At most n - 3 wheels coast in a hold.  The one that
only a bearing explains is the smoothest: controllers make a wheel's course rougher, never smoother.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from .doubts import FOLLOWS, MANY_COAST, ROUGH, SLOWS_AS_DRIVEN
from .run_downs import CURRENT, FEWEST

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .record import RecordedWheels
    from .run_downs import Finder
    from .slowing import Slowing

#: Wheels that hold an attitude.
HOLDING = 3
#: Chance of calling the rougher of two equal courses a follower, and by how much rougher it must be at least (variances).
_CHANCE, _ROUGHER = 1e-3, 1.5
#: Share of the samples that counts as independent: a controller's errors last.
_SHARE = 0.5


class _Find(NamedTuple):
    wheel: str
    which: Slowing
    start_s: float
    stop_s: float


def without_followers(
    record: RecordedWheels, seen: dict[str, list[Slowing]]
) -> tuple[dict[str, list[Slowing]], list[Doubt]]:
    """The slowings with a cause for those that follow another wheel, and a doubt each; as they are for up to three wheels."""
    if record.count <= HOLDING:
        return seen, []
    doubts: list[Doubt] = []
    refused: set[tuple[str, int]] = set()
    finds = [_find(record, n, s) for n, of_it in seen.items() for s in of_it if s.cause in (None, SLOWS_AS_DRIVEN)]
    for f in finds:
        if f.which.cause is None and (doubt := _refusal(record, f, finds)) is not None:
            refused.add((f.wheel, f.which.first))
            doubts.append(doubt)
    doubts += _too_many(record, finds, refused)
    kept = {
        n: [s._replace(cause=FOLLOWS) if (n, s.first) in refused else s for s in of_it] for n, of_it in seen.items()
    }
    return kept, _longest(doubts)


def _longest(doubts: list[Doubt]) -> list[Doubt]:
    """The doubt about the longest span of each wheel and kind."""
    longest: dict[tuple[str, str], Doubt] = {}
    for d in sorted(doubts, key=lambda d: d.numbers["start_s"] - d.numbers["stop_s"]):
        longest.setdefault((d.kind.id, d.about["wheel"]), d)
    return list(longest.values())


def _find(record: RecordedWheels, name: str, s: Slowing) -> _Find:
    t = record.finders[name].t
    return _Find(name, s, float(t[s.first]), float(t[s.end - 1]))


def _refusal(record: RecordedWheels, f: _Find, finds: list[_Find]) -> Doubt | None:
    """Why a find is no run-down: a named one overlaps it, another wheel is smoother meanwhile, or it is rougher than a coast."""
    told = {"wheel": f.wheel, "start_s": f.start_s, "stop_s": f.stop_s}
    sure = f.which.found_by == CURRENT
    if not sure and not _is_long(f):
        return ROUGH(**told)
    if not sure and (named := _named_beside(record, f)):
        return FOLLOWS(**told, other=named)
    if sure:  # nothing but another idle motor can contradict that
        finds = [o for o in finds if o.which.found_by == CURRENT]
    for o in finds:
        if o.wheel != f.wheel and (both := _together(f, o)) is not None:
            idle = o.which.found_by == CURRENT and not sure
            if idle or _rougher(*(_scatter(record.finders[x.wheel], *both) for x in (f, o))):
                return FOLLOWS(**told, other=o.wheel)
    of_all = (_scatter(record.finders[o.wheel], o.start_s, o.stop_s) for o in finds if _is_long(o))
    quiet = min(of_all, default=None)
    if quiet is not None and not sure and _rougher(_scatter(record.finders[f.wheel], f.start_s, f.stop_s), quiet):
        return ROUGH(**told)
    return None


def _is_long(f: _Find) -> bool:
    """A run-down too long to be by chance what a motor at work does."""
    return f.which.cause is None and f.which.end - f.which.first >= 2 * FEWEST


def _named_beside(record: RecordedWheels, f: _Find) -> str:
    """A wheel whose named run-down overlaps this find; '' for none."""
    beside = (n for n, spans in record.run_down.items() if any(a < f.stop_s and b > f.start_s for a, b in spans))
    return next(beside, "")


def _too_many(record: RecordedWheels, finds: list[_Find], refused: set[tuple[str, int]]) -> list[Doubt]:
    """Refuses finds of which more overlap than can coast in a hold, and that nothing tells apart."""
    left = [f for f in finds if f.which.cause is None and (f.wheel, f.which.first) not in refused]
    most, doubts = record.count - HOLDING, []
    for f in left:
        beside = {o.wheel: o for o in left if o.wheel != f.wheel and _together(f, o) is not None}
        if len(beside) + 1 <= most:
            continue
        told = {"wheel": f.wheel, "start_s": f.start_s, "stop_s": f.stop_s}
        if f.which.found_by == CURRENT:  # idle motors: the smoothest coast, the others hardly work
            smoother = [o.wheel for o in beside.values() if _smoother(record, o, f)]
            if len(smoother) < most:
                continue
            doubts.append(FOLLOWS(**told, other=smoother[0]))
        else:
            doubts.append(MANY_COAST(**told, others=sorted(beside), most=most))
        refused.add((f.wheel, f.which.first))
    return doubts


def _smoother(record: RecordedWheels, o: _Find, f: _Find) -> bool:
    """Whether the first scatters less than the second while both slow."""
    both = _together(f, o) or (f.start_s, f.stop_s)
    one, other = (_scatter(record.finders[x.wheel], *both)[0] for x in (o, f))
    return one < other


def _together(f: _Find, o: _Find) -> tuple[float, float] | None:
    """When both slow [s]; None where that is too short to compare them."""
    start, stop = max(f.start_s, o.start_s), min(f.stop_s, o.stop_s)
    shorter = min(f.stop_s - f.start_s, o.stop_s - o.start_s)
    return (start, stop) if stop - start > 0.25 * shorter else None


def _scatter(finder: Finder, start_s: float, stop_s: float) -> tuple[float, int]:
    """Mean square about the law of a coast [rad^2/s^2], and degrees of freedom."""
    a, b = np.searchsorted(finder.t, [start_s - 1e-9, stop_s + 1e-9])
    if b - a < FEWEST // 2:
        return 0.0, 0
    _, _, _, r, _ = finder.fitted(int(a), int(b))
    return float(np.mean(r**2)) + finder.quantum**2 / 12, int(_SHARE * (b - a)) - 3


def _rougher(one: tuple[float, int], other: tuple[float, int]) -> bool:
    """Whether one scatters more than the other, by more than chance."""
    (a, n), (b, m) = one, other
    if n < 3 or m < 3 or b <= 0:
        return False
    return a / b > max(_ROUGHER, float(scipy.special.fdtri(n, m, 1 - _CHANCE)))
