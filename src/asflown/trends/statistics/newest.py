"""A new actuation against those before it: does one of its figures deviate?

The line through the past is carried to the new date.  How far the new value lies from it, in units of the past
scatter, has a known distribution for normal scatter whatever its size: it is drawn by running the same estimator on
noise with the same dates and weights.  False alarms then come at their stated rate, with ten past events as with fifty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .slope import HUBER, POWER, YEAR, Values, mad, robust_line, scatter_of, sigmas_about, sizes

#: Past events needed for a judgement, and draws of the noise.
FEWEST_PAST, DRAWS = 4, 5000
_SEED = 20041209


@dataclass(frozen=True)
class Newest:
    """The newest value, the value expected from the past, and the significance of the difference."""

    day: float
    value: float
    expected: float
    low: float  # 95 % of new values lie between these
    high: float
    p_value: float
    spread: float  # one sigma of new values about the expected one
    chance: np.ndarray  # (K,), differences due to noise alone, in spreads of that draw
    own: np.ndarray  # (K,), one true spread in spreads as estimated in that draw

    def power(self, percent: float, alpha: float = 0.05) -> float:
        """Power: probability that a sudden change of that size is detected at significance ``alpha``."""
        edge = np.quantile(np.abs(self.chance), 1 - alpha)
        shift = abs(percent / 100 * self.expected) / self.spread if self.spread else np.inf
        return float(np.mean(np.abs(self.chance + shift * self.own) > edge))

    def detectable(self, alpha: float = 0.05) -> float | None:
        """Smallest sudden change that is detected with 80 % power. [%]"""
        if not self.expected or not self.spread:
            return None
        low, high = 0.0, 100 * 50 * self.spread / abs(self.expected)
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.power(middle, alpha) >= POWER else (middle, high)
        return high


def newest_of(values: Values) -> Newest | None:
    """The last of ``values`` against the others; None with fewer than four before it, or all of them at one time."""
    past = len(values.day) - 1
    if past < FEWEST_PAST or values.day[past - 1] <= values.day[0]:
        return None
    before = values.first(past)
    x = (values.day - values.day[0]) / YEAR
    size = sizes(x[:past], before.value, x)
    # scatter that so few events cannot exclude: half of its square's standard error, where the events' own sigmas hide it
    hidden = 0.5 * np.median(before.sigma) ** 2 * np.sqrt(2 / (past - 2))
    s = sigmas_about(
        np.sqrt(max(scatter_of(before, size[:past]) ** 2, hidden)) * size, values.sigma
    )  # of all, including the newest
    floor = float(
        np.median(values.sigma / s)
    )  # scatter due to the events' own sigmas alone: the past cannot scatter less
    start, slope, scale = _line(x[:past], values.value[:past], s[:past], floor)
    same = 1e-9 * np.max(np.abs(before.value))
    expected = float(start + slope * x[-1])
    expected = expected if abs(expected) > same else 0.0
    noise = s * np.random.default_rng(_SEED).standard_normal((DRAWS, past + 1))
    a, b, drawn = _line(x[:past], noise[:, :past], s[:past], floor)
    apart = noise[:, -1] - a - b * x[-1]
    chance, own = apart / drawn, np.std(apart) / drawn
    usual = np.std(apart) * scale / _usual(drawn)
    difference = values.value[-1] - expected
    if scale * np.median(s) <= same:  # the past values are equal: any difference is significant
        p, reach, usual = (1.0 if abs(difference) <= same else 0.0), 0.0, 0.0
    else:
        p = float((1 + np.sum(np.abs(chance) >= abs(difference / scale))) / (1 + DRAWS))
        reach = float(np.quantile(np.abs(chance), 0.95) * scale)
    return Newest(
        float(values.day[-1]), float(values.value[-1]), expected, expected - reach, expected + reach,
        p, float(usual), chance, own,
    )  # fmt: skip


def _line(x, y, s, floor):
    """A robust line and the scale of what it leaves, in units of ``s``; a single past outlier moves neither much."""
    start, slope = robust_line(x, y, s)
    z = (y - np.asarray(start)[..., None] - np.asarray(slope)[..., None] * x) / s
    rough = np.maximum(mad(z), 1e-300)
    clipped = np.clip(z / rough[..., None], -2 * HUBER, 2 * HUBER) * rough[..., None]
    return start, slope, np.maximum(np.sqrt(np.sum(clipped**2, axis=-1) / (np.shape(z)[-1] - 2)), floor)


def _usual(drawn) -> float:
    """Root mean square of the estimated scale where the true one is 1."""
    return float(np.sqrt(np.mean(drawn**2)))
