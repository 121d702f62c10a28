"""A leak or a weak thruster as a change in residual momentum: a Kalman filter and likelihood ratios on its innovations.

The filter knows momentum, the steady torque, and what is only roughly known beforehand (``Known``): thrust of each
thruster, centre of mass, inertia, spin inertia.  Its innovations are white while nothing changes.  A change that begins at
some instant adds a known signature to them, G per unit: with S their covariance

    d = sum G' S^-1 v      c = sum G' S^-1 G      log likelihood ratio  l = max(d, 0)^2 / 2c      (Willsky & Jones 1976)

for each instant at which it may have begun, and each of the thrusters leaking (along its column) or weak (against its
pulses).  Instants are thinned with age, so that memory and work do not grow with the record.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.errors import BadInput
from .residual import AXES_IN_A_LEAK, Steps

if TYPE_CHECKING:
    from .firing import Geometry
    from .known import Known
    from .noise import Noise

#: Times at which a change may have begun are kept this many to an octave of age, and half as many again.
_PER_OCTAVE = 8
_UNKNOWN = 1e3  # sigma of momentum where nothing is known of it, in sigmas of a reading

#: Law of false alarms, ln(rate an instant) = EXPONENT ln h - h for a threshold h: studies/leak_threshold.py.
_EXPONENT = 0.5
_MOST_OFTEN = 0.05  # an instant; the law has been seen to hold below it


def threshold_for(rate_per_instant: float) -> float:
    """Log likelihood ratio that noise alone exceeds at this rate.  Raises BadInput for a rate of one in a few instants."""
    if rate_per_instant > _MOST_OFTEN:
        raise BadInput(
            f"{rate_per_instant:g} false alarms an instant are too many for a monitor",
            remedy="Give a lower --false-alarms: it counts alarms an hour.",
        )
    wanted = np.log(rate_per_instant)
    return float(scipy.optimize.brentq(lambda h: _EXPONENT * np.log(h) - h - wanted, 1.0, 200.0))


def with_unknown_noise(log_ratio, degrees: float):
    """A log likelihood ratio where the noise is known by so many degrees of freedom only."""
    return degrees / 2 * np.log1p(2 * np.asarray(log_ratio) / degrees)


@dataclass(frozen=True)
class Evidence:
    """What is known at one instant of every change that began at ``onset`` (B,): d and c (B, hypotheses), leaks first and
    weak thrusters after; ``free`` d (B, 3) and c (B, 3, 3) of a torque in any direction."""

    instant: int
    onset: np.ndarray
    d: np.ndarray
    c: np.ndarray
    free_d: np.ndarray
    free_c: np.ndarray
    degrees: float

    @property
    def log_ratio(self) -> np.ndarray:
        """(B, hypotheses), over no change."""
        return with_unknown_noise(self._raw, self.degrees)

    @property
    def _raw(self) -> np.ndarray:
        up = np.maximum(self.d, 0.0)
        return 0.5 * np.divide(up**2, self.c, out=np.zeros_like(up), where=self.c > 0)

    @property
    def statistic(self) -> float:
        return float(self.log_ratio.max())

    def weights(self, thrust_N: float) -> np.ndarray:
        """Posterior of onset and hypothesis (B, hypotheses), sizes integrated out: flat up to all the thrust or all of it lost.

        An onset stands for the instants since the one before it that is kept.  Ratios are to the best of them, so that noise
        not quite known widens what is close and not the whole."""
        c = np.where(self.c > 0, self.c, 1.0)
        most = np.where(np.arange(self.c.shape[1]) < self.c.shape[1] // 2, thrust_N, 1.0)
        size = 0.5 * np.log(2 * np.pi / c) - np.log(most) + scipy.special.log_ndtr(self.d / np.sqrt(c))
        raw = self._raw
        log = np.where(self.c > 0, size - with_unknown_noise(raw.max() - raw, self.degrees), -np.inf)
        log = log + np.log(np.diff(self.onset, prepend=self.onset[0] - 1))[:, None]
        w = np.exp(log - log.max())
        return w / w.sum()


class Monitor:
    """Takes steps one by one; holds the statistic of each and, once beyond the threshold, the evidence at its largest.

    ``alarm``: the first instant beyond the threshold, an index; ``at_alarm`` and ``best``: the evidence then, and at the largest
    statistic since."""

    def __init__(self, geometry: Geometry, noise: Noise, inertia_kgm2, wheels: int, threshold: float, known: Known):
        j = len(geometry.names)
        self.geometry, self.noise, self.threshold, self.known = geometry, noise, threshold, known
        self.variance, self.degrees = noise.variance.copy(), noise.degrees
        self.taken, self._last_ns = 0, 0
        self.statistic: list[float] = []
        self.alarm: int | None = None
        self.best: Evidence | None = None
        self._highest = 0.0  # since the alarm
        self.at_alarm: Evidence | None = None
        at = np.cumsum([0, 3, 3, j, j, 3, 6, wheels])
        self._momentum, self._torque, self._thrust, self._pulse, self._middle, self._inertia, self._spin = (
            slice(a, b) for a, b in pairwise(at)
        )
        unknown = _UNKNOWN * noise.sigma.max()
        self._unknown = unknown**2 * np.eye(3)
        moment = known.inertia_share * np.r_[np.diag(inertia_kgm2), np.full(3, np.trace(inertia_kgm2) / 3)]
        self.x = np.zeros(at[-1])
        sigma = np.r_[np.full(3, unknown), np.full(3, known.torque_Nm), np.full(j, known.each_share), np.full(j, known.pulse_share),
                      known.center_of_mass_m, moment, np.full(wheels, known.spin_share)]  # fmt: skip
        self.P = np.diag(sigma**2)
        self.P[self._thrust, self._thrust] += known.thrust_share**2
        self.onset = np.zeros(0, int)
        self._E = np.zeros((0, at[-1], 3 + j))  # what a unit change has put between truth and estimate
        self._d, self._c = np.zeros((0, 3 + j)), np.zeros((0, 3 + j, 3 + j))
        self._unit = np.zeros((3 + j, 2 * j))  # changes -> hypotheses: a leak is a torque along its column
        self._unit[:3, :j] = geometry.columns
        self._unit[3:, j:] = np.eye(j)

    def take(self, steps: Steps) -> None:
        """All steps that have not been taken yet."""
        for i in range(self.taken, len(steps.tai_ns)):
            self.forward(steps, i)
            self.measure(steps, i)
            self._judge(i)
            self.taken, self._last_ns = i + 1, int(steps.tai_ns[i])

    def is_followed_by(self, steps: Steps) -> bool:
        """Whether ``steps`` begin with those taken so far: the same number of instants up to the last one's time."""
        return 0 < self.taken <= len(steps.tai_ns) and int(steps.tai_ns[self.taken - 1]) == self._last_ns

    def evidence(self, instant: int | None = None) -> Evidence:
        """As it stands after the last instant taken."""
        instant = self.taken - 1 if instant is None else instant
        d = self._d @ self._unit
        c = np.einsum("ah,bah->bh", self._unit, self._c @ self._unit)
        return Evidence(
            instant, self.onset.copy(), d, c, self._d[:, :3].copy(), self._c[:, :3, :3].copy(), self.degrees
        )

    def forward(self, steps: Steps, i: int) -> None:
        """To an instant, before it is measured."""
        if i == 0:
            self.x[self._momentum] = steps.residual[0]
            return
        dt = (steps.tai_ns[i] - steps.tai_ns[i - 1]) / 1e9
        R = 0.5 * (steps.turned[i] + steps.turned[i - 1])
        A, J = self.geometry.columns, steps.ordered[i]
        pushed = R @ (A * J)  # (3, j), by each thruster
        N = np.zeros((3, len(self.x)))
        N[:, self._torque] = dt * R
        N[:, self._thrust] = N[:, self._pulse] = pushed
        # a centre of mass further by e takes e x force off: force x e, as a matrix
        N[:, self._middle] = R @ _crossing(self.geometry.directions @ J)
        self._renew_pulses(steps.pulses[i], steps.guessed[i])
        self.x[:3] += N @ self.x
        self.P[:3] += N @ self.P
        self.P[:, :3] += self.P @ N.T
        if steps.lost[i]:
            self.P[:3, :3] += self._unknown
        self.P[self._torque, self._torque] += dt * self.known.torque_walk_Nm_per_sqrt_s**2 * np.eye(3)
        if self.alarm is None:
            self.onset = np.append(self.onset, i)
            self._E, self._d, self._c = (
                np.concatenate([a, np.zeros((1, *a.shape[1:]))]) for a in (self._E, self._d, self._c)
            )
        self._E[:, :3] += N @ self._E
        self._E[:, :3] += np.concatenate([dt * R, -pushed], axis=1)

    def _renew_pulses(self, begun, guessed) -> None:
        """Pulses begun have a thrust of their own, in the mean of them; one that goes on keeps it."""
        if not (begun > 0).any():
            return
        kept = np.ones(len(self.x))
        kept[self._pulse] = begun <= 0
        self.x *= kept
        self.P *= np.outer(kept, kept)
        self._E *= kept[:, None]
        fresh = np.where(begun > 0, self.known.pulse_share**2 / np.maximum(begun, 1.0) + guessed, 0.0)
        self.P[self._pulse, self._pulse] += np.diag(fresh)

    def gains(self, steps: Steps, i: int):
        """Of an instant: design C (3, states), innovation covariance S, gain K and S^-1 G (B, 3, changes)."""
        R = steps.turned[i]
        C = np.zeros((3, len(self.x)))
        C[:, :3] = np.eye(3)
        # momentum as computed has the inertia believed: more of it than there is, where that is too large
        C[:, self._inertia] = R @ _moments(steps.body_rate[i])
        C[:, self._spin] = R @ steps.in_wheels[i]
        S = C @ self.P @ C.T + R @ (np.diag(self.variance) + steps.unsure[i]) @ R.T
        inverse = np.linalg.inv(S)
        return C, S, self.P @ C.T @ inverse, inverse @ (C @ self._E)

    def measure(self, steps: Steps, i: int) -> None:
        """Take an instant's momentum into the estimate and into the evidence of every change."""
        C, S, K, weighted = self.gains(steps, i)
        v = steps.residual[i] - C @ self.x
        G = C @ self._E
        self._d += v @ weighted
        self._c += np.swapaxes(G, 1, 2) @ weighted
        self._E -= K @ G
        self.x += K @ v
        self.P -= K @ S @ K.T
        self.P = 0.5 * (self.P + self.P.T)
        if i >= self.noise.until and self.alarm is None and steps.quiet[i]:
            self._learn(v @ steps.turned[i], np.einsum("ij,ik,kj->j", steps.turned[i], S, steps.turned[i]))

    def _learn(self, v_B, expected) -> None:
        """The noise goes on being learned while nothing is wrong, from innovations, added to what was learned before."""
        self.degrees += AXES_IN_A_LEAK / self.noise.alike.max()
        again = self.noise.alike * v_B**2 / expected * self.variance
        self.variance += AXES_IN_A_LEAK * (again - self.variance) / (self.degrees * self.noise.alike)

    def _judge(self, i: int) -> None:
        if not len(self.onset):
            self.statistic.append(0.0)
            return
        now = self.evidence(i)
        height = now.statistic
        if self.alarm is None and height > self.threshold:
            self.alarm, self.at_alarm = i, now
        self.statistic.append(height)
        if self.alarm is None:
            self.thin(i)
        elif height > self._highest:
            self.best, self._highest = now, height

    def thin(self, i: int) -> None:
        """Forget beginnings grown old: those that divide by 2^k are kept 2^k times as long."""
        lasting = self.onset & -self.onset
        keep = i - self.onset < _PER_OCTAVE * 2 * lasting
        if not keep.all():
            self.onset, self._E, self._d, self._c = (a[keep] for a in (self.onset, self._E, self._d, self._c))


def _crossing(v) -> np.ndarray:
    """v x, as a matrix."""
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _moments(w) -> np.ndarray:
    """I w as a matrix times (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), (3, 6)."""
    x, y, z = w
    return np.array([[x, 0, 0, y, z, 0], [0, y, 0, x, 0, z], [0, 0, z, 0, x, y]])
