"""The likelihood of a Gates model's two variances, its biases profiled out, and its maximum.

    y_i ~ N(x_i . beta, d_i + a + b v_i^2)      a, b: fixed and proportional variance; d: the orbit determination's

Restricted (REML), the likelihood has the biases integrated out, which takes away the sqrt((N - 2) / N) by which maximum
likelihood underestimates sigmas.  A two-dimensional pointing error becomes two rows, along the axes of its orbit
determination's ellipse: a + b v^2 is the same in all directions, so that the rows are independent.

Inside, y and v are in units of their own rms (of y with tracking).  The kernels take a row a measurement, (M,), and columns of the biases, (M, p).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...kit.compiled import jit

#: Variance below which nothing is told apart from nothing, in units of mean y^2.
_FLOOR = 1e-12
#: log density of one component of a Gaussian: half of this.
LOG_2PI = float(np.log(2 * np.pi))


@jit
def _evaluate(a, b, y, d, z, X, k, reml, prior, beta, out):
    """Objective (-log likelihood without constants); biases into ``beta``, gradient and expected Hessian into ``out``."""
    M, p = X.shape
    A = np.zeros((p, p))  # then its Cholesky factor, with one over the diagonal
    c, h = np.zeros(p), np.zeros(p)
    inverse = np.empty(M)
    f = 0.0
    for i in range(M):
        s = max(d[i] + a + b * z[i], _FLOOR)
        inverse[i] = 1 / s
        f += 0.5 * k[i] * np.log(s)
        w = k[i] * inverse[i]
        for j in range(p):
            wx = w * X[i, j]
            c[j] += wx * y[i]
            for q in range(j + 1):
                A[j, q] += wx * X[i, q]
    for j in range(p):
        for q in range(j + 1):
            t = A[j, q]
            for m in range(q):
                t -= A[j, m] * A[q, m]
            if j == q:
                root = np.sqrt(max(t, 1e-14 * A[j, j]))  # of burns all of one size: either bias does, neither is known
                A[j, j] = 1 / root
                if reml:
                    f += np.log(root)
            else:
                A[j, q] = t * A[q, q]
    for j in range(p):
        t = c[j]
        for m in range(j):
            t -= A[j, m] * c[m]
        c[j] = t * A[j, j]
    for j in range(p - 1, -1, -1):
        t = c[j]
        for m in range(j + 1, p):
            t -= A[m, j] * beta[m]
        beta[j] = t * A[j, j]
    ga, gb, haa, hab, hbb = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(M):
        r = y[i]
        for j in range(p):
            r -= X[i, j] * beta[j]
        w = k[i] * inverse[i]
        f += 0.5 * w * r * r
        curve = 0.5 * w * inverse[i]
        slope = 0.5 * w - curve * r * r
        if reml:  # less the diagonal of the hat matrix
            for j in range(p):
                t = X[i, j]
                for m in range(j):
                    t -= A[j, m] * h[m]
                h[j] = t * A[j, j]
                slope -= curve * h[j] * h[j]
        ga += slope
        gb += slope * z[i]
        haa += curve
        hab += curve * z[i]
        hbb += curve * z[i] * z[i]
    if prior[1] > 0:
        root = np.sqrt(max(a, 1e-10))
        f += 0.5 * ((root - prior[0]) / prior[1]) ** 2
        ga += 0.5 * (1 - prior[0] / root) / prior[1] ** 2
        haa += 0.25 * prior[0] / root**3 / prior[1] ** 2
    if prior[3] > 0:
        root = np.sqrt(max(b, 1e-10))
        f += 0.5 * ((root - prior[2]) / prior[3]) ** 2
        gb += 0.5 * (1 - prior[2] / root) / prior[3] ** 2
        hbb += 0.25 * prior[2] / root**3 / prior[3] ** 2
    out[0], out[1], out[2], out[3], out[4] = ga, gb, haa, hab, hbb
    return f


@jit
def _descend(a, b, free_a, free_b, y, d, z, X, k, reml, prior, beta, out):
    """From one start to a minimum, by scoring steps kept at or above zero.  Returns a, b and the objective."""
    f = _evaluate(a, b, y, d, z, X, k, reml, prior, beta, out)
    for _ in range(200):
        ga, gb, haa, hab, hbb = out[0], out[1], out[2], out[3], out[4]
        move_a = free_a and not (a <= 0 and ga >= 0)
        move_b = free_b and not (b <= 0 and gb >= 0)
        if move_a and move_b:
            determinant = haa * hbb * (1 + 1e-9) - hab * hab
            da = -(hbb * ga - hab * gb) / determinant
            db = -(haa * gb - hab * ga) / determinant
        elif move_a:
            da, db = -ga / haa, 0.0
        elif move_b:
            da, db = 0.0, -gb / hbb
        else:
            break
        step, better = 1.0, False
        for _try in range(40):
            na, nb = max(a + step * da, 0.0), max(b + step * db, 0.0)
            found = _evaluate(na, nb, y, d, z, X, k, reml, prior, beta, out)
            if found < f:
                better = True
                break
            step *= 0.5
        if not better:
            break
        gain = f - found
        still = abs(na - a) <= 1e-9 * (na + 1e-9) and abs(nb - b) <= 1e-9 * (nb + 1e-9)
        a, b, f = na, nb, found
        if gain < 1e-9 or still:
            break
    return a, b, f


@jit
def _minimum(starts, free_a, free_b, y, d, z, X, k, reml, prior, best_beta):
    """The least objective over several starts (S, 2).  Returns a, b, objective; biases into ``best_beta``."""
    beta, out = np.zeros(X.shape[1]), np.zeros(5)
    best_a, best_b, best = starts[0, 0], starts[0, 1], np.inf
    for n in range(starts.shape[0]):
        a, b, f = _descend(starts[n, 0], starts[n, 1], free_a, free_b, y, d, z, X, k, reml, prior, beta, out)
        if f < best - 1e-11:
            best_a, best_b, best = a, b, f
    best = _evaluate(best_a, best_b, y, d, z, X, k, reml, prior, best_beta, out)
    return best_a, best_b, best


@jit
def _refits(sets, starts, free_a, free_b, d, z, X, k, reml, prior):
    """The minimum of every row of ``sets`` (B, M): variances and biases, (B, 2 + p)."""
    found = np.empty((sets.shape[0], 2 + X.shape[1]))
    beta = np.zeros(X.shape[1])
    for n in range(sets.shape[0]):
        a, b, _ = _minimum(starts, free_a, free_b, sets[n], d, z, X, k, reml, prior, beta)
        found[n, 0], found[n, 1] = a, b
        found[n, 2:] = beta
    return found


@dataclass(frozen=True)
class Point:
    """Where the likelihood was looked at: sigmas and biases in the user's units, the objective, and the expected
    information (2, 2) of both variances in units of this problem."""

    fixed: float
    proportional: float
    beta: np.ndarray  # (p,)
    objective: float
    information: np.ndarray


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

    def weights(self, point: Point) -> np.ndarray:
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
        return *_minimum(starts, *free, self.y, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), beta), beta  # fmt: skip

    def _refitted(self, sets, starts, free):
        return _refits(sets, starts, *free, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior))

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
        _evaluate(a, b, self.y, self.d, self.v**2, self.X, self.k, self.reml, np.array(self.prior), scratch, out)
        roots = np.sqrt([a, b]) * self.units
        return Point(
            float(roots[0]),
            float(roots[1]),
            beta * self.bias_units,
            float(f),
            np.array([[out[2], out[3]], [out[3], out[4]]]),
        )

    def variances(self, point: Point) -> np.ndarray:
        """Variance of every row at a point, dimensionless, (M,)."""
        a, b = np.square([point.fixed, point.proportional] / self.units)
        return np.maximum(self.d + a + b * self.v**2, _FLOOR)

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
