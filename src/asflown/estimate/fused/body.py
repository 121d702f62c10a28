"""What the fused method's models share: one axis of a body, what was measured on it, and a torque as a random process.

A model of one axis is a linear stochastic one whose last two states are the torque and its slope.  All
torques, momenta and their slopes are held per unit of the axis's moment of inertia, which keeps every
state of one size.

    T'     = slope
    slope' = -2 k slope - k^2 T + w        k = sqrt(3)/length: a Matern-3/2 torque of a given size
                                           k = 0: an integrated Wiener process; k = 0, w = 0: a straight line
    slope' = k^2 c                         ``curved``, with a third state: a Matern-5/2 torque, k = sqrt(5)/length, whose
    c'     = -k T - 3 slope - 3 k c + w    curvature k^2 c is continuous too
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar

import numpy as np

from ...kit.ensemble import respond
from ...kit.smoother import Measurements, Model, Smoothed, discretize, smooth
from .series import Times, arrange, channel_of, step_of


@dataclass(frozen=True)
class Levels:
    """What is fitted on one axis, SI: sizes and times of the unknown processes and of the noises, all positive."""

    torque_Nm: float
    length_s: float

    def logs(self) -> np.ndarray:
        return np.log([getattr(self, f.name) for f in fields(self)])

    @classmethod
    def from_logs(cls, p):
        return cls(*np.exp(p).tolist())


@dataclass(frozen=True, kw_only=True)
class Body:
    """One axis of a body.  A kind of body adds its own states, its Levels and what it measures.

    ``wiener``: the torque is an integrated Wiener process, not a Matern one."""

    inertia_kgm2: float
    wiener: bool = False
    curved: bool = False

    RATE: ClassVar[int]  # index of the body rate, and of the actuators' momentum
    STORED: ClassVar[int]
    SPREAD: ClassVar[tuple[float, ...]]  # of the weak log-normal priors, in the order of the Levels
    NARROWS: ClassVar[bool] = True  # whether the data may say how far off what is taken as known is

    @property
    def torque(self) -> int:
        """Index of the torque, and number of the states before it."""
        raise NotImplementedError

    @property
    def slope(self) -> int:
        return self.torque + 1

    @property
    def states(self) -> int:
        """How many."""
        return self.torque + (3 if self.curved else 2)

    def dynamics(self, v) -> tuple[np.ndarray, np.ndarray]:
        """F and spectral density of all but the torque's own rows."""
        raise NotImplementedError

    def measured(self, v) -> tuple[np.ndarray, np.ndarray]:
        """H (rows, n) and the white noise of each row."""
        raise NotImplementedError

    def start(self, v, times: Times) -> np.ndarray:
        """Standard deviation of every state but the torque's own at the first instant."""
        raise NotImplementedError

    def timing_s(self, v) -> float:  # noqa: ARG002
        """One sigma of a sample's instant."""
        return 0.0

    def starting_levels(self, series):
        """Levels to start a fit from, from the series alone."""
        raise NotImplementedError

    def sensitivities(self, axis: AxisData, best: Smoothed) -> dict[str, np.ndarray]:
        """By what each measurement (M,) of an axis of this body changes where a quantity taken as known is off.

        Names are those of ``fuse.CONSIDERED``; per share of the quantity, or per second.  ``best``: states smoothed with
        the quantities as given."""
        raise NotImplementedError

    def model(self, v, times: Times, length_s: float, size_Nm, steps_Nm: np.ndarray | None = None) -> Model:
        """The model at the instants of a pass; ``size_Nm``: of the torque, one for all or (N,); ``steps_Nm``: (N,), a random walk
        of the torque beside, in a second."""
        F, Q = self.dynamics(v)
        driven_state, drive, start = self._free_torque(F, length_s)
        drive = drive / self.inertia_kgm2**2
        one = np.ndim(size_Nm) == 0  # no part of the noise differs from step to step
        if one:
            Q[driven_state, driven_state] = drive * size_Nm**2
        A, fixed = discretize(F, Q, times.steps_s)
        driven, scale = np.empty((0, *A.shape)), np.empty((len(times.seconds), 0))
        for state, by, size in (
            (driven_state, drive, None if one else size_Nm),
            (self.torque, 1 / self.inertia_kgm2**2, steps_Nm),
        ):
            if size is not None:
                D = np.zeros_like(Q)
                D[state, state] = by
                driven = np.concatenate([driven, discretize(F, D, times.steps_s)[1][None]])
                scale = np.column_stack([scale, np.square(size)])
        # a Wiener torque has no size of its own: it starts within ten times what a Matern one would be
        first = np.ravel(size_Nm)[0] / self.inertia_kgm2 * (10 if self.wiener else 1)
        covariance = np.zeros_like(Q)
        np.fill_diagonal(covariance[: self.torque, : self.torque], self.start(v, times) ** 2)
        covariance[self.torque :, self.torque :] = first**2 * start
        H, white = self.measured(v)
        H, R = H[times.base], (white**2 + times.quantum**2 / 12)[times.base] + (self.timing_s(v) * times.steep) ** 2
        return Model(A, fixed, driven, scale, times.which, H, R, np.zeros(self.states), covariance)

    def _free_torque(self, F: np.ndarray, length_s: float) -> tuple[int, float, np.ndarray]:
        """Lay a torque of unit size into F: the state that is driven, by how much, and the stationary covariance of its states."""
        T, S = self.torque, self.slope
        F[T, S] = 1
        if not self.curved:
            k = np.sqrt(3) / length_s
            if not self.wiener:
                F[S, [T, S]] = -(k**2), -2 * k
            return S, 4 * k**3, np.diag([1, k**2])
        k, C = np.sqrt(5) / length_s, S + 1
        F[S, C] = k**2
        F[C, [T, S, C]] = -k, -3, -3 * k
        return C, 16 / 3 * k, np.array([[1, 0, -1 / 3], [0, k**2 / 3, 0], [-1 / 3, 0, 1]])

    def smooth_model(self, v, times: Times) -> Model:
        """With the torque of the fitted levels."""
        return self.model(v, times, v.length_s, v.torque_Nm)

    def lines(self, v, times: Times) -> np.ndarray:
        """Transitions (types, n, n) under which the torque is a straight line."""
        F, Q = self.dynamics(v)
        F[self.torque, self.slope] = 1
        return discretize(F, Q, times.steps_s)[0]


