"""What is to be flown: a frozen, checked description read from TOML, units in the values.

Times count from the epoch, at which recording starts.  docs/simulator.md lists every key.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator

from ...craft.model import Drag, InertiaElements, Kilogram, Second, _in
from ...kit.errors import BadInput
from ...kit.timeline import utc_to_tai_ns
from ..plans import Plan, shipped
from .control import Controller
from .motion import CoverMotion, Slew
from .orbiting import Environment, OrbitFlown, Pointing, Sensors, Unloading
from .recording import Sampling
from .thrusters import BranchSwap, Burn, ThrusterControl, ThrusterFault, ThrusterUse
from .torques import AnyTorque, Passage
from .units import RateVector, _by_name
from .wheels import Coast, DragGrowth, DragSpike, WheelBias

if TYPE_CHECKING:
    from pathlib import Path

NoiseName = Literal["none", "half", "nominal", "double"]


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
    inertia: InertiaElements | None = None  # the true one, in place of the craft file's
    orbit: OrbitFlown | None = None
    environment: Environment | None = None
    pointings: tuple[Pointing, ...] = ()
    unloading: Unloading | None = None
    sensors: Sensors = Sensors()
    wheel_rates: _by_name("rad/s") = Field(default_factory=dict)  # type: ignore[valid-type]
    torques: tuple[AnyTorque, ...] = ()
    flyby: Passage | None = None
    slews: tuple[Slew, ...] = ()
    coasts: tuple[Coast, ...] = ()
    drag_spikes: tuple[DragSpike, ...] = ()
    drag_growth: tuple[DragGrowth, ...] = ()
    wheel_drag: dict[str, Drag] = Field(default_factory=dict)  # the true one, in place of the craft file's
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
        if (self.wheel_biases or self.burns) and not (self.thrusters and self.thrusters.control):
            raise ValueError("wheel_biases and burns need [thrusters] that hold the attitude")
        if (self.thruster_control or self.branch_swaps) and self.thrusters is None:
            raise ValueError("thruster_control and branch_swaps are of a flight with [thrusters]")
        if self.thruster_control and self.thrusters is not None and not self.thrusters.control:
            raise ValueError("thrusters with control = false never hold the attitude: leave out thruster_control")
        return self

    @model_validator(mode="after")
    def _within_thruster_control(self):
        if not self.thruster_control:
            return self
        needed = [("a wheel bias", b.start, b.stop) for b in self.wheel_biases]
        needed += [("a burn", b.start, b.start) for b in self.burns]
        for what, start, stop in needed:
            if not any(c.start <= start and stop <= c.stop for c in self.thruster_control):
                raise ValueError(f"{what} ({start:g} to {stop:g} s) lies outside thruster_control")
        return self

    @model_validator(mode="after")
    def _flown_in_order(self):
        if self.flyby and self.flyby.gravity_gradient and self.slews:
            raise ValueError("a flyby with gravity_gradient is flown at one attitude: no slews")
        for name in ("branch_swaps", "burns", "pointings"):
            if any(b.start < a.start for a, b in pairwise(getattr(self, name))):
                raise ValueError(f"{name}: in order of their start")
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
