"""How the flight software is run."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ...craft.model import Frequency, InertiaElements, NewtonMetre, Second, _in
from ..plans import Part
from .units import _by_name


class NullSpace(Part):
    """Wheels brought to rates of their own by torques that cancel on the body: of four or more."""

    gain: _in("1/s") = Field(default=0.02, gt=0)  # type: ignore[valid-type]
    torque: NewtonMetre = Field(default=2e-3, gt=0)  # largest of any wheel
    rates: _by_name("rad/s") = Field(default_factory=dict)  # type: ignore[valid-type]  # those at the start unless given


class Controller(Part):
    """How the flight software is run; its gains are the craft's."""

    period: Second | None = Field(default=None, gt=0)  # the craft's own unless given
    delay_cycles: int = Field(default=0, ge=0, le=8)
    filter: Literal["tustin", "zoh"] = "tustin"
    inertia: InertiaElements | None = None  # what the controller believes; the craft file's unless given
    bandwidth: Frequency | None = Field(default=None, gt=0)  # the craft's own unless given, as the damping
    damping: float | None = Field(default=None, gt=0)
    gyroscopic_feedforward: bool | None = None  # the craft's; true where its file does not say
    acceleration_feedforward: bool | None = None
    tracking: bool | None = None  # the rate's error is against the commanded one
    null_space: NullSpace | None = None
    friction_compensation: bool = False
    friction_bandwidth: _in("rad/s") = 0.3  # type: ignore[valid-type]
