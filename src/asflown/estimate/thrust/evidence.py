"""What the results of several methods share: on-times, pulses and R, and what a record showed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import VARIANTS, Valve, expected_effective
from ...kit.timeline import utc_label
from ...telemetry.telemetry import file_name
from .result import EventSeen

if TYPE_CHECKING:
    from ..firing import Counters, Firings


def pulse_ratios(counters: list[Counters], which, step_s: float, valve: Valve) -> dict[str, float]:
    """R of all pulses of the thrusters ``which``, by both formulas."""
    on = np.concatenate([np.diff(c.on_time_s[:, which], axis=0) for c in counters])
    n = np.concatenate([np.diff(c.pulses[:, which], axis=0) for c in counters])
    return {v: float(expected_effective(on, n, step_s, valve, v).sum() / on.sum()) for v in VARIANTS}


def common_of(records: list[Firings], valve: Valve) -> dict:
    """Fields of the result that the joint and the printed method share."""
    first, names = records[0].subject, records[0].names
    fired = np.flatnonzero(np.sum([f.total_on_time_s for f in records], axis=0) > 0)
    return {
        "craft": first.craft.craft.name,
        "epoch": first.telemetry.epoch_label,
        "names": names,
        "pulse_ratio": pulse_ratios([f.counters for f in records], fired, records[0].step_s, valve),
        "on_time_s": {n: float(sum(f.total_on_time_s[k] for f in records)) for k, n in enumerate(names)},
        "pulses": {n: float(sum(f.total_pulses[k] for f in records)) for k, n in enumerate(names)},
        "pulses_counted": all(f.counters.counted for f in records),
    }


def event_seen(f: Firings, left, number: int) -> EventSeen:
    """``left`` (K, 3): the momentum's steps less the fit, or None where nothing was fitted to them."""
    tlm = f.telemetry
    wheels = {c.member: c.usable for c, _ in f.subject.wheels()} if tlm.members("wheel_rate") else {}
    base = next(iter(wheels.values()), None)
    t = np.empty(0) if base is None else tlm.seconds(base.tai_ns)
    steps = np.diff(f.in_space, axis=0)
    label = file_name(tlm.source) if tlm.source else f"record {number}"
    return EventSeen(
        label=f"{label}, {utc_label(tlm.epoch_ns)[:10]}" if tlm.dated else label,
        wheel_time_s=t,
        wheel_rate_rad_s={n: np.interp(t, tlm.seconds(c.tai_ns), c.values) for n, c in wheels.items()},
        counter_time_s=tlm.seconds(f.counters.tai_ns),
        on_time_s=f.counters.on_time_s,
        time_s=tlm.seconds(f.tai_ns[1:]),
        gained_Nms=np.cumsum(steps, axis=0),
        left_Nms=None if left is None else np.cumsum(left, axis=0),
    )
