"""Slews of the craft, and a part of it that turns about its hinge."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from ...craft.model import Direction, Kilogram, Metre, Radian, RadianPerSecond, Second, _in
from ..plans import Part
from .units import Kelvin, RadianPerSecond2, _series


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
