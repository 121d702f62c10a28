"""What the fused method's models share: series at their own times, and a torque as a random process.

A model of one axis is a linear stochastic one whose last two states are the torque and its slope.  All
torques, momenta and their slopes are held per unit of the axis's moment of inertia, which keeps every
state of one size.

    T'     = slope
    slope' = -2 k slope - k^2 T + w        k = sqrt(3)/length: a Matern-3/2 torque of a given size
                                           k = 0: an integrated Wiener process; k = 0, w = 0: a straight line
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...kit.ensemble import respond
from ...kit.smoother import Measurements, Model, Smoothed, discretize

if TYPE_CHECKING:
    from .series import Times


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

    STATES: ClassVar[int]
    RATE: ClassVar[int]  # index of the body rate, and of the actuators' momentum
    STORED: ClassVar[int]
    SPREAD: ClassVar[tuple[float, ...]]  # of the weak log-normal priors, in the order of the Levels
    SEARCH: ClassVar[tuple[float, ...]] = (1e-8,)  # steps of the likelihood's gradient, one search after the other
    NARROWS: ClassVar[bool] = True  # whether the data may say how far off what is taken as known is

    @property
    def torque(self) -> int:
        return self.STATES - 2

    @property
    def slope(self) -> int:
        return self.STATES - 1

    def dynamics(self, v) -> tuple[np.ndarray, np.ndarray]:
        """F and spectral density of all but the torque's own two rows."""
        raise NotImplementedError

    def measured(self, v) -> tuple[np.ndarray, np.ndarray]:
        """H (rows, n) and the white noise of each row."""
        raise NotImplementedError

    def start(self, v, times: Times) -> np.ndarray:
        """Standard deviation of every state but the torque's two at the first instant."""
        raise NotImplementedError

    def timing_s(self, v) -> float:
        """One sigma of a sample's instant."""
        return 0.0

    def starting_levels(self, series):
        """Levels to start a fit from, from the series alone."""
        raise NotImplementedError

    def sensitivities(self, v, times: Times, data: Measurements, best: Smoothed) -> dict[str, np.ndarray]:
        """By what each measurement (M,) changes where a quantity taken as known is off.

        Names are those of torque_fused.CONSIDERED; per share of the quantity, or per second.  ``best``:
        states smoothed with it as it was given."""
        raise NotImplementedError

    def model(self, v, times: Times, length_s: float, size_Nm) -> Model:
        """The model at the instants of a pass; ``size_Nm``: of the torque, one for all or (N,)."""
        F, Q = self.dynamics(v)
        drive = np.zeros_like(Q)
        k = np.sqrt(3) / length_s
        F[self.torque, self.slope] = 1
        if not self.wiener:
            F[self.slope, [self.torque, self.slope]] = -(k**2), -2 * k
        drive[self.slope, self.slope] = 4 * k**3 / self.inertia_kgm2**2
        A, fixed = discretize(F, Q, times.steps_s)
        driven = discretize(F, drive, times.steps_s)[1][None]
        size = np.broadcast_to(np.asarray(size_Nm, float), times.seconds.shape)
        # a Wiener torque has no size of its own: it starts within ten times what a Matern one would be
        first = size[0] / self.inertia_kgm2 * (10 if self.wiener else 1)
        deviation = np.concatenate([self.start(v, times), [first, k * first]])
        H, white = self.measured(v)
        H, R = H[times.base], (white**2 + times.quantum**2 / 12)[times.base] + (self.timing_s(v) * times.steep) ** 2
        return Model(
            A, fixed, driven, size[:, None] ** 2, times.which, H, R, np.zeros(self.STATES), np.diag(deviation**2)
        )

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


def response(body: Body, levels, times: Times, data: Measurements, torque_Nm) -> np.ndarray:
    """Measurements (M,) or (M, C), without noise, of torques (N,) or (N, C) [N m] that are straight lines between instants."""
    torque = np.asarray(torque_Nm, float) / body.inertia_kgm2
    columns = torque[:, None] if torque.ndim == 1 else torque
    model = body.smooth_model(levels, times)
    out = respond(body.lines(levels, times), model, data, body.torque, body.slope, columns)
    return out[:, 0] if torque.ndim == 1 else out


def without_known(body: Body, levels, times: Times, data: Measurements, known: Known | None) -> Measurements:
    """The measurements less what a known torque does to them."""
    if known is None:
        return data
    return replace(data, value=data.value - response(body, levels, times, data, known(times.seconds)))


@dataclass(frozen=True)
class Posterior:
    """The torque of one axis given its measurements, on the instants of a pass.

    ``mean``: (N,) [N m]; ``paths``: (K, N), drawn jointly; ``considered``: (K, P), drawn, of the quantities
    taken as known, in units of their sigma; ``whitened``: (M,), what prediction leaves, over its sigma."""

    mean: np.ndarray
    paths: np.ndarray
    considered: np.ndarray
    whitened: np.ndarray
    settings: dict
