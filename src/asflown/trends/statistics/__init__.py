"""Slopes, steps, newest values, pairs and curves: the statistics behind a verdict."""

from .change import FEW, Step, step_of
from .curves import TORQUE, Shape, distance, family_band, shape_of
from .newest import FEWEST_PAST, Newest, newest_of
from .pairs import (
    COLD_DAYS,
    MARGIN,
    WARM_DAYS,
    Distances,
    Equivalence,
    Pair,
    curve_distances,
    cycles,
    equivalence,
    find_pairs,
    rests,
    whole_days,
)
from .slope import FEWEST, YEAR, Trend, Values, holm, trend_of

__all__ = [
    "COLD_DAYS", "FEW", "FEWEST", "FEWEST_PAST", "MARGIN", "TORQUE", "WARM_DAYS", "YEAR", "Distances",
    "Equivalence", "Newest", "Pair", "Shape", "Step", "Trend", "Values", "curve_distances", "cycles", "distance",
    "equivalence", "family_band", "find_pairs", "holm", "newest_of", "rests", "shape_of", "step_of", "trend_of",
    "whole_days",
]  # fmt: skip
