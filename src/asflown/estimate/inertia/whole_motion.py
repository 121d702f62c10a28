"""Most likely tensor, momentum, outside torque and motion, given wheels, rates and attitude together.

Gauss-Newton: linearize about the motion found so far, filter and regress, smooth, move the motion; the noise levels
are the likeliest ones.  Steps of the acceleration are Student-t: every interval's own variance is reweighted, so that
the corner of a ramp does not stiffen or loosen the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import optimize

from ...kit.errors import BadInput
from ...kit.regressed import Disturbances, Filtered, Steps, run, smooth
from ...kit.rotations import rates_between
from .levels import Levels, first_levels
from .motion import WHEEL, Layout, Linearized, Motion, first_motion, instants, linearized
from .plain import _shifted, plain_fit

if TYPE_CHECKING:
    from .record import SlewRecord

#: Degrees of freedom of the acceleration's steps: tails for corners of ramps, and not so heavy that every step fits its own noise.
_FREEDOM = 5.0
#: Steps' variances settle slowly, each a little nearer: they go this much further than they would.
_STRIDE = 1.6
#: A corner is no looser than this: beyond it only rounding would show.
_LOOSEST = 1e10
#: What is assumed of time stamps and of the rates' bias: hardly anything. [s], [rad/s]
_SKEW_S, _BIAS = 10.0, 1e-3
#: The bias where no attitude shows it: then it turns the inertial axes themselves. [rad/s]
_BIAS_ALONE = 1e-5
#: A reading this many sigmas from what all others say of it is left out, and let in again below the second.
_OUT, _IN = 6.0, 4.0
#: In wheels' cadences, where single kicks tell all: a fit may slip from one reading of a kick to the next.
_SKEW_KICKED = 0.25
_SKEWS_TRIED = np.arange(-8.0, 8.01, 0.5)
_MOST_ROUNDS = 20
#: Sigmas the answer may still move by in the last round.
_SETTLED = 0.05
#: From this round on the constants are so nearly right that levels are fitted with them held, three times faster.
_NEARLY = 3
_TURNS = 8  # of the first round, in which the corners are found
#: Factors by which one search may move a level; ten for the others.
_REACH = {"jerk": 100.0, "kick": 100.0, "wander": 100.0, "coloured_s": 3.0}
_LONGEST_S = 300.0
#: Steps of momentum: tried at so many readings, then between the best one's neighbours, so many in one pass; not nearer to an
#: arc's ends than so many readings.
_STEPS_TRIED, _STEPS_BETWEEN, _STEPS_AT_ONCE, _FEWEST_BESIDE = 120, 11, 20, 10
#: Steps that the noise levels are fitted on, where there are more.
_ENOUGH = 2000


@dataclass(frozen=True)
class SlewFit:
    """The answer: beta (p,) with its random covariance, and its slope in the two scale errors (p, 2)."""

    record: SlewRecord
    layout: Layout
    beta: np.ndarray
    moved: np.ndarray  # by how much in the last round
    covariance: np.ndarray
    by_scale: np.ndarray  # beta per unit error of the wheels' spin inertia, and of the rates' scale
    levels: Levels
    motion: Motion
    model: Linearized
    smoothed: Disturbances
    kept: np.ndarray  # (M,) bool
    loosened: np.ndarray
    rounds: int
    converged: bool

    @property
    def residual(self) -> np.ndarray:
        """What every reading differs from the smoothed motion by, in its own unit. (M,)"""
        z = self.model
        departure = self.smoothed.mean
        step = np.repeat(np.arange(len(z.start) - 1), np.diff(z.start))
        return z.y - z.Z[:, : self.layout.size] @ self.moved - np.sum(z.H * departure[step], axis=1)


def fit_slews(record: SlewRecord, *, frame: str = "body", prior: tuple[np.ndarray, np.ndarray] | None = None,
              seen: np.ndarray | None = None, wander: bool = False, levels: Levels | None = None,
              progress=None) -> SlewFit:  # fmt: skip
    """``prior``: mean (6,) and information (6, 6) of the tensor's elements, None for none; ``seen`` (3, 3): projector
    onto the directions of the slews, where they are not all; ``wander``: whether the total momentum walks, under
    outside torques that vary.  ``levels``: known noise levels; fitted unless given.

    Raises BadInput where the record tells nothing of the tensor."""
    layout = Layout.of(record)
    tell = progress or (lambda text: None)
    beta, motion = _start(record, layout, wander)
    skew = _SKEW_KICKED * _cadence(record) if wander else _SKEW_S
    weight, centre = _priors(layout, prior, skew)
    if prior is not None:
        beta[layout.TENSOR] = prior[0]  # plain least squares has nothing to say where the slews do not
    first = first_levels(record)
    first = replace(first, **{n: max(getattr(first, n), 2 * v) for n, v in _floors(record).items()})
    if wander:
        first = replace(first, kick=first.rate, wander=first.wheel * float(np.median(record.momentum.unit)))
    fitted = levels or first
    loosened, last, converged = np.ones((len(motion.time_s), 6 if wander else 3)), motion, False
    readings = np.ones(len(record.momentum.time_s) + len(record.rates.time_s) + 3 * len(record.attitude.time_s), bool)
    for rounds in range(1, _MOST_ROUNDS + 1):
        tell(f"round {rounds}")
        motion = motion.at(instants(record, layout, beta))
        model = linearized(record, layout, beta, motion, frame, first, np.eye(3) if seen is None else seen)
        loosened = carried(loosened, last, motion)
        last, before, kept = motion, fitted, readings[model.place]
        around = (weight, centre - beta) if rounds < _NEARLY else None
        for turn in range(_TURNS if rounds == 1 else 2):
            # corners first: a level fitted before they are loose takes them for noise
            loosened, kept = _reweighted(model, fitted, loosened, kept, around, outliers=rounds > 2 and not wander)
            if levels is None and (rounds > 1 or turn >= _TURNS - 2):
                fitted = _likeliest(model, fitted, loosened, kept, around)
        readings[model.place] = kept
        steps = model.at(fitted, loosened, kept)
        f = run(steps)
        delta, covariance, by_scale = solved(f, layout, weight, centre - beta)
        s = smooth(steps, f, np.append(delta, [0.0, 0.0]))
        moved = np.max(np.abs(delta) / np.sqrt(np.diag(covariance)))
        settled = moved < 0.5 * _SETTLED and (levels is not None or _near(before, fitted))
        if settled or rounds == _MOST_ROUNDS:
            converged = bool(moved < _SETTLED)
            break
        motion, beta = motion.moved(s.mean), beta + delta
    return SlewFit(
        record,
        layout,
        beta + delta,
        delta,
        covariance,
        by_scale,
        fitted,
        motion,
        model,
        s,
        kept,
        loosened,
        rounds,
        converged,
    )


def momentum_step(fit: SlewFit, prior=None) -> tuple[float, float]:
    """Where the total momentum most likely stepped, and that step's square in its own covariance (chi square of 3).

    As if a step were let in at each of many instants in turn, motion and levels held: all in one filter pass, then again
    between the neighbours of the best, down to the wheels' cadence.  Residuals would not show it: rates and coloured
    attitude error give way first."""
    away = _priors(fit.layout, prior, _SKEW_S)
    momentum, cadence = fit.record.momentum, _cadence(fit.record)
    best = 0.0, 0.0
    for arc, (_, stop) in enumerate(fit.record.arcs):
        times = np.unique(momentum.time_s[momentum.arc == arc])
        if len(times) <= 2 * _FEWEST_BESIDE:
            continue
        inside = times[_FEWEST_BESIDE : len(times) - _FEWEST_BESIDE]
        low, high = inside[0], min(inside[-1], stop)
        tried = np.unique(
            inside[np.linspace(0, len(inside) - 1, _STEPS_TRIED).astype(int)]
        )  # denser where readings are
        while True:
            squares = _steps_told(fit, arc, tried, away)
            k = int(np.argmax(squares))
            best = max(best, (float(squares[k]), float(tried[k])))
            around = tried[max(k - 1, 0)], tried[min(k + 1, len(tried) - 1)]
            if around[1] - around[0] <= 2 * cadence:
                break
            tried = np.linspace(max(around[0], low), min(around[1], high), _STEPS_BETWEEN)
    return best[1], best[0]


def _steps_told(fit: SlewFit, arc: int, at_s: np.ndarray, away) -> np.ndarray:
    """Chi square of a step of an arc's momentum at each instant (K,), each alone."""
    z, p, momentum = fit.model, fit.layout.size, fit.record.momentum
    steps = z.at(fit.levels, fit.loosened, fit.kept)
    wheels = np.flatnonzero(z.kind == WHEEL)
    when = np.where(momentum.arc == arc, momentum.time_s, -np.inf)[z.source[wheels]]
    squares = []
    for group in np.array_split(at_s, np.ceil(len(at_s) / _STEPS_AT_ONCE)):
        extra = np.zeros((len(z.y), 3 * len(group)))
        extra[wheels] = (z.Z[wheels, fit.layout.momentum(arc)][:, None] * (when[:, None] >= group)[:, :, None]).reshape(
            len(wheels), -1
        )
        f = run(replace(steps, Z=np.column_stack([z.Z[:, :p], extra])))
        told = f.information
        delta, _, slope = solved(f, fit.layout, away[0], away[1] - z.beta)
        score = told[p + 1 :, 0] - told[p + 1 :, 1 : p + 1] @ delta
        information = told[p + 1 :, p + 1 :] - told[p + 1 :, 1 : p + 1] @ slope
        for k in range(len(group)):
            own = slice(3 * k, 3 * k + 3)
            squares.append(score[own] @ np.linalg.solve(information[own, own], score[own]))
    return np.array(squares)


