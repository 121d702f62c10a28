"""Counters that cannot be: on-times that run faster than the clock, and pulse counts that contradict the on-times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput
from ...kit.timeline import NS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Thruster
    from ...telemetry.telemetry import Telemetry

#: Share by which the clock of the counters may be off.
_CLOCK = 0.02
#: Intervals too fast for the clock that are a wrong unit and no corrupt reading: so many, or all that fire, and this share of those.
_SEVERAL, _SHARE = 3, 0.05
#: Pulses that a record may tear apart at its ends, or a packet may lose.
_LOST = 2
#: A rise is a whole number of cycles to this share of one; fewest rises from which a cycle is taken, and the shortest one. [s]
_WHOLE, _FEWEST, _CYCLE = 0.02, 8, 1e-3

FASTER_THAN_CLOCK = Kind(
    "firing.faster-than-clock", Severity.SUSPECT,
    "the on-time of {thruster} rises by {rise_s:.4g} s within {interval_s:.4g} s at {time} ({count} times in all), which no thruster "
    "can do: what fired there is not used",
    "Check the counter's unit (ms, or cycles, labelled s?) and the time column's.",
)  # fmt: skip
MORE_PULSES_THAN_CYCLES = Kind(
    "firing.more-pulses-than-cycles", Severity.SUSPECT,
    "{pulses:.0f} pulses of {thruster} are counted, and its on-time, which rises by whole cycles of {cycle_s:.4g} s, has room for "
    "{most:.0f} at most",
    "Check what the pulse count counts: one for every opening of the valve.",
)  # fmt: skip


def check_clock(
    used: np.ndarray, tai_ns: np.ndarray, step_s: float, names: Sequence[str], tlm: Telemetry
) -> tuple[np.ndarray, list[Doubt]]:
    """Intervals (M,) in which an on-time rises faster than the clock, and a doubt where there are any.

    ``used`` (M, j): rises of the on-times [s] between instants ``tai_ns`` (M + 1,); ``step_s``: how much later than its stamp a
    counter may be read.  Raises BadInput where that is more than a corrupt reading."""
    interval = np.diff(tai_ns) / NS
    late = step_s + _jitter(interval)
    fast = np.any(used > (1 + _CLOCK) * interval[:, None] + late, axis=1)
    rows = np.flatnonzero(fast)
    if not len(rows):
        return fast, []
    k = int(rows[0])
    j = int(np.argmax(used[k]))
    told: dict[str, Any] = {
        "thruster": names[j], "rise_s": float(used[k, j]), "interval_s": float(interval[k]),
        "time": tlm.describe_time(int(tai_ns[k + 1])), "count": len(rows),
    }  # fmt: skip
    fires = int((used > 0).any(axis=1).sum())
    if len(rows) > _SHARE * fires and (len(rows) >= _SEVERAL or len(rows) == fires):
        raise BadInput(
            f"the on-time rises by {told['rise_s']:.4g} s within {told['interval_s']:.4g} s at {told['time']}, and in "
            f"{len(rows)} intervals faster than the clock: no thruster fires longer than the time that passes",
            file=tlm.source or None,
            channel=f"on_time_{names[j]}",
            remedy=FASTER_THAN_CLOCK.remedy,
        )
    return fast, [FASTER_THAN_CLOCK(**told)]


def _jitter(interval_s: np.ndarray) -> float:
    """How far stamps lie off an even cadence, at most half of it: rounded stamps make one interval longer than the next."""
    cadence = float(np.median(interval_s))
    return float(np.abs(interval_s - cadence * np.round(interval_s / cadence)).max()) if cadence > 0 else 0.0


def check_counts(tlm: Telemetry, names: Sequence[str]) -> None:
    """Raises BadInput for a pulse count that is no whole number."""
    for name in names:
        c = tlm.channel(f"pulse_count_{name}").usable
        broken = np.flatnonzero(np.abs(c.values - np.round(c.values)) > _WHOLE)
        if len(broken):
            k = int(broken[0])
            raise BadInput(
                f"a pulse count of {c.values[k]:.6g} at {tlm.describe_time(int(c.tai_ns[k]))} is no whole number",
                file=tlm.source or None,
                channel=c.name,
                remedy="Is it the on-time, or a rate?  Give pulses counted since the start.",
            )


def check_pulses(
    used: np.ndarray,
    begun: np.ndarray,
    interval_s: np.ndarray,
    step_s: float,
    thrusters: Sequence[Thruster],
    tlm: Telemetry,
) -> list[Doubt]:
    """What pulse counts say against on-times, thruster by thruster; rises (M, j) of both within intervals (M,).

    ``step_s``: the control step, taken for the cycle of the on-times where they are whole numbers of it.

    Raises BadInput for fewer pulses than the on-time has beginnings, and for pulses too short for the valve to open."""
    doubts: list[Doubt] = []
    for thruster, on, count in zip(thrusters, used.T, begun.T, strict=True):
        pulses, total = float(count.sum()), float(on.sum())
        begins = int(np.count_nonzero((on[1:] > 0) & (on[:-1] == 0)))
        if 2 * (pulses + _LOST) < begins:
            what = f"{pulses:.0f} pulses are counted, and the on-time begins to rise {begins} times after a rest"
        elif pulses > _LOST and total < thruster.delay * pulses:
            what = f"{pulses:.0f} pulses of {1e3 * total / pulses:.3g} ms each are shorter than the valve takes to open"
        else:
            cycle = _cycle(on[on > 0], step_s)
            # each pulse takes a cycle on, and between two of them is one off
            most = np.inf if cycle is None else float(np.minimum(on, interval_s - on + cycle).sum() / cycle)
            if cycle is not None and pulses > most * (1 + _CLOCK) + _LOST:
                doubts.append(MORE_PULSES_THAN_CYCLES(thruster=thruster.name, cycle_s=cycle, most=most, pulses=pulses))
            continue
        raise BadInput(
            what,
            file=tlm.source or None,
            channel=f"pulse_count_{thruster.name}",
            remedy="Check the units of on_time and the columns of both counters; without its pulse count the number of pulses is estimated.",
        )
    return doubts


def _cycle(rises: np.ndarray, step_s: float) -> float | None:
    """The cycle of which all rises are whole numbers: the control step or the smallest rise.  None where they are of neither."""
    if len(rises) < _FEWEST:
        return None
    for cycle in (step_s, float(rises.min())):
        whole = rises / cycle
        if cycle > _CYCLE and np.abs(whole - np.round(whole)).max() < _WHOLE and 1.5 < whole.max() < 1 / _WHOLE:
            return cycle
    return None
