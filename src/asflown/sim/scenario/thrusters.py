"""Thrusters: how they are used, their beds, faults, burns and swapped branches."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from ...craft.model import MetrePerSecond, MetreVector, Newton, Second
from ..plans import Part
from .units import AngleVector, Kelvin


class CatalystBeds(Part):
    """Rise and fall that follow the beds' warmth: cold at the start, warmer with every second of firing.

    Feldman & Lee section V: 15 to 25 ms and 40 to 90 ms; the beds' own time constants are assumed."""

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

    ``branch``: the one whose valves open, taken to sit where the craft's do (Feldman & Lee give the places of branch A alone, Wagner calls
    the two identical); ``counted_branch``: the one whose on-times reach the ground, where it is not the one that opens."""

    control: bool = True
    branch: str | None = None  # the craft's own
    counted_branch: str | None = None  # whichever opens
    thrust: Newton | None = Field(default=None, gt=0)  # the craft's own on the date
    center_of_mass: MetreVector | None = None  # where the craft's file has none
    deadband: AngleVector = (2e-3, 2e-3, 2e-3)  # Feldman & Lee section V
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


class Burn(Part):
    """A change of velocity by the thrusters that burn, the others and their off-pulses holding the attitude.

    It is over when on-time times ``thrust`` over mass, as the flight software reckons, reaches ``delta_v`` (Feldman & Lee, section V)."""

    start: Second
    delta_v: MetrePerSecond = Field(gt=0)
    thrust: Newton | None = Field(default=None, gt=0)  # as the flight software believes it; the true one
    deadband: AngleVector = tuple(np.radians([0.5, 0.5, 1.0]))
