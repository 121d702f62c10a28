"""What is to be flown: a frozen, checked description read from TOML, units in the values.

Times count from the epoch, at which recording starts.  docs/simulator.md lists every key.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..craft.model import (
    Direction,
    InertiaElements,
    Kilogram,
    Metre,
    Metre2,
    MetrePerSecond,
    MetreVector,
    Newton,
    NewtonMetre,
    Radian,
    RadianPerSecond,
    Second,
    _in,
)
from ..kit.errors import BadInput
from ..kit.quantities import numbers, quantity
from ..kit.timeline import utc_to_tai_ns
from ..telemetry.channels import AXES, kind_of
from .plans import Part, Plan, shipped

NoiseName = Literal["none", "half", "nominal", "double"]


def _series(unit: str):
    """'0 60 90 s' -> a tuple of any length, SI."""

    def parse(text):
        count = len(re.findall(r"(?:^|[\s,])[-+]?(?:\d|\.\d)", str(text)))
        return numbers(text, unit, count)

    return Annotated[tuple[float, ...], BeforeValidator(parse)]


def _by_name(unit: str):
    """{ RWA1 = "600 rpm" } -> SI numbers."""

    def parse(table):
        if not isinstance(table, dict):
            raise ValueError('write it as { NAME = "value unit" }')
        return {name: quantity(text, unit) for name, text in table.items()}

    return Annotated[dict[str, float], BeforeValidator(parse)]


TorqueVector, RateVector, AngleVector = _in("N m", 3), _in("rad/s", 3), _in("rad", 3)
RadianPerSecond2, KilometrePerSecond, Kelvin = _in("rad/s2"), _in("m/s"), _in("K")


class Triangles(Part):
    """Repeated triangular pulses about one body axis, alternating in sign (000 section VI)."""

    shape: Literal["triangles"]
    axis: Literal["x", "y", "z"]
    peak: NewtonMetre
    rise: Second
    first: Second  # start of the first pulse
    count: int = Field(ge=1)


class Constant(Part):
    """A constant torque in body axes, such as 001 Appendix A's non-gravitational one."""

    shape: Literal["constant"]
    torque: TorqueVector


class Table(Part):
    """A torque about one body axis, linear between instants, zero outside; inline, or columns of a CSV
    (header ``time [s],x [N m],y [N m],z [N m]``, any of the axes)."""

    shape: Literal["table"]
    axis: Literal["x", "y", "z"] | None = None
    times: _series("s") | None = None  # type: ignore[valid-type]
    torques: _series("N m") | None = None  # type: ignore[valid-type]
    file: str | None = None

    @model_validator(mode="after")
    def _one_source(self):
        inline = (self.axis, self.times, self.torques)
        if (self.file is None) == all(v is None for v in inline):
            raise ValueError("give either file, or axis, times and torques")
        if self.file is None:
            if any(v is None for v in inline) or len(self.times) != len(self.torques):
                raise ValueError("axis, times and torques belong together, as many times as torques")
            if len(self.times) < 2 or min(np.diff(self.times)) <= 0:
                raise ValueError("times must increase, and there must be two or more")
        return self


class Plume(Part):
    """Drag torque of E3's plume about one axis, with 004's own area and arm; a ``Passage`` has more."""

    shape: Literal["plume"]
    flyby: Literal["enceladus-3"] = "enceladus-3"
    closest_approach: Second
    axis: Literal["x", "y", "z"] = "z"
    sign: Literal[-1, 1] = -1
    exponent: Literal[1, 2] = 1


