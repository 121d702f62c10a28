"""Thrusters' counters: on-times and pulses, at their samples and at any time between, with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS
from .clock import check_clock, check_counts, check_pulses
from .pulse_counts import Guess, guess_pulses
from .pulse_lengths import Lengths, lengths_of, weak_because_lasting

if TYPE_CHECKING:
    from ...craft.model import Craft, Thruster
    from ...telemetry.telemetry import Channel, Telemetry
    from ..subject import Subject

#: A pulse has delivered its impulse at the latest so long after its command. [s]
_TAIL_S = 0.5
#: Share of the busiest counter's samples at which all must be known.
_KNOWN = 0.25
#: The control step of a craft without a controller: Cassini's. [s]
_CONTROL_STEP_S = 0.125
#: Counters that fall by less than this are rounded, not reset. [s]
_ROUNDING = 1e-6


PULSES_GUESSED = Kind(
    "firing.pulses-guessed", Severity.NOTE,
    "the pulses of {thrusters} are not counted: their number is estimated from the on-times ({pulses:.0f} ± {sigma:.0f} in all)",
    "Add the pulse counts.",
)  # fmt: skip
COUNTER_FALLS = Kind(
    "firing.counter-falls", Severity.CAUTION,
    "the {counter} of {thruster} falls at {time}, by a reset or a wrap: what fired between these two samples is not used",
    "If the counter wraps, declare the wrap in a channel dictionary.",
)  # fmt: skip


class NothingFires(BadInput):
    """No on-time rises."""


class Known(NamedTuple):
    """Counters at N instants, (N, j) each.

    ``squares``: sum of the squares of the pulses' lengths [s2], with which the scatter from pulse to pulse grows; ``short``: the
    same of pulses that have no parameter of their own, and ``long`` (N, L) the on-time so far of each that has one;
    ``early``: variance of the number of pulses given by then; ``duty`` and ``rate``: share of time on, and pulses a second, in
    the interval that ends there, by which some impulse may still be to come."""

    on_time_s: np.ndarray
    pulses: np.ndarray
    spread: np.ndarray
    chance: np.ndarray
    squares: np.ndarray
    short: np.ndarray
    long: np.ndarray
    early: np.ndarray
    duty: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True)
class Counters:
    """Thrusters' counters at their own instants (M,), from their first sample on; j thrusters.

    Where pulses are not counted, ``spread`` is what one sigma of their mean length adds to their number, and ``chance`` the
    variance of the number in each interval.  ``loose``: variance of the number of pulses given by then, for a counter that is
    not sampled at that instant."""

    tai_ns: np.ndarray
    on_time_s: np.ndarray  # (M, j)
    pulses: np.ndarray  # (M, j)
    spread: np.ndarray  # (M, j)
    chance: np.ndarray  # (M, j)
    loose: np.ndarray  # (M, j)
    broken: np.ndarray  # (M - 1,) bool: a counter fell, so that what was fired in the interval is not known
    counted: bool  # pulses are telemetry, not estimated

    @cached_property
    def lengths(self) -> Lengths:
        return lengths_of(self.on_time_s, self.pulses)

    def weak(self, scatter: float) -> np.ndarray:
        """Share by which the impulse of each thruster may lie below the mean of its pulses, (j,)."""
        return weak_because_lasting(np.diff(self.on_time_s, axis=0), np.diff(self.tai_ns) / NS, scatter)

    def at(self, tai_ns) -> Known:
        """At instants within the counters' span, linear in time between two samples."""
        x, grid = (np.asarray(v - self.tai_ns[0], float) / NS for v in (tai_ns, self.tai_ns))
        k = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
        f = ((x - grid[k]) / (grid[k + 1] - grid[k]))[:, None]
        own = self.lengths
        sums = (self.on_time_s, self.pulses, self.spread, self.chance, own.squares, own.short, own.long, self.loose)
        on, n, s, chance, squares, short, long, loose = ((1 - f) * v[k] + f * v[k + 1] for v in sums)
        # where counters are sampled more often than a tail lasts, only pulses within the last tail may still be to come
        before = np.minimum(np.where(f[:, 0] > 0, grid[k], grid[np.maximum(k - 1, 0)]), x - _TAIL_S)
        span = np.maximum(x - before, _TAIL_S)[:, None]
        until = np.where(f[:, 0] > 0, grid[k + 1], x)

        def lately(v):
            rises = np.stack([np.interp(until, grid, c) - np.interp(before, grid, c) for c in v.T], axis=1)
            return rises / (span + (until - x)[:, None])

        return Known(
            on,
            n,
            s,
            chance,
            squares,
            short,
            long,
            (self.pulses[k + 1] - self.pulses[k]) * f * (1 - f) + loose,
            lately(self.on_time_s),
            lately(self.pulses),
        )


