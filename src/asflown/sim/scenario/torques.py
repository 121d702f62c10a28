"""Torques from outside: profiles, tables, and flybys through gas."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from ...craft.model import Direction, Metre, Metre2, MetrePerSecond, MetreVector, NewtonMetre, Radian, Second, _in
from ...telemetry.channels import AXES
from ..plans import Part
from .units import TorqueVector, _series


class Triangles(Part):
    """Repeated triangular pulses about one body axis, alternating in sign (cover paper, section VI)."""

    shape: Literal["triangles"]
    axis: Literal["x", "y", "z"]
    peak: NewtonMetre
    rise: Second
    first: Second  # start of the first pulse
    count: int = Field(ge=1)


class Constant(Part):
    """A constant torque in body axes, such as Feldman & Lee's Appendix A's non-gravitational one."""

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
            if self.times is None or self.torques is None or self.axis is None or len(self.times) != len(self.torques):
                raise ValueError("axis, times and torques belong together, as many times as torques")
            if len(self.times) < 2 or min(np.diff(self.times)) <= 0:
                raise ValueError("times must increase, and there must be two or more")
        return self


class Plume(Part):
    """Drag torque of E3's plume about one axis, with the plume paper's own area and arm; a ``Passage`` has more."""

    shape: Literal["plume"]
    flyby: Literal["enceladus-3"] = "enceladus-3"
    closest_approach: Second
    axis: Literal["x", "y", "z"] = "z"
    sign: Literal[-1, 1] = -1
    exponent: Literal[1, 2] = 1


class Passage(Part):
    """A straight flyby through gas: of jets, or where the body has one of an atmosphere (plume paper, eqs 19-27).

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


def axis_number(axis: str) -> int:
    return AXES.index(axis)
