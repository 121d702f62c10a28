"""What the surroundings exert on a craft: gravity gradient, sunlight, residual dipole, drag and torque rods, as terms to fit or to take as known."""

from .believed import NAMES, Air, Environment, environment_of
from .orbits import BODY_UNKNOWN, NOT_FREE_FALL, gravity_words, longest_gap, orbit_in
from .term import Term, levers

__all__ = [
    "BODY_UNKNOWN", "NAMES", "NOT_FREE_FALL", "Air", "Environment", "Term", "environment_of", "gravity_words",
    "levers", "longest_gap", "orbit_in",
]  # fmt: skip