def _priors(layout: Layout, prior, skew_s: float):
    weight, centre = np.zeros((layout.size, layout.size)), np.zeros(layout.size)
    for k in (layout.skew_wheels, layout.skew_rates):
        if k is not None:
            weight[k, k] = 1 / skew_s**2
    if layout.bias is not None:
        weight[layout.bias, layout.bias] = np.eye(3) / (_BIAS if layout.skew_rates is not None else _BIAS_ALONE) ** 2
    if prior is not None:
        centre[layout.TENSOR], weight[layout.TENSOR, layout.TENSOR] = prior
    return weight, centre


def _cadence(record: SlewRecord) -> float:
    return float(np.median(np.diff(np.unique(record.momentum.time_s))))


def solved(f: Filtered, layout: Layout, weight: np.ndarray, away: np.ndarray):
    """Least squares of the innovations with the prior: beta, covariance, slope in the scales."""
    p, everything = layout.size, f.information
    lam = everything[1 : p + 1, 1 : p + 1] + weight
    if not np.isfinite(everything).all():
        raise BadInput(
            "the fit of the slews broke down: the telemetry's numbers are not those of one motion",
            remedy="Check units and time stamps (asflown telemetry check), or narrow the window (--start, --stop).",
        )
    size = np.sqrt(np.maximum(np.diag(lam), 1e-300))
    inverse = np.linalg.pinv(lam / np.outer(size, size), rcond=1e-14, hermitian=True) / np.outer(size, size)
    delta = inverse @ (everything[1 : p + 1, 0] + weight @ away)
    return delta, inverse, inverse @ everything[1 : p + 1, p + 1 :]


