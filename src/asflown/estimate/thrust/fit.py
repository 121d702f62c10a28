"""Thrust of every thruster, fall time, centre of mass and nuisance parameters, from all records at once.

    step of a chain = arms(centre) diag(F) effective(on-time, pulses; fall) + nuisances + noise

by Gauss-Newton on the posterior.  Thrusts are spread about a mean, F_k ~ N(m, (u m)^2); the spread u is integrated over, with
the weight that the records give each value.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...telemetry.channels import AXES
from ..firing import Parameter, Source

if TYPE_CHECKING:
    from ...dynamics.pulses import Valve
    from ..firing import Chain, Priors

#: Values of the spread, as a share, over which is summed.
_UNLIKE = np.geomspace(0.002, 0.3, 11)
#: Sigma of the prior on the thrusters' mean, which is as good as flat. [N]
_ANY_THRUST = 1e4
#: Rounds at most, and the step, in sigmas, below which there is no further one.
_ROUNDS, _SMALL_STEP = 12, 1e-3
FALL_TIME, CENTER = Parameter(Source.FALL_TIME), tuple(Parameter(Source.CENTER, a) for a in AXES)
_MEAN, _MASS = Parameter(Source.MEAN_THRUST), Parameter(Source.MASS)
#: Pulses that last in a burn are weaker by a known share (Chain.weak) times a factor between 0 and 1: its prior mean and sigma.
_LASTING, _HALF = Parameter(Source.LASTING), 0.5
#: Change of the fall time by which its effect is found. [s]
_SLOWER = 1e-5
#: The least sigma of a pulse that has a parameter of its own, where pulses do not scatter.
_SCATTER = 1e-6
#: Probability of a chi square this large, below which the noise assumed is too small.
_CHANCE = 0.01


def thrust_of(name: str) -> Parameter:
    return Parameter(Source.THRUST, name)


@dataclass(frozen=True)
class Fit:
    """Posterior of all P parameters: thrusts, fall time, centre of mass, and the nuisances."""

    parameters: tuple[Parameter, ...]
    values: np.ndarray
    covariance: np.ndarray
    considered: dict[Parameter, np.ndarray]  # (P,): shift by one sigma of what is not estimated; in the covariance
    fired: tuple[str, ...]
    effective_s: np.ndarray  # (j,): impulse per newton of those that fired, over all records
    misfit: float  # chi square over its degrees of freedom
    widened: float  # by which variances were widened for it
    left: tuple[np.ndarray, ...]  # each chain's steps less the fit

    def value(self, parameter: Parameter) -> float:
        return float(self.values[self.parameters.index(parameter)])

    def sigma(self, parameter: Parameter) -> float:
        k = self.parameters.index(parameter)
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
        return self.value(thrust_of(name)) / mean, self.combination(self.ratio_weights(name))[1] / mean

    def ratio_weights(self, name: str) -> dict[str, float]:
        """By which thrusts add up to that thrust less its share of the mean."""
        ratio = self.value(thrust_of(name)) / self.mean()[0]
        return {n: (n == name) - ratio * w for n, w in self.mean_weights.items()}

    @property
    def mean_weights(self) -> dict[str, float]:
        given = self.effective_s * [self.value(thrust_of(n)) for n in self.fired]
        return dict(zip(self.fired, given / given.sum(), strict=True))

    def share(self, weights: dict[str, float], source: Source) -> float:
        """Part of the sigma of a weighted sum of thrusts that is due to the parameters of one source. [N]"""
        w, k = self._weights(weights), [i for i, p in enumerate(self.parameters) if p.source == source]
        if not k:
            return float(np.sqrt(sum((w @ s) ** 2 for p, s in self.considered.items() if p.source == source)))
        shared = (self.covariance @ w)[k]
        return float(np.sqrt(max(shared @ np.linalg.solve(self.covariance[np.ix_(k, k)], shared), 0.0)))

    def correlation(self, weights: dict[str, float], parameter: Parameter) -> float:
        """Of a weighted sum of thrusts with a parameter."""
        w, k = self._weights(weights), self.parameters.index(parameter)
        return float((self.covariance @ w)[k] / np.sqrt(self.covariance[k, k] * (w @ self.covariance @ w)))

    def _weights(self, weights: dict[str, float]) -> np.ndarray:
        w = np.zeros(len(self.parameters))
        for n, x in weights.items():
            w[self.parameters.index(thrust_of(n))] = x
        return w


def fit_thrust(chains: list[Chain], names: tuple[str, ...], valve: Valve, priors: Priors) -> Fit:
    """``names`` (j,) of the chains' thrusters; ``valve``: delay and rise, which are taken as known."""
    fired_any = np.sum([c.on_time_s.sum(axis=0) for c in chains], axis=0) > 0
    model = _Model(chains, np.flatnonzero(fired_any), names, valve, priors)
    x, covariance, left = _converged(model)
    normal, pull, chi, count, considered = model.equations(x, left)
    freedom = max(count - float(np.trace(covariance @ normal)), 1.0)
    parts = [_solved(model, x, normal, pull, u) for u in _UNLIKE]
    # half-normal in u, and steps of u that grow with it
    odds = np.array([e for _, _, e in parts]) + np.log(_UNLIKE) - 0.5 * (_UNLIKE / priors.unlike) ** 2
    weight = np.exp(odds - odds.max())
    weight /= weight.sum()
    values = weight @ np.array([v for v, _, _ in parts])
    spread = [c + np.outer(v - values, v - values) for v, c, _ in parts]
    widened = max(chi / freedom, 1.0) if chi > scipy.special.chdtri(freedom, _CHANCE) else 1.0
    inverse = np.einsum("u,uij->ij", weight, np.array([c for _, c, _ in parts]))
    shifts = {n: -sigma * (inverse @ considered[:, q]) for q, (n, sigma) in enumerate(model.considered.items())}
    covariance = widened * np.einsum("u,uij->ij", weight, spread)
    covariance += sum((np.outer(s, s) for s in shifts.values()), np.zeros_like(covariance))
    return Fit(
        parameters=tuple(model.place),
        values=values,
        covariance=covariance,
        considered=shifts,
        fired=tuple(names[k] for k in model.fired),
        effective_s=model.total_effective(values),
        misfit=float(chi / freedom),
        widened=float(widened),
        left=tuple(model.left(values)),
    )


