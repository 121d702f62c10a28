"""The motion of a slewing craft, linearized about itself, and what every sensor says of it.

States are small departures from a reference motion, body axes: angle (3), rate (3), acceleration (3), and, where
there is attitude telemetry, its coloured error (3); where outside torques vary, momentum (3), inertial axes.  The reference is what the data say, so the model of the motion
is only how smooth it is: the acceleration walks randomly, in steps whose size differs from interval to interval
(a ramp's corner is one large step).  Nothing is assumed of the controller.

    wheels    d.h = d.(R^T (H + integral of T) - I w)     R: body to inertial, H: total momentum, inertial axes
    rates     w + bias                                    (001 eqs 3, 5, 9)
    attitude  angle + coloured error

Unknown constants: the tensor's six elements, H for each arc, T, the offsets of the wheels' and the rates' time
stamps against the attitude's, and the rates' bias.  Two scale errors are carried along without being estimated.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ...dynamics.momentum import grown_by
from ...dynamics.rigid_body import momentum_regressor, tensor_of
from ...kit.regressed import Steps
from ...kit.rotations import quaternion, rates_between, rotation, turned_by

if TYPE_CHECKING:
    from .levels import Levels
    from .record import SlewRecord

#: Instants closer than this are one. [s]
_SAME_S = 1e-6
#: Time stamps are moved in whole steps of this; the rest of an offset is linear in the motion. [s]
_SHIFT_S = 0.02
#: First departures from the reference, over one reading's noise: far wider than any, not so wide that rounding shows.
_FIRST = 100.0


@dataclass(frozen=True)
class Layout:
    """Where each unknown constant stands in beta; the two scales stand behind it."""

    arcs: int
    skew_wheels: int  # against the attitude, or against the rates where there is none
    skew_rates: int | None
    bias: slice | None
    size: int

    TENSOR = slice(0, 6)

    def momentum(self, arc: int) -> slice:
        return slice(6 + 3 * arc, 9 + 3 * arc)

    @property
    def torque(self) -> slice:
        return slice(6 + 3 * self.arcs, 9 + 3 * self.arcs)

    def shifts(self, beta: np.ndarray) -> tuple[float, float]:
        """By how much the wheels' and the rates' time stamps are moved. [s]"""
        both = float(beta[self.skew_wheels]), 0.0 if self.skew_rates is None else float(beta[self.skew_rates])
        return _SHIFT_S * round(both[0] / _SHIFT_S), _SHIFT_S * round(both[1] / _SHIFT_S)

    @property
    def wheel_scale(self) -> int:
        return self.size

    @property
    def rate_scale(self) -> int:
        return self.size + 1

    @classmethod
    def of(cls, record: SlewRecord) -> Layout:
        at = 9 + 3 * len(record.arcs)
        skew_wheels, at = at, at + 1
        skew_rates = bias = None
        if record.has_rates and record.has_attitude:
            skew_rates, at = at, at + 1
        if record.has_rates:
            bias, at = slice(at, at + 3), at + 3
        return cls(len(record.arcs), skew_wheels, skew_rates, bias, at)


@dataclass(frozen=True)
class Motion:
    """A motion at instants (N,): attitude (N, 4), rate and acceleration (N, 3), body axes; parabolic between."""

    time_s: np.ndarray
    q_NB: np.ndarray
    omega_B: np.ndarray
    alpha_B: np.ndarray

    def at(self, time_s: np.ndarray) -> Motion:
        k = np.clip(np.searchsorted(self.time_s, time_s + _SAME_S) - 1, 0, len(self.time_s) - 1)
        dt = time_s - self.time_s[k]
        turn = Rotation.from_rotvec(turned(self.omega_B[k], self.alpha_B[k], dt))
        omega = self.omega_B[k] + self.alpha_B[k] * dt[:, None]
        return Motion(time_s, quaternion(rotation(self.q_NB[k]) * turn), omega, self.alpha_B[k])

    def moved(self, departure: np.ndarray) -> Motion:
        """By angle, rate and acceleration (N, >= 9)."""
        q = quaternion(rotation(self.q_NB) * Rotation.from_rotvec(departure[:, :3]))
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
        k = np.clip(np.searchsorted(tq, time_s + _SAME_S) - 1, 0, len(step) - 1)
        q = quaternion(r[k] * Rotation.from_rotvec(step[k] * (time_s - tq[k])[:, None]))
        if not record.has_rates:
            omega = np.stack([np.interp(time_s, mid, step[:, j]) for j in range(3)], axis=1)
    else:
        q = quaternion(turned_by(time_s, omega))
    return Motion(time_s, q, omega, np.zeros((len(time_s), 3)))


#: Kinds of measurement.
WHEEL, RATE, ATTITUDE = 0, 1, 2


@dataclass(frozen=True)
class Linearized:
    """The model about one reference and one beta, ready to be run at any levels.

    ``kind`` (M,): WHEEL, RATE or ATTITUDE; ``unit`` (M,): one sigma of the level makes this of the measurement;
    ``source`` (M,): its number among the record's samples of its kind (three to an attitude); ``place`` (M,): among all."""

    record: SlewRecord
    layout: Layout
    beta: np.ndarray
    motion: Motion
    A: np.ndarray
    b: np.ndarray
    start: np.ndarray
    H: np.ndarray
    y: np.ndarray
    Z: np.ndarray  # (M, size + 2): constants, then the two scales
    kind: np.ndarray
    unit: np.ndarray
    source: np.ndarray
    place: np.ndarray
    walks: int  # 1: of the acceleration; 2: of the rate as well
    coloured: slice | None  # its states, where there are any
    wander: slice | None
    first: np.ndarray  # (3,), sigma of the first departure in angle, rate and acceleration
    steps_s: np.ndarray  # (kinds,), distinct steps
    which: np.ndarray  # (N,), which of them

    def at(self, levels: Levels, loosened: np.ndarray, kept: np.ndarray) -> Steps:
        """``loosened`` (N, 3 walks): variance of each step's walk over the level's; ``kept`` (M,) bool: no outlier."""
        dt, n = self.steps_s, self.A.shape[1]
        driven = [_walk(dt, n, j, 2) for j in range(3)]
        scale = [levels.jerk**2 * loosened[:, j] for j in range(3)]
        if self.walks == 2:
            driven += [_walk(dt, n, j, 1) for j in range(3)]
            scale += [levels.kick**2 * loosened[:, 3 + j] for j in range(3)]
        A, first = self.A, np.zeros((n, n))
        first[:9, :9] = np.diag(np.repeat(np.square(self.first), 3))
        if self.coloured is None:
            first[:3, :3] = 0.0  # no attitude telemetry: the inertial axes are the body's at the start
        else:
            part = self.coloured
            keep = np.exp(-dt / levels.coloured_s)
            driven.append(_noise(dt, n, part, 1 - keep**2))
            scale.append(np.full(len(self.which), levels.coloured**2))
            A = A.copy()
            A[:, part, part] = np.eye(3) * keep[self.which][:, None, None]
            first[part, part] = levels.coloured**2 * np.eye(3)
        if self.wander is not None:
            driven.append(_noise(dt, n, self.wander, dt))
            scale.append(np.full(len(self.which), levels.wander**2))
        sigma = np.array([levels.wheel, levels.rate, levels.attitude])[self.kind] * self.unit
        R = np.where(kept, sigma**2, 1e12 * sigma**2)  # an outlier stays in the tables, and says nothing
        return Steps(
            A,
            self.b,
            np.array(driven),
            self.which,
            np.column_stack(scale),
            self.start,
            self.H,
            self.y,
            self.Z,
            R,
            first,
        )


