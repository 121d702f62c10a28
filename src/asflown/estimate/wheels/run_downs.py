"""Run-downs: a wheel whose motor is off slows by its bearing alone, and its course shows the drag.

    J du/dt = -(coulomb + viscous u),   u = |rate|;   with a = coulomb / J, b = viscous / J and s from the middle
    u(s) = u_m exp(-b s) - a s phi(b s),   phi(x) = (1 - exp(-x)) / x

The law itself is fitted to the samples: nothing is differenced.  The wheel turns against the body, so the left side
is J (du/dt + a.dw/dt).  Where the body's rate along the axis is known, d = a.w, the rate u + d - q obeys the law, with
dq/dt = b (d - q): what the bearing does to the part that is the body's.  In a hold that is below 1e-4 rad/s, against
5e-3 rad/s of a tachometer's noise; a slew of 4 mrad/s would just reach that noise.  Turning of the momentum (w x h) loads
the bearings across the spin axis and does not slow the wheel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.scatter import robust_sigma
from ...kit.timeline import runs
from ...telemetry.screening import quantisation_step

if TYPE_CHECKING:
    from ...telemetry.telemetry import Channel

#: Below it the drag law has a third part, stiction, and samples are left out: 20 rpm. [rad/s]
STICTION_RATE = 2.0
#: A run-down has at least this many samples, and slows by this many sigma of one.
FEWEST, _LEAST_FALL = 24, 40.0
#: Blocks in which residuals are averaged: a motor at work wanders slowly, a tachometer's noise does not.
_BLOCKS = 8
#: Chance of refusing a true run-down for its residuals, at each look.
_CHANCE = 1e-4
#: A departure from the law below this share of the fall is a bearing's own, not a motor's.
_OWN_WAYS = 1e-3
#: Found by shape: the curvature stands out by this many sigma, and viscous drag has a share between these of the drag
#: at the highest rate.  Less is a motor's straight ramp, more one that is let out exponentially.
_CURVED, _SHARE = 5.0, (0.1, 0.95)
#: Time constants from the middle beyond which a trial step of the fit is not followed: exp() would overflow.
_STEEP = 50.0
#: Samples beyond this many sigma are not counted.
_FAR = 5.0
#: Slow residuals this many times the noise are doubted.
_MISFIT = 2.0


#: How a run-down is known: the user names it, the motor's current is zero, or only a bearing explains its shape.
NAMED, CURRENT, SHAPE = "named", "current", "shape"


@dataclass(frozen=True)
class RunDown:
    """One stretch in which a wheel coasts.  ``found_by``: named (the user says so), current (the motor's is zero) or shape.

    ``alone``: the law of this run-down by itself."""

    start_s: float
    stop_s: float
    from_rad_s: float
    to_rad_s: float
    found_by: str
    time_s: np.ndarray  # (N,), samples used
    rate_rad_s: np.ndarray  # (N,)
    fit_rad_s: np.ndarray  # (N,)
    alone: Law

    @property
    def is_guessed(self) -> bool:
        """Whether nothing but the shape says that the motor was off."""
        return self.found_by == SHAPE

    def slowing_rad_s2(self, blocks: int = 16) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mean rate, slowing of |rate| and its sigma in blocks, by straight lines: to look at, not to fit."""
        rows = []
        for part in np.array_split(np.arange(len(self.time_s)), max(min(blocks, len(self.time_s) // 4), 1)):
            t, u = self.time_s[part], np.abs(self.rate_rad_s[part])
            t = t - t.mean()
            slope = float(t @ u / (t @ t))
            left = float(np.std(u - u.mean() - slope * t))
            rows.append((float(self.rate_rad_s[part].mean()), -slope, left / float(np.sqrt(t @ t))))
        rate, slowing, sigma = np.array(rows).T
        return rate, slowing, sigma

    def record(self) -> dict:
        return {
            "start_s": self.start_s,
            "stop_s": self.stop_s,
            "from_rad_s": self.from_rad_s,
            "to_rad_s": self.to_rad_s,
            "samples": len(self.time_s),
            "rms_residual_rad_s": float(np.sqrt(np.mean((self.rate_rad_s - self.fit_rad_s) ** 2))),
            "found_by": self.found_by,
        }


@dataclass(frozen=True)
class Law:
    """Constant and proportional part of the slowing of a wheel.

    ``values``: a [rad/s^2] and b [1/s]; ``covariance`` of both; ``rate``: mean |rate| of the samples [rad/s];
    ``misfit``: reduced chi square of the slow residuals, by which the covariance is widened where it is significant."""

    values: np.ndarray
    covariance: np.ndarray
    rate: float
    misfit: float

    @property
    def misfits(self) -> float | None:
        """Size of the slow residuals over the noise, where that is to be doubted."""
        return float(np.sqrt(self.misfit)) if self.misfit > _MISFIT**2 else None


@dataclass(frozen=True)
class Coasting:
    """All run-downs of a wheel, and the law that they have in common."""

    law: Law
    run_downs: tuple[RunDown, ...]


@dataclass(frozen=True)
class Span:
    """Samples of one coast: seconds from the middle, |rate|, quantum."""

    s: np.ndarray
    u: np.ndarray
    quantum: float


def phi(x):
    """(1 - exp(-x)) / x, and its slope."""
    x = np.clip(np.asarray(x, float), -_STEEP, _STEEP)
    small = np.abs(x) < 1e-4
    safe = np.where(small, 1.0, x)
    value = np.where(small, 1 - x / 2 + x**2 / 6, -np.expm1(-safe) / safe)
    slope = np.where(small, -0.5 + x / 3, (np.exp(-safe) * (1 + safe) - 1) / safe**2)
    return value, slope


def coast(s, middle: float, a: float, b: float) -> np.ndarray:
    """|rate| in a coast, s seconds from where it is ``middle``. [rad/s]"""
    return middle * np.exp(-np.clip(b * s, -_STEEP, _STEEP)) - a * s * phi(b * s)[0]


def fit_coasts(spans: list[Span]) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """a, b and every span's middle rate by least squares: (2 + spans,), (J' J)^-1, residuals."""
    edges = np.concatenate([[0], np.cumsum([len(p.s) for p in spans])])

    def residuals(x):
        return np.concatenate([coast(p.s, m, x[0], x[1]) - p.u for p, m in zip(spans, x[2:], strict=True)])

    def jacobian(x):
        J = np.zeros((edges[-1], len(x)))
        for i, p in enumerate(spans):
            rows = slice(edges[i], edges[i + 1])
            value, slope = phi(x[1] * p.s)
            decay = np.exp(-np.clip(x[1] * p.s, -_STEEP, _STEEP))
            J[rows, 0] = -p.s * value
            J[rows, 1] = -p.s * x[2 + i] * decay - x[0] * p.s**2 * slope
            J[rows, 2 + i] = decay
        return J

    longest = max(float(np.abs(p.s).max()) for p in spans)
    parabolas = [np.polyfit(p.s / longest, p.u, 2) for p in spans]
    middles = [float(c[2]) for c in parabolas]
    c2, c1, _ = parabolas[int(np.argmax([np.ptp(p.s) for p in spans]))] / longest ** np.array([2, 1, 0])
    b = -2 * c2 / c1 if c1 else 0.0
    b = float(np.clip(b, -3 / longest, 3 / longest))
    start = np.array([-c1 - b * middles[0], b, *middles])
    found = scipy.optimize.least_squares(
        residuals, start, jacobian, method="lm", x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12
    )
    # scaled, or the inverse of quantities of such different size is taken for singular
    size = np.linalg.norm(found.jac, axis=0)
    size[size == 0] = 1.0
    inverse = np.linalg.pinv((found.jac / size).T @ (found.jac / size), rcond=1e-14) / np.outer(size, size)
    return found.x, inverse, [-found.fun[edges[i] : edges[i + 1]] for i in range(len(spans))]


def slow_misfit(spans: list[Span], residuals: list[np.ndarray], sigma: float) -> tuple[float, int, float]:
    """Chi square of residuals averaged in blocks, its degrees of freedom, and their largest size. [rad/s]

    A count's error repeats while the rate stays within it: it averages over counts, not over samples."""
    total, blocks, largest = 0.0, 0, 0.0
    for p, r in zip(spans, residuals, strict=True):
        for rows in np.array_split(np.arange(len(r)), max(min(_BLOCKS, len(r) // 6), 1)):
            counts = 1 + np.ptp(p.u[rows]) / p.quantum if p.quantum > 0 else len(rows)
            variance = sigma**2 / len(rows) + p.quantum**2 / 12 / min(counts, len(rows))
            mean = float(np.mean(r[rows]))
            total += mean**2 / variance if variance > 0 else 0.0
            largest = max(largest, abs(mean))
            blocks += 1
    return total, max(blocks - 2 - len(spans), 1), largest


def own_noise(values: np.ndarray, seconds: np.ndarray) -> float:
    """White noise of one sample, from how far each lies off the line between its neighbours; 0 for too few. [rad/s]

    Unlike ``difference_sigma`` it takes uneven times, which wheels' records have."""
    if len(values) < 3:
        return 0.0
    share = (seconds[2:] - seconds[1:-1]) / (seconds[2:] - seconds[:-2])
    off = values[1:-1] - share * values[:-2] - (1 - share) * values[2:]
    return float(robust_sigma(off / np.sqrt(1 + share**2 + (1 - share) ** 2)))


def followed(t: np.ndarray, turning: np.ndarray, per_s: float) -> np.ndarray:
    """q with dq/dt = per_s (turning - q), which begins at the first value; turning is straight from sample to sample. (N,)"""
    q = np.empty_like(turning)
    q[0] = turning[0]
    dt = np.diff(t)
    keep, mean = np.exp(-per_s * dt), phi(per_s * dt)[0]
    for k in range(len(dt)):
        rise = turning[k + 1] - turning[k]
        q[k + 1] = keep[k] * q[k] + (1 - keep[k]) * turning[k] + (1 - mean[k]) * rise
    return q


class Finder:
    """Looks for run-downs in one wheel's samples: stretches that slow as a bearing alone would slow it.

    ``turning``: the body's rate along the wheel's axis at the samples (N,) [rad/s], None where it is not known or does not matter;
    ``rate``: the wheel's with it."""

    def __init__(self, channel: Channel, seconds: np.ndarray, turning: np.ndarray | None = None):
        c = channel.usable
        self.t, self.turning = seconds, turning
        self.rate = c.values if turning is None else c.values + turning
        self.quantum = channel.count_size or quantisation_step(c.values)
        self.gapless = c.segments()
        self.fitted = lru_cache(maxsize=None)(self._fitted)

    def stretches(self) -> list[slice]:
        """Without a gap, turning one way, clear of stiction, long enough."""
        found = []
        for s in self.gapless:
            for way in (1, -1):
                found += [slice(s.start + r.start, s.start + r.stop) for r in runs(way * self.rate[s] > STICTION_RATE)]
        return sorted((s for s in found if s.stop - s.start >= FEWEST), key=lambda s: s.start)

    def span(self, a: int, b: int, viscous_per_s: float = 0.0) -> Span:
        """Samples a..b.  ``viscous_per_s``: viscous drag per spin inertia, by which the body's part of the rate decays."""
        t, u = self.t[a:b], np.abs(self.rate[a:b])
        if self.turning is not None and viscous_per_s > 0:
            u = u - np.sign(self.rate[a]) * followed(t, self.turning[a:b], viscous_per_s)
        return Span(t - 0.5 * (t[0] + t[-1]), u, self.quantum)

    def _fitted(self, a: int, b: int):
        p = self.span(a, b)
        x, inverse, (r,) = fit_coasts([p])
        if self.turning is not None:
            p = self.span(a, b, float(x[1]))
            x, inverse, (r,) = fit_coasts([p])
        return p, x, inverse, r, own_noise(p.u, p.s)

    def obeys(self, a: int, b: int) -> bool:
        """Whether samples a..b follow the law of a coast to within their noise, or a bearing's own ways."""
        p, _, _, r, noise = self.fitted(a, b)
        fall = float(p.u[0] - r[0] - (p.u[-1] - r[-1]))
        sample = float(np.hypot(noise, self.quantum / np.sqrt(12)))
        if fall < _LEAST_FALL * sample or fall <= 1e-6 * abs(p.u[0]):
            return False
        own_ways = _OWN_WAYS * fall
        far = np.abs(r) > _FAR * sample + own_ways
        if far.sum() > max(1, 0.02 * len(r)) or far[:2].any() or far[-2:].any():
            return False
        total, freedom, largest = slow_misfit([p], [np.where(far, 0.0, r)], noise)
        return largest < own_ways or total < scipy.special.chdtri(freedom, _CHANCE)

    def falls(self, a: int, b: int) -> bool:
        """Whether the wheel is slower in the second half by more than noise does."""
        p = self.span(a, b)
        noise = float(np.hypot(own_noise(p.u, p.s), self.quantum / np.sqrt(12)))
        half = len(p.u) // 2
        fall = float(p.u[:half].mean() - p.u[half:].mean())
        return fall > 10 * noise / np.sqrt(half) and fall > 1e-6 * float(p.u.max())

    def is_bearing(self, a: int, b: int) -> bool:
        """Whether the course is curved as viscous drag has it: a motor, or a steady torque, makes straight ones."""
        p, x, inverse, r, noise = self.fitted(a, b)
        total, freedom, _ = slow_misfit([p], [r], noise)
        scatter = max(float(np.std(r)), noise) * np.sqrt(max(total / freedom, 1.0))
        sigma_b = scatter * float(np.sqrt(inverse[1, 1]))
        fastest = float(p.u.max())
        share = x[1] * fastest / (x[0] + x[1] * fastest)
        # rounding makes a straight line 'curved' where there is no noise at all
        seen = x[1] * np.ptp(p.s) > 1e-3
        return bool(seen and x[1] > _CURVED * sigma_b and _SHARE[0] < share < _SHARE[1])

    def found(self) -> list[tuple[int, int]]:
        """All stretches that obey the law, grown as far as they do; of two that overlap, the longer one."""
        grown: list[tuple[int, int]] = []
        for stretch in self.stretches():
            a = stretch.start
            while a + FEWEST <= stretch.stop:
                if not self.obeys(a, a + FEWEST):
                    a += FEWEST // 2
                    continue
                # the sample on either side of a switch may just fall within the noise: it is left out
                b = _farthest(lambda b, a=a: self.obeys(a, b), a + FEWEST, stretch.stop)
                end = b - 1 if b < stretch.stop else b
                start = -_farthest(lambda x, end=end: self.obeys(-x, end), -a, -stretch.start)
                grown.append((start + 1 if start > stretch.start else start, end))
                a = b
        kept: list[tuple[int, int]] = []
        for a, b in sorted(grown, key=lambda k: k[0] - k[1]):
            if b - a >= FEWEST and all(b <= c or a >= d for c, d in kept):
                kept.append((a, b))
        return sorted(kept)


def _farthest(good, start: int, limit: int) -> int:
    """The farthest end up to which ``good`` holds, by doubling strides and then halving them."""
    end, stride = start, FEWEST // 2
    while end < limit:
        ahead = min(end + stride, limit)
        if not good(ahead):
            break
        end, stride = ahead, 2 * stride
    while stride > 1:
        stride //= 2
        ahead = min(end + stride, limit)
        if ahead > end and good(ahead):
            end = ahead
    return end


def common_law(finder: Finder, spans: list[tuple[int, int]], found_by: str) -> Coasting:
    """One drag law for all run-downs of a wheel, each with a start rate of its own; and the law of each by itself."""
    law, keep, fits = _law(finder, spans)
    found = []
    for (a, b), k, fit in zip(spans, keep, fits, strict=True):
        fit = np.sign(finder.rate[a]) * fit
        alone = law if len(spans) == 1 else _law(finder, [(a, b)])[0]
        found.append(RunDown(
            float(finder.t[a]), float(finder.t[b - 1]), float(fit[0]), float(fit[-1]), found_by,
            finder.t[a:b][k], finder.rate[a:b][k], fit[k], alone,
        ))  # fmt: skip
    return Coasting(law, tuple(found))


def _law(finder: Finder, spans: list[tuple[int, int]]) -> tuple[Law, list[np.ndarray], list[np.ndarray]]:
    """The law of some spans together; of each which samples are used, and |rate| by the law."""
    parts = [finder.span(a, b) for a, b in spans]
    if finder.turning is not None:
        viscous_per_s = float(fit_coasts(parts)[0][1])
        parts = [finder.span(a, b, viscous_per_s) for a, b in spans]
    keep = [np.ones(len(p.s), bool) for p in parts]
    for _ in range(5):
        used = [replace(p, s=p.s[k], u=p.u[k]) for p, k in zip(parts, keep, strict=True)]
        x, inverse, residuals = fit_coasts(used)
        sizes = np.concatenate(residuals)
        sigma = float(np.sqrt(np.sum(sizes**2) / max(len(sizes) - len(x), 1)))
        limit = _FAR * max(robust_sigma(sizes), finder.quantum / np.sqrt(12))
        again = [np.abs(p.u - coast(p.s, m, x[0], x[1])) <= limit if limit > 0 else k
                 for p, m, k in zip(parts, x[2:], keep, strict=True)]  # fmt: skip
        if all(np.array_equal(k, n) for k, n in zip(keep, again, strict=True)) or min(map(np.sum, again)) < FEWEST // 2:
            break
        keep = again
    total, freedom, _ = slow_misfit(used, residuals, sigma)
    # a chi square of this size is still chance, and widening for it would make the band too wide on average
    widened = total / freedom if total > scipy.special.chdtri(freedom, 0.01) else 1.0
    rate = float(np.mean(np.concatenate([p.u for p in used])))
    law = Law(x[:2], widened * sigma**2 * inverse[:2, :2], rate, widened)
    return law, keep, [coast(p.s, m, x[0], x[1]) for p, m in zip(parts, x[2:], strict=True)]
