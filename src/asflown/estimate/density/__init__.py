"""Density of the gas that a craft flies through, from the torque it exerts."""

from .along_flyby import density
from .result import DensityResult

__all__ = [
    "DensityResult", "density",
]  # fmt: skip
