"""A body whose controller is not known: what its actuators do is measured, not modelled.

One axis has five states: the body's rate; the actuators' momentum; their torque on the body; the disturbance
and its slope.

    I rate' = T + u          h' = -u          u' = -u/time + w    a Gauss-Markov process of its own size and time

Such a u may jump, as it does where a wheel sticks and tears loose.
Measured are the rate and either h (wheels) or u itself (control-moment gyros, or commands alone).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..kit.smoother import Measurements, Smoothed
from .latent import BODY_RATE, CONTROL_TORQUE, MOMENTUM, ROWS, Body, Levels, Times, step_of
from .latent_loop import usual_size, white_noise

_RATE, _STORED, _PUSH, _TORQUE, _STATES = 0, 1, 2, 3, 5


@dataclass(frozen=True)
class FreeLevels(Levels):
    """Fitted on one axis of a body whose control is not known."""

    rate_white_rad_s: float
    actuator_white: float  # of the momentum [N m s], or of the control torque [N m] where that is read
    reaction_Nm: float
    reaction_time_s: float


@dataclass(frozen=True, kw_only=True)
class FreeBody(Body):
    """A body whose actuators are only read."""

    STATES: ClassVar[int] = _STATES
    RATE: ClassVar[int] = _RATE
    STORED: ClassVar[int] = _STORED
    SPREAD: ClassVar[tuple[float, ...]] = (1.5, 0.8, 0.7, 0.7, 1.5, 1.0)

    def dynamics(self, v: FreeLevels) -> tuple[np.ndarray, np.ndarray]:
        F, Q = np.zeros((2, _STATES, _STATES))
        F[_RATE, [_PUSH, _TORQUE]] = 1
        F[_STORED, _PUSH] = -1
        F[_PUSH, _PUSH] = -1 / v.reaction_time_s
        Q[_PUSH, _PUSH] = 2 * (v.reaction_Nm / self.inertia_kgm2) ** 2 / v.reaction_time_s
        return F, Q

    def sensitivities(self, v: FreeLevels, times: Times, data: Measurements, best: Smoothed) -> dict[str, np.ndarray]:
        """All motion answers to another inertia, not the disturbance's part alone; so do the actuators' readings to their scale."""
        at = best.mean[step_of(data)]

        def on(row: int, values) -> np.ndarray:
            return np.where(data.row == row, values, 0.0)

        return {
            "inertia": on(BODY_RATE, -at[:, _RATE]),
            "spin_inertia": on(MOMENTUM, self.inertia_kgm2 * at[:, _STORED]),
            "control_torque": on(CONTROL_TORQUE, self.inertia_kgm2 * at[:, _PUSH]),
        }

    def measured(self, v: FreeLevels) -> tuple[np.ndarray, np.ndarray]:
        H = np.zeros((len(ROWS), _STATES))
        H[BODY_RATE, _RATE] = 1
        H[MOMENTUM, _STORED] = self.inertia_kgm2
        H[CONTROL_TORQUE, _PUSH] = self.inertia_kgm2
        return H, np.array([np.inf, v.rate_white_rad_s, v.actuator_white, v.actuator_white])

    def start(self, v: FreeLevels, times: Times) -> np.ndarray:
        push = 3 * v.reaction_Nm / self.inertia_kgm2
        stored = 3 * times.largest[MOMENTUM] / self.inertia_kgm2 + 1e-12
        return np.array([3 * times.largest[BODY_RATE] + 1e-9, stored, push])

    def starting_levels(self, series) -> FreeLevels:
        rate = next(s for s in series if s.row == BODY_RATE)
        actuator = next(s for s in series if s.row != BODY_RATE)
        pushed = actuator.row == CONTROL_TORQUE
        push = actuator.values if pushed else np.gradient(actuator.values, actuator.seconds)
        # what the wheels do to hold a body still is what disturbs it: the same size to start from
        size = max(usual_size(push), 1e-12)
        return FreeLevels(
            torque_Nm=size,
            length_s=15.0,
            rate_white_rad_s=white_noise(rate, 1e-10),
            actuator_white=white_noise(actuator, 1e-6 * size),
            reaction_Nm=size,
            reaction_time_s=15.0,
        )
