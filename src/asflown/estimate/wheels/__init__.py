"""Bearing drag of the wheels, and how they were used."""

from .result import RUN_DOWN, WheelDrag, WheelsResult
from .study import wheel_drag

__all__ = [
    "RUN_DOWN", "WheelDrag", "WheelsResult", "wheel_drag",
]  # fmt: skip
