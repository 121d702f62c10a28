"""The closed loop with an unknown torque in it, as a linear stochastic model.

One axis has ten states: attitude and rate of the body; the rate filter's four; the wheels' momentum; the
slow error of the attitude estimate, which the controller flies on; the torque and its slope.  Momentum,
torque and slope are held per unit of the axis's moment of inertia, which keeps all states of one size.

    attitude'  = rate
    I rate'    = T + u + w_u                     u = I KD (KP e - F(rate)),   e = -(attitude + error)
    h'         = -u - w_u
    error'     = -error/time + w_a               a Gauss-Markov process
    T'         = slope
    slope'     = -2 k slope - k^2 T + w_T        k = sqrt(3)/length: Matern-3/2;  k = 0: piecewise linear

w_u is what the wheels do beside their command (gyro noise in the loop, friction, a cycle of delay): it
moves body and wheels oppositely, so total momentum never feels it.  Measured are e, the rate and h,
each at its own times.  With ``edges`` the slope is driven by jumps of unequal size, one scale a step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..craft.model import WheelController
from ..kit.smoother import Measurements, Model, discretize

STATES = 10
ATTITUDE, RATE, FILTER, MOMENTUM, ERROR, TORQUE, SLOPE = 0, 1, 2, 6, 7, 8, 9
CHANNELS = ("attitude_error", "body_rate", "momentum")


@dataclass(frozen=True)
class Levels:
    """What is fitted on one axis, SI: sizes and times of the unknown processes and of the noises."""

    torque_Nm: float
    length_s: float
    error_white_rad: float
    rate_white_rad_s: float
    momentum_white_Nms: float
    error_slow_rad: float
    error_time_s: float
    reaction_Nm_sqrt_s: float  # square root of w_u's spectral density

    def logs(self) -> np.ndarray:
        return np.log([getattr(self, n) for n in self.__dataclass_fields__])

    @classmethod
    def from_logs(cls, p) -> Levels:
        return cls(*np.exp(p).tolist())


@dataclass(frozen=True)
class Body:
    """One axis of a body under control."""

    inertia_kgm2: float
    controller: WheelController

    def dynamics(self, v: Levels, edges: bool):
        """F, spectral density of the fixed noises, and of the slope's noise at scale 1; (10, 10) each."""
        k = self.controller
        w, z = k.rate_filter.natural_frequency, k.rate_filter.damping
        F, Q, drive = np.zeros((3, STATES, STATES))
        F[ATTITUDE, RATE] = 1
        F[RATE, [ATTITUDE, ERROR, FILTER + 2, TORQUE]] = (
            -k.kd_per_s * k.kp_per_s,
            -k.kd_per_s * k.kp_per_s,
            -k.kd_per_s,
            1,
        )
        F[MOMENTUM] = -F[RATE]
        F[MOMENTUM, TORQUE] = 0
        for stage, source in ((FILTER, RATE), (FILTER + 2, FILTER)):
            F[stage, stage + 1] = 1
            F[stage + 1, [source, stage, stage + 1]] = w**2, -(w**2), -2 * z * w
        F[ERROR, ERROR] = -1 / v.error_time_s
        Q[ERROR, ERROR] = 2 * v.error_slow_rad**2 / v.error_time_s
        rate = 0.0 if edges else np.sqrt(3) / v.length_s
        F[TORQUE, SLOPE] = 1
        F[SLOPE, [TORQUE, SLOPE]] = -(rate**2), -2 * rate
        drive[SLOPE, SLOPE] = slope_density(v) / self.inertia_kgm2**2
        spread = np.zeros(STATES)  # where w_u goes
        spread[RATE], spread[MOMENTUM] = 1, -1
        Q += (v.reaction_Nm_sqrt_s / self.inertia_kgm2) ** 2 * np.outer(spread, spread)
        return F, Q, drive

    def model(self, v: Levels, times: Times, *, edges: bool = False) -> Model:
        """The model at the measurement times, all scales 1."""
        I = self.inertia_kgm2  # noqa: E741
        F, Q, drive = self.dynamics(v, edges)
        A, fixed = discretize(F, Q, times.steps_s)
        driven = discretize(F, drive, times.steps_s)[1][None]
        H = np.zeros((3, STATES))
        H[0, [ATTITUDE, ERROR]] = -1
        H[1, RATE] = 1
        H[2, MOMENTUM] = I
        R = np.square([v.error_white_rad, v.rate_white_rad_s, v.momentum_white_Nms])
        slope = v.torque_Nm / I * np.sqrt(3) / v.length_s
        momentum = 10 * v.momentum_white_Nms / I + times.largest_rate_rad_s
        start = [
            times.largest_error_rad,
            *[times.largest_rate_rad_s] * 5,
            momentum,
            v.error_slow_rad,
            v.torque_Nm / I,
            slope,
        ]
        scale = np.ones((len(times.which), 1))
        return Model(A, fixed, driven, scale, times.which, H, R, np.zeros(STATES), np.diag(np.square(start)))


def slope_density(v: Levels) -> float:
    """Spectral density that gives a Matern-3/2 torque its size."""
    return 4 * (np.sqrt(3) / v.length_s) ** 3 * v.torque_Nm**2


@dataclass(frozen=True)
class Times:
    """The instants of a pass: every sample's, and those wanted beside them."""

    seconds: np.ndarray  # (N,)
    steps_s: np.ndarray  # the different steps
    which: np.ndarray  # (N,)
    wanted: np.ndarray  # (N,) bool
    largest_error_rad: float
    largest_rate_rad_s: float


@dataclass(frozen=True)
class Series:
    """One measured series of one axis: row of the model's H, seconds from the grid's start, values."""

    row: int
    seconds: np.ndarray
    values: np.ndarray


def arrange(series: list[Series], wanted_s: np.ndarray | None = None) -> tuple[Times, Measurements]:
    """Merge series of different times into one pass.  Times are taken to the millisecond."""
    everything = [np.round(s.seconds * 1e3).astype(np.int64) for s in series]
    extra = np.round(np.asarray([] if wanted_s is None else wanted_s) * 1e3).astype(np.int64)
    ms = np.unique(np.concatenate([*everything, extra]))
    place = np.concatenate([np.searchsorted(ms, e) for e in everything])
    row = np.concatenate([np.full(len(s.values), s.row) for s in series])
    value = np.concatenate([s.values for s in series])
    order = np.argsort(place, kind="stable")
    start = np.searchsorted(place[order], np.arange(len(ms) + 1))
    steps, which = np.unique(np.diff(ms), return_inverse=True)

    def largest(kind: int) -> float:
        return max((float(np.max(np.abs(s.values), initial=0.0)) for s in series if s.row == kind), default=0.0)

    wanted = np.isin(ms, extra)
    first = np.concatenate([[0], which])
    times = Times(ms / 1e3, steps / 1e3, first, wanted, 3 * largest(0) + 1e-4, 3 * largest(1) + 1e-5)
    return times, Measurements(start, row[order], value[order])