def counters_of(subject: Subject) -> tuple[tuple[Thruster, ...], Counters, list[Doubt]]:
    """The craft's thrusters, their counters at instants that all share, and doubts.

    Raises BadInput for a thruster that the craft does not have or that has no on-time, NothingFires where none fires."""
    tlm, craft = subject.telemetry, subject.craft.craft
    names = [t.name for t in craft.thrusters]
    check_thrusters(subject)
    _check_complete(tlm, names)
    fires = [n for n in names if np.ptp(tlm.channel(f"on_time_{n}").usable.values) > 0]
    uncounted = [n for n in fires if f"pulse_count_{n}" not in tlm]
    check_counts(tlm, [n for n in fires if n not in uncounted])
    both = [f"on_time_{n}" for n in names] + [f"pulse_count_{n}" for n in fires if not uncounted]
    tai_ns, values, loose = _common(tlm, both)
    on, loose = values[:, : len(names)], loose[:, : len(names)]
    steps, broken = _rises(on)
    doubts = _falls(on, "on-time", names, tlm, tai_ns)
    if not (steps > 0).any():
        raise NothingFires(
            "no thruster fires in this record",
            file=tlm.source or None,
            remedy="Take a record of a wheel biasing, a run-down under thruster control or a burn.",
        )
    step_s = step_of(craft, on)
    fast, too_fast = check_clock(steps, tai_ns, control_step_s(craft), names, tlm)
    doubts += too_fast
    steps, broken = np.where(fast[:, None], 0.0, steps), broken | fast
    guess = guess_pulses(steps, np.diff(tai_ns) / NS, step_s)
    if uncounted:
        number, sigma = float(guess.pulses.sum()), float(guess.spread.sum())
        doubts.append(PULSES_GUESSED(thrusters=some_of(uncounted), pulses=number, sigma=sigma))
    else:
        counts = np.zeros_like(on)
        counts[:, [names.index(n) for n in fires]] = values[:, len(names) :]
        pulses, also = _rises(counts)
        doubts += _falls(counts, "pulse count", names, tlm, tai_ns)
        pulses = np.where(fast[:, None], 0.0, pulses)
        doubts += check_pulses(steps, pulses, np.diff(tai_ns) / NS, step_s, craft.thrusters, tlm)
        guess, broken = Guess(pulses, np.zeros_like(pulses), np.zeros_like(pulses)), broken | also
    on_time, pulses, spread, chance = (
        np.vstack([np.zeros(len(names)), np.cumsum(v, axis=0)])
        for v in (steps, guess.pulses, guess.spread, guess.chance)
    )
    counters = Counters(tai_ns, on_time, pulses, spread, chance, loose / step_s, broken, not uncounted)
    return craft.thrusters, counters, doubts


def check_thrusters(subject: Subject) -> None:
    """Raises BadInput for a counter of a thruster that the craft does not have."""
    tlm, craft = subject.telemetry, subject.craft.craft
    names = [t.name for t in craft.thrusters]
    for stem in ("on_time", "pulse_count"):
        for name in tlm.members(stem):
            if name not in names:
                raise BadInput(
                    f"{craft.name} has no thruster {name!r}",
                    file=tlm.source or None,
                    channel=f"{stem}_{name}",
                    remedy=f"Its thrusters: {some_of(names)}. Rename the column, or name the right --craft.",
                )


