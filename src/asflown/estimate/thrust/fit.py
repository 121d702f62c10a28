"""Thrust of every thruster, fall time, centre of mass and all that may be off, from all records at once.

    step of a chain = arms(centre) diag(F) effective(on-time, pulses; fall) + nuisances + noise

by Gauss and Newton on the posterior.  Thrusters are alike about a mean, F_k ~ N(m, (u m)^2); how unlike, u, is itself summed
over, with the weight that the records give each value.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2

if TYPE_CHECKING:
    from ...dynamics.pulses import Valve
    from ..firing import Chain, Priors

#: How unlike thrusters may be, as a share, at which the sum is taken.
_UNLIKE = np.geomspace(0.002, 0.3, 11)
#: Flat prior on the thrusters' mean: its sigma. [N]
_ANY_THRUST = 1e4
_ROUNDS = 12
#: What lasts of a burn is weak by a share that is known (Chain.weak) times something between none and all: its sigma and mean.
_LASTING, _HALF = "lasting", 0.5
#: Scatter from pulse to pulse below which it is none: the least that a pulse followed by itself is given.
_SCATTER = 1e-6
#: Chance below which what is left over is more than the noise taken for it.
_CHANCE = 0.01


@dataclass(frozen=True)
class Fit:
    """Posterior of all parameters, by name: ``thrust Z1`` ..., ``fall``, ``center x`` ..., and the nuisances."""

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    considered: dict[str, np.ndarray]  # what one sigma of what is not estimated shifts, (P,) each; in the covariance
    fired: tuple[str, ...]
    effective_s: np.ndarray  # (j,): impulse per newton of those that fired, over all records
    misfit: float  # chi square over its degrees of freedom
    widened: float  # by which variances were widened for it
    unlike: float
    left: tuple[np.ndarray, ...]  # each chain's steps less the fit

    def index(self, name: str) -> int:
        return self.names.index(name)

    def value(self, name: str) -> float:
        return float(self.values[self.index(name)])

    def sigma(self, name: str) -> float:
        k = self.index(name)
        return float(np.sqrt(self.covariance[k, k]))

    def combination(self, weights: dict[str, float]) -> tuple[float, float]:
        """Value and sigma of a weighted sum of thrusts."""
        w = self._weights(weights)
        return float(w @ self.values), float(np.sqrt(w @ self.covariance @ w))

    def mean(self) -> tuple[float, float]:
        """Of the thrusters that fired, weighted by their impulse."""
        return self.combination(self.mean_weights)

    def over_mean(self, name: str) -> tuple[float, float]:
        """A thrust over the mean, and its sigma: what all thrusts share cancels."""
        mean = self.mean()[0]
        return self.value(f"thrust {name}") / mean, self.combination(self.ratio_weights(name))[1] / mean

    def ratio_weights(self, name: str) -> dict[str, float]:
        """By which thrusts add up to that thrust less its share of the mean."""
        ratio = self.value(f"thrust {name}") / self.mean()[0]
        return {n: (n == name) - ratio * w for n, w in self.mean_weights.items()}

    @property
    def mean_weights(self) -> dict[str, float]:
        given = self.effective_s * [self.value(f"thrust {n}") for n in self.fired]
        return dict(zip(self.fired, given / given.sum(), strict=True))

    def share(self, weights: dict[str, float], *names: str) -> float:
        """What not knowing these parameters makes of the sigma of a weighted sum of thrusts. [N]"""
        w, k = self._weights(weights), [i for i, n in enumerate(self.names) if n.startswith(names)]
        if not k:
            return float(np.sqrt(sum((w @ s) ** 2 for n, s in self.considered.items() if n.startswith(names))))
        shared = (self.covariance @ w)[k]
        return float(np.sqrt(max(shared @ np.linalg.solve(self.covariance[np.ix_(k, k)], shared), 0.0)))

    def correlation(self, weights: dict[str, float], name: str) -> float:
        w, k = self._weights(weights), self.index(name)
        return float((self.covariance @ w)[k] / np.sqrt(self.covariance[k, k] * (w @ self.covariance @ w)))

    def _weights(self, weights: dict[str, float]) -> np.ndarray:
        w = np.zeros(len(self.names))
        for n, x in weights.items():
            w[self.index(f"thrust {n}")] = x
        return w


def fit_thrust(chains: list[Chain], names: tuple[str, ...], valve: Valve, priors: Priors) -> Fit:
    """``names`` (j,) of the chains' thrusters; ``valve``: delay and rise, which are taken as known."""
    fired_any = np.sum([c.on_time_s.sum(axis=0) for c in chains], axis=0) > 0
    model = _Model(chains, np.flatnonzero(fired_any), names, valve, priors)
    x, left = model.start(), None
    for _ in range(_ROUNDS):
        normal, pull, *_ = model.equations(x, left)
        left = model.left(x)
        best = _solved(model, x, normal, pull, priors.unlike)
        step = best[0] - x
        x = best[0]
        if np.abs(step / np.sqrt(np.diag(best[1]))).max() < 1e-3:
            break
    normal, pull, chi, count, beside = model.equations(x, left)
    freedom = max(count - float(np.trace(best[1] @ normal)), 1.0)
    parts = [_solved(model, x, normal, pull, u) for u in _UNLIKE]
    # half-normal in u, and steps of u that grow with it
    odds = np.array([e for _, _, e in parts]) + np.log(_UNLIKE) - 0.5 * (_UNLIKE / priors.unlike) ** 2
    weight = np.exp(odds - odds.max())
    weight /= weight.sum()
    values = weight @ np.array([v for v, _, _ in parts])
    spread = [c + np.outer(v - values, v - values) for v, c, _ in parts]
    widened = max(chi / freedom, 1.0) if chi > chi2.isf(_CHANCE, freedom) else 1.0
    inverse = np.einsum("u,uij->ij", weight, np.array([c for _, c, _ in parts]))
    shifts = {n: -sigma * (inverse @ beside[:, q]) for q, (n, sigma) in enumerate(model.considered.items())}
    covariance = widened * np.einsum("u,uij->ij", weight, spread)
    covariance += sum((np.outer(s, s) for s in shifts.values()), np.zeros_like(covariance))
    return Fit(
        names=tuple(model.names),
        values=values,
        covariance=covariance,
        considered=shifts,
        fired=tuple(names[k] for k in model.fired),
        effective_s=model.total_effective(values),
        misfit=float(chi / freedom),
        widened=float(widened),
        unlike=float(np.exp(weight @ np.log(_UNLIKE))),
        left=tuple(model.left(values)),
    )


