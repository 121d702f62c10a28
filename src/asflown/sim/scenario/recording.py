"""What the telemetry holds: intervals, counts, gaps and lost samples."""

from __future__ import annotations

from pydantic import Field, model_validator

from ...craft.model import Second
from ...kit.errors import BadInput
from ...kit.quantities import quantity
from ...telemetry.channels import kind_of
from ..plans import Part


class Gap(Part):
    """Samples that never reach the ground; channel is a name, a family ('wheel_rate') or '*'."""

    channel: str = "*"
    start: Second
    stop: Second


class Sampling(Part):
    """What the telemetry holds: the interval of each family of channels; '0 s' leaves one out."""

    wheel_rate: Second = 4.0
    body_rate: Second = 4.0
    attitude_error: Second = 2.0
    rate_error: Second = 0.0
    controller_rate_error: Second = 0.0
    quaternion: Second = 4.0
    control_torque: Second = 0.0
    wheel_torque: Second = 0.0
    wheel_current: Second = 0.0  # where the craft's file gives every motor's torque_constant
    commanded_rate: Second = 0.0
    commanded_quaternion: Second = 0.0
    orbit_position: Second = 0.0  # this and the next four of a flight in an orbit
    orbit_velocity: Second = 0.0
    magnetic_field: Second = 0.0
    sun_direction: Second = 0.0
    torque_rod_dipole: Second = 0.0
    wheel_momentum: Second = 0.0
    on_time: Second = 16.0  # thrusters' counters, only where the flight has any
    pulse_count: Second = 0.0
    accelerometer_count: Second = 0.0
    control_mode: Second = 64.0  # RCS or RWA
    thruster_branch: Second = 64.0
    catbed_temperature: Second = 0.0
    tank_pressure: Second = 0.0  # only where the craft's file ties it to the thrust
    wheel_drag_torque: Second = 4.0  # only where the controller estimates it
    mechanism: Second = 64.0  # cover angle, motor current, temperature and states
    quantum: dict[str, str] = Field(default_factory=dict)  # family -> one count, with its unit
    random_phases: bool = False
    dropout: float = Field(default=0.0, ge=0, lt=1)  # chance of each sample to be lost
    gaps: tuple[Gap, ...] = ()

    @model_validator(mode="after")
    def _known(self):
        for stem, value in self:
            if isinstance(value, float) and value < 0:
                raise ValueError(f"{stem}: an interval is not negative; '0 s' leaves the channels out")
        for stem in self.quantum:
            self.count_size(stem)
        return self

    def count_size(self, stem: str) -> float:
        if stem not in self.quantum:
            return 0.0
        member = {"axis": "_x", "component": "_w", "wheel": "_A", "thruster": "_A"}
        kind = next((kind_of(stem + m) for m in ("", *member.values()) if _is_channel(stem + m)), None)
        if kind is None:
            raise ValueError(f"quantum: {stem!r} is not a family of channels")
        return quantity(self.quantum[stem], kind.unit)


def _is_channel(name: str) -> bool:
    try:
        kind_of(name)
    except BadInput:
        return False
    return True
