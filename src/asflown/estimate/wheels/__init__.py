"""Bearing drag of the wheels, and how they were used."""

from .doubts import MISFIT
from .records import wheels_of_records
from .result import RUN_DOWN, DragFit, WheelDrag, WheelsResult
from .run_downs import RunDown
from .study import wheels

__all__ = ["MISFIT", "RUN_DOWN", "DragFit", "RunDown", "WheelDrag", "WheelsResult", "wheels", "wheels_of_records"]
