"""Standard deviation of noise from medians, which a few outliers do not move."""

from __future__ import annotations

from math import comb

import numpy as np

#: Median size of a standard normal variable.
MEDIAN_SIZE = 0.6744897501960817


def robust_sigma(residuals, axis: int | None = None):
    """Standard deviation of normal residuals about zero, from their median size."""
    return np.median(np.abs(residuals), axis=axis) / MEDIAN_SIZE


def difference_sigma(values: np.ndarray, order: int, counting: np.ndarray | None = None) -> float:
    """White noise of evenly spaced samples (N,) or (N, k), from their differences of an order: a slow signal hardly shows in them.

    ``counting`` (N - order,): which differences count.  NaN where there are none."""
    differences = np.diff(values, order, axis=0)
    if counting is not None:
        differences = differences[counting]
    return float(robust_sigma(differences) / comb(2 * order, order) ** 0.5) if len(differences) else float("nan")
