"""Most likely tensor, momentum, external torque and motion, given wheels, rates and attitude together.

Gauss-Newton: linearize about the motion found so far, filter and regress, smooth, move the motion; the noise levels
are the likeliest ones.  Steps of the acceleration are Student-t: every interval's own variance is reweighted, so that
the corner of a ramp does not stiffen or loosen the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.regressed import Disturbances, run, smooth
from ...kit.rotations import rates_between
from .levels import Levels, first_levels
from .likelihood import (
    Around,
    Weighted,
    corners_loosened,
    floors,
    information_criterion,
    likeliest,
    outliers_sorted,
    smoothed,
    solved,
)
from .linear import linearized
from .motion import Layout, Motion, Reference, first_motion, instants
from .plain import fit_of_changes, plain_fit, shifted

if TYPE_CHECKING:
    from collections.abc import Callable

    from .prior import Prior
    from .record import SlewRecord

#: What is assumed of time stamps and of the rates' bias: hardly anything. [s], [rad/s]
_SKEW_S, _BIAS = 10.0, 1e-3
#: The bias where no attitude shows it: then it turns the inertial axes themselves. [rad/s]
_BIAS_ALONE = 1e-5
#: Sigma of a time offset, in wheels' cadences, where single kicks are all that informs: a wider prior would let the fit move
#: a kick from one reading to the next.
_SKEW_KICKED = 0.25
#: Sigma of a lever of the surroundings, over the torque that is seen to act: wide, and finite where no motion tells it.
_LEVER_SHARE = 10.0
#: Where the search for the slow torque starts, over the torque that is seen to act, and its time: one that starts large takes the
#: levers' part, and hands it back in many rounds. [s]
_SLOW_SHARE, _SLOW_S = 0.01, 1000.0
#: One sigma of what swings, over what the craft file says of it: it may be there or not.
_SWINGS = 1.0
_SKEWS_TRIED = np.arange(-8.0, 8.01, 0.5)
_MOST_ROUNDS = 20
#: Sigmas the answer may still move by in the last round.
_SETTLED = 0.05
#: Share that the tensor's sigmas may still change by: a level that dwindles to nothing need not be followed there.
_STEADY = 0.02
#: From this round on the constants are so nearly right that levels are fitted with them held, three times faster.
_NEARLY = 3
_TURNS = 8  # of the first round, in which the corners are found


@dataclass(frozen=True)
class SlewFit:
    """The answer of one round: how far it moved the constants (p,), their random covariance, and their slope in the two
    scale errors (p, 2), of the wheels' spin inertia and of the rates' scale."""

    weighted: Weighted
    moved: np.ndarray
    covariance: np.ndarray
    by_scale: np.ndarray
    levels: Levels
    smoothed: Disturbances
    rounds: int
    around: Around
    converged: bool = False

    @property
    def record(self) -> SlewRecord:
        return self.weighted.model.about.record

    @property
    def layout(self) -> Layout:
        return self.weighted.model.layout

    @property
    def beta(self) -> np.ndarray:
        return self.weighted.model.about.beta + self.moved

    @property
    def criterion(self) -> float:
        """BIC; less is better.  A step has its instant and three components, a slow torque its size and its time.  The levers have a
        prior, so they cost what the data narrow them by."""
        levers = slice(self.layout.torque.stop, self.layout.pushes.stop)
        narrowed = self.covariance[levers, levers] @ self.around.information[levers, levers]
        parameters = 4 * len(self.record.steps) + (2 if self.record.slow else 0)
        found = information_criterion(self.weighted, self.levels, self.around, parameters)
        return found - float(np.linalg.slogdet(narrowed)[1])

    @property
    def motion(self) -> Motion:
        """What this round was linearized about."""
        return self.weighted.model.about.motion

    @property
    def sigma(self) -> np.ndarray:
        return np.sqrt(np.diag(self.covariance))

    @property
    def residual(self) -> np.ndarray:
        """What every reading differs from the smoothed motion by, in its own unit. (M,)"""
        z = self.weighted.model
        departure = self.smoothed.mean
        step = np.repeat(np.arange(len(z.start) - 1), np.diff(z.start))
        return z.y - z.Z[:, : self.layout.size] @ self.moved - np.sum(z.H * departure[step], axis=1)


def fit_slews(
    record: SlewRecord,
    *,
    frame: str = "body",
    prior: Prior | None = None,
    seen: np.ndarray | None = None,
    levels: Levels | None = None,
    progress: Callable[[str], None] | None = None,
) -> SlewFit:
    """``frame`` of the external torque; ``prior`` of the tensor's elements, None for none; ``seen`` (3, 3): projector onto
    the directions of the slews, where they are not all; ``levels``: known noise levels; fitted unless given.

    Raises BadInput where the record tells nothing of the tensor."""
    task = _Task.of(record, frame, prior, np.eye(3) if seen is None else seen, levels)
    state = task.start(prior)
    sigma = np.full(6, np.inf)
    for number in range(1, _MOST_ROUNDS + 1):
        if progress is not None:
            progress(f"round {number}")
        fit = task.round(state, number)
        moved = np.max(np.abs(fit.moved) / fit.sigma)
        changed = np.max(np.abs(fit.sigma[Layout.TENSOR] / sigma - 1))
        if moved < 0.5 * _SETTLED and (levels is not None or changed < _STEADY):
            break
        state, sigma = _State.after(fit), fit.sigma[Layout.TENSOR]
    return replace(fit, converged=bool(moved < _SETTLED))


@dataclass(frozen=True)
class _State:
    """Between two rounds: what to linearize about, each step's variance, which of all readings count, noise levels."""

    about: Reference
    loosened: np.ndarray
    readings: np.ndarray
    levels: Levels

    @classmethod
    def after(cls, fit: SlewFit) -> _State:
        times = instants(fit.record, fit.beta)
        about = Reference(fit.record, fit.beta, fit.motion.moved(fit.smoothed.mean).at(times))
        readings = np.empty(len(fit.weighted.kept), bool)
        readings[fit.weighted.model.place] = fit.weighted.kept
        return cls(about, carried(fit.weighted.loosened, fit.motion, about.motion), readings, fit.levels)


