"""An orbit, what its surroundings do to the craft, where it points, and the rods that unload its wheels."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from ...craft.model import Metre, Radian, Second, _in
from ..plans import Part
from .units import AngleVector, Share, TorqueVector, _by_name

DipoleVector, MomentumVector = _in("A m2", 3), _in("N m s", 3)


class OrbitFlown(Part):
    """About the Earth: osculating elements at the scenario's epoch, or a CSV of positions.

    The table has the header ``time [s],x [km],y [km],z [km]``, inertial axes (GCRS), times from the scenario's epoch."""

    semi_major_axis: Metre | None = Field(default=None, gt=0)
    eccentricity: float = Field(default=0.0, ge=0, lt=1)
    inclination: Radian = 0.0
    ascending_node: Radian = 0.0
    argument_of_perigee: Radian = 0.0
    mean_anomaly: Radian = 0.0
    file: str | None = None

    @model_validator(mode="after")
    def _one_source(self):
        if (self.semi_major_axis is None) == (self.file is None):
            raise ValueError("give either semi_major_axis with the other elements, or file")
        return self


class Environment(Part):
    """Which torques of an orbit act, and what of the craft is truly so where it differs from what its file says.

    Each acts where it is true, or where nothing is said and the craft is described for it."""

    gravity_gradient: bool = True
    sunlight: bool | None = None
    dipole: bool | None = None
    drag: bool | None = None
    residual_dipole: DipoleVector | None = None  # type: ignore[valid-type]
    sunlight_lever: TorqueVector | None = None  # type: ignore[valid-type]
    drag_lever: TorqueVector | None = None  # type: ignore[valid-type]  # at the reference density
    air: Literal["exponential", "msis"] = "exponential"
    reference_density: _in("kg/m3") | None = Field(default=None, gt=0)  # type: ignore[valid-type]  # the craft's
    reference_height: Metre | None = None  # where the exponential air has it; in the mean over the flight
    scale_height: Metre = Field(default=60e3, gt=0)
    f107: float = Field(default=150.0, gt=0)
    f107_mean: float = Field(default=150.0, gt=0)
    ap: float = Field(default=8.0, ge=0)
    density_factor: float = Field(default=1.0, ge=0)  # on either air
    density_swing: float = Field(default=0.0, ge=0, lt=1)  # day and night: 1 + swing cos(n t + phase)
    density_phase: Radian = 0.0
    corotation: bool = False  # the air turns with the Earth; else the wind is the orbit's own velocity


class Pointing(Part):
    """What the craft is to point at from ``start`` on, turning there within ``turn``.

    ``inertial`` holds an attitude in space, ``lvlh`` follows the orbit (z to the nadir, x along the track), ``target`` points z at
    a place on the Earth, y against the orbit normal as far as that goes.  ``attitude`` is a turn from those axes; an inertial
    one without it holds what it has at its start."""

    start: Second = float("-inf")
    frame: Literal["inertial", "lvlh", "target"] = "lvlh"
    attitude: AngleVector | None = None  # type: ignore[valid-type]
    turn: Second = Field(default=60.0, gt=0)
    latitude: Radian | None = None
    longitude: Radian | None = None
    height: Metre = 0.0

    @model_validator(mode="after")
    def _placed(self):
        if (self.frame == "target") != (self.latitude is not None and self.longitude is not None):
            raise ValueError("a target has a latitude and a longitude, and only a target has")
        return self


class Unloading(Part):
    """Torque rods that take momentum from the wheels: m = gain (h - target) x B / B^2."""

    gain: _in("1/s") = Field(gt=0)  # type: ignore[valid-type]
    target: MomentumVector = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    period: Second = Field(default=1.0, gt=0)  # from one order to the next
    duty: Share = Field(default=1.0, gt=0, le=1)  # of it, in which the rods are on; the field is read at its start


class Sensors(Part):
    """One sigma of each at noise = nominal, in place of the simulator's own table."""

    attitude_white: Radian | None = Field(default=None, ge=0)
    attitude_coloured: Radian | None = Field(default=None, ge=0)
    attitude_time: Second | None = Field(default=None, gt=0)
    gyro: _in("rad/s") | None = Field(default=None, ge=0)  # type: ignore[valid-type]
    wheel_rate: _in("rad/s") | None = Field(default=None, ge=0)  # type: ignore[valid-type]
    magnetic_field: _in("T") = Field(default=1e-7, ge=0)  # type: ignore[valid-type]
    magnetic_bias: _in("T", 3) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    sun_direction: Radian = Field(default=2e-3, ge=0)
    wheel_current: _in("A") = Field(default=1e-3, ge=0)  # type: ignore[valid-type]
    wheel_current_zero: _by_name("A") = Field(default_factory=dict)  # type: ignore[valid-type]
    orbit_position: Metre = Field(default=0.0, ge=0)
    orbit_velocity: _in("m/s") = Field(default=0.0, ge=0)  # type: ignore[valid-type]
