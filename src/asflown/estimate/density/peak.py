"""The peak of a plume: from jets near the known sources, and a free remainder.

A smoothed curve has its peak early where the density rises slowly to a cusp and falls fast after: no smooth prior has
cusps.  Here the density is, as near as the data ask,

    rho = sum_j K_j (R/r_j)^1.5 exp(-(theta_j/w)^n)  +  remainder

with every choice of the sources, their common width w and exponent n, all of them leaning by one angle or by none, and a
remainder that is a Gaussian process of a share of the density's own size up to some altitude, and of all of it above: jets
of this form need not hold far out.  One choice is no jets at all and the smooth density.  Densities K are linear and not
negative, so each choice has its evidence in closed form; peaks are those of densities drawn from all of them together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.plume import FARTHEST_M, Jet, jet_density
from ..fused import AxisData, Regression, regression
from .axes import tells

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby

# The choices below are assumed; studies/plume_peak.py measures how well peaks come out with them.
POWERS = (1.0, 1.4, 2.0)
#: Steps of 2.6 %: of 11 % they are wider than the posterior, which then sits on one of them and says too little.
WIDTHS_RAD = np.geomspace(0.1, 1.2, 96)
#: By how much all sources may lean from where they are said to stand; half of the prior is on none. [rad]
LEANS_RAD = np.radians(np.arange(-10, 10.1, 1))
#: Remainders as shares of the density thereabouts, and up to which altitudes the jets hold. [m]
SHARES, HOLDS_M = (0.03, 0.1, 0.3), (700e3, 1000e3, FARTHEST_M)
#: Of jets in one choice; of the span around closest approach; of nodes; of "thereabouts". [s]
_MOST, _SPAN_S, _NODE_S, _NEARBY_S = 3, (-60.0, 160.0), 0.5, 10.0
#: Between the times at which a drawn curve may have its peak.
TIME_STEP_S = 0.1
_DRAWS = 400
#: Remainders' share and reach; the last is no jets and the smooth torque of the fitted levels' length.
_WAYS = [(share, holds) for holds in HOLDS_M for share in SHARES] + [(1.0, 0.0)]
_UPRIGHT = len(LEANS_RAD) // 2
#: Torque per density at times from closest approach, (N,) -> (N,).
PerDensity = Callable[[np.ndarray], np.ndarray]


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
    axes: Sequence[AxisData], per_density: Sequence[PerDensity], flyby: Flyby, sources: Sequence[Jet], closest_s: float, seed: int = 0
) -> DrawnPeaks:  # fmt: skip
    """Peaks drawn from the posterior.

    ``axes``: every axis that gas turns; ``per_density``: of each, the torque per density at times from closest approach;
    ``closest_s``: from the telemetry's epoch."""
    rng = np.random.default_rng(seed)
    plume = _Plume(tuple(axes), tuple(per_density), flyby, tuple(sources), closest_s)
    log = np.array([plume.evidence(way) for way in _WAYS])  # (ways, exponents and leans, widths, subsets and none)
    p = np.exp(log - log.max())
    p /= p.sum()
    drawn = np.stack(np.unravel_index(rng.choice(p.size, _DRAWS, p=p.ravel()), p.shape), axis=1)
    tops = [plume.tops(_WAYS[w], drawn[drawn[:, 0] == w, 1:], rng) for w in np.unique(drawn[:, 0])]
    times, heights = np.concatenate(tops).T
    jets = p[..., :-1].sum(axis=(0, 2, 3)).reshape(len(POWERS), len(LEANS_RAD))
    return DrawnPeaks(
        times, heights, float(jets.sum()), {f"{n:g}": float(v) for n, v in zip(POWERS, jets.sum(axis=1), strict=True)},
        float(np.delete(jets, _UPRIGHT, axis=1).sum()),
    )  # fmt: skip


def _nodes() -> np.ndarray:
    return np.arange(_SPAN_S[0], _SPAN_S[1] + _NODE_S / 2, _NODE_S)


