"""The disturbance torque of one axis from all channels at once: state-space model, noise levels, prior, evidence."""

from .fuse import CONSIDERED, PRIORS, fused
from .gather import LOOPS
from .peaks import PEAK_REACH_S, excursions, heights
from .whitening import AxisData, Regression, hats, regression

__all__ = [
    "CONSIDERED", "LOOPS", "PEAK_REACH_S", "PRIORS", "AxisData", "Regression", "excursions", "fused", "hats",
    "heights", "regression",
]  # fmt: skip
