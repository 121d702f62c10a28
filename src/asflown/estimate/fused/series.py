"""Measured series of one axis, arranged in time for the smoother, and how noisy they look."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from ...kit.regression import noise_sigma
from ...kit.scatter import robust_sigma
from ...kit.smoother import Measurements

#: Rows of every model's H, by what is measured.
ROWS = ("attitude_error", "body_rate", "momentum", "control_torque")


ATTITUDE_ERROR, BODY_RATE, MOMENTUM, CONTROL_TORQUE = range(4)


#: A step this many times as far from its neighbours as is usual is a jump.
_A_JUMP = 8.0


@dataclass(frozen=True)
class Series:
    """One measured series of one axis: its row, seconds from the grid's start, values, its smallest step.

    ``steep``: (N,), how fast the value changes where it jumps, 0 elsewhere [unit/s]; None: it never does."""

    row: int
    seconds: np.ndarray
    values: np.ndarray
    quantum: float = 0.0
    steep: np.ndarray | None = None

    def where(self, keep: np.ndarray) -> Series:
        steep = None if self.steep is None else self.steep[keep]
        return replace(self, seconds=self.seconds[keep], values=self.values[keep], steep=steep)

    def with_jumps(self) -> Series:
        """The same, its jumps marked: there an uncertain instant within the cadence is worth more than the noise.

        A jump is a step far from those around it; a steady rise has none."""
        step, dt = np.diff(self.values), np.diff(self.seconds)
        odd = np.abs(step - scipy.ndimage.median_filter(step, 5))
        rate = np.where(odd > _A_JUMP * max(robust_sigma(odd), self.quantum), odd / dt, 0.0)
        steep = np.maximum(np.append(rate, 0.0), np.append(0.0, rate))
        return replace(self, steep=steep if steep.any() else None)

    def later(self, seconds: float) -> Series:
        """The same values taken to be measured later."""
        return replace(self, seconds=self.seconds + seconds)

    def between(self, start_s: float, stop_s: float) -> Series:
        return self.where((self.seconds >= start_s) & (self.seconds <= stop_s))


@dataclass(frozen=True)
class Times:
    """The instants of a pass, every sample's and those wanted beside them, and the size of what was measured.

    A sample at a jump has a row of its own, after those of the channels: ``base`` is the channel of every row,
    ``steep`` how fast the value changes there."""

    seconds: np.ndarray  # (N,)
    steps_s: np.ndarray  # the different steps
    which: np.ndarray  # (N,)
    wanted: np.ndarray  # (N,) bool
    largest: np.ndarray  # (rows,), of each row's values; 0 where there are none
    quantum: np.ndarray  # (rows,)
    base: np.ndarray  # (rows and jumps,)
    steep: np.ndarray  # (rows and jumps,)


def arrange(series, wanted_s: np.ndarray | None = None) -> tuple[Times, Measurements]:
    """Merge series of different times into one pass.  Times are taken to the millisecond."""
    everything = [np.round(s.seconds * 1e3).astype(np.int64) for s in series]
    extra = np.round(np.asarray([] if wanted_s is None else wanted_s) * 1e3).astype(np.int64)
    ms = np.unique(np.concatenate([*everything, extra]))
    place = np.concatenate([np.searchsorted(ms, e) for e in everything])
    row = np.concatenate([np.full(len(s.values), s.row) for s in series])
    value = np.concatenate([s.values for s in series])
    steep = np.concatenate([np.zeros(len(s.values)) if s.steep is None else s.steep for s in series])
    jumps = np.flatnonzero(steep)
    base = np.concatenate([np.arange(len(ROWS)), row[jumps]])
    row[jumps] = len(ROWS) + np.arange(len(jumps))
    order = np.argsort(place, kind="stable")
    start = np.searchsorted(place[order], np.arange(len(ms) + 1))
    steps, which = np.unique(np.diff(ms), return_inverse=True)
    largest, quantum = np.zeros(len(ROWS)), np.zeros(len(ROWS))
    for s in series:
        largest[s.row] = max(largest[s.row], float(np.max(np.abs(s.values), initial=0.0)))
        quantum[s.row] = max(quantum[s.row], s.quantum)
    first = np.concatenate([[0], which])
    times = Times(
        ms / 1e3,
        steps / 1e3,
        first,
        np.isin(ms, extra),
        largest,
        quantum,
        base,
        np.concatenate([np.zeros(len(ROWS)), steep[jumps]]),
    )
    return times, Measurements(start, row[order], value[order])


def channel_of(times: Times, data: Measurements) -> np.ndarray:
    """The row in ROWS of each measurement, at a jump or not. (M,)"""
    return times.base[data.row]


def step_of(data: Measurements) -> np.ndarray:
    """The step at which each measurement was taken. (M,)"""
    return np.searchsorted(data.start, np.arange(len(data.row)), side="right") - 1


def usual_size(values: np.ndarray) -> float:
    """Standard deviation, values beyond twice the size that one in five exceeds cut to that (spikes)."""
    most = 2 * float(np.quantile(np.abs(values), 0.8))
    return float(np.std(np.clip(values, -most, most)))


def white_noise(s: Series, least: float) -> float:
    """A series' white noise, from local fits; at least ``least``."""
    sigma = noise_sigma(s.seconds, s.values, degree=3, half_width=4 * float(np.median(np.diff(s.seconds))))
    return max(sigma, least) if np.isfinite(sigma) else least
