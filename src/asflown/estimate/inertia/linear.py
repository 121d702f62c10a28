"""The motion of a slewing craft, linearized about a reference, and what every sensor says of it.

States are small departures from the reference, body axes: angle (3), rate (3), acceleration (3), and, where there is attitude
telemetry, its coloured error (3); where external torques vary, momentum (3), or a slow torque and its momentum (6), inertial axes.  The reference is what the data
say, so the model of the motion is only how smooth it is: the acceleration is a random walk whose step size differs from
interval to interval (a ramp's corner is one large step).  Nothing is assumed of the controller.

    wheels    d.h = d.(R^T (H + integral of T) - I w)     R: body to inertial, H: total momentum, inertial axes
    rates     w + bias                                    (Feldman and Lee eqs 3, 5, 9)
    attitude  angle + coloured error
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.momentum import grown_by
from ...dynamics.rigid_body import momentum_regressor
from ...kit.regressed import Steps
from ...kit.rotations import rotation
from .motion import Layout, Motion, Reference, turned

if TYPE_CHECKING:
    from .levels import Levels
    from .record import SlewRecord

#: First departures from the reference, over one reading's noise: far wider than any, not so wide that rounding shows.
_FIRST = 100.0
#: Variance of an outlier over that of its neighbours: it stays in the tables and has no weight.
OUTLIER_VARIANCE = 1e12
#: Kinds of measurement.
WHEEL, RATE, ATTITUDE = 0, 1, 2


@dataclass(frozen=True)
class States:
    """Where the states stand behind angle, rate and acceleration; None for what is not modelled."""

    coloured: slice | None
    wander: slice | None
    slow: slice | None  # momentum that a slow torque has brought, and that torque, inertial axes
    size: int

    @classmethod
    def of(cls, record: SlewRecord, noise: Levels) -> States:
        size = 9
        coloured = wander = slow = None
        if record.has_attitude:
            coloured, size = slice(size, size + 3), size + 3
        if noise.wander > 0:
            wander, size = slice(size, size + 3), size + 3
        if noise.slow > 0:
            slow, size = slice(size, size + 6), size + 6
        return cls(coloured, wander, slow, size)


@dataclass(frozen=True)
class Linearized:
    """The model about one reference, ready to be run at any levels.

    ``kind`` (M,): WHEEL, RATE or ATTITUDE; ``unit`` (M,): one sigma of the level makes this of the measurement;
    ``source`` (M,): its number among the record's samples of its kind (three to an attitude); ``place`` (M,): among all."""

    about: Reference
    states: States
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
    first: np.ndarray  # (3,), sigma of the first departure in angle, rate and acceleration
    steps_s: np.ndarray  # (kinds,), distinct steps
    which: np.ndarray  # (N,), which of them

    @property
    def layout(self) -> Layout:
        return self.about.layout

    def at(self, levels: Levels, loosened: np.ndarray, kept: np.ndarray) -> Steps:
        """``loosened`` (N, 3 walks): variance of each step's walk over the level's; ``kept`` (M,) bool: no outlier."""
        dt, n = self.steps_s, self.states.size
        driven = [_walk(dt, n, j, 2) for j in range(3)]
        scale = [levels.jerk**2 * loosened[:, j] for j in range(3)]
        if self.walks == 2:
            driven += [_walk(dt, n, j, 1) for j in range(3)]
            scale += [levels.kick**2 * loosened[:, 3 + j] for j in range(3)]
        A, first = self.A, np.zeros((n, n))
        first[:9, :9] = np.diag(np.repeat(np.square(self.first), 3))
        if self.states.coloured is None:
            first[:3, :3] = 0.0  # no attitude telemetry: the inertial axes are the body's at the start
        else:
            part = self.states.coloured
            keep = np.exp(-dt / levels.coloured_s)
            driven.append(_noise(dt, n, part, 1 - keep**2))
            scale.append(np.full(len(self.which), levels.coloured**2))
            A = A.copy()
            A[:, part, part] = np.eye(3) * keep[self.which][:, None, None]
            first[part, part] = levels.coloured**2 * np.eye(3)
        if self.states.wander is not None:
            driven.append(_noise(dt, n, self.states.wander, dt))
            scale.append(np.full(len(self.which), levels.wander**2))
        if self.states.slow is not None:
            brought, torque = _halves(self.states.slow)
            keep, driven_by = _slow_torque(dt, n, brought, torque, levels.slow_s)
            driven.append(driven_by)
            scale.append(np.full(len(self.which), levels.slow**2))
            A = A.copy()
            A[:, torque, torque] = np.eye(3) * keep[self.which][:, None, None]
            A[:, brought, torque] = np.eye(3) * (levels.slow_s * (1 - keep))[self.which][:, None, None]
            first[torque, torque] = levels.slow**2 * np.eye(3)
        sigma = np.array([levels.wheel, levels.rate, levels.attitude])[self.kind] * self.unit
        R = np.where(kept, sigma**2, OUTLIER_VARIANCE * sigma**2)
        return Steps(
            A, self.b, np.array(driven), self.which, np.column_stack(scale), self.start, self.H,
            self.y, self.Z, R, first,
        )  # fmt: skip


