"""A few values over years: the trend, its significance, and its power.

    y_i = a + b t_i + e_i,    e_i of variance tau^2 + sigma_i^2

sigma_i is each event's own, tau the scatter from event to event (Paule and Mandel's estimate), in proportion to the
line where the values keep one sign: a mechanism that pushes harder also scatters more.  The line is Huber's
M-estimate.  Its p-value and intervals come from one permutation test: under the right hypothesis the residuals are
exchangeable in date, so that shuffling them gives the distribution of the statistic sum d_i psi(r_i / s_i).  Intervals
hold the hypotheses that the test does not reject; with ten events a normal approximation would be too narrow.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import permutations
from math import factorial

import numpy as np
import scipy

from ...kit.scatter import robust_sigma

YEAR = 365.25  # days
#: Residuals count at most this many scales: 95 % efficient for normal errors (Huber 1964).
HUBER = 1.345
#: Shuffles of the residuals; all permutations where there are no more.
SHUFFLES = 3999
#: Fewest events with which a 95 % interval can exist: 2 / 4! is above 0.05.
FEWEST = 5
#: Power at which a change counts as detectable.
POWER = 0.8
_SEED = 20150929


@dataclass(frozen=True)
class Values:
    """One figure's values in order of date; ``day`` counts from 2000-01-01, ``sigma`` is zero where unknown."""

    day: np.ndarray
    value: np.ndarray
    sigma: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Time as a share of the whole span, 0 to 1."""
        return (self.day - self.day[0]) / (self.day[-1] - self.day[0])

    def first(self, count: int) -> Values:
        return Values(self.day[:count], self.value[:count], self.sigma[:count])


@dataclass(frozen=True)
class Trend:
    """A line through one figure's values, with its intervals.  Changes are of the line, from first to last event."""

    values: Values
    start: float  # the line at the first event
    slope_per_year: float
    slope_ci95: tuple[float, float]
    change_percent: float | None
    change_percent_ci95: tuple[float, float] | None
    p_value: float
    scatter: float  # tau, event to event [the figure's unit]
    residual: float  # one sigma of an event of usual sigma about the line
    detectable_percent: float | None

    def at(self, day) -> np.ndarray:
        return self.start + self.slope_per_year * (np.asarray(day) - self.values.day[0]) / YEAR

    @property
    def sigmas(self) -> np.ndarray:
        """One sigma of every event about the line."""
        return sigmas_about(self.scatter * sizes(self.values.share, self.values.value), self.values.sigma)

    def power(self, percent: float) -> float:
        """Power: probability that a change of that size, first to last event, is detected at 5 %."""
        return power_of_slope(abs(percent / 100 * self.start), self.residual, self.values.share)

    def band(self, day, share: float = 0.95) -> tuple[np.ndarray, np.ndarray]:
        """Where a further event at ``day`` would lie with that probability: (low, high)."""
        s = self.sigmas
        w = 1 / s**2
        t = self.values.day
        mean = np.average(t, weights=w)
        own = np.sqrt(
            (self.scatter * sizes(self.values.share, self.values.value, (np.asarray(day) - t[0]) / np.ptp(t))) ** 2
            + np.median(self.values.sigma) ** 2
        )
        spread = np.sqrt(own**2 + 1 / w.sum() + (np.asarray(day) - mean) ** 2 / np.sum(w * (t - mean) ** 2))
        reach = scipy.stats.t.ppf(0.5 + share / 2, len(t) - 2) * spread
        return self.at(day) - reach, self.at(day) + reach

    def crossing(self, limit: float, years: float = 20.0) -> tuple[float | None, float | None]:
        """Days (from 2000-01-01) at which the 95 % band's edge, and the line, first reach ``limit``; None where not within ``years``."""
        last = self.values.day[-1]
        days = last + np.linspace(0, years * YEAR, 2001)
        rising = bool(limit >= self.at(last))
        low, high = self.band(days)
        edge, line = (high, self.at(days)) if rising else (low, self.at(days))
        return tuple(self._first(days, x, limit, rising=rising) for x in (edge, line))  # type: ignore[return-value]

    @staticmethod
    def _first(days, x, limit: float, *, rising: bool) -> float | None:
        passed = x >= limit if rising else x <= limit
        return float(days[np.argmax(passed)]) if passed.any() else None