def _noise(dt: np.ndarray, n: int, part: slice, variance: np.ndarray) -> np.ndarray:
    """White noise on three states. (kinds, n, n)"""
    Q = np.zeros((len(dt), n, n))
    Q[:, part, part] = np.eye(3) * variance[:, None, None]
    return Q


def _walk(dt: np.ndarray, n: int, axis: int, last: int) -> np.ndarray:
    """Covariance per unit intensity of one axis whose acceleration (``last`` 2) or rate (1) walks. (kinds, n, n)"""
    Q = np.zeros((len(dt), n, n))
    for a in range(last + 1):
        for c in range(last + 1):
            p, q = last - a, last - c  # a step of what walks grows into angle and rate as t^p / p!
            Q[:, 3 * a + axis, 3 * c + axis] = dt ** (p + q + 1) / ((p + q + 1) * factorial(p) * factorial(q))
    return Q


def instants(record: SlewRecord, layout: Layout, beta: np.ndarray) -> np.ndarray:
    """When anything was measured, time stamps mended, sorted, each once. [s]"""
    wheels, rates = layout.shifts(beta)
    times = [record.momentum.time_s + wheels, record.rates.time_s + rates, record.attitude.time_s]
    every = np.sort(np.concatenate(times))
    return every[np.concatenate([[True], np.diff(every) > _SAME_S])]