def _likeliest(model: Linearized, levels: Levels, loosened, kept, around) -> Levels:
    """Levels of the largest likelihood, the constants at their best for each, or held where ``around`` is None."""
    part = _excerpt(model, loosened, kept)
    floor = _floors(model.record)
    floor |= {n: 1e-14 for n in ("kick", "wander") if getattr(levels, n) > 0}
    names = list(floor)
    first = np.array([max(getattr(levels, n), 1.001 * floor[n]) for n in names])

    def cost(logs):
        trial = replace(levels, **dict(zip(names, np.exp(logs), strict=True)))
        value, slope = _cost(*part, trial, around)
        if "coloured_s" in names:
            h = 0.02
            other = replace(trial, coloured_s=trial.coloured_s * np.exp(h))
            slope["coloured_s"] = (_cost(*part, other, around, slopes=False)[0] - value) / h
        return value, np.array([slope[n] for n in names])

    reach = np.log([_REACH.get(n, 10.0) for n in names])  # of one call; a far step of the search would end in rounding
    low, high = np.maximum(np.log(first) - reach, np.log([floor[n] for n in names])), np.log(first) + reach
    if "coloured_s" in names:
        high[names.index("coloured_s")] = np.log(_LONGEST_S)
    best = optimize.minimize(cost, np.log(first), jac=True, method="L-BFGS-B", bounds=list(zip(low, high, strict=True)),
                             options={"maxiter": 6, "ftol": 1e-7})  # fmt: skip
    return replace(levels, **dict(zip(names, np.exp(best.x).tolist(), strict=True)))


def _floors(record: SlewRecord) -> dict[str, float]:
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


def _pass(steps: Steps, layout: Layout, around) -> tuple[Filtered, np.ndarray, float]:
    """The filter with the constants at their best about ``around`` (prior information, distance to its centre), or held
    (None); the constants' move, for all columns that were run; and what the prior takes off the log likelihood."""
    if around is None:
        return run(replace(steps, Z=steps.Z[:, :0])), np.empty(0), 0.0
    f = run(steps)
    beta, _, _ = solved(f, layout, *around)
    off = beta - around[1]
    return f, np.append(beta, [0.0, 0.0]), float(0.5 * off @ around[0] @ off)


