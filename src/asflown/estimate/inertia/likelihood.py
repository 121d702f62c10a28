"""Noise levels of the largest likelihood, and which readings count."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from ...kit.errors import BadInput
from ...kit.regressed import Disturbances, Filtered, Steps, run, smooth
from .linear import OUTLIER_VARIANCE, Linearized

if TYPE_CHECKING:
    from .levels import Levels
    from .motion import Layout
    from .record import SlewRecord

#: Degrees of freedom of the acceleration's steps: tails for corners of ramps, and not so heavy that every step fits its own noise.
_FREEDOM = 5.0
#: Steps' variances converge slowly; each change is overrelaxed by this power.
_STRIDE = 1.6
#: A corner is no looser than this: beyond it only rounding would show.
_LOOSEST = 1e10
#: A reading this many sigmas from what all others say of it is left out, and let in again below the second.
_OUT, _IN = 6.0, 4.0
#: Factors by which one search may move a level; ten for the others.
_REACH = {"jerk": 100.0, "kick": 100.0, "wander": 100.0, "slow": 100.0, "coloured_s": 3.0, "slow_s": 3.0}
#: Time constants fitted, and the bounds of each. [s]
_LASTS = {"coloured_s": (1.0, 300.0), "slow_s": (30.0, 3000.0)}
#: Steps that the noise levels are fitted on, where there are more.
_ENOUGH = 2000


class Around(NamedTuple):
    """Prior of the constants: its information (p, p), and the distance from the present values to its centre (p,)."""

    information: np.ndarray
    away: np.ndarray


@dataclass(frozen=True)
class Weighted:
    """A linearized model with the variance of each step's walk over the level's, (N, 3 walks), and which readings count, (M,)."""

    model: Linearized
    loosened: np.ndarray
    kept: np.ndarray

    def steps(self, levels: Levels) -> Steps:
        return self.model.at(levels, self.loosened, self.kept)

    def excerpt(self) -> Weighted:
        """The fastest part, where the model is long: levels need no more."""
        model = self.model
        N = len(model.start) - 1
        if N <= _ENOUGH or model.states.slow is not None:
            return self  # what is slow shows in the whole record only
        energy = np.cumsum(np.sum(model.about.motion.omega_B**2, axis=1))
        first = int(np.argmax(energy[_ENOUGH:] - energy[:-_ENOUGH]))
        rows = slice(first, first + _ENOUGH)
        read = slice(model.start[first], model.start[first + _ENOUGH])
        part = replace(
            model, A=model.A[rows], b=model.b[rows], which=model.which[rows], start=model.start[first : first + _ENOUGH + 1] - read.start,
            H=model.H[read], y=model.y[read], Z=model.Z[read], kind=model.kind[read], unit=model.unit[read],
        )  # fmt: skip
        return Weighted(part, self.loosened[rows], self.kept[read])


def smoothed(weighted: Weighted, levels: Levels, around: Around | None) -> tuple[Steps, Disturbances]:
    """The model at these levels, smoothed with the constants at their best, or held where ``around`` is None."""
    steps = weighted.steps(levels)
    f, whole, _ = _pass(steps, weighted.model.layout, around)
    return steps, smooth(steps, f, whole)


def corners_loosened(weighted: Weighted, s: Disturbances) -> Weighted:
    """Each step's own variance by its posterior mean, Student-t."""
    loosened = weighted.loosened
    parts = np.repeat([3, 2], 3)[: loosened.shape[1]]  # of a step: angle, rate, acceleration; angle, rate
    square = loosened * (parts + 2 * s.by_drive[:, : len(parts)])  # E[w^T Q^-1 w]
    wanted = (_FREEDOM + np.maximum(square, 0.0)) / (_FREEDOM + parts)
    return replace(weighted, loosened=np.minimum(loosened * (wanted / loosened) ** _STRIDE, _LOOSEST))


def outliers_sorted(weighted: Weighted, steps: Steps, s: Disturbances) -> Weighted:
    """Readings far from what all others say of them out, those that agree again in."""
    kept = weighted.kept
    spread = s.error**2 - 2 * s.by_noise / steps.R  # of the pull: alone = pull / sqrt(spread)
    alone = np.abs(s.error) / np.sqrt(np.maximum(spread, 1e-300))
    sigma = np.sqrt(np.where(kept, steps.R, steps.R / OUTLIER_VARIANCE))
    again = np.abs(steps.R * s.error) < _IN * sigma
    return replace(weighted, kept=np.where(kept, alone < _OUT, again))


