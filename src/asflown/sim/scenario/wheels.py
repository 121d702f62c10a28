"""What wheels are made to do or suffer: coasts, drag spikes, new rates."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from ...craft.model import NewtonMetre, Second
from ..plans import Part
from .units import _by_name


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