def _cost(model: Linearized, loosened, kept, levels: Levels, around, slopes: bool = True):
    """Minus log likelihood, and its slope in the log of every level."""
    steps = model.at(levels, loosened, kept)
    f, whole, penalty = _pass(steps, model.layout, around)
    value = penalty - f.log_likelihood(whole)
    if not slopes:
        return value, {}
    s = smooth(steps, f, whole)
    noise = np.where(kept, s.by_noise, 0.0)
    slope = {name: -2 * noise[model.kind == k].sum() for k, name in enumerate(("wheel", "rate", "attitude"))}
    slope["jerk"] = -2 * s.by_drive[:, :3].sum()
    if model.walks == 2:
        slope["kick"] = -2 * s.by_drive[:, 3:6].sum()
    if model.coloured is not None:
        first = levels.coloured**2 * np.trace(s.by_first[model.coloured, model.coloured])
        slope["coloured"] = -2 * (s.by_drive[:, 3 * model.walks].sum() + first)
    if model.wander is not None:
        slope["wander"] = -2 * s.by_drive[:, -1].sum()
    return value, slope


def _excerpt(model: Linearized, loosened, kept):
    """The model's fastest part, where it is long: levels need no more."""
    N = len(model.start) - 1
    if N <= _ENOUGH:
        return model, loosened, kept
    energy = np.cumsum(np.sum(model.motion.omega_B**2, axis=1))
    first = int(np.argmax(energy[_ENOUGH:] - energy[:-_ENOUGH]))
    rows = slice(first, first + _ENOUGH)
    read = slice(model.start[first], model.start[first + _ENOUGH])
    part = replace(
        model, A=model.A[rows], b=model.b[rows], which=model.which[rows], start=model.start[first : first + _ENOUGH + 1] - read.start,
        H=model.H[read], y=model.y[read], Z=model.Z[read], kind=model.kind[read], unit=model.unit[read],
    )  # fmt: skip
    return part, loosened[rows], kept[read]


def _reweighted(model: Linearized, levels: Levels, loosened, kept, around, outliers: bool):
    """Each step's own variance by its posterior mean, Student-t; and which readings are out."""
    steps = model.at(levels, loosened, kept)
    f, whole, _ = _pass(steps, model.layout, around)
    s = smooth(steps, f, whole)
    parts = np.repeat([3, 2], 3)[: loosened.shape[1]]  # of a step: angle, rate, acceleration; angle, rate
    square = loosened * (parts + 2 * s.by_drive[:, : len(parts)])  # E[w^T Q^-1 w]
    wanted = (_FREEDOM + np.maximum(square, 0.0)) / (_FREEDOM + parts)
    loosened = np.minimum(loosened * (wanted / loosened) ** _STRIDE, _LOOSEST)
    if not outliers:
        return loosened, kept
    spread = s.error**2 - 2 * s.by_noise / steps.R  # of the pull: alone = pull / sqrt(spread)
    alone = np.abs(s.error) / np.sqrt(np.maximum(spread, 1e-300))
    sigma = np.sqrt(np.where(kept, steps.R, steps.R / 1e12))
    again = np.abs(steps.R * s.error) < _IN * sigma
    return loosened, np.where(kept, alone < _OUT, again)


def carried(loosened: np.ndarray, old: Motion, new: Motion) -> np.ndarray:
    """The same steps' variances on other instants."""
    return loosened[np.clip(np.searchsorted(old.time_s, new.time_s), 0, len(loosened) - 1)]


def _near(a: Levels, b: Levels) -> bool:
    return all(
        abs(np.log(getattr(b, n) / getattr(a, n))) < 0.03 for n in ("wheel", "rate", "attitude", "coloured")
    ) and (abs(b.wander - a.wander) <= 0.05 * a.wander)


def _start(record: SlewRecord, layout: Layout, quick: bool) -> tuple[np.ndarray, Motion]:
    """Plain least squares of momentum (001 eq 11, the momentum free), at the time offset that fits best."""
    beta = np.zeros(layout.size)
    if layout.skew_rates is not None:
        beta[layout.skew_rates] = _rates_late(record)
    late = {skew: plain_fit(record, layout, beta, skew, quick) for skew in _SKEWS_TRIED}
    least = min(left for _, left in late.values())
    skew = min(late, key=lambda s: (late[s][1] > 1.02 * least, abs(s)))
    beta = late[skew][0]
    motion = first_motion(_shifted(record, layout, beta), instants(record, layout, beta))
    return beta, motion


def _rates_late(record: SlewRecord) -> float:
    """By how much the rates' time stamps must be moved for them to match the attitude's, roughly. [s]"""
    tg, w = record.common_rates()
    mid, mean = rates_between(record.attitude.time_s, record.attitude.q_NB)
    misfit = {
        s: sum(np.sum((np.interp(mid, tg + s, w[:, j]) - mean[:, j]) ** 2) for j in range(3)) for s in _SKEWS_TRIED
    }
    least = min(misfit.values())
    return min((s for s in misfit if misfit[s] <= 1.02 * least), key=abs)