class Passage(Part):
    """A straight flyby through gas: of jets, or where the body has one of an atmosphere (004 eqs 19-27).

    Constants are those of ``dynamics.flyby`` unless given; the craft holds its attitude, in which ``arm`` is u x (r_CP - r_CM)."""

    name: str  # E3, E4, E5, E9, Titan
    closest_approach: Second
    altitude: Metre | None = Field(default=None, gt=0)  # at closest approach
    speed: MetrePerSecond | None = Field(default=None, gt=0)
    latitude_south: Radian | None = Field(default=None, ge=-np.pi / 2, le=np.pi / 2)
    longitude_west: Radian | None = None
    jets: dict[str, float] | None = None  # those that blow and how strongly; all of Table 3, each once
    exponent: Literal[1, 2] = 1
    angle: Literal["plane", "space"] = "plane"
    density: _in("kg/m3") | None = Field(default=None, gt=0)  # type: ignore[valid-type]  # of the atmosphere, at its own altitude
    scale_height: Metre | None = Field(default=None, gt=0)
    area: Metre2 | None = Field(default=None, gt=0)  # the craft's
    arm: MetreVector | None = None  # the craft's, about its axis, negative as E3's
    gravity_gradient: bool = False
    velocity: Direction | None = None  # of flight, and from the body to the craft at closest approach; body axes
    up: Direction | None = None
    small_torques: bool = False  # sunlight, generators and magnetism at their bounds, about the arm

    @model_validator(mode="after")
    def _sensible(self):
        if self.gravity_gradient and (self.velocity is None or self.up is None):
            raise ValueError("gravity_gradient needs velocity and up, in body axes")
        if self.jets is not None and (not self.jets or min(self.jets.values()) < 0):
            raise ValueError("jets: one or more, each with a factor that is not negative")
        return self


AnyTorque = Annotated[Triangles | Constant | Table | Plume, Field(discriminator="shape")]


class Slew(Part):
    """A rest-to-rest turn about an axis fixed in the body: constant acceleration, coast, deceleration."""

    start: Second
    axis: Direction
    angle: Radian
    rate: RadianPerSecond = Field(description="largest rate")
    acceleration: RadianPerSecond2

    @model_validator(mode="after")
    def _sensible(self):
        if np.linalg.norm(self.axis) == 0 or self.rate <= 0 or self.acceleration <= 0:
            raise ValueError("a slew needs an axis, a positive rate and a positive acceleration")
        return self


class Coast(Part):
    """A wheel left to its bearing: the motor is off.

    Where the wheels hold the attitude an ideal torque from outside does this one's part of it."""

    wheel: str
    start: Second
    stop: Second

    @model_validator(mode="after")
    def _forward(self):
        if self.stop <= self.start:
            raise ValueError("a coast stops after it starts")
        return self


class DragSpike(Part):
    """Drag of one bearing that rises by ``torque`` for a while, as where its cage turns unstable.

    It comes and goes within EDGE_S, or a quarter of its duration."""

    EDGE_S: ClassVar[float] = 1.0

    wheel: str
    start: Second
    duration: Second = Field(gt=0)
    torque: NewtonMetre = Field(gt=0)


class CatalystBeds(Part):
    """Rise and fall that follow the beds' warmth: cold at the start, warmer with every second of firing.

    001 section V: 15 to 25 ms and 40 to 90 ms; the beds' own time constants are assumed."""

    hot_rise: Second = Field(default=0.015, ge=0)
    hot_fall: Second = Field(default=0.040, ge=0)
    cold_rise: Second = Field(default=0.025, ge=0)
    cold_fall: Second = Field(default=0.090, ge=0)
    heating: Second = Field(default=2.0, gt=0)
    cooling: Second = Field(default=900.0, gt=0)
    # what telemetry says of a bed that its heater keeps warm, and of one that fires; assumed
    cold_temperature: Kelvin = Field(default=420.0, gt=0)  # type: ignore[valid-type]
    hot_temperature: Kelvin = Field(default=900.0, gt=0)  # type: ignore[valid-type]


class ThrusterUse(Part):
    """The craft's thrusters, holding the attitude unless ``control`` is false.

    ``branch``: the one whose valves open, taken to sit where the craft's do (001 gives the places of branch A alone, 002 calls
    the two identical); ``counted_branch``: the one whose on-times reach the ground, where it is not the one that opens."""

    control: bool = True
    branch: str | None = None  # the craft's own
    counted_branch: str | None = None  # whichever opens
    thrust: Newton | None = Field(default=None, gt=0)  # the craft's own on the date
    center_of_mass: MetreVector | None = None  # where the craft's file has none
    deadband: AngleVector = (2e-3, 2e-3, 2e-3)  # 001 section V
    rise: Second | None = Field(default=None, ge=0)  # the craft's own
    fall: Second | None = Field(default=None, ge=0)
    pulse_scatter: float = Field(default=0.0, ge=0, lt=0.3)  # one sigma of a pulse's thrust, relative
    catalyst_beds: CatalystBeds | None = None

    @model_validator(mode="after")
    def _one_lag(self):
        if self.catalyst_beds is not None and (self.rise is not None or self.fall is not None):
            raise ValueError("give either rise and fall, or catalyst_beds")
        return self