def trend_of(values: Values) -> Trend:
    """The trend of a figure.  Raises ValueError for fewer than three events, or none later than the first."""
    day, y = values.day, values.value
    if len(day) < 3 or day[-1] <= day[0]:
        raise ValueError("a trend needs at least three events at different times")
    u = values.share
    one = np.ones_like(u)
    size = sizes(u, y)
    scatter = scatter_of(values, size)
    s = sigmas_about(scatter * size, values.sigma)
    start, rise = (float(x) for x in robust_line(u, y, s))
    left = y - start - rise * u
    scale = mad(left / s)
    residual = float(np.median(s)) * float(np.sqrt(np.sum(_psi(left / s, max(scale, 1e-300)) ** 2) / (len(y) - 2)))
    if scale == 0 or np.max(np.abs(left)) <= 1e-9 * np.max(np.abs(y)):  # all on one line: nothing to shuffle
        exact = abs(rise) > 1e-9 * np.max(np.abs(y))
        rise = rise if exact else 0.0
        change = None if start == 0 else 100 * rise / start
        return Trend(
            values, float(start), float(rise * YEAR / (day[-1] - day[0])), (np.nan, np.nan), change, None,
            2 / factorial(len(y)) if exact else 1.0, scatter, residual, None,
        )  # fmt: skip
    orders = shuffles(len(y))

    def p_of_rise(b):
        return _p(y - b * u, s, one, u, scale, orders)

    def p_of_change(c):
        return _p(y, s, one + c * u, u, scale, orders)

    d = u - np.average(u, weights=1 / s**2)
    error = float(residual / np.median(s) / np.sqrt(np.sum((d / s) ** 2)))
    years = (day[-1] - day[0]) / YEAR
    low, high = (_edge(p_of_rise, rise, sign * error) for sign in (-1, 1))
    change, interval = None, None
    if start != 0 and np.all(np.sign(y) == np.sign(start)):
        change = rise / start
        below, above = (100 * _edge(p_of_change, change, sign * abs(error / start)) for sign in (-1, 1))
        interval = (below, above)
    return Trend(
        values,
        start,
        rise / years,
        (low / years, high / years),
        None if change is None else 100 * change,
        interval,
        p_of_rise(0.0),
        scatter,
        residual,
        None if change is None else float(100 * detectable(residual, u) / abs(start)),
    )


def robust_line(x, y, s, rounds: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Huber's line through y (..., N) of standard deviations ``s`` up to a factor: (at x = 0, slope per x)."""
    y = np.asarray(y, float)
    x = np.asarray(x, float)
    pair = np.triu_indices(len(x), 1)
    apart = x[pair[1]] - x[pair[0]]
    keep = np.abs(apart) > 0
    slope = np.median(
        (y[..., pair[1]] - y[..., pair[0]])[..., keep] / apart[keep], axis=-1
    )  # Theil and Sen's, to start
    start = np.median(y - slope[..., None] * x, axis=-1)
    scale = mad((y - start[..., None] - slope[..., None] * x) / s)[..., None]
    floor = np.maximum(scale, 1e-300)
    for _ in range(rounds):
        z = np.abs(y - start[..., None] - slope[..., None] * x) / s / floor
        w = np.minimum(1, HUBER / np.maximum(z, 1e-300)) / s**2
        mean_x, mean_y = np.sum(w * x, -1) / np.sum(w, -1), np.sum(w * y, -1) / np.sum(w, -1)
        d = x - mean_x[..., None]
        slope = np.sum(w * d * y, -1) / np.sum(w * d * d, -1)
        start = mean_y - slope * mean_x
    return start, slope


@cache
def shuffles(count: int) -> np.ndarray:
    """Orders of so many events, (P, count): all but the true one, or a seeded sample of them."""
    if factorial(count) <= SHUFFLES + 1:
        return np.array(list(permutations(range(count))))[1:]
    rng = np.random.default_rng(_SEED)
    return np.argsort(rng.random((SHUFFLES, count)), axis=1)


def detectable(residual: float, share) -> float:
    """Smallest change over the span that a test at 5 % detects with 80 % power, in the residual's unit."""
    freedom = len(share) - 2
    return _error_of_rise(residual, share) * float(
        scipy.stats.t.ppf(0.975, freedom) + scipy.stats.t.ppf(POWER, freedom)
    )


def power_of_slope(change: float, residual: float, share) -> float:
    """Power: probability that a change of that size over the span is detected at 5 %."""
    if residual == 0:
        return 1.0 if change else 0.05
    freedom = len(share) - 2
    edge = scipy.stats.t.ppf(0.975, freedom)
    away = change / _error_of_rise(residual, share)
    if away > 30:  # beyond the range of the distribution's numerics: power 1
        return 1.0
    return float(scipy.stats.nct.sf(edge, freedom, away) + scipy.stats.nct.cdf(-edge, freedom, away))


def holm(p_values) -> np.ndarray:
    """p-values adjusted for testing all of them (Holm 1979)."""
    p = np.asarray(p_values, float)
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(1, np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p)))))
    return adjusted


