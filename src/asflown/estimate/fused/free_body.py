"""A body whose controller is not known: its gains are fitted, and what its actuators do is measured.

One axis has nine states: the body's rate; the actuators' momentum; their torque's free part and its slope; the
angle turned and the rate held; the rate sensor's slow error; the disturbance and its slope.

    I rate' = T + u          h' = -u
    u       = c - I (rate - held + angle/turning) / damping        angle' = rate - held,  held unknown, constant
    c'' = -(2 c' + c/time)/time + w                                a Matern-3/2 process of its own size and time
    error'  = -error/time + w_e                                    Gauss-Markov: motion of what the sensor sits on

So actuators answer a disturbance, as those of any craft that is held do: without that the rate of a body
nobody looks at would wander off, and no torque on the actuators could be told from their own.  Where nothing is
held, ``damping`` comes out long and ``c`` takes all; where a wheel sticks and tears loose, c's time comes out short.
Measured are rate + error and either h (wheels) or u itself (control-moment gyros, or commands alone).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from .body import Body, Levels
from .series import BODY_RATE, CONTROL_TORQUE, MOMENTUM, ROWS, Times, step_of, usual_size, white_noise

if TYPE_CHECKING:
    from ...kit.smoother import Smoothed
    from .body import AxisData

_RATE, _STORED, _FREE, _FREE_SLOPE, _ANGLE, _HELD, _ERROR, _TORQUE = 0, 1, 2, 3, 4, 5, 6, 7


@dataclass(frozen=True)
class FreeLevels(Levels):
    """Fitted on one axis of a body whose control is not known."""

    rate_white_rad_s: float
    actuator_white: float  # of the momentum [N m s], or of the control torque [N m] where that is read
    reaction_Nm: float
    reaction_time_s: float
    damping_s: float
    turning_s: float
    rate_slow_rad_s: float
    rate_time_s: float
    timing_s: float  # of a sample's instant: what a reading at a jump is uncertain by


@dataclass(frozen=True, kw_only=True)
class FreeBody(Body):
    """A body whose actuators are only read."""

    RATE: ClassVar[int] = _RATE
    STORED: ClassVar[int] = _STORED
    # lengths of a torque: from a thruster's seconds to an orbit
    SPREAD: ClassVar[tuple[float, ...]] = (1.5, 1.2, 0.7, 0.7, 1.5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.5)
    # A channel's scale is not in the channel: regressed on its own smoothed self it would shrink towards nothing,
    # the more so the longer the record.
    NARROWS: ClassVar[bool] = False

    @property
    def torque(self) -> int:
        return _TORQUE

    def control(self, v: FreeLevels) -> np.ndarray:
        """The actuators' torque on the body per unit inertia, (n,), of the states."""
        u = np.zeros(self.states)
        u[[_FREE, _RATE, _HELD, _ANGLE]] = 1, -1 / v.damping_s, 1 / v.damping_s, -1 / (v.damping_s * v.turning_s)
        return u

    def dynamics(self, v: FreeLevels) -> tuple[np.ndarray, np.ndarray]:
        F, Q = np.zeros((2, self.states, self.states))
        F[_RATE] = self.control(v)
        F[_STORED] = -F[_RATE]
        F[_RATE, _TORQUE] = 1
        w = 1 / v.reaction_time_s  # the slope is held over w, which gives it the size of c itself
        F[_FREE, _FREE_SLOPE] = w
        F[_FREE_SLOPE, [_FREE, _FREE_SLOPE]] = -w, -2 * w
        Q[_FREE_SLOPE, _FREE_SLOPE] = 4 * w * (v.reaction_Nm / self.inertia_kgm2) ** 2
        F[_ANGLE, [_RATE, _HELD]] = 1, -1
        F[_ERROR, _ERROR] = -1 / v.rate_time_s
        Q[_ERROR, _ERROR] = 2 * v.rate_slow_rad_s**2 / v.rate_time_s
        return F, Q

    def sensitivities(self, axis: AxisData, best: Smoothed) -> dict[str, np.ndarray]:
        """Another inertia changes all motion, not the disturbance's part alone; another scale changes all actuators' readings."""
        at = best.mean[step_of(axis.data)]

        def on(row: int, values) -> np.ndarray:
            return np.where(axis.channel == row, values, 0.0)

        return {
            "inertia": on(BODY_RATE, -at[:, _RATE]),
            "spin_inertia": on(MOMENTUM, self.inertia_kgm2 * at[:, _STORED]),
            "control_torque": on(CONTROL_TORQUE, self.inertia_kgm2 * at @ self.control(axis.levels)),  # type: ignore[arg-type]
        }

    def measured(self, v: FreeLevels) -> tuple[np.ndarray, np.ndarray]:
        H = np.zeros((len(ROWS), self.states))
        H[BODY_RATE, [_RATE, _ERROR]] = 1
        H[MOMENTUM, _STORED] = self.inertia_kgm2
        H[CONTROL_TORQUE] = self.inertia_kgm2 * self.control(v)
        return H, np.array([np.inf, v.rate_white_rad_s, v.actuator_white, v.actuator_white])

    def start(self, v: FreeLevels, times: Times) -> np.ndarray:
        push = v.reaction_Nm / self.inertia_kgm2
        stored = 3 * times.largest[MOMENTUM] / self.inertia_kgm2 + 1e-12
        rate = 3 * times.largest[BODY_RATE] + 1e-9
        # an angle at which the controller holds against torques of the fitted size
        angle = 3 * (v.torque_Nm + v.reaction_Nm) / self.inertia_kgm2 * v.damping_s * v.turning_s
        return np.array([rate, stored, push, push, angle, rate, v.rate_slow_rad_s])

    def timing_s(self, v: FreeLevels) -> float:
        return v.timing_s

    def starting_levels(self, series) -> FreeLevels:
        rate = next(s for s in series if s.row == BODY_RATE)
        actuator = next(s for s in series if s.row != BODY_RATE)
        pushed = actuator.row == CONTROL_TORQUE
        push = actuator.values if pushed else np.gradient(actuator.values, actuator.seconds)
        # what the wheels do to hold a body still is what disturbs it: the same size to start from
        size = max(usual_size(push), 1e-12)
        white = white_noise(rate, 1e-10)
        return FreeLevels(
            torque_Nm=size,
            length_s=15.0,
            rate_white_rad_s=white,
            actuator_white=white_noise(actuator, 1e-6 * size),
            reaction_Nm=size,
            # kicks last a sample or two; from a longer time the fit does not find them
            reaction_time_s=2 * float(np.median(np.diff(actuator.seconds))),
            damping_s=15.0,
            turning_s=15.0,
            rate_slow_rad_s=white,
            rate_time_s=5.0,
            timing_s=0.02 * float(np.median(np.diff(actuator.seconds))),  # good stamps, unless the data say otherwise
        )
