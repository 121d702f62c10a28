"""The wheels of several records as one: a month of run-downs in one call."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...kit.doubts import Doubt, Doubts
from ...kit.errors import BadInput, some_of
from .named import NamedRunDown, check_named, named_run_downs
from .study import LOW_SPEED, wheels
from .use import WheelUse

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from .result import WheelDrag, WheelsResult
    from .run_downs import RunDown


class _Seen(NamedTuple):
    epoch_ns: int
    source: str
    result: WheelsResult


def wheels_of_records(
    records: Iterable[Telemetry],
    craft: Craft,
    *,
    low_speed_rad_s: float = LOW_SPEED,
    run_down: Collection[str | NamedRunDown] = (),
    each: Callable[[WheelsResult, Telemetry], None] | None = None,
) -> WheelsResult:
    """What ``wheels`` finds in each of several records, as one result.

    Parameters
    ----------
    records : iterable of Telemetry
        In any order; they may come one by one, and are not kept.
    craft : Craft
        The wheels' axes, spin inertia and rate limits.
    low_speed_rad_s : float
        Below it a wheel dwells [rad/s].
    run_down : collection of str or NamedRunDown
        As of ``wheels``.  All must lie in the records; in several records their times are UTC.
    each : callable, optional
        Is told the result of every record, with its telemetry, once that is done.

    Returns
    -------
    WheelsResult
        Times count from the epoch of the earliest record.  Of every wheel all run-downs, each with its own drag; the drag is
        that of the latest record that has one; use is summed.

    Raises
    ------
    BadInput
        Where ``wheels`` does; for several records without dates; for a run-down that lies in none, with its line in the list.
    """
    named = named_run_downs(run_down)
    check_named(named, craft.wheel_names)
    seen: list[_Seen] = []
    found: set[NamedRunDown] = set()
    for telemetry in records:
        if seen:
            _check_several(telemetry, named)
        here = [n for n in named if _lies_in(n, telemetry)]
        result = wheels(telemetry, craft, low_speed_rad_s=low_speed_rad_s, run_down=here)
        if each is not None:
            each(result, telemetry)
        found.update(here)
        seen.append(_Seen(telemetry.epoch_ns, Path(telemetry.source).name, result))
    for n in named:
        if n not in found:
            raise n.refused(
                f"the run-down of wheel {n.wheel} from {n.start} to {n.stop} lies outside of the telemetry",
                f"The telemetry: {some_of([s.source for s in seen])}. Name its file too, or take the run-down off the list.",
            )
    return seen[0].result if len(seen) == 1 else _together(sorted(seen, key=lambda s: s.epoch_ns))


def _check_several(telemetry: Telemetry, named: Iterable[NamedRunDown]) -> None:
    if not telemetry.dated:
        raise BadInput(
            "one of several records has no epoch, so that they cannot be put in order",
            file=telemetry.source or None,
            remedy="Put '# epoch: 2015-09-29T00:00:00 UTC' at the head of each file.",
        )
    for n in named:
        if n.start is not None and not n.is_dated:
            raise n.refused(
                f"the run-down of wheel {n.wheel} is given in seconds, which count from another epoch in each of several records",
                "Give UTC, as in 2026-04-01T06:01:00.",
            )


def _lies_in(n: NamedRunDown, telemetry: Telemetry) -> bool:
    a, b = n.span(telemetry)
    first, last = telemetry.span()
    return a < last and b > first and f"wheel_rate_{n.wheel}" in telemetry


def _together(seen: list[_Seen]) -> WheelsResult:
    """``seen``: in order of time."""
    first = seen[0]
    names = dict.fromkeys(w.name for s in seen for w in s.result.wheels)
    kept: dict[tuple, Doubt] = {}
    for s in seen:
        for d in s.result.doubts:
            # what is grave is told of every record, the rest once
            once = (str(d), s.source) if d.is_grave else (d.kind.id, d.about.get("wheel"))
            kept.setdefault(once, d.of_record(s.source) if d.is_grave else d)
    return replace(
        first.result,
        wheels=tuple(_wheel(n, seen) for n in names),
        doubts=Doubts(kept.values()),
        inputs=tuple(dict.fromkeys(i for s in seen for i in s.result.inputs)),
    )


def _wheel(name: str, seen: list[_Seen]) -> WheelDrag:
    """One wheel in all records that have it."""
    parts = [(1e-9 * (s.epoch_ns - seen[0].epoch_ns), w) for s in seen for w in s.result.wheels if w.name == name]
    with_drag = [w for _, w in parts if w.fits]
    spikes = [replace(k, time_s=k.time_s + later) for later, w in parts for k in (w.spikes or ())]
    return replace(
        with_drag[-1] if with_drag else parts[-1][1],
        use=_use([(later, w.use) for later, w in parts]),
        time_s=np.concatenate([w.time_s + later for later, w in parts]),
        rate_rad_s=np.concatenate([w.rate_rad_s for _, w in parts]),
        run_downs=tuple(_moved(r, later) for later, w in parts for r in w.run_downs),
        spikes=None if all(w.spikes is None for _, w in parts) else tuple(spikes),
        samples=None,
    )


def _moved(r: RunDown, later_s: float) -> RunDown:
    return replace(r, start_s=r.start_s + later_s, stop_s=r.stop_s + later_s, time_s=r.time_s + later_s)


def _use(parts: list[tuple[float, WheelUse]]) -> WheelUse:
    """Sums, but for the largest rate; what lies between the records is no gap."""
    uses = [u for _, u in parts]
    return WheelUse(
        seen_s=sum(u.seen_s for u in uses),
        gaps_s=sum(u.gaps_s for u in uses),
        revolutions=sum(u.revolutions for u in uses),
        low_speed_dwell_s=sum(u.low_speed_dwell_s for u in uses),
        zero_crossings=sum(u.zero_crossings for u in uses),
        crossing_times_s=tuple(t + later for later, u in parts for t in u.crossing_times_s),
        largest_rate_rad_s=max(u.largest_rate_rad_s for u in uses),
    )
