"""How well a Gates model is known: intervals from the likelihood's profile, which at a bound become limits."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from .likelihood import Point, Problem

#: Sigmas are looked for up to this many times the scatter of the errors; beyond, an interval has no upper end.
_FARTHEST = 30.0
#: Of a 95 % interval: low and high, None where open.
Ends = tuple[float | None, float | None]


@cache
def _cuts() -> tuple[np.ndarray, np.ndarray]:
    """Twice the log likelihood ratio that 95 of 100 samples stay below, over the truth's distance from its bound (in sigma).

    An estimate that cannot be negative falls on its bound more often the nearer the truth is to it; the ratio's
    distribution then changes from chi-square with one degree of freedom (3.84, far away) to half of one and half of none
    (2.71, on the bound).  This is the ordering of Feldman and Cousins (1998) for a bounded Gaussian mean."""
    far = np.linspace(0.0, 4.0, 81)

    def accepted(cut, distance):
        root = np.sqrt(cut)
        if distance >= root:
            low = -root
        else:
            low = -np.inf if distance == 0 else (distance**2 - cut) / (2 * distance) - distance
        return scipy.stats.norm.cdf(root) - scipy.stats.norm.cdf(low) - 0.95

    return far, np.array([scipy.optimize.brentq(accepted, 1.0, 5.0, args=(x,)) for x in far])


def sigma_interval(problem: Problem, best: Point, which: int) -> Ends:
    """95 % interval of one sigma (0 fixed, 1 proportional); from zero where it is a limit, None where it has no end."""
    unit = problem.units[which]
    name = ("fixed", "proportional")[which]
    estimate = (best.fixed, best.proportional)[which]

    def beyond(sigma: float) -> float:
        """Twice the log likelihood ratio at a sigma, less what chance would give there."""
        at = problem.minimum(**{name: sigma}, near=best)
        return 2 * (at.objective - best.objective) - _cut(problem, at, which)

    low = 0.0
    if estimate > 0 and beyond(0.0) > 0:
        low = _crossing(beyond, estimate, 0.0, 1e-6 * estimate)
    inner, top = estimate, max(1.5 * estimate, 0.05 * unit)
    while beyond(top) < 0:
        inner, top = top, 1.6 * top
        if top > _FARTHEST * unit:
            return low, None
    high = _crossing(beyond, inner, top, 1e-6 * top)
    return float(low), float(high)


def _crossing(beyond, inside: float, outside: float, step: float) -> float:
    """Where ``beyond`` turns positive; ``inside`` where it already is there, as where many burns repeat one another to the
    digit and the likelihood has a spike beside the optimum that was found."""
    if beyond(inside) >= 0:
        return inside
    low, high = sorted((inside, outside))
    return float(scipy.optimize.brentq(beyond, low, high, xtol=step))


def _cut(problem: Problem, at: Point, which: int) -> float:
    """The ratio allowed by chance at a point, from the tested variance's distance to its bound in its own sigmas."""
    variance = (np.array([at.fixed, at.proportional])[which] / problem.units[which]) ** 2
    own, other, both = at.information[which, which], at.information[1 - which, 1 - which], at.information[0, 1]
    free = problem.held[1 - which] is None and (at.fixed, at.proportional)[1 - which] > 0
    known = own - both**2 / other if free else own
    return float(np.interp(variance * np.sqrt(max(known, 0.0)), *_cuts()))


def bias_intervals(problem: Problem, best: Point) -> list[Ends]:
    """95 % interval of every bias, from the profile of the full likelihood.

    The ratio allowed by chance is the exact one of a linear model with one unknown variance, log(1 + t^2 / (M - p)) M,
    which tends to 3.84 for many burns."""
    M, p = problem.X.shape
    if p == 0 or M <= p:
        return [(None, None)] * p
    t = scipy.stats.t.ppf(0.975, M - p)
    cut = M * np.log1p(t * t / (M - p))
    full = replace(problem, reml=False)
    top = full.minimum(near=best)
    spread = np.sqrt(np.diag(problem.bias_covariance(best)))
    return [_bias_interval(full, top, j, cut, float(t * spread[j])) for j in range(p)]


def _bias_interval(full: Problem, top: Point, j: int, cut: float, step: float) -> Ends:
    unit = full.bias_units[j]
    rest = replace(full, X=np.ascontiguousarray(np.delete(full.X, j, axis=1)), bias_units=np.delete(full.bias_units, j))

    def beyond(value: float) -> float:
        held = replace(rest, y=full.y - full.X[:, j] * (value / unit))
        return 2 * (held.minimum(near=top).objective - top.objective) - cut

    def end(way: float) -> float | None:
        inner, reach = top.beta[j], step
        for _ in range(12):
            outer = top.beta[j] + way * reach
            if beyond(outer) > 0:
                return _crossing(beyond, float(inner), float(outer), 1e-5 * step)
            inner, reach = outer, 1.5 * reach
        return None

    return end(-1.0), end(1.0)