def _converged(model: _Model):
    """Parameters (P,) for the prior's own spread of the thrusters, their covariance, and the residuals one round before."""
    x, left = model.start(), None
    for _ in range(_ROUNDS):
        normal, pull, *_ = model.equations(x, left)
        left = model.left(x)
        best, covariance, _ = _solved(model, x, normal, pull, model.priors.unlike)
        step = best - x
        x = best
        if np.abs(step / np.sqrt(np.diag(covariance))).max() < _SMALL_STEP:
            break
    return x, covariance, left


def _solved(model: _Model, x, normal, pull, unlike: float):
    """Posterior mean, covariance and log evidence (up to a constant) for one spread ``unlike`` of the thrusters."""
    precision, centre, log_prior = model.prior(x, unlike)
    total = normal + precision
    covariance = np.linalg.inv(total)
    # without a prior the best offset from x solves normal @ offset = pull
    offset = covariance @ (pull + precision @ (centre - x))
    gain = offset @ pull - 0.5 * offset @ normal @ offset
    miss = x + offset - centre
    evidence = gain - 0.5 * miss @ precision @ miss - 0.5 * np.linalg.slogdet(total)[1] + log_prior
    return x + offset, covariance, float(evidence)


@dataclass(frozen=True)
class _Given:
    """What j thrusters give in K steps of a chain under certain parameters."""

    thrust_N: np.ndarray  # (j,)
    valve: Valve
    lighter: float  # by which a heavier craft gains less velocity; 1 for momentum
    arms: np.ndarray  # (K, d, j): what a newton second of each adds
    effective: np.ndarray  # (K, j): impulse per newton of pulses that are all alike [s]
    own: np.ndarray  # (K, j): the same of the pulses as they are
    more: np.ndarray  # (K, j): pulses beyond the number estimated

    @property
    def per_newton(self) -> np.ndarray:
        return self.arms * self.own[:, None, :]

    @property
    def steps(self) -> np.ndarray:
        return (self.per_newton * self.thrust_N).sum(axis=2)