#: A torque [N m] known beforehand, at given instants [s].
Known = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class AxisData:
    """One axis: its body, levels, and what was measured.

    As the fused method hands it on, levels are fitted, and outliers and the coupling to other axes are taken off.
    ``columns``: (M, P), what one sigma of each quantity taken as known does to the measurements; ``start_s``: of the pass,
    from the telemetry's epoch."""

    body: Body
    levels: Levels
    times: Times
    data: Measurements
    columns: np.ndarray
    start_s: float = 0.0

    @classmethod
    def of(cls, body: Body, levels: Levels, series, wanted_s: np.ndarray | None = None) -> AxisData:
        """Series arranged into one pass; nothing is taken as known."""
        times, data = arrange(series, wanted_s)
        return cls(body, levels, times, data, np.empty((len(data.row), 0)))

    @property
    def time_s(self) -> np.ndarray:
        """Instants of the pass from the epoch. (N,)"""
        return self.start_s + self.times.seconds

    @property
    def measured_s(self) -> np.ndarray:
        """When each measurement was taken, from the epoch. (M,)"""
        return self.time_s[step_of(self.data)]

    @property
    def channel(self) -> np.ndarray:
        """Row in ROWS of each measurement. (M,)"""
        return channel_of(self.times, self.data)

    @property
    def model(self) -> Model:
        """With the torque of the fitted levels."""
        return self.body.smooth_model(self.levels, self.times)

    def smooth_torque(self) -> np.ndarray:
        """Of the fitted levels, at the instants of the pass. (N,) [N m]"""
        best = smooth(self.model, self.data)
        return self.body.inertia_kgm2 * best.mean[:, self.body.torque]

    def response(self, torque_Nm) -> np.ndarray:
        """Measurements (M,) or (M, C), without noise, of torques (N,) or (N, C) [N m], linear between instants."""
        body, torque = self.body, np.asarray(torque_Nm, float) / self.body.inertia_kgm2
        columns = torque[:, None] if torque.ndim == 1 else torque
        lines = body.lines(self.levels, self.times)
        out = respond(lines, self.model, self.data, body.torque, body.slope, columns)
        return out[:, 0] if torque.ndim == 1 else out

    def moved(self, torque_Nm: np.ndarray) -> np.ndarray:
        """States (N, n), at the instants of the pass, of a craft at rest driven by a torque (N,) [N m]."""
        body, model, (N, n) = self.body, self.model, (len(self.times.seconds), self.body.states)
        read = Measurements(n * np.arange(N + 1), np.tile(np.arange(n), N), np.zeros(n * N))
        seen = replace(model, H=np.eye(n))
        column = np.asarray(torque_Nm, float)[:, None] / body.inertia_kgm2
        return respond(body.lines(self.levels, self.times), seen, read, body.torque, body.slope, column).reshape(N, n)

    def without(self, torque_Nm: np.ndarray) -> AxisData:
        """The same less what a known torque (N,), at the instants of the pass, does."""
        return replace(self, data=replace(self.data, value=self.data.value - self.response(torque_Nm)))

    def without_known(self, known: Known | None) -> AxisData:
        """The same less what a torque known at any time does; None: there is none."""
        return self if known is None else self.without(known(self.times.seconds))

    def until(self, stop_s: float) -> AxisData:
        """The same less what was measured later [s from the epoch]."""
        n = int(np.sum(self.measured_s <= stop_s))  # they are in order of time
        start, row, value = self.data.start, self.data.row, self.data.value
        return replace(self, data=Measurements(np.minimum(start, n), row[:n], value[:n]), columns=self.columns[:n])

    def answers(self, nodes_s: np.ndarray) -> np.ndarray:
        """Measurements (M, C) of torques of 1 N m at each node, falling linearly to zero at the neighbouring nodes."""
        return self.response(hats(self.time_s, nodes_s))


def hats(time_s: np.ndarray, nodes_s: np.ndarray) -> np.ndarray:
    """Values (N, C) at some instants of piecewise linear functions that are 1 at one of the even nodes, 0 at all others."""
    return np.maximum(1 - np.abs(np.asarray(time_s)[:, None] - nodes_s) / (nodes_s[1] - nodes_s[0]), 0.0)


@dataclass(frozen=True)
class Posterior:
    """The torque of one axis given its measurements, on the instants of a pass.

    ``mean``: (N,) [N m]; ``paths``: (K, N), drawn jointly; ``considered``: (K, P), drawn, of the quantities
    taken as known, in units of their sigma; ``whitened``: (M,), innovations over their sigma; ``explained``: whether the
    prior's torques explain the data; ``peak_scale``: by what the sigma of peaks is multiplied (``peaks.peak_scale``)."""

    mean: np.ndarray
    paths: np.ndarray
    considered: np.ndarray
    whitened: np.ndarray
    settings: dict = field(default_factory=dict)
    explained: bool = True
    peak_scale: float = 1.0
