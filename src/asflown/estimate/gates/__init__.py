"""Maneuver execution errors: the Gates model, its fit, its judgement, and what it foretells."""

from .checks import Directions
from .fit import TERMS, fit_gates
from .intervals import Interval
from .judge import Judgement, judge_gates
from .patch import Patch, across_patch
from .planned import predict
from .result import GatesFit, Part
from .watch import FEWEST_BEFORE, Watch, watch_maneuvers

__all__ = [
    "FEWEST_BEFORE", "TERMS", "Directions", "GatesFit", "Interval", "Judgement", "Part", "Patch", "Watch",
    "across_patch", "fit_gates", "judge_gates", "predict", "watch_maneuvers",
]  # fmt: skip
