"""The order of time: late samples sorted, copies taken out, samples stamped far off their neighbours left out."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.scatter import difference_sigma
from ..kit.timeline import NS
from .findings import Finding

if TYPE_CHECKING:
    from .telemetry import Channel, Telemetry

LATE_FEW, LATE_PART = 3, 0.01  # up to this many late samples count as disorder, more as a clock running backwards
#: A few samples beyond a pause of this many spans of all others, and of this length, are stamped wrongly.
_FAR_SPANS, _FAR_NS = 100, 86_400 * NS
#: A second copy of a sample follows within this share of the cadence and differs by less than this share of the noise.
_AT_ONCE, _ALIKE = 0.2, 0.1
#: Samples per stamp from which stamps are coarser than the cadence.
_COARSE = 1.5


def in_order(telemetry: Telemetry) -> tuple[dict[str, Channel], list[Finding]]:
    """Each channel increasing in time: a few late samples sorted, the first of copies kept, strays left out.

    Raises BadInput where time runs backwards for more than a few samples."""
    counts: dict[str, tuple[int, int]] = {}  # finding -> most samples of one channel, first instant
    channels, seen = {}, {}
    for name, c in telemetry.channels.items():
        key = id(c.tai_ns)
        if key not in seen:
            seen[key] = _plan(c, telemetry)
        order, strays, late = seen[key]
        if order is None and len(strays) == 0:
            channels[name] = c
            continue
        _note(counts, "stray", c.tai_ns[strays])
        _note(counts, "disorder", c.tai_ns[late])
        c = c.where(np.arange(len(c.tai_ns)) if order is None else order)
        first = np.concatenate(([True], np.diff(c.tai_ns) > 0))
        if not first.all():
            kept = np.flatnonzero(first)[np.cumsum(first) - 1]  # for each sample, the one kept at its instant
            same = c.values == c.values[kept]
            _note(counts, "conflict", c.tai_ns[~first & ~same])
            _note(counts, "duplicate", c.tai_ns[~first & same])
            c = c.where(first)
        channels[name] = c
    found = [
        Finding("", what, n, at, _DETAILS[what] + _coarse(what, n, channels)) for what, (n, at) in counts.items() if n
    ]
    channels, copies = _without_second_copies(channels)
    return channels, found + copies


_DETAILS = {
    "stray": "samples are stamped far off those beside them in the file; not used",
    "disorder": "late samples, sorted into place",
    "duplicate": "samples with the time stamp and the value of another; not used",
    "conflict": "samples with the time stamp of another and other values; not used",
}


def _coarse(what: str, lost: int, channels: dict[str, Channel]) -> str:
    """What to do where stamps are coarser than the samples."""
    longest = max(channels.values(), key=lambda c: len(c.tai_ns), default=None)
    if what != "conflict" or longest is None or lost < (_COARSE - 1) * len(longest.tai_ns):
        return ""
    step = longest.cadence_ns / NS
    return f": the stamps step by {step:.4g} s, coarser than the samples. cadence under [time] of a channel dictionary spreads them"


def _note(counts: dict[str, tuple[int, int]], what: str, instants: np.ndarray) -> None:
    if len(instants):
        most, first = counts.get(what, (0, int(instants.min())))
        counts[what] = max(most, len(instants)), min(first, int(instants.min()))


def _plan(c: Channel, telemetry: Telemetry) -> tuple[np.ndarray | None, np.ndarray, np.ndarray]:
    """Samples in the order of time or None where they are so, those stamped far off, and those that come late."""
    none = np.empty(0, np.int64)
    t = c.tai_ns
    steps = np.diff(t)
    if (steps > 0).all():
        strays = _strays(t)
        return (np.setdiff1d(np.arange(len(t)), strays) if len(strays) else None), strays, none
    late = _late(t) if (steps < 0).any() else none
    kept = np.setdiff1d(np.arange(len(t)), late)
    span = int(t[kept].max() - t[kept].min())
    off = np.maximum(t[kept].min() - t[late], t[late] - t[kept].max())
    strays = late[off > max(span, 1000 * c.cadence_ns)]
    late = np.setdiff1d(late, strays)
    if len(late) + len(strays) > max(LATE_FEW, LATE_PART * len(t)) or 2 * (len(late) + len(strays)) >= len(t):
        _refuse(c, telemetry, len(late) + len(strays))
    used = np.setdiff1d(np.arange(len(t)), strays)
    order = used[np.argsort(t[used], kind="stable")]
    beyond = _strays(t[order])
    return np.delete(order, beyond), np.union1d(strays, order[beyond]), late


def _strays(t: np.ndarray) -> np.ndarray:
    """A few samples at either end, beyond a pause that dwarfs the record: indices into increasing times."""
    if len(t) < 10:
        return np.empty(0, np.int64)
    widest = int(np.argmax(np.diff(t)))
    before, after = widest + 1, len(t) - widest - 1
    few = min(before, after)
    span = int(t[-1] - t[widest + 1]) if before < after else int(t[widest] - t[0])
    if few > max(LATE_FEW, LATE_PART * len(t)) or t[widest + 1] - t[widest] < max(_FAR_SPANS * span, _FAR_NS):
        return np.empty(0, np.int64)
    return np.arange(before) if before < after else np.arange(widest + 1, len(t))


def _late(t: np.ndarray) -> np.ndarray:
    """Samples out of order: all but a longest non-decreasing subsequence."""
    tails: list[int] = []
    length = np.empty(len(t), np.int64)
    for i, instant in enumerate(t.tolist()):
        k = bisect_right(tails, instant)
        tails[k : k + 1] = [instant]
        length[i] = k
    in_order, want, last = np.zeros(len(length), bool), len(tails) - 1, t.max()
    for i in range(len(length) - 1, -1, -1):
        if length[i] == want and t[i] <= last:
            in_order[i], last, want = True, t[i], want - 1
    return np.flatnonzero(~in_order)


def _refuse(c: Channel, telemetry: Telemetry, count: int) -> None:
    back = int(np.flatnonzero(np.diff(c.tai_ns) < 0)[0]) + 1
    raise BadInput(
        f"time runs backwards: {telemetry.describe_time(int(c.tai_ns[back]))} follows "
        f"{telemetry.describe_time(int(c.tai_ns[back - 1]))}, and {count} of {len(c.tai_ns)} samples are out of order",
        channel=c.name,
        time=telemetry.describe_time(int(c.tai_ns[back])),
        remedy="Divide the table where the clock was reset or a playback begins; sort it by time only where rows were shuffled.",
    )


def _without_second_copies(channels: dict[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """Samples received twice with stamps a little apart, as over two links: the second of each pair is left out.

    They are told by their values: alike within a tenth of the noise, in most samples of the channel."""
    channels, found = dict(channels), []
    even: dict[int, bool] = {}  # by the id of an axis of times
    for name, c in channels.items():
        if c.kind.behaves != "sensor" or len(c.tai_ns) <= 30 or even.get(id(c.tai_ns)):
            continue
        steps = np.diff(c.tai_ns)
        even[id(c.tai_ns)] = bool((steps == steps[0]).all())
        if even[id(c.tai_ns)]:
            continue
        beside = np.maximum(np.concatenate((steps[1:], [0])), np.concatenate(([0], steps[:-1])))
        close = steps < _AT_ONCE * beside
        if close.mean() < 0.3:
            continue
        second = np.concatenate(([False], close))
        noise = difference_sigma(c.values[~second], 2)
        pair = np.abs(np.diff(c.values))[close]
        if noise > 0 and np.mean(pair < _ALIKE * noise) > 0.9:
            first = int(c.tai_ns[second][0])
            found.append(
                Finding(
                    name,
                    "duplicate",
                    int(second.sum()),
                    first,
                    "samples follow another at once with the same value, rounded; not used",
                )
            )
            channels[name] = c.where(~second)
    return channels, found