def likeliest(weighted: Weighted, levels: Levels, around: Around | None) -> Levels:
    """Levels of the largest likelihood, the constants at their best for each, or held where ``around`` is None."""
    part = weighted.excerpt()
    floor = floors(part.model.about.record)
    floor |= {n: 1e-14 for n in ("kick", "wander", "slow") if getattr(levels, n) > 0}
    if levels.slow > 0:
        floor["slow_s"] = _LASTS["slow_s"][0]
    names = list(floor)
    first = np.array([max(getattr(levels, n), 1.001 * floor[n]) for n in names])

    def cost(logs):
        trial = replace(levels, **dict(zip(names, np.exp(logs), strict=True)))
        value, slope = _cost_and_slope(part, trial, around)
        h = 0.02
        for n in _LASTS.keys() & set(names):
            other = replace(trial, **{n: getattr(trial, n) * np.exp(h)})
            slope[n] = (_cost(part, other, around) - value) / h
        return value, np.array([slope[n] for n in names])

    reach = np.log([_REACH.get(n, 10.0) for n in names])  # of one call; a far step of the search would end in rounding
    low, high = np.maximum(np.log(first) - reach, np.log([floor[n] for n in names])), np.log(first) + reach
    for n in _LASTS.keys() & set(names):
        high[names.index(n)] = np.log(_LASTS[n][1])
    best = scipy.optimize.minimize(cost, np.log(first), jac=True, method="L-BFGS-B", bounds=list(zip(low, high, strict=True)),
                             options={"maxiter": 6, "ftol": 1e-7})  # fmt: skip
    return replace(levels, **dict(zip(names, np.exp(best.x).tolist(), strict=True)))


def floors(record: SlewRecord) -> dict[str, float]:
    """Levels that can be fitted, each with the least it may be: what rounding to counts makes, or a ten-millionth of
    the readings themselves, which is what is left of digits in a table without noise."""

    def least(stem, values):
        return max(record.counts[stem] / np.sqrt(12), 1e-7 * float(np.sqrt(np.mean(values**2))), 1e-14)

    floor = {"wheel": least("wheel_rate", record.momentum.value_Nms / record.momentum.unit), "jerk": 1e-14}
    if record.has_rates:
        floor["rate"] = least("body_rate", record.rates.value_rad_s)
    if record.has_attitude:
        floor |= {"attitude": 1e-9, "coloured": 1e-9, "coloured_s": 1.0}
    return floor


def solved(f: Filtered, layout: Layout, around: Around) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least squares of the innovations with the prior: beta, covariance, slope in the scales."""
    p, everything = layout.size, f.information
    lam = everything[1 : p + 1, 1 : p + 1] + around.information
    if not np.isfinite(everything).all():
        raise BadInput(
            "the fit of the slews diverged: the telemetry's numbers are not those of one motion",
            remedy="Check units and time stamps (asflown telemetry check), or narrow the window (--start, --stop).",
        )
    size = np.sqrt(np.maximum(np.diag(lam), 1e-300))
    inverse = np.linalg.pinv(lam / np.outer(size, size), rcond=1e-14, hermitian=True) / np.outer(size, size)
    delta = inverse @ (everything[1 : p + 1, 0] + around.information @ around.away)
    return delta, inverse, inverse @ everything[1 : p + 1, p + 1 :]


def _pass(steps: Steps, layout: Layout, around: Around | None) -> tuple[Filtered, np.ndarray, float]:
    """The filter with the constants at their best ``around`` a prior, or held (None); the constants' move, for all columns
    that were run; and what the prior takes off the log likelihood."""
    if around is None:
        return run(replace(steps, Z=steps.Z[:, :0])), np.empty(0), 0.0
    f = run(steps)
    beta, _, _ = solved(f, layout, around)
    off = beta - around.away
    return f, np.append(beta, [0.0, 0.0]), float(0.5 * off @ around.information @ off)


def information_criterion(weighted: Weighted, levels: Levels, around: Around, parameters: int) -> float:
    """Bayes's (BIC): twice the cost, with the steps' variances by their own prior, and ln M for each of the model's parameters."""
    x = weighted.loosened[1:]
    walk = _FREEDOM / 2 * float(np.sum(np.log(x) + 1 / x))
    return 2 * (_cost(weighted, levels, around) + walk) + parameters * float(np.log(len(weighted.kept)))


def _cost(weighted: Weighted, levels: Levels, around: Around | None) -> float:
    """Minus log likelihood."""
    f, whole, penalty = _pass(weighted.steps(levels), weighted.model.layout, around)
    return penalty - f.log_likelihood(whole)


def _cost_and_slope(weighted: Weighted, levels: Levels, around: Around | None) -> tuple[float, dict[str, float]]:
    """Minus log likelihood, and its slope in the log of every level but the coloured error's time constant."""
    model, steps = weighted.model, weighted.steps(levels)
    f, whole, penalty = _pass(steps, model.layout, around)
    s = smooth(steps, f, whole)
    noise = np.where(weighted.kept, s.by_noise, 0.0)
    slope = {name: -2 * noise[model.kind == k].sum() for k, name in enumerate(("wheel", "rate", "attitude"))}
    slope["jerk"] = -2 * s.by_drive[:, :3].sum()
    if model.walks == 2:
        slope["kick"] = -2 * s.by_drive[:, 3:6].sum()
    part = model.states.coloured
    if part is not None:
        first = levels.coloured**2 * np.trace(s.by_first[part, part])
        slope["coloured"] = -2 * (s.by_drive[:, 3 * model.walks].sum() + first)
    if model.states.wander is not None:
        slope["wander"] = -2 * s.by_drive[:, -1].sum()
    slow = model.states.slow
    if slow is not None:
        torque = slice(slow.start + 3, slow.stop)
        slope["slow"] = -2 * (s.by_drive[:, -1].sum() + levels.slow**2 * np.trace(s.by_first[torque, torque]))
    return penalty - f.log_likelihood(whole), slope