@dataclass(frozen=True)
class _Task:
    """What stays the same from round to round: the prior's information and centre of all constants, first and known levels."""

    record: SlewRecord
    frame: str
    seen: np.ndarray
    information: np.ndarray
    centre: np.ndarray
    first: Levels
    known: Levels | None

    @classmethod
    def of(cls, record: SlewRecord, frame: str, prior: Prior | None, seen: np.ndarray, known: Levels | None) -> _Task:
        skew = _SKEW_KICKED * cadence_s(record) if record.wanders else _SKEW_S
        first = first_levels(record)
        first = replace(first, **{n: max(getattr(first, n), 2 * v) for n, v in floors(record).items()})
        if record.wanders:
            first = replace(first, kick=first.rate, wander=first.wheel * float(np.median(record.momentum.unit)))
        seen_Nm = _torque_seen(record) if record.slow else 0.0
        if record.slow:
            first = replace(first, slow=_SLOW_SHARE * seen_Nm, slow_s=_SLOW_S)
        weight, centre = prior_of_all(Layout.of(record), prior, skew, _LEVER_SHARE * seen_Nm)
        return cls(record, frame, seen, weight, centre, first, known)

    def start(self, prior: Prior | None) -> _State:
        beta, motion = _start(self.record)
        if prior is not None:
            beta[Layout.TENSOR] = prior.mean  # plain least squares has nothing to say where the slews do not
        motion = motion.at(instants(self.record, beta))
        r = self.record
        readings = np.ones(len(r.momentum.time_s) + len(r.rates.time_s) + 3 * len(r.attitude.time_s), bool)
        loosened = np.ones((len(motion.time_s), 6 if r.wanders else 3))
        return _State(Reference(r, beta, motion), loosened, readings, self.known or self.first)

    def round(self, state: _State, number: int) -> SlewFit:
        """Linearize, tune weights and levels, solve, smooth."""
        model = linearized(state.about, self.frame, self.first, self.seen)
        around = Around(self.information, self.centre - state.about.beta)
        weighted = Weighted(model, state.loosened, state.readings[model.place])
        weighted, levels = self.tuned(weighted, state.levels, around if number < _NEARLY else None, number)
        steps = weighted.steps(levels)
        f = run(steps)
        delta, covariance, by_scale = solved(f, model.layout, around)
        s = smooth(steps, f, np.append(delta, [0.0, 0.0]))
        return SlewFit(weighted, delta, covariance, by_scale, levels, s, number, around)

    def tuned(self, weighted: Weighted, levels: Levels, around: Around | None, number: int) -> tuple[Weighted, Levels]:
        """Corners loosened, outliers out (not where kicks look like outliers, nor before the motion is right), levels fitted."""
        for turn in range(_TURNS if number == 1 else 2):
            steps, s = smoothed(weighted, levels, around)
            if number > 2 and not self.record.wanders:
                weighted = outliers_sorted(weighted, steps, s)
            weighted = corners_loosened(weighted, s)
            # corners first: a level fitted before they are loose takes them for noise
            if self.known is None and (number > 1 or turn >= _TURNS - 2):
                levels = likeliest(weighted, levels, around)
        return weighted, levels