def _noise(dt: np.ndarray, n: int, part: slice, variance: np.ndarray) -> np.ndarray:
    """White noise on three states. (kinds, n, n)"""
    Q = np.zeros((len(dt), n, n))
    Q[:, part, part] = np.eye(3) * variance[:, None, None]
    return Q


def _halves(part: slice) -> tuple[slice, slice]:
    return slice(part.start, part.start + 3), slice(part.start + 3, part.stop)


def _slow_torque(
    dt: np.ndarray, n: int, brought: slice, torque: slice, forgets_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """What a first-order Gauss-Markov torque of unit variance keeps over each step (kinds,), and the covariance of what is new
    in it and in the momentum that it brings (kinds, n, n)."""
    x, s = dt / forgets_s, forgets_s
    lost = -np.expm1(-x)
    # the closed form loses its digits in short steps
    short = x**3 * (2 / 3 - x / 2 + 7 * x**2 / 30)
    momentum = s**2 * np.where(x < 1e-2, short, 2 * x - 4 * lost + lost * (2 - lost))
    Q, eye = np.zeros((len(dt), n, n)), np.eye(3)
    Q[:, torque, torque] = eye * (lost * (2 - lost))[:, None, None]
    Q[:, brought, torque] = Q[:, torque, brought] = eye * (s * lost**2)[:, None, None]
    Q[:, brought, brought] = eye * momentum[:, None, None]
    return 1 - lost, Q


def _walk(dt: np.ndarray, n: int, axis: int, last: int) -> np.ndarray:
    """Covariance per unit intensity of one axis whose acceleration (``last`` 2) or rate (1) walks. (kinds, n, n)"""
    Q = np.zeros((len(dt), n, n))
    for a in range(last + 1):
        for c in range(last + 1):
            p, q = last - a, last - c  # a step of what walks grows into angle and rate as t^p / p!
            Q[:, 3 * a + axis, 3 * c + axis] = dt ** (p + q + 1) / ((p + q + 1) * factorial(p) * factorial(q))
    return Q


def linearized(about: Reference, frame: str, noise: Levels, seen: np.ndarray) -> Linearized:
    """About a motion given at the ``instants`` of its record and constants.

    ``frame`` of the torque: 'body' or 'inertial'; ``noise``: levels of about the right size; ``seen`` (3, 3): projector onto
    the directions about which the body slews.  Jitter about the others is motion too, but has no weight in the tensor."""
    record, t = about.record, about.motion.time_s
    states = States.of(record, noise)
    A, b = _transitions(about.motion, states.size)
    N, dt = len(t), np.diff(t)
    rows = {WHEEL: _wheel_rows(about, states, frame, seen)}
    if record.has_rates:
        rows[RATE] = _rate_rows(about, states)
    if record.has_attitude:
        rows[ATTITUDE] = _attitude_rows(about, states)
    step, H, y, Z, unit = (np.concatenate([row[k] for row in rows.values()]) for k in range(5))
    counts = [len(row[0]) for row in rows.values()]
    kind = np.repeat(list(rows), counts)
    source = np.concatenate([np.arange(count) for count in counts])
    order = np.argsort(step, kind="stable")
    start = np.searchsorted(step[order], np.arange(N + 1))
    steps_s, which = np.unique(np.round(np.append(0.0, dt), 9), return_inverse=True)
    first = _FIRST * np.array([noise.attitude, noise.rate, noise.rate * N / (t[-1] - t[0])])
    return Linearized(
        about, states, A, b, start, H[order], y[order], Z[order], kind[order], unit[order], source[order], order,
        2 if noise.kick > 0 else 1, first, steps_s, which,
    )  # fmt: skip


def _transitions(motion: Motion, n: int) -> tuple[np.ndarray, np.ndarray]:
    """How departures go over from step to step, (N, n, n), and what the reference itself departs by, (N, n)."""
    dt, N = np.diff(motion.time_s), len(motion.time_s)
    r = rotation(motion.q_NB)
    turn = scipy.spatial.transform.Rotation.from_rotvec(turned(motion.omega_B[:-1], motion.alpha_B[:-1], dt))
    A = np.zeros((N, n, n))
    A[1:, :3, :3] = turn.inv().as_matrix()
    # a departure in rate turns with the body while it adds up: half the turn, on average
    half = scipy.spatial.transform.Rotation.from_rotvec(-0.5 * motion.omega_B[:-1] * dt[:, None]).as_matrix()
    A[1:, :3, 3:6] = half * dt[:, None, None]
    A[1:, :3, 6:9] = half * (0.5 * dt**2)[:, None, None]
    A[:, range(3, n), range(3, n)] = 1.0
    A[1:, range(3, 6), range(6, 9)] = dt[:, None]
    b = np.zeros((N, n))
    b[1:, :3] = (r[1:].inv() * r[:-1] * turn).as_rotvec()
    b[1:, 3:6] = motion.omega_B[:-1] + motion.alpha_B[:-1] * dt[:, None] - motion.omega_B[1:]
    b[1:, 6:9] = motion.alpha_B[:-1] - motion.alpha_B[1:]
    return A, b


#: Of one kind of measurement: step (m,), H (m, n), y (m,), Z (m, size + 2), unit (m,).
_Measured = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _wheel_rows(about: Reference, states: States, frame: str, seen: np.ndarray) -> _Measured:
    m, layout, beta, motion = about.record.momentum, about.layout, about.beta, about.motion
    shift = about.shifts[0]
    k = about.step_of(m.time_s + shift)
    R = rotation(motion.q_NB).as_matrix()
    d, I_B = m.direction, about.tensor
    grown = grown_by(motion.time_s, R, frame)
    around = about.record.surroundings
    if layout.levers and around is not None:
        grown = np.concatenate([grown, around.grown(motion.time_s, R)], axis=2)
    added = grown @ beta[layout.pushes]
    gravity = about.record.grown_by_gravity(motion.time_s, R)
    if gravity is not None:
        added = added + gravity @ beta[layout.TENSOR]
    w, alpha, Rk = motion.omega_B[k], motion.alpha_B[k], R[k]
    L = np.einsum("nji,nj->ni", Rk, layout.momenta(beta)[m.arc] + added[k])  # of everything, body axes
    predicted = L - w @ I_B
    held = np.zeros((len(k), 3, layout.swings))
    for j, swing in enumerate(about.record.swings):
        held[:, :, j] = swing.momentum(motion.time_s, motion.alpha_B)[k]
    predicted = predicted - held @ beta[layout.amplitudes]
    H = np.zeros((len(k), states.size))
    H[:, :3] = np.cross(d, L)
    H[:, 3:6] = -d @ I_B
    Z = np.zeros((len(k), layout.size + 2))
    Z[:, layout.TENSOR] = -np.einsum("ni,nik->nk", d, momentum_regressor(w @ seen))
    inertial = np.einsum("nij,nj->ni", Rk, d)
    if gravity is not None:
        Z[:, layout.TENSOR] += np.einsum("ni,nik->nk", inertial, gravity[k])
    if states.wander is not None:
        H[:, states.wander] = inertial
    if states.slow is not None:
        H[:, _halves(states.slow)[0]] = inertial
    for arc in range(layout.arcs):
        here = m.arc == arc
        Z[here, layout.momentum(arc)] = inertial[here]
    Z[:, layout.pushes] = np.einsum("ni,nij->nj", inertial, grown[k])
    Z[:, layout.amplitudes] = -np.einsum("ni,nij->nj", d, held)
    Z[:, layout.skew_wheels] = np.sum(d * (-np.cross(w, L) - alpha @ I_B), axis=1)
    Z[:, layout.wheel_scale] = -np.sum(d * predicted, axis=1)
    late = Z[:, layout.skew_wheels] * (beta[layout.skew_wheels] - shift)
    return k, H, m.value_Nms - np.sum(d * predicted, axis=1) - late, Z, m.unit / np.sqrt(m.count)


def _rate_rows(about: Reference, states: States) -> _Measured:
    g, layout, beta, motion = about.record.rates, about.layout, about.beta, about.motion
    shift = about.shifts[1]
    k = about.step_of(g.time_s + shift)
    w = motion.omega_B[k, g.axis]
    H, Z = np.zeros((len(k), states.size)), np.zeros((len(k), layout.size + 2))
    every = np.arange(len(k))
    bias = layout.bias_at(g.axis)
    H[every, 3 + g.axis] = 1.0
    Z[every, bias] = 1.0
    y = g.value_rad_s - w - beta[bias]
    if layout.skew_rates is not None:
        Z[:, layout.skew_rates] = motion.alpha_B[k, g.axis]
        y -= Z[:, layout.skew_rates] * (beta[layout.skew_rates] - shift)
    Z[:, layout.rate_scale] = w
    return k, H, y, Z, 1 / np.sqrt(g.count)


def _attitude_rows(about: Reference, states: States) -> _Measured:
    a = about.record.attitude
    k = about.step_of(a.time_s)
    away = (rotation(about.motion.q_NB[k]).inv() * rotation(a.q_NB)).as_rotvec()
    H = np.zeros((3 * len(k), states.size))
    every = np.arange(3 * len(k))
    H[every, every % 3] = 1.0
    H[every, 9 + every % 3] = 1.0
    Z = np.zeros((3 * len(k), about.layout.size + 2))
    return np.repeat(k, 3), H, away.ravel(), Z, np.repeat(1 / np.sqrt(a.count), 3)
