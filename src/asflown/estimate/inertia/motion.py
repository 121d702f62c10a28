"""The motion of a slewing craft, the unknown constants beside it, and a first guess of both from the data.

Unknown constants: the tensor's six elements, H for each arc, T, the offsets of the wheels' and the rates' time stamps against
the attitude's, and the rates' bias.  Two scale errors are carried along without being estimated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.rigid_body import tensor_of
from ...kit.rotations import quaternion, rates_between, rotation, turned_by

if TYPE_CHECKING:
    from .record import SlewRecord

#: Instants closer than this are one. [s]
SAME_S = 1e-6
#: Time stamps are moved in whole steps of this; the rest of an offset is linear in the motion. [s]
_SHIFT_S = 0.02


@dataclass(frozen=True)
class Layout:
    """Where each unknown constant stands in beta; the two scales stand behind it."""

    arcs: int
    skew_wheels: int  # against the attitude, or against the rates where there is none
    skew_rates: int | None
    bias: slice | None
    size: int
    levers: int = 0
    swings: int = 0  # amplitudes of what swings, the last constants

    TENSOR = slice(0, 6)

    def momentum(self, arc: int) -> slice:
        return slice(6 + 3 * arc, 9 + 3 * arc)

    @property
    def torque(self) -> slice:
        return slice(6 + 3 * self.arcs, 9 + 3 * self.arcs)

    @property
    def pushes(self) -> slice:
        """The torque and the levers of the surroundings."""
        return slice(6 + 3 * self.arcs, 9 + 3 * self.arcs + 3 * self.levers)

    def momenta(self, beta: np.ndarray) -> np.ndarray:
        """Total momentum of each arc, inertial axes. (arcs, 3)"""
        return beta[6 : 6 + 3 * self.arcs].reshape(self.arcs, 3)

    def bias_at(self, axis: np.ndarray) -> np.ndarray:
        """Places of the rates' biases about these axes (m,)."""
        return axis + (0 if self.bias is None else self.bias.start)

    def shifts(self, beta: np.ndarray) -> tuple[float, float]:
        """By how much the wheels' and the rates' time stamps are moved. [s]"""
        both = float(beta[self.skew_wheels]), 0.0 if self.skew_rates is None else float(beta[self.skew_rates])
        return _SHIFT_S * round(both[0] / _SHIFT_S), _SHIFT_S * round(both[1] / _SHIFT_S)

    @property
    def amplitudes(self) -> slice:
        """Of what swings, over what the craft file says."""
        return slice(self.size - self.swings, self.size)

    @property
    def wheel_scale(self) -> int:
        return self.size

    @property
    def rate_scale(self) -> int:
        return self.size + 1

    @classmethod
    def of(cls, record: SlewRecord) -> Layout:
        at = 9 + 3 * len(record.arcs) + 3 * record.levers
        skew_wheels, at = at, at + 1
        skew_rates = bias = None
        if record.has_rates and record.has_attitude:
            skew_rates, at = at, at + 1
        if record.has_rates:
            bias, at = slice(at, at + 3), at + 3
        swings = len(record.swings)
        return cls(len(record.arcs), skew_wheels, skew_rates, bias, at + swings, record.levers, swings)


@dataclass(frozen=True)
class Motion:
    """A motion at instants (N,): attitude (N, 4), rate and acceleration (N, 3), body axes; parabolic between."""

    time_s: np.ndarray
    q_NB: np.ndarray
    omega_B: np.ndarray
    alpha_B: np.ndarray

    def at(self, time_s: np.ndarray) -> Motion:
        k = np.clip(np.searchsorted(self.time_s, time_s + SAME_S) - 1, 0, len(self.time_s) - 1)
        dt = time_s - self.time_s[k]
        turn = scipy.spatial.transform.Rotation.from_rotvec(turned(self.omega_B[k], self.alpha_B[k], dt))
        omega = self.omega_B[k] + self.alpha_B[k] * dt[:, None]
        return Motion(time_s, quaternion(rotation(self.q_NB[k]) * turn), omega, self.alpha_B[k])

    def moved(self, departure: np.ndarray) -> Motion:
        """By angle, rate and acceleration (N, >= 9)."""
        q = quaternion(rotation(self.q_NB) * scipy.spatial.transform.Rotation.from_rotvec(departure[:, :3]))
        return Motion(self.time_s, q, self.omega_B + departure[:, 3:6], self.alpha_B + departure[:, 6:9])


def turned(omega_B, alpha_B, dt) -> np.ndarray:
    """Rotation vector of a turn at a rate that grows linearly, to the second term of its series. (N, 3)"""
    dt = np.asarray(dt)[:, None]
    return omega_B * dt + 0.5 * alpha_B * dt**2 + np.cross(omega_B, alpha_B) * dt**3 / 12


def first_motion(record: SlewRecord, time_s: np.ndarray) -> Motion:
    """Straight from the data: attitude interpolated, or rates summed up where there is none."""
    if record.has_rates:
        tg, w = record.common_rates()
        omega = np.stack([np.interp(time_s, tg, w[:, j]) for j in range(3)], axis=1)
    if record.has_attitude:
        tq = record.attitude.time_s
        r = rotation(record.attitude.q_NB)
        mid, step = rates_between(tq, record.attitude.q_NB)
        k = np.clip(np.searchsorted(tq, time_s + SAME_S) - 1, 0, len(step) - 1)
        q = quaternion(r[k] * scipy.spatial.transform.Rotation.from_rotvec(step[k] * (time_s - tq[k])[:, None]))
        if not record.has_rates:
            omega = np.stack([np.interp(time_s, mid, step[:, j]) for j in range(3)], axis=1)
    else:
        q = quaternion(turned_by(time_s, omega))
    return Motion(time_s, q, omega, np.zeros((len(time_s), 3)))


@dataclass(frozen=True)
class Reference:
    """What the model is linearized about: values of the constants and a motion, for one record."""

    record: SlewRecord
    beta: np.ndarray
    motion: Motion

    @cached_property
    def layout(self) -> Layout:
        return Layout.of(self.record)

    @property
    def shifts(self) -> tuple[float, float]:
        """By how much the wheels' and the rates' time stamps are moved. [s]"""
        return self.layout.shifts(self.beta)

    @property
    def tensor(self) -> np.ndarray:
        return tensor_of(self.beta[self.layout.TENSOR])

    def step_of(self, time_s: np.ndarray) -> np.ndarray:
        """Index of the motion's instant at which something was measured."""
        return np.searchsorted(self.motion.time_s, time_s - 2 * SAME_S)


def instants(record: SlewRecord, beta: np.ndarray) -> np.ndarray:
    """When anything was measured, time stamps corrected, sorted, each once. [s]"""
    wheels, rates = Layout.of(record).shifts(beta)
    times = [record.momentum.time_s + wheels, record.rates.time_s + rates, record.attitude.time_s]
    every = np.sort(np.concatenate(times))
    return every[np.concatenate([[True], np.diff(every) > SAME_S])]