class _Model:
    """The parameters' places in one vector, and what they make of the chains."""

    def __init__(self, chains: list[Chain], fired, names: tuple[str, ...], valve: Valve, priors: Priors):
        self.chains, self.fired, self.valve, self.priors = chains, fired, valve, priors
        self.thrusts = len(fired)
        own = {n.parameter: n.sigma for c in chains for n in c.nuisances if not n.considered}
        self.considered = {n.parameter: n.sigma for c in chains for n in c.nuisances if n.considered}
        if any(c.turn is None for c in chains):
            own[_MASS] = priors.mass_share
        self.uncounted = {
            Parameter(Source.UNCOUNTED, f"{c.what}, {k}"): (c, g) for c in chains for k, g in enumerate(c.guessed())
        }
        own |= dict.fromkeys(self.uncounted, 1.0)
        own |= {p: max(priors.pulse_scatter, _SCATTER) for c in chains for p in c.long}
        if any(c.weak.any() for c in chains):
            own[_LASTING] = _HALF
        order = [*(thrust_of(names[k]) for k in fired), _MEAN, FALL_TIME, *CENTER, *own]
        self.place = {p: k for k, p in enumerate(order)}
        self.sigmas = np.array([priors.fall_sigma_s, *priors.center_sigma_m, *own.values()])

    def start(self) -> np.ndarray:
        """One thrust for all, by least squares with everything else as it is thought to be."""
        x = np.r_[np.zeros(self.thrusts + 1), self.priors.fall_s, self.priors.center_m, np.zeros(len(self.sigmas) - 4)]
        if _LASTING in self.place:
            x[self.place[_LASTING]] = _HALF
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

    def _given(self, c: Chain, x) -> _Given:
        """What a chain's thrusters give under these parameters."""
        more = np.zeros_like(c.spread)
        for p, g in self._uncounted_in(c):
            more[:, g] = x[self.place[p]] * c.spread[:, g]
        lighter = 1 - x[self.place[_MASS]] if c.turn is None else 1.0
        valve = self._valve(x)
        effective = c.effective(valve, more)
        own = effective.copy()  # with what pulses of minutes give more or less than the others
        for p, (j, on) in c.long.items():
            own[:, j] += x[self.place[p]] * on
        if _LASTING in self.place:
            own -= x[self.place[_LASTING]] * c.weak * effective
        return _Given(self._full(x), valve, lighter, lighter * c.arms(self._center(x)), effective, own, more)

    def _uncounted_in(self, c: Chain):
        return [(p, g) for p, (chain, g) in self.uncounted.items() if chain is c]

    def predicted(self, c: Chain, x, given: _Given) -> np.ndarray:
        """Steps of a chain, (K, d)."""
        steps = given.steps
        for n in c.nuisances:
            if not n.considered:
                steps = steps + x[self.place[n.parameter]] * n.column
        return steps

    def columns(self, c: Chain, given: _Given) -> np.ndarray:
        """What each of P parameters changes in a chain's steps, (K, d, P)."""
        F, valve, arms, effective = given.thrust_N, given.valve, given.arms, given.effective
        X = np.zeros((len(c.steps), c.width, len(self.place)))
        X[:, :, : self.thrusts] = given.per_newton[:, :, self.fired]
        later = c.effective(replace(valve, fall_s=valve.fall_s + _SLOWER), given.more)
        X[:, :, self.place[FALL_TIME]] = (arms * ((later - effective) / _SLOWER)[:, None, :] * F).sum(axis=2)
        for p, moved in zip(CENTER, c.arms_by_center(), strict=True):
            X[:, :, self.place[p]] = (moved * (given.own * F)[:, None, :]).sum(axis=2)
        if _LASTING in self.place:
            X[:, :, self.place[_LASTING]] = -(arms * (effective * c.weak * F)[:, None, :]).sum(axis=2)
        for p, (j, on) in c.long.items():
            X[:, :, self.place[p]] = arms[:, :, j] * (F[j] * on)[:, None]
        for p, g in self._uncounted_in(c):
            added = (arms * (c.spread * valve.added() * F)[:, None, :])[:, :, g]
            X[:, :, self.place[p]] = added.sum(axis=2)
        if c.turn is None:
            X[:, :, self.place[_MASS]] = -given.steps / given.lighter
        for n in c.nuisances:
            if not n.considered:
                X[:, :, self.place[n.parameter]] = n.column
        return X

    def left(self, x) -> list[np.ndarray]:
        return [c.steps - self.predicted(c, x, self._given(c, x)) for c in self.chains]

    def equations(self, x, left):
        """Normal matrix, right-hand side, chi square at x, number of values in it, and right-hand sides of the considered
        parameters, (P, Q).  ``left``: residuals from which the noise is taken, None: those at x."""
        size = len(x)
        normal, pull, chi, count = np.zeros((size, size)), np.zeros(size), 0.0, 0
        considered, places = np.zeros((size, len(self.considered))), list(self.considered)
        left = left if left is not None else self.left(x)
        for c, of_noise in zip(self.chains, left, strict=True):
            given = self._given(c, x)
            noise = c.noise(of_noise)
            covariance = c.covariance(given.thrust_N, self._center(x), given.valve, self.priors.pulse_scatter, noise)
            flat, r = self.columns(c, given).reshape(-1, size), (c.steps - self.predicted(c, x, given)).ravel()
            solved = covariance.solve(np.column_stack([flat, r]))
            normal += flat.T @ solved[:, :-1]
            pull += solved[:, :-1].T @ r
            for n in c.nuisances:
                if n.considered:
                    considered[:, places.index(n.parameter)] += solved[:, :-1].T @ n.column.ravel()
            chi, count = chi + float(r @ solved[:, -1]), count + int(c.used.sum()) * c.width
        return normal, pull, chi, count, considered

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
        if _LASTING in self.place:
            centre[self.place[_LASTING]] = _HALF
        return precision, centre, 0.5 * j * np.log(one)
