"""What of a flight reaches the ground: every channel at its own interval, counted, noisy, with losses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ...kit.timeline import NS
from ...telemetry.channels import kind_of, member_of
from ...telemetry.telemetry import Channel, Telemetry
from .sensors import stream

if TYPE_CHECKING:
    from ..scenario import Sampling, Scenario


def telemetry_of(
    readings: dict[str, np.ndarray], scenario: Scenario, period_s: float, seed: int, source: str
) -> Telemetry:
    """Telemetry from readings at every control cycle, in order of time from the epoch on.

    Sample instants are control instants.  Raises BadInput for an interval shorter than the cycle and
    for a gap in a channel that is not sent."""
    _check_gaps(scenario.telemetry, readings)
    channels = {}
    for name, values in readings.items():
        taken = _taken(name, len(values), scenario.telemetry, period_s, seed)
        if not len(taken):
            continue
        sampled = values[taken]
        count = scenario.telemetry.count_size(kind_of(name).stem)
        if count > 0:
            sampled = count * np.round(sampled / count)
        # integer nanoseconds of the cycle itself, so that a long flight keeps its instants exact
        tai_ns = scenario.epoch_ns + np.rint(taken * (period_s * NS)).astype(np.int64)
        channels[name] = Channel(name, tai_ns, sampled, np.ones(len(taken), bool), kind_of(name).unit, count)
    if not channels:
        raise BadInput(
            "this flight sends no telemetry at all",
            remedy="Give a family under [telemetry] an interval, or a shorter one.",
        )
    return Telemetry(channels, scenario.epoch_ns, dated=True, source=source)


def _taken(name: str, cycles: int, sampling: Sampling, period_s: float, seed: int) -> np.ndarray:
    """Control cycles at which a channel is sampled and reaches the ground; none for one that is not sent."""
    stem, member = kind_of(name).stem, kind_of(name).member
    every_s = sampling.mechanism if member == "mechanism" else getattr(sampling, stem)
    if every_s == 0:
        return np.empty(0, int)
    every = round(every_s / period_s)
    if every < 1:
        raise BadInput(
            f"{stem} cannot be sampled every {every_s:g} s",
            channel=name,
            remedy=f"The control cycle is {period_s:g} s: samples are taken at its instants.",
        )
    phase = int(stream(seed, f"phase {stem}").integers(every)) if sampling.random_phases else 0
    taken = np.arange(phase, cycles, every)
    if sampling.dropout > 0:
        taken = taken[stream(seed, f"dropout {name}").random(len(taken)) >= sampling.dropout]
    for gap in sampling.gaps:
        if gap.channel in ("*", name, stem):
            taken = taken[(taken * period_s < gap.start) | (taken * period_s > gap.stop)]
    return taken


def _check_gaps(sampling: Sampling, readings) -> None:
    for gap in sampling.gaps:
        if gap.channel != "*" and not any(gap.channel in (n, kind_of(n).stem) for n in readings):
            raise BadInput(
                f"a gap names {gap.channel!r}, which this flight does not send",
                channel=gap.channel,
                remedy="Use '*' for all channels, a family such as wheel_rate, or a channel's name.",
            )


def axes_of(stem: str, values: np.ndarray, members) -> dict[str, np.ndarray]:
    """{'body_rate_x': ...}: one reading a column."""
    named = {f"{stem}_{m}": np.ascontiguousarray(values[:, i]) for i, m in enumerate(members)}
    for name in named:
        member_of(name)  # refuses what the house does not know
    return named
