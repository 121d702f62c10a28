"""Bearing drag of the wheels, and how they were used."""

from .result import RUN_DOWN, DragFit, WheelDrag, WheelsResult
from .study import wheels

__all__ = ["RUN_DOWN", "DragFit", "WheelDrag", "WheelsResult", "wheels"]
