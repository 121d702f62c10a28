"""A Gates model whose errors have the tails of Student's t: burns far out count less.

    y_i / (c s_i) ~ t(4),    s_i^2 = d_i + a + b v_i^2;    of pointing the bivariate t, one weight a burn

The scale of a t is less than the sigma of a normal set that it is fitted to; c is their ratio, so that s_i of clean sets is the
sigma that it is by the other likelihoods.  The maximum is found by turns (Lange, Little and Taylor 1989, "Robust
statistical modeling using the t distribution"): each burn's weight u = (4 + m) / (4 + q / c^2), from the squared distance
q of its m errors, then the normal likelihood with errors and columns of the biases times sqrt(u) / c.  The
restricted likelihood's own term takes the weights as given, which leaves up to 0.01 of the log likelihood.  Four degrees of
freedom are what they advise for small sets, where fitted ones are hardly told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import integrate, optimize, special, stats

from ...kit.compiled import jit
from .likelihood import _FLOOR, Point, Problem, _evaluate, _minimum

#: Degrees of freedom.
FREEDOM = 4.0


@cache
def scale_of(components: int) -> float:
    """c: the scale of the t that normal errors of one sigma are fitted by, a burn having so many components."""

    def excess(c: float) -> float:
        def pull(x):
            return stats.chi2.pdf(x, components) * (FREEDOM + components) * x / (FREEDOM * c * c + x)

        return integrate.quad(pull, 0, np.inf)[0] - components

    return float(optimize.brentq(excess, 0.3, 1.5))


@jit
def _weigh(a, b, y, d, z, X, burn, c, beta, root):
    """sqrt(u) / c of every row into ``root``.  Returns by what t's objective exceeds that of the normal one so weighted."""
    n = burn.max() + 1
    q, m, extra = np.zeros(n), np.zeros(n), 0.0
    for i in range(len(y)):
        r = y[i]
        for j in range(X.shape[1]):
            r -= X[i, j] * beta[j]
        q[burn[i]] += r * r / max(d[i] + a + b * z[i], _FLOOR) / c**2
        m[burn[i]] += 1
    for i in range(len(y)):
        root[i] = np.sqrt((FREEDOM + m[burn[i]]) / (FREEDOM + q[burn[i]])) / c
    for g in range(n):
        extra += 0.5 * (FREEDOM + m[g]) * (np.log1p(q[g] / FREEDOM) - q[g] / (FREEDOM + q[g]))
    return extra


@jit
def _robust(starts, free_a, free_b, y, d, z, X, k, reml, prior, burn, c, beta):
    """The most likely variances and the objective there; biases into ``beta``."""
    starts, root, out = starts.copy(), np.empty(len(y)), np.zeros(5)
    a, b, _ = _minimum(starts, free_a, free_b, y, d, z, X, k, reml, prior, beta)
    last = np.inf
    for _ in range(200):
        extra = _weigh(a, b, y, d, z, X, burn, c, beta, root)
        weighted, columns = y * root, X.copy()
        for j in range(X.shape[1]):
            columns[:, j] *= root
        f = extra + _evaluate(a, b, weighted, d, z, columns, k, reml, prior, beta, out)
        if abs(last - f) < 1e-9:
            break
        last = f
        starts[0, 0], starts[0, 1] = a, b
        a, b, _ = _minimum(starts, free_a, free_b, weighted, d, z, columns, k, reml, prior, beta)
    return a, b, f


@jit
def _robust_refits(sets, starts, free_a, free_b, d, z, X, k, reml, prior, burn, c):
    """The maximum of every row of ``sets`` (B, M): variances and biases, (B, 2 + p)."""
    found = np.empty((sets.shape[0], 2 + X.shape[1]))
    beta = np.zeros(X.shape[1])
    for n in range(sets.shape[0]):
        found[n, 0], found[n, 1], _ = _robust(starts, free_a, free_b, sets[n], d, z, X, k, reml, prior, burn, c, beta)
        found[n, 2:] = beta
    return found


@dataclass(frozen=True)
class RobustProblem(Problem):
    """What ``Problem`` is for normal errors."""

    @property
    def normal(self) -> bool:
        return False

    @property
    def _scale(self) -> float:
        return scale_of(int(np.bincount(self.burn).max()))

    def _maximised(self, starts, free):
        beta = np.zeros(self.X.shape[1])
        return *_robust(starts, *free, self.y, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), self.burn, self._scale, beta), beta  # fmt: skip

    def _refitted(self, sets, starts, free):
        return _robust_refits(sets, starts, *free, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), self.burn, self._scale)  # fmt: skip

    def weights(self, point: Point) -> np.ndarray:
        """What each burn counts beside a usual one, (N,): 1 + m / 4 at most, in the mean of a normal set about 1."""
        root = np.empty(len(self.y))
        a, b = np.square([point.fixed, point.proportional] / self.units)
        _weigh(a, b, self.y, self.d, self.v**2, self.X, self.burn, self._scale, point.beta / self.bias_units, root)
        return np.square(root * self._scale)[np.unique(self.burn, return_index=True)[1]]

    def log_likelihood(self, point: Point) -> float:
        m = np.bincount(self.burn)
        m = m[m > 0]
        scale2 = self.variances(point) * (self._scale * self.size) ** 2
        tails = 0.5 * (FREEDOM + m) * np.log((FREEDOM + m) / (FREEDOM * self.weights(point)))
        norm = special.gammaln((FREEDOM + m) / 2) - special.gammaln(FREEDOM / 2) - 0.5 * m * np.log(FREEDOM * np.pi)
        return float(np.sum(norm - tails) - 0.5 * np.sum(np.log(scale2)))
