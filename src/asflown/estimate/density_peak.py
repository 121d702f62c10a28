"""The peak of a plume: from jets near the known sources, and a remainder that is free.

A smoothed curve has its peak early where the density rises slowly to a cusp and falls fast after: no smooth prior knows of
cusps.  Here the density is, as near as the data ask,

    rho = sum_j K_j (R/r_j)^1.5 exp(-(theta_j/w)^n)  +  remainder

with every choice of the sources, their common width w and exponent n, all of them leaning by one angle or by none, and a
remainder that is a Gaussian process of a share of the density's own size up to some altitude, and of all of it above: jets
of this form need not hold far out.  One choice is no jets at all and the smooth density.  Densities K are linear and not negative, so each choice has
its evidence in closed form; peaks are those of densities drawn from all of them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..dynamics.flyby import Flyby
from ..dynamics.plume import FARTHEST_M, Jet, jet_density
from .whitened import AxisData, Regression, regression

POWERS = (1.0, 1.4, 2.0)
WIDTHS_RAD = np.geomspace(0.1, 1.2, 24)
#: By how much all sources may lean from where they are said to stand; half of the prior is on none. [rad]
LEANS_RAD = np.radians(np.arange(-10, 10.1, 1))
#: Remainders as shares of the density thereabouts, and up to which altitudes the jets hold. [m]
SHARES, HOLDS_M = (0.03, 0.1, 0.3), (700e3, 1000e3, FARTHEST_M)
#: Of jets in one choice; of the span around closest approach; of nodes; of the drawn curves; of "thereabouts". [s]
_MOST, _SPAN_S, _NODE_S, _FINE_S, _NEARBY_S = 3, (-60.0, 160.0), 0.5, 0.1, 10.0
_DRAWS = 400


@dataclass(frozen=True)
class DrawnPeaks:
    """Time from closest approach [s] and density [kg/m3] of the peak of every drawn curve, (K,); how likely jets are, and each exponent."""

    time_s: np.ndarray
    density_kgm3: np.ndarray
    jets_probability: float
    powers: dict[str, float]
    leaning_probability: float

    def record(self) -> dict:
        return {
            "draws": len(self.time_s), "jets_probability": self.jets_probability, "power_probability": self.powers,
            "leaning_probability": self.leaning_probability,
        }  # fmt: skip


def draw_peaks(
    axes: Sequence[AxisData], per_density: Sequence, flyby: Flyby, sources: Sequence[Jet], closest_s: float, seed: int = 0
) -> DrawnPeaks:  # fmt: skip
    """Peaks drawn from the posterior.

    ``axes``: every axis that gas turns; ``per_density``: of each, the torque per density at times from closest approach (a
    callable, (N,) -> (N,)); ``closest_s``: from the telemetry's epoch."""
    rng = np.random.default_rng(seed)
    nodes = _nodes()
    shapes, sizes = _shapes(flyby, tuple(sources))
    answers = [a.answers(nodes + closest_s) for a in axes]
    factors = [k(nodes) for k in per_density]
    local = [_local(a.smooth_torque(), a.time_s) for a in axes]
    largest = max(
        float(np.max(s / np.maximum(np.abs(k(a.time_s - closest_s)), 1e-300)))
        for s, k, a in zip(local, per_density, axes, strict=True)
    )
    some = [list(c) for n in range(1, min(len(sources), _MOST) + 1) for c in combinations(range(len(sources)), n)]
    ways = [(share, hold) for hold in HOLDS_M for share in SHARES] + [(1.0, 0.0)]
    score = []  # (ways, exponents and leans, widths, choices); the last choice: no jets
    for share, hold in ways:
        fits = _regressions(axes, answers, nodes, closest_s, local, flyby, share, hold)
        score.append(_evidence(fits, factors, shapes, some, largest))
    log = np.array(score)
    p = np.exp(log - log.max())
    p /= p.sum()
    drawn = np.stack(np.unravel_index(rng.choice(p.size, _DRAWS, p=p.ravel()), p.shape), axis=1)
    fine = np.arange(nodes[0], nodes[-1], _FINE_S)
    tops = []
    for w in np.unique(drawn[:, 0]):
        mine = drawn[drawn[:, 0] == w]
        fits = _regressions(axes, answers, nodes, closest_s, local, flyby, *ways[w])
        tops.append(
            _tops(
                fits,
                factors,
                shapes,
                sizes,
                [some[i] if i < len(some) else [] for i in mine[:, 3]],
                mine,
                largest,
                flyby,
                sources,
                per_density,
                closest_s,
                fine,
                rng,
            )
        )
    times, heights = np.concatenate(tops).T
    powers = p[..., :-1].sum(axis=(0, 2, 3)).reshape(len(POWERS), len(LEANS_RAD))
    return DrawnPeaks(
        times, heights, float(powers.sum()), {f"{n:g}": float(v) for n, v in zip(POWERS, powers.sum(axis=1), strict=True)},
        float(powers[:, LEANS_RAD != LEANS_RAD[len(LEANS_RAD) // 2]].sum()),
    )  # fmt: skip


def _nodes() -> np.ndarray:
    return np.arange(_SPAN_S[0], _SPAN_S[1] + _NODE_S / 2, _NODE_S)


def _jet(jet: Jet, flyby: Flyby, time_s, n: float, lean: float, width: float) -> np.ndarray:
    return jet_density(
        replace(jet, density_kgm3=1.0, width_rad=width, tilt_rad=jet.tilt_rad + lean), flyby, time_s, power=n
    )


@lru_cache(maxsize=4)
def _shapes(flyby: Flyby, sources: tuple[Jet, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Jets of height one at the nodes, (exponents and leans, widths, J, C), and their heights at unit density."""
    nodes = _nodes()
    shapes = np.array(
        [
            [[_jet(j, flyby, nodes, n, lean, w) for j in sources] for w in WIDTHS_RAD]
            for n in POWERS
            for lean in LEANS_RAD
        ]
    )
    sizes = np.maximum(shapes.max(axis=-1), 1e-300)
    return shapes / sizes[..., None], sizes


def _local(torque: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Size of a torque thereabouts. (N,)"""
    return np.sqrt(gaussian_filter1d(torque**2, _NEARBY_S / float(np.mean(np.diff(time_s))), mode="nearest"))


def _regressions(axes, answers, nodes, closest_s, local, flyby: Flyby, share: float, hold: float) -> list[Regression]:
    found = []
    for axis, seen, size in zip(axes, answers, local, strict=True):
        near = flyby.altitude(axis.time_s - closest_s) < hold
        found.append(regression(axis, nodes + closest_s, np.where(near, share, 1.0) * size, seen))
    return found


def _evidence(fits: list[Regression], factors, shapes, some, largest: float) -> np.ndarray:
    """Log of evidence times prior, (exponents and leans, widths, choices and none)."""
    W = np.concatenate([f.W * k for f, k in zip(fits, factors, strict=True)]) * largest
    y = np.concatenate([f.y for f in fits])
    base = sum(f.log_evidence for f in fits)
    seen = shapes.reshape(-1, shapes.shape[-1]) @ np.asarray(np.linalg.qr(W, mode="r")).T
    c = shapes @ (W.T @ y)
    seen = seen.reshape(*shapes.shape[:3], -1)
    GS = seen @ np.swapaxes(seen, -1, -2)
    choices = np.log(2 * shapes.shape[1] * len(POWERS) * len(some))
    lean = np.tile(np.where(LEANS_RAD == LEANS_RAD[len(LEANS_RAD) // 2], 0.0, -np.log(len(LEANS_RAD) - 1)), len(POWERS))
    log = np.full((*shapes.shape[:2], len(some) + 1), -np.inf)
    for i, ids in enumerate(some):
        M = GS[:, :, ids][:, :, :, ids] + np.eye(len(ids))  # heights: half-normal, of the largest density there is
        k = np.linalg.solve(M, c[:, :, ids, None])[..., 0]
        value = base + 0.5 * np.sum(c[:, :, ids] * k, axis=-1) - 0.5 * np.linalg.slogdet(M)[1] + len(ids) * np.log(2)
        log[:, :, i] = np.where((k >= 0).all(axis=-1), value - choices + lean[:, None], -np.inf)
    log[0, 0, -1] = base
    return log


def _tops(
    fits, factors, shapes, sizes, chosen, mine, largest, flyby, sources, per_density, closest_s, fine, rng
) -> np.ndarray:
    """Time and density of the peak of one curve for every choice drawn. (K, 2)"""
    W = np.concatenate([f.W * k for f, k in zip(fits, factors, strict=True)]) * largest
    y = np.concatenate([f.y for f in fits])
    at_nodes, curves = np.zeros((len(mine), W.shape[1])), np.zeros((len(mine), len(fine)))
    for row, ids in enumerate(chosen):
        if not ids:
            continue
        a, k = mine[row, 1:3]
        heights = _positive(W @ shapes[a, k, ids].T, y, rng)
        at_nodes[row] = largest * heights @ shapes[a, k, ids]
        n, lean = POWERS[a // len(LEANS_RAD)], LEANS_RAD[a % len(LEANS_RAD)]
        for i, h in zip(ids, heights, strict=True):
            curves[row] += largest * h / sizes[a, k, i] * _jet(sources[i], flyby, fine, n, lean, WIDTHS_RAD[k])
    extra, weight = np.zeros_like(curves), 0.0
    for f, k, of in zip(fits, factors, per_density, strict=True):
        t = f.axis.time_s - closest_s
        K = of(t)
        rest = f.remainders(at_nodes * k, rng)
        # a remainder of one axis is a density as far as that axis tells one: weighed by what it knows
        known = float(np.sum((f.W * k) ** 2))
        part = np.array([np.interp(fine, t, r / np.where(K == 0, np.inf, K)) for r in rest])
        extra, weight = extra + known * part, weight + known
    curves = curves + extra / weight
    near = flyby.altitude(fine) <= FARTHEST_M
    top = np.argmax(np.where(near, curves, -np.inf), axis=1)
    return np.column_stack([fine[top], curves[np.arange(len(curves)), top]])


def _positive(X: np.ndarray, y: np.ndarray, rng) -> np.ndarray:
    """Heights under their normal posterior, drawn again while one is negative; then the most probable ones."""
    precision = X.T @ X + np.eye(X.shape[1])
    mean = np.linalg.solve(precision, X.T @ y)
    root = np.linalg.cholesky(np.linalg.inv(precision))
    for _ in range(50):
        drawn = mean + root @ rng.standard_normal(len(mean))
        if (drawn >= 0).all():
            return drawn
    return np.maximum(mean, 0.0)
