"""What an orbiting craft measures and reports besides its rates and attitude: field, Sun, motors, its place and what is commanded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.rotations import rotation
from ...telemetry.channels import AXES
from .sampling import axes_of
from .sensors import FACTOR, normal

if TYPE_CHECKING:
    from ...craft.model import CraftAt
    from ..scenario import Scenario
    from .truth import Truth
    from .world import Along

#: With less of its disc in view than this a sun sensor says nothing.
_SEEN = 0.5


def magnetometer_error(scenario: Scenario, cycles: int) -> np.ndarray:
    """Noise and bias of every reading, body axes. (N, 3) [T]"""
    s = scenario.sensors
    return np.asarray(s.magnetic_bias) + normal(
        scenario.seed, "magnetometer", (cycles, 3), FACTOR[scenario.noise] * s.magnetic_field
    )


def orbital_readings(scenario: Scenario, truth: Truth, here: Along, field_error: np.ndarray) -> dict[str, np.ndarray]:
    """Magnetometer, sun sensor, place and rods at every control instant; ``here``: the world at those instants."""
    s, seed, factor = scenario.sensors, scenario.seed, FACTOR[scenario.noise]
    back, shape = rotation(truth.attitude).inv(), (len(truth.time_s), 3)
    sun = back.apply(here.sun_N) + normal(seed, "sun sensor", shape, factor * s.sun_direction)
    sun /= np.linalg.norm(sun, axis=1, keepdims=True)
    readings = axes_of("magnetic_field", back.apply(here.field_N) + field_error, AXES)
    readings |= axes_of("sun_direction", np.where(here.lit[:, None] > _SEEN, sun, 0.0), AXES)
    place = here.position_N + normal(seed, "orbit position", shape, factor * s.orbit_position)
    speed = here.velocity_N + normal(seed, "orbit velocity", shape, factor * s.orbit_velocity)
    readings |= axes_of("orbit_position", place, AXES) | axes_of("orbit_velocity", speed, AXES)
    if scenario.unloading is not None:
        readings |= axes_of("torque_rod_dipole", truth.rod_dipole_Am2, AXES)
    return readings


def motor_readings(scenario: Scenario, truth: Truth, now: CraftAt) -> dict[str, np.ndarray]:
    """Ordered torque of each motor, and its current where the craft's file says what torque an ampere gives.

    A current is read across the instant at which it changes: the mean of the cycles before and after."""
    names = [w.name for w in now.wheels]
    readings = axes_of("wheel_torque", truth.motor_torque_Nm, names)
    constants = [w.torque_constant for w in now.wheels]
    if None in constants:
        return readings
    s = scenario.sensors
    zero = np.array([s.wheel_current_zero.get(name, 0.0) for name in names])
    noise = normal(
        scenario.seed, "motor current", truth.motor_torque_Nm.shape, FACTOR[scenario.noise] * s.wheel_current
    )
    held = truth.motor_torque_Nm
    across = np.vstack([held[:1], (held[:-1] + held[1:]) / 2])
    return readings | axes_of("wheel_current", across / np.array(constants, float) + zero + noise, names)