def linearized(
    record: SlewRecord, layout: Layout, beta: np.ndarray, motion: Motion, frame: str, noise: Levels, seen: np.ndarray
) -> Linearized:
    """About a motion given at ``instants(record, layout, beta)``.  ``frame`` of the torque: 'body' or 'inertial';
    ``noise``: levels of about the right size; ``seen`` (3, 3): projector onto the directions about which the body
    really turns.  What jitters about the others is motion too, but tells nothing of the tensor worth believing."""
    t = motion.time_s
    coloured = slice(9, 12) if record.has_attitude else None
    at = 12 if record.has_attitude else 9
    wander = slice(at, at + 3) if noise.wander > 0 else None
    n = at + (0 if wander is None else 3)
    dt = np.diff(t)
    N = len(t)
    r = rotation(motion.q_NB)
    R = r.as_matrix()

    turn = Rotation.from_rotvec(turned(motion.omega_B[:-1], motion.alpha_B[:-1], dt))
    A = np.zeros((N, n, n))
    A[1:, :3, :3] = turn.inv().as_matrix()
    # a departure in rate turns with the body while it adds up: half the turn, on average
    half = Rotation.from_rotvec(-0.5 * motion.omega_B[:-1] * dt[:, None]).as_matrix()
    A[1:, :3, 3:6] = half * dt[:, None, None]
    A[1:, :3, 6:9] = half * (0.5 * dt**2)[:, None, None]
    A[:, range(3, n), range(3, n)] = 1.0
    A[1:, range(3, 6), range(6, 9)] = dt[:, None]
    b = np.zeros((N, n))
    b[1:, :3] = (r[1:].inv() * r[:-1] * turn).as_rotvec()
    b[1:, 3:6] = motion.omega_B[:-1] + motion.alpha_B[:-1] * dt[:, None] - motion.omega_B[1:]
    b[1:, 6:9] = motion.alpha_B[:-1] - motion.alpha_B[1:]

    rows = [_wheel_rows(record, layout, beta, motion, R, frame, n, seen, wander)]
    if record.has_rates:
        rows.append(_rate_rows(record, layout, beta, motion, n))
    if record.has_attitude:
        rows.append(_attitude_rows(record, motion, n, layout.size + 2))
    step, H, y, Z, unit = (np.concatenate([row[k] for row in rows]) for k in range(5))
    kind = np.repeat(
        [WHEEL, RATE, ATTITUDE][: len(rows)] if record.has_rates else [WHEEL, ATTITUDE], [len(row[0]) for row in rows]
    )
    source = np.concatenate([np.arange(len(row[0])) for row in rows])
    order = np.argsort(step, kind="stable")
    start = np.searchsorted(step[order], np.arange(N + 1))
    steps_s, which = np.unique(np.round(np.append(0.0, dt), 9), return_inverse=True)
    return Linearized(
        record, layout, beta, motion, A, b, start, H[order], y[order], Z[order], kind[order], unit[order], source[order], order,
        2 if noise.kick > 0 else 1, coloured, wander, _FIRST * np.array([noise.attitude, noise.rate, noise.rate * N / (t[-1] - t[0])]), steps_s, which,
    )  # fmt: skip