def _solved(model: _Model, x, normal, pull, unlike: float):
    """Posterior mean, covariance and log evidence (up to a constant) for one value of how unlike thrusters are."""
    precision, centre, log_prior = model.prior(x, unlike)
    total = normal + precision
    covariance = np.linalg.inv(total)
    # pull is normal times the best offset from x without a prior
    offset = covariance @ (pull + precision @ (centre - x))
    gain = offset @ pull - 0.5 * offset @ normal @ offset
    miss = x + offset - centre
    evidence = gain - 0.5 * miss @ precision @ miss - 0.5 * np.linalg.slogdet(total)[1] + log_prior
    return x + offset, covariance, float(evidence)


class _Model:
    """The parameters' places in one vector, and what they make of the chains."""

    def __init__(self, chains, fired, names, valve: Valve, priors: Priors):
        self.chains, self.fired, self.valve, self.priors = chains, fired, valve, priors
        self.thrusts = len(fired)
        own = {n.name: n.sigma for c in chains for n in c.nuisances if not n.considered}
        self.considered = {n.name: n.sigma for c in chains for n in c.nuisances if n.considered}
        if any(c.turn is None for c in chains):
            own["mass"] = priors.mass_share
        self.uncounted = {
            f"pulses not counted, {c.what}, {k}": (c, g) for c in chains for k, g in enumerate(c.guessed())
        }
        own |= dict.fromkeys(self.uncounted, 1.0)
        own |= {n: max(priors.pulse_scatter, _SCATTER) for c in chains for n in c.long}
        if any(c.weak.any() for c in chains):
            own[_LASTING] = _HALF
        self.names = [f"thrust {names[k]}" for k in fired] + [
            "mean thrust",
            "fall",
            "center x",
            "center y",
            "center z",
            *own,
        ]
        self.sigmas = np.array([priors.fall_sigma_s, *priors.center_sigma_m, *own.values()])

    def start(self) -> np.ndarray:
        """One thrust for all, by least squares with everything else as it is thought to be."""
        x = np.r_[np.zeros(self.thrusts + 1), self.priors.fall_s, self.priors.center_m, np.zeros(len(self.sigmas) - 4)]
        if _LASTING in self.names:
            x[self.names.index(_LASTING)] = _HALF
        u, v = [], []
        for c in self.chains:
            given = np.einsum("kdj,kj->kd", c.arms(self._center(x)), c.effective(self._valve(x)))
            scale = max(float(np.abs(given).max()), 1e-300)
            u.append(given[c.used].ravel() / scale)
            v.append(c.steps[c.used].ravel() / scale)
        a, b = np.concatenate(u), np.concatenate(v)
        x[: self.thrusts + 1] = max(float(a @ b / (a @ a)), 1e-3) if a.any() else 1.0
        return x

    def _center(self, x) -> np.ndarray:
        return x[self.thrusts + 2 : self.thrusts + 5]

    def _valve(self, x) -> Valve:
        return replace(self.valve, fall_s=float(x[self.thrusts + 1]))

    def _full(self, x) -> np.ndarray:
        F = np.zeros(self.chains[0].on_time_s.shape[1])
        F[self.fired] = x[: self.thrusts]
        return F

    def total_effective(self, x) -> np.ndarray:
        return np.sum([c.effective(self._valve(x)).sum(axis=0) for c in self.chains], axis=0)[self.fired]

    def predicted(self, c: Chain, x) -> tuple[np.ndarray, np.ndarray]:
        """Steps (K, d) of a chain, and what each parameter changes in them, (K, d, P)."""
        F, valve, K = self._full(x), self._valve(x), len(c.steps)
        groups = {name: g for name, (chain, g) in self.uncounted.items() if chain is c}
        more = np.zeros_like(c.spread)
        for name, g in groups.items():
            more[:, g] = x[self.names.index(name)] * c.spread[:, g]
        lighter = 1 - x[self.names.index("mass")] if c.turn is None else 1.0
        arms, effective = lighter * c.arms(self._center(x)), c.effective(valve, more)
        longs = {self.names.index(n): course for n, course in c.long.items()}
        own = effective.copy()  # with what pulses of minutes give more or less than the others
        for k, (j, on) in longs.items():
            own[:, j] += x[k] * on
        if _LASTING in self.names:
            own -= x[self.names.index(_LASTING)] * c.weak * effective
        per_newton = arms * own[:, None, :]
        columns = np.zeros((K, c.width, len(x)))
        steps = (per_newton * F).sum(axis=2)
        columns[:, :, : self.thrusts] = per_newton[:, :, self.fired]
        later = c.effective(replace(valve, fall_s=valve.fall_s + 1e-5), more)
        columns[:, :, self.thrusts + 1] = (arms * ((later - effective) / 1e-5)[:, None, :] * F).sum(axis=2)
        for k, moved in enumerate(c.arms_by_center()):
            columns[:, :, self.thrusts + 2 + k] = (moved * (own * F)[:, None, :]).sum(axis=2)
        if _LASTING in self.names:
            columns[:, :, self.names.index(_LASTING)] = -(arms * (effective * c.weak * F)[:, None, :]).sum(axis=2)
        for k, (j, on) in longs.items():
            columns[:, :, k] = arms[:, :, j] * (F[j] * on)[:, None]
        for name, g in groups.items():
            added = (arms * (c.spread * valve.added() * F)[:, None, :])[:, :, g]
            columns[:, :, self.names.index(name)] = added.sum(axis=2)
        if c.turn is None:
            columns[:, :, self.names.index("mass")] = -steps / lighter
        for n in c.nuisances:
            if not n.considered:
                k = self.names.index(n.name)
                columns[:, :, k] = n.column
                steps = steps + x[k] * n.column
        return steps, columns

    def left(self, x) -> list[np.ndarray]:
        return [c.steps - self.predicted(c, x)[0] for c in self.chains]

    def equations(self, x, left):
        """Normal matrix, pull, chi square at x, how many numbers it is of, and pulls of what is only considered, (P, Q)."""
        size = len(x)
        normal, pull, chi, count = np.zeros((size, size)), np.zeros(size), 0.0, 0
        beside, places = np.zeros((size, len(self.considered))), list(self.considered)
        left = left if left is not None else self.left(x)
        F = self._full(x)
        for c, of_noise in zip(self.chains, left, strict=True):
            steps, columns = self.predicted(c, x)
            noise = c.noise(of_noise)
            covariance = c.covariance(F, self._center(x), self._valve(x), self.priors.pulse_scatter, noise)
            flat, r = columns.reshape(-1, size), (c.steps - steps).ravel()
            solved = covariance.solve(np.column_stack([flat, r]))
            normal += flat.T @ solved[:, :-1]
            pull += solved[:, :-1].T @ r
            for n in c.nuisances:
                if n.considered:
                    beside[:, places.index(n.name)] += solved[:, :-1].T @ n.column.ravel()
            chi, count = chi + float(r @ solved[:, -1]), count + int(c.used.sum()) * c.width
        return normal, pull, chi, count, beside

    def prior(self, x, unlike: float):
        """Precision, centre and log density's constant."""
        j, size = self.thrusts, len(x)
        precision, centre = np.zeros((size, size)), np.zeros(size)
        one = 1 / (unlike * x[j]) ** 2
        for k in range(j):
            precision[k, k] += one
            precision[j, j] += one
            precision[k, j] -= one
            precision[j, k] -= one
        precision[j, j] += 1 / _ANY_THRUST**2
        precision[np.arange(j + 1, size), np.arange(j + 1, size)] = 1 / self.sigmas**2
        centre[j + 1] = self.priors.fall_s
        centre[j + 2 : j + 5] = self.priors.center_m
        if _LASTING in self.names:
            centre[self.names.index(_LASTING)] = _HALF
        return precision, centre, 0.5 * j * np.log(one)
