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
import scipy

from . import kernel
from .kernel import FREEDOM
from .likelihood import Point, Problem


@cache
def scale_of(components: int) -> float:
    """c: the scale of the t that normal errors of one sigma are fitted by, a burn having so many components."""

    def excess(c: float) -> float:
        def pull(x):
            return scipy.stats.chi2.pdf(x, components) * (FREEDOM + components) * x / (FREEDOM * c * c + x)

        return scipy.integrate.quad(pull, 0, np.inf)[0] - components

    return float(scipy.optimize.brentq(excess, 0.3, 1.5))


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
        return *kernel.robust_minimum(starts, *free, self.y, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), self.burn, self._scale, beta), beta  # fmt: skip

    def _refitted(self, sets, starts, free):
        return kernel.robust_refits(sets, starts, *free, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), self.burn, self._scale)  # fmt: skip

    def weights(self, point: Point) -> np.ndarray:
        """What each burn counts beside a usual one, (N,): 1 + m / 4 at most, in the mean of a normal set about 1."""
        root = np.empty(len(self.y))
        a, b = np.square([point.fixed, point.proportional] / self.units)
        kernel.weigh(
            a, b, self.y, self.d, self.v**2, self.X, self.burn, self._scale, point.beta / self.bias_units, root
        )
        return np.square(root * self._scale)[np.unique(self.burn, return_index=True)[1]]

    def log_likelihood(self, point: Point) -> float:
        m = np.bincount(self.burn)
        m = m[m > 0]
        scale2 = self.variances(point) * (self._scale * self.size) ** 2
        tails = 0.5 * (FREEDOM + m) * np.log((FREEDOM + m) / (FREEDOM * self.weights(point)))
        norm = (
            scipy.special.gammaln((FREEDOM + m) / 2)
            - scipy.special.gammaln(FREEDOM / 2)
            - 0.5 * m * np.log(FREEDOM * np.pi)
        )
        return float(np.sum(norm - tails) - 0.5 * np.sum(np.log(scale2)))
