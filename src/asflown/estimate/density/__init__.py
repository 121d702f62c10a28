"""Density of the gas that a craft flies through, from the torque it exerts."""

from .along_flyby import density, density_along
from .asked import Asked
from .drag import DragGiven
from .parts import MomentumHeld
from .result import DensityResult

__all__ = [
    "Asked", "DensityResult", "DragGiven", "MomentumHeld", "density", "density_along",
]  # fmt: skip
