"""What a Gates model, fitted to a finite number of burns, says of a further one: mean, variance, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from ...maneuvers.model import Gates
    from .likelihood import Point, Problem


@dataclass(frozen=True)
class Foreseen:
    """The error of one burn in c components, before it is seen.

    ``covariance`` (c, c) holds execution, orbit determination and what the biases are uncertain by [m2/s2]; ``freedom``: degrees
    of freedom of the variance's estimate (infinite for a model taken as given)."""

    mean: np.ndarray  # (c,)
    covariance: np.ndarray
    freedom: float

    def distance2(self, error) -> float:
        """Squared distance of an error, in sigmas."""
        off = np.atleast_1d(error) - self.mean
        return float(off @ np.linalg.solve(self.covariance, off))

    def p_value(self, error) -> float:
        """How often chance alone goes as far, in whatever direction."""
        c, d2 = len(self.mean), self.distance2(error)
        return float(
            scipy.special.chdtrc(c, d2) if np.isinf(self.freedom) else scipy.special.fdtrc(c, self.freedom, d2 / c)
        )

    def z(self, error) -> float:
        """Of one component: signed, in sigmas.  Of two: the distance that chance goes as often in one."""
        if len(self.mean) == 1:
            return float((np.atleast_1d(error)[0] - self.mean[0]) / np.sqrt(self.covariance[0, 0]))
        return float(-scipy.special.ndtri(max(self.p_value(error), 1e-300) / 2))

    def score(self, error) -> float:
        """One component's z as a standard normal one, whatever the degrees of freedom."""
        z = self.z(error)
        return (
            z
            if np.isinf(self.freedom)
            else float(-np.sign(z) * scipy.special.ndtri(max(scipy.special.stdtr(self.freedom, -abs(z)), 1e-300)))
        )


def foresee(problem: Problem, point: Point, dv_mps: float, od_covariance) -> Foreseen:
    """What a fit says of a further burn.

    Degrees of freedom are Satterthwaite's: those of the variance at this size, which few burns may have told of."""
    od = np.atleast_2d(od_covariance)
    c = len(od)
    v = dv_mps / problem.speed
    g = np.array([1.0, v * v])
    a = np.square([point.fixed, point.proportional] / problem.units)
    own = float(g @ a) * problem.size**2
    mean, spread = np.zeros(c), np.zeros((c, c))
    if len(point.beta):
        at = np.kron(np.eye(c), [1.0, dv_mps])
        mean, spread = at @ point.beta, at @ problem.bias_covariance(point) @ at.T
    covariance = (own + 1e-12 * problem.size**2) * np.eye(c) + od + spread
    return Foreseen(mean, covariance, _freedom(problem, point, g, float(np.trace(covariance)) / c / problem.size**2))


def _freedom(problem: Problem, point: Point, g, total: float) -> float:
    """2 V^2 / var(V) of the variance V at a size, between 1 and what all burns together have."""
    most = float(len(problem.y) - problem.X.shape[1])
    free = [h is None for h in problem.held]
    information = point.information[np.ix_(free, free)]
    if not any(free):
        return np.inf
    g = g[free]
    uncertain = float(g @ np.linalg.pinv(information, hermitian=True) @ g)
    return float(np.clip(2 * total**2 / uncertain if uncertain > 0 else most, min(1.0, most), most))


def foresee_by(gates: Gates, dv_mps: float, od_covariance) -> Foreseen:
    """What a given model, its biases included, says of a burn: magnitude where ``od_covariance`` is (1, 1), pointing where (2, 2)."""
    od = np.atleast_2d(od_covariance)
    if len(od) == 1:
        sigma, mean = gates.sigma_magnitude(dv_mps), np.atleast_1d(gates.mean_magnitude(dv_mps))
    else:
        sigma, mean = gates.sigma_pointing(dv_mps), gates.mean_pointing(dv_mps)
    return Foreseen(mean, (float(sigma) ** 2 + 1e-18) * np.eye(len(od)) + od, np.inf)