def prior_of_all(
    layout: Layout, prior: Prior | None, skew_s: float = _SKEW_S, lever_Nm: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Information (p, p) and centre (p,) for all constants, from that of the tensor and sigma of a time offset."""
    weight, centre = np.zeros((layout.size, layout.size)), np.zeros(layout.size)
    for k in (layout.skew_wheels, layout.skew_rates):
        if k is not None:
            weight[k, k] = 1 / skew_s**2
    for k in range(layout.torque.stop, layout.pushes.stop):
        weight[k, k] = 1 / lever_Nm**2
    weight[layout.amplitudes, layout.amplitudes] = np.eye(layout.swings) / _SWINGS**2
    if layout.bias is not None:
        weight[layout.bias, layout.bias] = np.eye(3) / (_BIAS if layout.skew_rates is not None else _BIAS_ALONE) ** 2
    if prior is not None:
        centre[layout.TENSOR], weight[layout.TENSOR, layout.TENSOR] = prior.mean, prior.information
    return weight, centre


def cadence_s(record: SlewRecord) -> float:
    """Of the wheels' readings."""
    return float(np.median(np.diff(np.unique(record.momentum.time_s))))


def carried(loosened: np.ndarray, old: Motion, new: Motion) -> np.ndarray:
    """The same steps' variances on other instants."""
    return loosened[np.clip(np.searchsorted(old.time_s, new.time_s), 0, len(loosened) - 1)]


def _torque_seen(record: SlewRecord) -> float:
    """About the size of an outside torque that would explain what plain least squares of momentum leaves over. [N m]"""
    m = record.momentum
    left = np.sqrt(plain_fit(record)[1] / len(m.time_s))
    return max(6 * float(left) / float(np.ptp(m.time_s)), 1e-13)


def _start(record: SlewRecord) -> tuple[np.ndarray, Motion]:
    """Plain least squares of momentum (Feldman and Lee eq 11, the momentum free), at the time offset that fits best."""
    layout = Layout.of(record)
    beta = np.zeros(layout.size)
    if layout.skew_rates is not None:
        beta[layout.skew_rates] = _rates_late(record)
    fitted = fit_of_changes if record.wanders else plain_fit
    late = {skew: fitted(record, beta, skew) for skew in _SKEWS_TRIED}
    least = min(left for _, left in late.values())
    skew = min(late, key=lambda s: (late[s][1] > 1.02 * least, abs(s)))
    beta = late[skew][0]
    return beta, first_motion(shifted(record, beta), instants(record, beta))


def _rates_late(record: SlewRecord) -> float:
    """By how much the rates' time stamps must be moved for them to match the attitude's, roughly. [s]"""
    tg, w = record.common_rates()
    mid, mean = rates_between(record.attitude.time_s, record.attitude.q_NB)
    misfit = {
        s: sum(np.sum((np.interp(mid, tg + s, w[:, j]) - mean[:, j]) ** 2) for j in range(3)) for s in _SKEWS_TRIED
    }
    least = min(misfit.values())
    return min((s for s in misfit if misfit[s] <= 1.02 * least), key=abs)
