"""What wheels are made to do or suffer: coasts, drag spikes, new rates."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from ...craft.model import Date, NewtonMetre, Second
from ..plans import Part
from .units import Share, _by_name


class Coast(Part):
    """A wheel left to its bearing: the motor is off.

    The other wheels hold the attitude where they span three axes; else an ideal torque from outside does this one's part."""

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


class DragGrowth(Part):
    """Bearing drag that has grown by the scenario's epoch: linear in time from a date on, a share of the craft's own a day."""

    wheel: str
    since: Date
    coulomb_per_day: Share = 0.0
    viscous_per_day: Share = 0.0
