"""How a wheel was used: revolutions, time at low speed, zero crossings.

Between samples of one gap-free stretch the rate is taken as linear; nothing is counted inside a gap, but that a wheel
which comes out of it turning the other way has crossed zero."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from .run_downs import own_noise

if TYPE_CHECKING:
    from ...telemetry.telemetry import Channel


@dataclass(frozen=True)
class WheelUse:
    """What a bearing has been through in one record.  ``gaps_s``: total length of what is not seen."""

    seen_s: float
    gaps_s: float
    revolutions: float
    low_speed_dwell_s: float
    zero_crossings: int
    crossing_times_s: tuple[float, ...]  # of those seen; one inside a gap has no time
    largest_rate_rad_s: float


def wheel_use(channel: Channel, seconds: np.ndarray, low_rad_s: float) -> WheelUse:
    """From a channel's usable samples at ``seconds``."""
    c = channel.usable
    turned = dwell = seen = gaps = 0.0
    times: list[float] = []
    crossed, last = 0, 0
    for k, s in enumerate(c.segments()):
        t, w = seconds[s], c.values[s]
        if k:
            gaps += float(t[0] - seconds[s.start - 1])
        steps = np.diff(t)
        seen += float(steps.sum())
        turned += float(np.sum(steps * _mean_size(w[:-1], w[1:])))
        dwell += float(np.sum(steps * _share_below(w[:-1], w[1:], low_rad_s)))
        # a wheel near rest whose sensor's noise changes sign does not cross
        noise = own_noise(w, t) if len(w) > 2 else 0.0
        dead = max(5 * noise, c.count_size)
        for a, b in pairwise([-1, *np.flatnonzero(np.abs(w) > dead).tolist()]):
            way = int(np.sign(w[b]))
            if last and way != last:
                crossed += 1
                if a >= 0:
                    times.append(_when(t[a : b + 1], w[a : b + 1]))
            last = way
    largest = float(np.max(np.abs(c.values), initial=0.0))
    return WheelUse(seen, gaps, turned / (2 * np.pi), dwell, crossed, tuple(times), largest)


def _mean_size(a, b) -> np.ndarray:
    """Mean of |x| along straight lines from a to b."""
    same = a * b >= 0
    size = np.where(same, 1.0, np.abs(a) + np.abs(b))
    return np.where(same, 0.5 * np.abs(a + b), 0.5 * (a**2 + b**2) / np.where(size > 0, size, 1.0))


def _share_below(a, b, limit: float) -> np.ndarray:
    """Which share of straight lines from a to b lies within +-limit."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    inside = np.clip(np.minimum(high, limit) - np.maximum(low, -limit), 0.0, None)
    width = high - low
    return np.where(width > 0, inside / np.where(width > 0, width, 1.0), (np.abs(a) < limit).astype(float))


def _when(t, w) -> float:
    """Instant at which a straight line through the samples of a crossing is zero."""
    x = t - t[0]
    spread = x - x.mean()
    slope = float(spread @ w / (spread @ spread))
    return float(t[0] + np.clip(x.mean() - w.mean() / slope if slope else 0.0, 0.0, x[-1]))