def _error_of_rise(residual: float, share) -> float:
    efficiency = 0.95  # of Huber's estimate, for normal errors
    return residual / np.sqrt(efficiency * np.sum((share - np.mean(share)) ** 2))


def _psi(z, scale):
    """Huber's: residuals clipped."""
    return np.clip(z / scale, -HUBER, HUBER) * scale


def mad(z) -> np.ndarray:
    """Standard deviation from the median size, corrected for a line having been fitted."""
    n = np.shape(z)[-1]
    return robust_sigma(z, axis=-1) * np.sqrt(n / max(n - 2, 1))


def sizes(x, y, at=None) -> np.ndarray:
    """Size of a line through ``y`` over its mean, at ``x`` (or ``at``): the scatter is in proportion to it; 1 across zero."""
    where = x if at is None else at
    if not (np.all(y > 0) or np.all(y < 0)):
        return np.ones_like(where)
    start, slope = robust_line(x, y, np.ones_like(x))
    return np.clip((start + slope * where) / np.mean(start + slope * x), 0.4, 2.5)


def sigmas_about(scatter, sigma) -> np.ndarray:
    total = np.sqrt(scatter**2 + sigma**2)
    return np.where(total > 0, total, 1.0)


def scatter_of(values: Values, size) -> float:
    """Event-to-event scatter beyond the events' own sigma: sum of psi(r / s)^2 = N - 2  (Paule and Mandel 1982)."""
    u, y, sigma = values.share, values.value, values.sigma

    def excess(tau):
        s = sigmas_about(tau * size, sigma)
        start, slope = robust_line(u, y, s)
        z = (y - start - slope * u) / s
        return np.sum(np.clip(z, -3, 3) ** 2) - (len(y) - 2)

    low, high = 0.0, float(np.ptp(y))
    if high == 0 or (np.all(sigma > 0) and excess(0.0) <= 0):
        return 0.0
    for _ in range(25):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return high


def _p(y, s, nuisance, direction, scale, orders) -> float:
    """Two-sided permutation p-value of y = m nuisance + e against a part along ``direction``."""
    g, d, z = nuisance / s, direction / s, y / s
    d = d - g * (g @ d) / (g @ g)
    m = (g @ z) / (g @ g)
    for _ in range(8):
        w = np.minimum(1, HUBER * scale / np.maximum(np.abs(z - m * g), 1e-300))
        m = (w * g) @ z / ((w * g) @ g)
    left = z - m * g
    psi = _psi(
        left, max(scale, float(mad(left)))
    )  # far from the right hypothesis all residuals are large, none is an outlier
    chance = np.abs(psi[orders] @ d)
    return float((1 + np.sum(chance >= abs(d @ psi) * (1 - 1e-12))) / (1 + len(orders)))


def _edge(p_of, estimate: float, step: float, alpha: float = 0.05) -> float:
    """Where hypotheses from ``estimate`` on, in the direction of ``step``, begin to be rejected; infinite where none is."""
    inside, outside = estimate, estimate + 3 * step
    for _ in range(20):
        if p_of(outside) <= alpha:
            break
        inside, outside = outside, outside + 2 * (outside - estimate)
    else:
        return float(np.copysign(np.inf, step))
    for _ in range(12):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if p_of(middle) <= alpha else (middle, outside)
    return float(outside)