def _jet(jet: Jet, flyby: Flyby, time_s, form: int, width) -> np.ndarray:
    """Density of a jet of unit K; ``form``: number of exponent and lean; ``width``: one, or (W, 1)."""
    power, lean = POWERS[form // len(LEANS_RAD)], LEANS_RAD[form % len(LEANS_RAD)]
    leaning = replace(jet, density_kgm3=1.0, width_rad=width, tilt_rad=jet.tilt_rad + lean)
    return jet_density(leaning, flyby, time_s, power=power)


@dataclass(frozen=True)
class _Shapes:
    """Jets of height one at the nodes: shares (exponents and leans, widths, J, B) of a few curves (B, C).

    ``sizes``: their heights at unit density (exponents and leans, widths, J).  All these thousands of curves are, to a ten-thousandth
    of their height, sums of about a hundred, which makes the evidence of every choice cheap."""

    shares: np.ndarray
    curves: np.ndarray
    sizes: np.ndarray

    def of(self, form: int, width: int, ids: list[int]) -> np.ndarray:
        """(len(ids), C)"""
        return self.shares[form, width, ids] @ self.curves


@lru_cache(maxsize=4)
def _shapes(flyby: Flyby, sources: tuple[Jet, ...]) -> _Shapes:
    nodes, forms = _nodes(), range(len(POWERS) * len(LEANS_RAD))
    each = np.array([[_jet(j, flyby, nodes, f, WIDTHS_RAD[:, None]) for j in sources] for f in forms]).swapaxes(1, 2)
    sizes = np.maximum(each.max(axis=-1), 1e-300)
    each /= sizes[..., None]
    rows = each.reshape(-1, len(nodes))
    value, vector = np.linalg.eigh(rows.T @ rows)
    curves = vector[:, value > 1e-12 * value[-1]].T
    return _Shapes(each @ curves.T, curves, sizes)


def _local(torque: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Size of a torque thereabouts. (N,)"""
    return np.sqrt(
        scipy.ndimage.gaussian_filter1d(torque**2, _NEARBY_S / float(np.mean(np.diff(time_s))), mode="nearest")
    )


def _positive(X: np.ndarray, y: np.ndarray, rng) -> np.ndarray:
    """Heights under their normal posterior, drawn again while one is negative; in the end the most probable ones."""
    precision = X.T @ X + np.eye(X.shape[1])
    mean = np.linalg.solve(precision, X.T @ y)
    root = np.linalg.cholesky(np.linalg.inv(precision))
    for _ in range(50):
        drawn = mean + root @ rng.standard_normal(len(mean))
        if (drawn >= 0).all():
            return drawn
    return np.maximum(mean, 0.0)


class _Plume:
    """A flyby's telemetry, and every choice of jets for it.  Heights of jets are in units of the largest density there is."""

    def __init__(self, axes: tuple[AxisData, ...], per_density: tuple[PerDensity, ...], flyby: Flyby, sources: tuple[Jet, ...], closest_s: float):  # fmt: skip
        self.axes, self.per_density, self.flyby, self.sources, self.closest_s = (
            axes,
            per_density,
            flyby,
            sources,
            closest_s,
        )
        self.nodes = _nodes()
        self.shapes = _shapes(flyby, sources)
        self.factors = [k(self.nodes) for k in per_density]
        self.span_s = (max(a.time_s[0] for a in axes) - closest_s, min(a.time_s[-1] for a in axes) - closest_s)
        self.answers = [a.answers(self.nodes + closest_s) for a in axes]
        self.local = [_local(a.smooth_torque(), a.time_s) for a in axes]
        self.largest = max(
            float(np.max(np.interp(self.nodes + closest_s, a.time_s, size)[told] / np.abs(k[told])))
            for a, size, k in zip(axes, self.local, self.factors, strict=True)
            for told in [tells(k[:, None])]
        )
        most = range(1, min(len(sources), _MOST) + 1)
        self.subsets = [list(c) for n in most for c in combinations(range(len(sources)), n)]

    def regressions(self, way: tuple[float, float]) -> tuple[list[Regression], np.ndarray, np.ndarray]:
        """Of every axis under the remainder of a way; y (R,) and W (R, C) of all for the density in units of the largest."""
        share, holds_m = way
        fits = []
        for axis, answers, size in zip(self.axes, self.answers, self.local, strict=True):
            near = self.flyby.altitude(axis.time_s - self.closest_s) < holds_m
            fits.append(regression(axis, self.nodes + self.closest_s, np.where(near, share, 1.0) * size, answers))
        W = np.concatenate([f.W * k for f, k in zip(fits, self.factors, strict=True)])
        return fits, np.concatenate([f.y for f in fits]), W * self.largest

    def evidence(self, way: tuple[float, float]) -> np.ndarray:
        """Log of evidence times prior of every choice, (exponents and leans, widths, subsets and none)."""
        fits, y, W = self.regressions(way)
        base = sum(f.log_evidence for f in fits)
        shares, of_curves = self.shapes.shares, W @ self.shapes.curves.T
        G, b = shares @ (of_curves.T @ of_curves) @ np.swapaxes(shares, -1, -2), shares @ (of_curves.T @ y)
        lean = np.full(len(LEANS_RAD), -np.log(2 * (len(LEANS_RAD) - 1)))
        lean[_UPRIGHT] = -np.log(2)
        prior = np.tile(lean, len(POWERS))[:, None] - np.log(len(POWERS) * len(WIDTHS_RAD) * len(self.subsets))
        log = np.full((*shares.shape[:2], len(self.subsets) + 1), -np.inf)
        for i, ids in enumerate(self.subsets):
            M = G[:, :, ids][:, :, :, ids] + np.eye(len(ids))  # a height's prior: half of a normal one, of sigma 1
            k = np.linalg.solve(M, b[:, :, ids, None])[..., 0]
            value = 0.5 * np.sum(b[:, :, ids] * k, axis=-1) - 0.5 * np.linalg.slogdet(M)[1] + len(ids) * np.log(2)
            log[:, :, i] = np.where((k >= 0).all(axis=-1), base + value + prior, -np.inf)
        log[0, 0, -1] = base
        return log

    def tops(self, way: tuple[float, float], chosen: np.ndarray, rng) -> np.ndarray:
        """Time and density of the peak of one curve drawn for each choice (K, 3). (K, 2)"""
        fits, y, W = self.regressions(way)
        fine = np.arange(self.nodes[0], self.nodes[-1], TIME_STEP_S)  # a cusp lies between nodes
        jets, curves = np.zeros((len(chosen), len(self.nodes))), np.zeros((len(chosen), len(fine)))
        for row, (form, width, subset) in enumerate(chosen):
            if subset == len(self.subsets):
                continue
            ids = self.subsets[subset]
            shapes = self.shapes.of(form, width, ids)
            heights = _positive(W @ shapes.T, y, rng)
            jets[row] = self.largest * heights @ shapes
            for i, h in zip(ids, heights, strict=True):
                unit = _jet(self.sources[i], self.flyby, fine, form, WIDTHS_RAD[width])
                curves[row] += self.largest * h / self.shapes.sizes[form, width, i] * unit
        rests, weights = [], []
        for f, k, per_density in zip(fits, self.factors, self.per_density, strict=True):
            t = f.axis.time_s - self.closest_s
            K = per_density(t)
            rest = f.remainders(jets * k, rng) / np.where(K == 0, np.inf, K)
            rests.append([np.interp(fine, t, r) for r in rest])
            weights.append(float(np.sum((f.W * k) ** 2)))  # a remainder tells of the density what its axis does
        curves += np.average(rests, axis=0, weights=weights)
        told = tells(np.stack([k(fine) for k in self.per_density], axis=-1))
        told &= (self.flyby.altitude(fine) <= FARTHEST_M) & (fine >= self.span_s[0]) & (fine <= self.span_s[1])
        top = np.argmax(np.where(told, curves, -np.inf), axis=1)
        return np.column_stack([fine[top], curves[np.arange(len(curves)), top]])