def _check_complete(tlm: Telemetry, names: list[str]) -> None:
    """Raises BadInput for a thruster without an on-time."""
    missing = [n for n in names if f"on_time_{n}" not in tlm]
    if missing:
        raise BadInput(
            f"no on-time of thruster {some_of(missing)}: its impulse would be attributed to the others",
            file=tlm.source or None,
            channel=f"on_time_{missing[0]}",
            remedy="Add the channel, or remove the thruster from the craft file if it does not exist.",
        )


def control_step_s(craft: Craft) -> float:
    """The craft's control step, of which pulses are multiples; assumed where it has no controller. [s]"""
    law = craft.wheel_controller
    return _CONTROL_STEP_S if law is None or law.period is None else law.period


def step_of(craft: Craft, on_time_s) -> float:
    """The control step [s]: the craft's, or the smallest rise of an on-time."""
    if craft.wheel_controller is not None and craft.wheel_controller.period is not None:
        return control_step_s(craft)
    rises = np.diff(on_time_s, axis=0)
    return float(rises[rises > _ROUNDING].min())


def _common(tlm: Telemetry, names: list[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Instants at which every counter is known, its values there, and their variance in units of the value, (M, j) each.

    A counter is known where it is sampled, and where it is the same before and after.  Where that is too rare, the instants of
    the counter that rises most are used, and the others are interpolated linearly in time."""
    channels = [tlm.channel(n).usable for n in names]
    if min(len(c.tai_ns) for c in channels) < 2:
        raise BadInput("fewer than two usable samples", channel=names[0], remedy="Take a longer record.")
    start, stop = max(c.tai_ns[0] for c in channels), min(c.tai_ns[-1] for c in channels)
    busiest = max(channels, key=lambda c: float(np.ptp(c.values)))
    every = np.unique(np.concatenate([c.tai_ns for c in channels]))
    every = every[(every >= start) & (every <= stop)]
    if len(every) < 2:
        raise BadInput(
            "the thrusters' counters have no time in common", channel=names[0], remedy="Take a longer record."
        )
    values, loose = (np.stack(v, axis=1) for v in zip(*(_between(c, every) for c in channels), strict=True))
    kept = ~loose.any(axis=1)
    if kept.sum() < _KNOWN * len(busiest.tai_ns):
        kept = np.isin(every, busiest.tai_ns)
    return every[kept], values[kept], loose[kept]


def _between(c: Channel, tai_ns) -> tuple[np.ndarray, np.ndarray]:
    """A counter interpolated linearly in time, and rise x share x (1 - share), which is zero at its samples."""
    x, grid = (np.asarray(v - c.tai_ns[0], float) / NS for v in (tai_ns, c.tai_ns))
    k = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
    f, rise = (x - grid[k]) / (grid[k + 1] - grid[k]), c.values[k + 1] - c.values[k]
    return c.values[k] + f * rise, np.abs(rise) * f * (1 - f)


def _rises(counts) -> tuple[np.ndarray, np.ndarray]:
    """Rises of counters (M, j) from sample to sample, none where any fell, and where one fell (M - 1,)."""
    steps = np.diff(counts, axis=0)
    broken = (steps < -_ROUNDING).any(axis=1)
    return np.where(broken[:, None], 0.0, np.maximum(steps, 0.0)), broken


def _falls(counts, counter: str, names: list[str], tlm: Telemetry, tai_ns) -> list[Doubt]:
    """A doubt for each thruster whose counter falls, at its first fall."""
    fell = np.diff(counts, axis=0) < -_ROUNDING
    return [
        COUNTER_FALLS(
            counter=counter, thruster=names[k], time=tlm.describe_time(int(tai_ns[np.argmax(fell[:, k]) + 1]))
        )
        for k in np.flatnonzero(fell.any(axis=0))
    ]