def _step_of(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    return np.searchsorted(motion.time_s, time_s - 2 * _SAME_S)


def _wheel_rows(record, layout, beta, motion, R, frame, n, seen, wander):
    m = record.momentum
    shift = layout.shifts(beta)[0]
    k = _step_of(motion, m.time_s + shift)
    d, I_B = m.direction, tensor_of(beta[layout.TENSOR])
    grown = grown_by(motion.time_s, R, frame)
    added = grown @ beta[layout.torque]
    starts = beta[6 : 6 + 3 * layout.arcs].reshape(layout.arcs, 3)
    w, alpha, Rk = motion.omega_B[k], motion.alpha_B[k], R[k]
    L = np.einsum("nji,nj->ni", Rk, starts[m.arc] + added[k])  # of everything, body axes
    predicted = L - w @ I_B
    H = np.zeros((len(k), n))
    H[:, :3] = np.cross(d, L)
    H[:, 3:6] = -d @ I_B
    Z = np.zeros((len(k), layout.size + 2))
    Z[:, layout.TENSOR] = -np.einsum("ni,nik->nk", d, momentum_regressor(w @ seen))
    inertial = np.einsum("nij,nj->ni", Rk, d)
    if wander is not None:
        H[:, wander] = inertial
    for arc in range(layout.arcs):
        here = m.arc == arc
        Z[here, layout.momentum(arc)] = inertial[here]
    Z[:, layout.torque] = np.einsum("ni,nij->nj", inertial, grown[k])
    Z[:, layout.skew_wheels] = np.sum(d * (-np.cross(w, L) - alpha @ I_B), axis=1)
    Z[:, layout.wheel_scale] = -np.sum(d * predicted, axis=1)
    late = Z[:, layout.skew_wheels] * (beta[layout.skew_wheels] - shift)
    return k, H, m.value_Nms - np.sum(d * predicted, axis=1) - late, Z, m.unit / np.sqrt(m.count)


def _rate_rows(record, layout, beta, motion, n):
    g = record.rates
    shift = layout.shifts(beta)[1]
    k = _step_of(motion, g.time_s + shift)
    w = motion.omega_B[k, g.axis]
    H, Z = np.zeros((len(k), n)), np.zeros((len(k), layout.size + 2))
    every = np.arange(len(k))
    H[every, 3 + g.axis] = 1.0
    Z[every, layout.bias.start + g.axis] = 1.0
    y = g.value_rad_s - w - beta[layout.bias][g.axis]
    if layout.skew_rates is not None:
        Z[:, layout.skew_rates] = motion.alpha_B[k, g.axis]
        y -= Z[:, layout.skew_rates] * (beta[layout.skew_rates] - shift)
    Z[:, layout.rate_scale] = w
    return k, H, y, Z, 1 / np.sqrt(g.count)


def _attitude_rows(record, motion, n, columns):
    a = record.attitude
    k = _step_of(motion, a.time_s)
    away = (rotation(motion.q_NB[k]).inv() * rotation(a.q_NB)).as_rotvec()
    H = np.zeros((3 * len(k), n))
    every = np.arange(3 * len(k))
    H[every, every % 3] = 1.0
    H[every, 9 + every % 3] = 1.0
    return np.repeat(k, 3), H, away.ravel(), np.zeros((3 * len(k), columns)), np.repeat(1 / np.sqrt(a.count), 3)