class ThrusterControl(Part):
    """A span in which thrusters hold the attitude; outside of all such spans the wheels do."""

    start: Second
    stop: Second

    @model_validator(mode="after")
    def _forward(self):
        if self.stop <= self.start:
            raise ValueError("thruster control stops after it starts")
        return self


class BranchSwap(Part):
    """From ``start`` on the other branch's valves open, with a thrust of their own or with the same."""

    start: Second
    branch: str
    thrust: Newton | None = Field(default=None, gt=0)


class ThrusterFault(Part):
    """A thruster that leaks, whatever is ordered of it, or whose pulses are weak."""

    thruster: str
    start: Second
    stop: Second = float("inf")
    leak: Newton = Field(default=0.0, ge=0)
    factor: float = Field(default=1.0, ge=0)  # on its thrust


class WheelBias(Part):
    """Wheels brought to new rates in straight lines while thrusters hold the attitude, as far as their rate limits let them."""

    start: Second
    stop: Second
    rates: _by_name("rad/s")  # type: ignore[valid-type]

    @model_validator(mode="after")
    def _forward(self):
        if self.stop <= self.start:
            raise ValueError("a wheel bias stops after it starts")
        return self


class Burn(Part):
    """A change of velocity by the thrusters that burn, the others and their off-pulses holding the attitude.

    It is over when on-time times ``thrust`` over mass, as the flight software reckons, reaches ``delta_v`` (001 section V)."""

    start: Second
    delta_v: MetrePerSecond = Field(gt=0)
    thrust: Newton | None = Field(default=None, gt=0)  # as the flight software believes it; the true one
    deadband: AngleVector = tuple(np.radians([0.5, 0.5, 1.0]))


class CoverMotion(Part):
    """A part of the craft turning about its hinge, the angle prescribed by a table of rates.

    The rate is a monotone piecewise cubic through the table (continuous with its slope), scaled by
    less than 2 % so that the travel is exactly the mechanism's."""

    mechanism: str = "cover"
    direction: Literal["deploy", "stow"] = "deploy"
    times: _series("s")  # type: ignore[valid-type]
    rates: _series("rad/s")  # type: ignore[valid-type]
    arm: Metre  # hinge to the part's own centre of mass
    arm_tilt: Radian  # of the arm when stowed, from z, about the hinge axis
    craft_mass: Kilogram
    motor_on: Second
    stall: Second
    motor_off: Second
    run_current: _in("A")  # type: ignore[valid-type]
    stall_current: _in("A")  # type: ignore[valid-type]
    temperature: Kelvin
    temperature_rise: Kelvin

    @model_validator(mode="after")
    def _sensible(self):
        if len(self.times) != len(self.rates) or len(self.times) < 3 or min(np.diff(self.times)) <= 0:
            raise ValueError("cover: as many increasing times as rates, three or more")
        if self.rates[0] != 0 or self.rates[-1] != 0 or min(self.rates) < 0:
            raise ValueError("cover: the rates start and end at zero and are not negative in between")
        if not self.motor_on <= self.stall <= self.motor_off:
            raise ValueError("cover: motor_on, stall and motor_off come in this order")
        return self


class Controller(Part):
    """How the flight software is run; its gains are the craft's."""

    period: Second | None = Field(default=None, gt=0)  # the craft's own unless given
    delay_cycles: int = Field(default=0, ge=0, le=8)
    filter: Literal["tustin", "zoh"] = "tustin"
    inertia: InertiaElements | None = None  # what the controller believes; the true one unless given
    gyroscopic_feedforward: bool = True
    friction_compensation: bool = False
    friction_bandwidth: _in("rad/s") = 0.3  # type: ignore[valid-type]


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


