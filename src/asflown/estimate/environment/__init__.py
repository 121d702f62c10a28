"""What the surroundings exert on a craft: gravity gradient, sunlight, residual dipole, drag and torque rods, as terms to fit or to take as known."""

from .believed import NAMES, Air, Environment, environment_of, inertia_sigma, known_terms
from .orbits import BODY_UNKNOWN, NOT_FREE_FALL, gravity_words, longest_gap, orbit_in
from .readings import WHEELS_MISREAD, misread_in, misread_wheels
from .sky import attitude_at
from .term import Term, levers

__all__ = [
    "BODY_UNKNOWN", "NAMES", "NOT_FREE_FALL", "WHEELS_MISREAD", "Air", "Environment", "Term", "attitude_at", "environment_of",
    "gravity_words", "inertia_sigma", "known_terms", "levers", "longest_gap", "misread_in",
    "misread_wheels", "orbit_in",
]  # fmt: skip
