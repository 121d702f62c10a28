"""The closed loop with an unknown torque in it: the controller and its rate filter are known.

One axis has ten states: attitude and rate of the body; the wheels' momentum; the slow error of the attitude
estimate, which the controller flies on; the rate filter's four, where there is one; the torque and its slope.

    attitude'  = rate
    I rate'    = T + u + w_u                     u = J KD (KP e - F(rate)),   e = -(attitude + error)
    h'         = -u - w_u
    error'     = -error/time + w_a               a Gauss-Markov process

J is the moment of inertia that the controller believes: the body's own, unless the craft file says otherwise.
w_u is what the wheels do beside their command (gyro noise in the loop, friction, a cycle of delay): it
moves body and wheels oppositely, so total momentum never feels it.  Measured are e, the rate and h.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from .body import Body, Levels
from .series import ATTITUDE_ERROR, BODY_RATE, MOMENTUM, ROWS, Times, usual_size, white_noise

if TYPE_CHECKING:
    from ...craft.model import WheelController
    from ...kit.smoother import Smoothed
    from .body import AxisData

_ATTITUDE, _RATE, _STORED, _ERROR, _FILTER = 0, 1, 2, 3, 4


@dataclass(frozen=True)
class LoopLevels(Levels):
    """Fitted on one axis of a body under known control."""

    rate_white_rad_s: float
    momentum_white_Nms: float
    error_white_rad: float
    error_slow_rad: float
    error_time_s: float
    reaction_Nm_sqrt_s: float  # square root of w_u's spectral density


@dataclass(frozen=True, kw_only=True)
class HeldBody(Body):
    """A body whose controller is known.

    ``kd_per_s``: per unit of the body's inertia.  ``believes``: whether the controller's own inertia is stated, so that an error
    of the body's changes its gains.  ``filter_rad_s``: infinite where the rate is not filtered.  ``delay_s``: of the loop beyond its rate filter, to first order; zero but for asking what a delay would do."""

    kp_per_s: float
    kd_per_s: float
    filter_rad_s: float
    filter_damping: float
    delay_s: float = 0.0
    believes: bool = False

    RATE: ClassVar[int] = _RATE
    STORED: ClassVar[int] = _STORED
    # lengths of a torque: from a thruster's seconds to an orbit
    SPREAD: ClassVar[tuple[float, ...]] = (1.5, 1.2, 0.7, 0.7, 0.7, 1.0, 0.7, 1.5)

    @classmethod
    def under(
        cls,
        controller: WheelController,
        inertia_kgm2: float,
        believed_kgm2: float | None = None,
        *,
        wiener: bool = False,
    ) -> HeldBody:
        """``believed_kgm2``: the controller's moment of inertia about this axis; None: the body's own, whatever that is."""
        f, share = controller.rate_filter, 1.0 if believed_kgm2 is None else believed_kgm2 / inertia_kgm2
        return cls(
            inertia_kgm2=inertia_kgm2, wiener=wiener, kp_per_s=controller.kp_per_s, kd_per_s=share * controller.kd_per_s,
            filter_rad_s=f.natural_frequency if f else np.inf, filter_damping=f.damping if f else 1.0,
            believes=believed_kgm2 is not None,
        )  # fmt: skip

    @property
    def stiffness_Nm(self) -> float:
        """The torque of a turn of one radian off the attitude held."""
        return self.inertia_kgm2 * self.kd_per_s * self.kp_per_s

    @property
    def late_s(self) -> float:
        """Delay of the rate that the controller sees: of the filter's cascade it is 4 z / w."""
        return 4 * self.filter_damping / self.filter_rad_s + self.delay_s

    @property
    def torque(self) -> int:
        return 8 if self.late_s else 4

    def dynamics(self, v: LoopLevels) -> tuple[np.ndarray, np.ndarray]:
        n, stiffness = self.states, -self.kd_per_s * self.kp_per_s
        F, Q = np.zeros((2, n, n))
        F[_ATTITUDE, _RATE] = 1
        F[_RATE, [_ATTITUDE, _ERROR, self.torque]] = stiffness, stiffness, 1
        if self.late_s:
            self._filter_into(F)
        F[_RATE, _FILTER + 2 if self.late_s else _RATE] = -self.kd_per_s
        F[_RATE, _RATE] -= stiffness * self.delay_s
        F[_STORED] = -F[_RATE]
        F[_STORED, self.torque] = 0
        F[_ERROR, _ERROR] = -1 / v.error_time_s
        Q[_ERROR, _ERROR] = 2 * v.error_slow_rad**2 / v.error_time_s
        spread = np.zeros(n)  # where w_u goes
        spread[_RATE], spread[_STORED] = 1, -1
        Q += (v.reaction_Nm_sqrt_s / self.inertia_kgm2) ** 2 * np.outer(spread, spread)
        return F, Q

    def _filter_into(self, F: np.ndarray) -> None:
        """The cascade of two filters on the rate."""
        z = self.filter_damping
        w = 4 * z / self.late_s
        for stage, source in ((_FILTER, _RATE), (_FILTER + 2, _FILTER)):
            F[stage, stage + 1] = 1
            F[stage + 1, [source, stage, stage + 1]] = w**2, -(w**2), -2 * z * w

    def sensitivities(self, axis: AxisData, best: Smoothed) -> dict[str, np.ndarray]:
        """The response to the torque under other numbers.

        Per unit of the body's inertia the loop has the craft's own gains, but where the controller's inertia is stated."""
        torque = self.inertia_kgm2 * best.mean[:, self.torque]
        here = axis.response(torque)
        stored = axis.channel == MOMENTUM
        changes = {
            "kp": (0.01, replace(self, kp_per_s=1.01 * self.kp_per_s)),
            "kd": (0.01, replace(self, kd_per_s=1.01 * self.kd_per_s)),
            "delay_s": (0.05, replace(self, delay_s=0.05)),
        }
        found = {
            name: (replace(axis, body=other).response(torque) - here) / step for name, (step, other) in changes.items()
        }
        inertia = np.where(stored, 0.0, -here) - (found["kd"] if self.believes else 0.0)
        return found | {"inertia": inertia, "spin_inertia": np.where(stored, here, 0.0)}

    def measured(self, v: LoopLevels) -> tuple[np.ndarray, np.ndarray]:
        H = np.zeros((len(ROWS), self.states))
        H[ATTITUDE_ERROR, [_ATTITUDE, _ERROR]] = -1
        H[BODY_RATE, _RATE] = 1
        H[MOMENTUM, _STORED] = self.inertia_kgm2
        return H, np.array([v.error_white_rad, v.rate_white_rad_s, v.momentum_white_Nms, np.inf])

    def start(self, v: LoopLevels, times: Times) -> np.ndarray:
        turning = 3 * times.largest[BODY_RATE] + 1e-5
        stored = 3 * times.largest[MOMENTUM] / self.inertia_kgm2 + turning  # the first sample may be a bad one
        filtered = [turning] * 4 if self.late_s else []
        return np.array([3 * times.largest[ATTITUDE_ERROR] + 1e-4, turning, stored, v.error_slow_rad, *filtered])

    def starting_levels(self, series) -> LoopLevels:
        by_row = {s.row: s for s in series}
        h = by_row[MOMENTUM]
        push = max(usual_size(np.gradient(h.values, h.seconds)), 1e-7)
        white, stored = white_noise(by_row[ATTITUDE_ERROR], 1e-9), white_noise(h, 1e-6)
        return LoopLevels(
            torque_Nm=push,
            length_s=15.0,
            rate_white_rad_s=white_noise(by_row[BODY_RATE], 1e-10),
            momentum_white_Nms=stored,
            error_white_rad=white,
            error_slow_rad=1.5 * white,
            error_time_s=15.0,
            # a third of what would make all of that noise: of a small craft w_u makes most of it, of a large one the reading
            reaction_Nm_sqrt_s=0.3 * stored / np.sqrt(np.median(np.diff(h.seconds))),
        )