class Scenario(Plan):
    """One flight."""

    KIND = "scenario"
    REMEDY = "See docs/simulator.md for the keys; every value carries its unit."

    description: str = ""
    craft: str = "cassini"
    epoch: str = "2015-09-29T00:00:00"  # UTC
    duration: Second = Field(gt=0)
    settle: Second = Field(default=0.0, ge=0)  # flown before the epoch, not recorded
    seed: int = Field(default=1, ge=0)
    noise: NoiseName = "nominal"
    substeps: int = Field(default=4, ge=1, le=1000)  # Runge-Kutta steps a control cycle
    flexible: bool = False
    slosh: bool = False
    craft_mass: Kilogram | None = Field(default=None, gt=0)  # of all of it, propellant too
    friction: bool = False
    gyro_bias: RateVector = (0.0, 0.0, 0.0)  # what calibration left over
    accelerometer_bias: _in("m/s2") = 0.0  # type: ignore[valid-type]
    wheel_rates: _by_name("rad/s") = Field(default_factory=dict)  # type: ignore[valid-type]
    torques: tuple[AnyTorque, ...] = ()
    flyby: Passage | None = None
    slews: tuple[Slew, ...] = ()
    coasts: tuple[Coast, ...] = ()
    drag_spikes: tuple[DragSpike, ...] = ()
    thrusters: ThrusterUse | None = None
    thruster_control: tuple[ThrusterControl, ...] = ()
    branch_swaps: tuple[BranchSwap, ...] = ()
    thruster_faults: tuple[ThrusterFault, ...] = ()
    wheel_biases: tuple[WheelBias, ...] = ()
    burns: tuple[Burn, ...] = ()
    cover: CoverMotion | None = None
    controller: Controller = Controller()
    telemetry: Sampling = Sampling()
    assumptions: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _dated(self):
        try:
            utc_to_tai_ns(self.epoch)
        except BadInput as why:
            raise ValueError(f"epoch: {why.what}") from None
        return self

    @model_validator(mode="after")
    def _with_thrusters(self):
        if self.thrusters is None and (self.thruster_faults or self.telemetry.accelerometer_count):
            raise ValueError("thruster_faults and accelerometer_count are of a flight with [thrusters]")
        if self.flyby and self.flyby.gravity_gradient and self.slews:
            raise ValueError("a flyby with gravity_gradient is flown at one attitude: no slews")
        if (self.wheel_biases or self.burns) and not (self.thrusters and self.thrusters.control):
            raise ValueError("wheel_biases and burns need [thrusters] that hold the attitude")
        if (self.thruster_control or self.branch_swaps) and self.thrusters is None:
            raise ValueError("thruster_control and branch_swaps are of a flight with [thrusters]")
        if self.thruster_control:
            if self.thrusters is not None and not self.thrusters.control:
                raise ValueError("thrusters with control = false never hold the attitude: leave out thruster_control")
            spans = [(c.start, c.stop) for c in self.thruster_control]
            for what, start, stop in (
                *(("a wheel bias", b.start, b.stop) for b in self.wheel_biases),
                *(("a burn", b.start, b.start) for b in self.burns),
            ):
                if not any(a <= start and stop <= b for a, b in spans):
                    raise ValueError(f"{what} ({start:g} to {stop:g} s) lies outside thruster_control")
        if any(b.start < a.start for a, b in pairwise(self.branch_swaps)):
            raise ValueError("branch_swaps: in order of their start")
        if any(b.start < a.start for a, b in pairwise(self.burns)):
            raise ValueError("burns: in order of their start")
        return self

    def known_mass(self, who: str) -> float:
        """The whole craft's. [kg]  Raises BadInput for ``who`` needs it where it is not given."""
        mass = self.craft_mass or (self.cover.craft_mass if self.cover else None)
        if mass is None:
            raise BadInput(f"{who} needs the mass of the craft", remedy='Give the scenario a craft_mass = "2500 kg".')
        return mass

    @property
    def epoch_ns(self) -> int:
        return int(utc_to_tai_ns(self.epoch))


def shipped_scenarios() -> list[str]:
    """Names that ``load_scenario`` and ``fly`` take without a file."""
    return shipped("scenario")


def load_scenario(name_or_path: str | Path) -> Scenario:
    """A shipped scenario by name, or one from a TOML file.

    Raises BadInput for an unknown name, an unreadable file, an unknown key or a wrong unit."""
    return Scenario.load(name_or_path)


def axis_number(axis: str) -> int:
    return AXES.index(axis)
