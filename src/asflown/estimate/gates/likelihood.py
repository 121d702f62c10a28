"""The likelihood of a Gates model's two variances, its biases profiled out, and its maximum.

    y_i ~ N(x_i . beta, d_i + a + b v_i^2)      a, b: fixed and proportional variance; d: the orbit determination's

Restricted (REML), the likelihood has the biases integrated out, which takes away the sqrt((N - 2) / N) by which maximum
likelihood underestimates sigmas.  A two-dimensional pointing error becomes two rows, along the axes of its orbit
determination's ellipse: a + b v^2 is the same in all directions, so that the rows are independent.

Inside, y and v are in units of their own rms (of y with tracking).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import kernel

#: log density of one component of a Gaussian: half of this.
LOG_2PI = float(np.log(2 * np.pi))


@dataclass(frozen=True)
class Point:
    """Where the likelihood was looked at: sigmas and biases in the user's units, the objective, and the expected
    information (2, 2) of both variances in units of this problem."""

    fixed: float
    proportional: float
    beta: np.ndarray  # (p,)
    objective: float
    information: np.ndarray

    @property
    def values(self) -> np.ndarray:
        """Fixed and proportional sigma, then the biases, (2 + p,)."""
        return np.array([self.fixed, self.proportional, *self.beta])


#: Of too few burns to look at all.
NOWHERE = Point(np.nan, np.nan, np.empty(0), np.nan, np.full((2, 2), np.nan))


@dataclass(frozen=True)
class Problem:
    """Errors of N burns in one or two components, ready for the kernels; dimensionless inside (see the module)."""

    y: np.ndarray  # (M,)
    d: np.ndarray  # (M,)
    v: np.ndarray  # (M,)
    X: np.ndarray  # (M, p): columns of 1 and v, per component
    k: np.ndarray  # (M,), exponents
    burn: np.ndarray  # (M,), which burn a row belongs to
    size: float  # [m/s] of one unit of y
    speed: float  # [m/s] of one unit of v
    bias_units: np.ndarray  # (p,): m/s for a fixed bias, m/s per m/s for a proportional one
    reml: bool = True
    prior: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # mean and width of both sigmas; width 0: none
    held: tuple[float | None, float | None] = (None, None)

    @classmethod
    def of(
        cls,
        error_mps,
        covariance,
        dv_mps,
        *,
        biased: bool,
        weight=None,
        reml=True,
        prior=(0, 0, 0, 0),
        held=(None, None),
    ):
        """``error_mps`` (N, c) with covariance (N, c, c), c = 1 or 2; ``weight`` (N,): exponents, then without covariance."""
        n, c = error_mps.shape
        values, axes = np.linalg.eigh(covariance)
        size = float(np.sqrt(np.mean(error_mps**2) + np.mean(np.clip(values, 0, None)))) or 1.0
        speed = float(np.sqrt(np.mean(dv_mps**2)))
        v = np.repeat(dv_mps / speed, c)
        along = axes.transpose(0, 2, 1)  # rows: axes of the ellipse
        y = np.einsum("nai,ni->na", along, error_mps).ravel() / size
        rows = along.reshape(n * c, c)
        X = np.stack([rows, rows * v[:, None]], axis=2).reshape(n * c, 2 * c) if biased else np.zeros((n * c, 0))
        k = np.ones(n * c) if weight is None else np.repeat(weight / np.mean(weight), c)
        d = np.zeros(n * c) if weight is not None else np.maximum(values.ravel(), 0) / size**2
        units = np.array([size, size / speed])
        m1, w1, m2, w2 = (float(x / u) for x, u in zip(prior, np.repeat(units, 2), strict=True))
        fixed, proportional = (None if h is None else float(h / u) for h, u in zip(held, units, strict=True))
        return cls(
            y, d, v, X, k, np.repeat(np.arange(n), c), size, speed, np.tile(units, X.shape[1] // 2), reml,
            (m1, w1, m2, w2), (fixed, proportional),
        )  # fmt: skip

    @property
    def normal(self) -> bool:
        """Whether errors are taken to be normal."""
        return True

    def weights(self, point: Point) -> np.ndarray:  # noqa: ARG002 - those of the robust likelihood depend on it
        """What each burn counts beside a usual one, (N,)."""
        return np.ones(len(np.unique(self.burn)))

    @property
    def units(self) -> np.ndarray:
        """Of fixed and proportional values: m/s, and m/s per m/s."""
        return np.array([self.size, self.size / self.speed])

    def without(self, burn: int) -> Problem:
        return self.only(self.burn != burn)

    def only(self, rows) -> Problem:
        cut: dict[str, Any] = {
            n: np.ascontiguousarray(getattr(self, n)[rows]) for n in ("y", "d", "v", "X", "k", "burn")
        }
        return replace(self, **cut)

    def minimum(
        self, *, fixed: float | None = None, proportional: float | None = None, near: Point | None = None
    ) -> Point:
        """The most likely point; a sigma given (user's units) or held stays where it is."""
        given = [
            g / u if g is not None else h for g, h, u in zip((fixed, proportional), self.held, self.units, strict=True)
        ]
        free = [g is None for g in given]
        return self._point(*self._maximised(self._starts(given, near), free))

    def _maximised(self, starts, free):
        """The kernel's variances, objective and biases."""
        beta = np.zeros(self.X.shape[1])
        return *kernel.minimum(starts, *free, self.y, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), beta), beta  # fmt: skip

    def _refitted(self, sets, starts, free):
        return kernel.refits(sets, starts, *free, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior))

    def _starts(self, given, near: Point | None) -> np.ndarray:
        """Inside, and from each edge: the likelihood may have a maximum on either."""
        spread = max(float(np.mean(self.y**2) - np.mean(self.d)), 0.05)
        starts = spread * np.array([[0.5, 0.5], [1.0, 1e-3], [1e-3, 1.0]])
        if near is not None:
            starts = np.vstack([np.square([near.fixed, near.proportional] / self.units), starts[1:]])
        for j, g in enumerate(given):
            if g is not None:
                starts[:, j] = g * g
        return np.ascontiguousarray(starts[:1] if None not in given else starts)

    def _point(self, a, b, f, beta) -> Point:
        out, scratch = np.zeros(5), np.zeros_like(beta)
        kernel.evaluate(a, b, self.y, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), scratch, out)
        roots = np.sqrt([a, b]) * self.units
        information = np.array([[out[2], out[3]], [out[3], out[4]]])
        return Point(float(roots[0]), float(roots[1]), beta * self.bias_units, float(f), information)

    def variances(self, point: Point) -> np.ndarray:
        """Variance of every row at a point, dimensionless, (M,)."""
        a, b = np.square([point.fixed, point.proportional] / self.units)
        return np.maximum(self.d + a + b * self.v**2, kernel.FLOOR)

    def bias_covariance(self, point: Point) -> np.ndarray:
        """Covariance of the biases at a point's sigmas, user's units, (p, p)."""
        w = self.k / self.variances(point)
        inverse = np.linalg.pinv(self.X.T @ (w[:, None] * self.X))
        return inverse * np.outer(self.bias_units, self.bias_units)

    def log_likelihood(self, point: Point) -> float:
        """Full log likelihood (not restricted, no prior) at a point, for densities per m/s."""
        s = self.variances(point)
        r = self.y - self.X @ (point.beta / self.bias_units)
        return float(np.sum(self.k * -0.5 * (LOG_2PI + np.log(s * self.size**2) + r * r / s)))

    def at(self, fixed: float, proportional: float, beta) -> Point:
        """A point of one's own choice; biases as many as the problem has."""
        p = self.X.shape[1]
        return Point(fixed, proportional, np.asarray(list(beta)[:p], float), np.nan, np.full((2, 2), np.nan))

    def refits(self, point: Point, count: int, rng: np.random.Generator) -> np.ndarray:
        """Fits of ``count`` sets drawn from a point's model: fixed, proportional and biases, (count, 2 + p)."""
        mean = self.X @ (point.beta / self.bias_units)
        sets = mean + np.sqrt(self.variances(point)) * rng.standard_normal((count, len(self.y)))
        return self.refit_all(sets, point)

    def refit_all(self, sets: np.ndarray, near: Point) -> np.ndarray:
        """Fits of sets of this problem's rows (B, M), dimensionless: fixed, proportional and biases, (B, 2 + p)."""
        free = [h is None for h in self.held]
        # without the first edge: of 4000 sets of 8 to 49 burns 0.1 % at most then miss a likelihood higher by up to 0.04
        starts = np.ascontiguousarray(self._starts(self.held, near)[::2])
        found = self._refitted(sets, starts, free)
        found[:, :2] = np.sqrt(found[:, :2]) * self.units
        found[:, 2:] *= self.bias_units
        return found
