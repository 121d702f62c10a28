"""How the flight software is run."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ...craft.model import InertiaElements, Second, _in
from ..plans import Part


class Controller(Part):
    """How the flight software is run; its gains are the craft's."""

    period: Second | None = Field(default=None, gt=0)  # the craft's own unless given
    delay_cycles: int = Field(default=0, ge=0, le=8)
    filter: Literal["tustin", "zoh"] = "tustin"
    inertia: InertiaElements | None = None  # what the controller believes; the true one unless given
    gyroscopic_feedforward: bool = True
    friction_compensation: bool = False
    friction_bandwidth: _in("rad/s") = 0.3  # type: ignore[valid-type]
