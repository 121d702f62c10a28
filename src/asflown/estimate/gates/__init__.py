"""Maneuver execution errors: the Gates model, its fit, its judgement, and what it foretells."""

from .checks import Directions, Shape, Spread
from .fit import gates
from .intervals import Ends
from .judge import gates_judgement
from .judgement import GatesJudgement
from .patch import GatesPatch, gates_patch
from .planned import GatesPredictionResult, gates_prediction
from .result import GatesResult, Part
from .terms import SIGMAS, Law, Term
from .watch import FEWEST_BEFORE, GatesWatchResult, gates_watch

__all__ = [
    "FEWEST_BEFORE", "SIGMAS", "Directions", "Ends", "GatesJudgement", "GatesPatch", "GatesPredictionResult", "GatesResult",
    "GatesWatchResult", "Law", "Part", "Shape", "Spread", "Term", "gates", "gates_judgement", "gates_patch", "gates_prediction",
    "gates_watch",
]  # fmt: skip
