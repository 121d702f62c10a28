"""What really happened in a flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from .thrusters import ThrusterTruth
    from .world import Along


@dataclass(frozen=True)
class Truth:
    """What really happened, at the control instants from the epoch on; body axes unless named otherwise."""

    time_s: np.ndarray  # (N,)
    torque_Nm: (
        np.ndarray
    )  # (N, 3), disturbance: external torque, rods included, leaks, and the reaction of a moving part
    attitude: np.ndarray  # (N, 4), body to inertial
    body_rate_rad_s: np.ndarray  # (N, 3)
    wheel_rate_rad_s: np.ndarray  # (N, wheels), relative to the body
    wheel_momentum_Nms: np.ndarray  # (N, 3), stored, relative to the body
    momentum_inertial_Nms: np.ndarray  # (N, 3), of everything, inertial axes
    control_torque_Nm: np.ndarray  # (N, 3), as the controller orders it
    motor_torque_Nm: np.ndarray  # (N, wheels), held until the next instant
    holding_torque_Nm: np.ndarray  # (N, 3), from outside in place of coasting wheels, held until the next instant
    estimation_error_rad: np.ndarray  # (N, 3), estimated less true attitude
    mode_amplitude: np.ndarray  # (N, modes), hybrid coordinates [kg(1/2) m]
    mode_rate: np.ndarray  # (N, modes)
    ledger_J: np.ndarray  # (N, 4): work by the external torque, by the motors, lost in bearings, in modes
    density_kgm3: np.ndarray | None  # (N,), of the gas met in a flyby
    altitude_m: np.ndarray | None  # (N,)
    thrusters: ThrusterTruth | None
    cover_angle_rad: np.ndarray | None  # (N,)
    peaks: tuple[tuple[float, float, str], ...]  # (time [s], torque [N m], axis) of the injected profile
    torque_by_source_Nm: dict[str, np.ndarray]  # of an orbit's torques (plant.SOURCES) those that act, (N, 3) each
    impulse_by_source_Nms: dict[str, np.ndarray]  # their integrals in inertial axes from the epoch on, (N, 3) each
    rod_dipole_Am2: np.ndarray  # (N, 3), held until the next instant
    along: Along | None  # the world at these instants; None without an orbit
    shadows: tuple[dict, ...]  # passages through the shadow
