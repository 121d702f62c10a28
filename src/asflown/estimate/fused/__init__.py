"""The disturbance torque of one axis from all channels at once: state-space model, noise levels, prior, evidence."""

from .body import AxisData, hats
from .feed import Foreknown
from .fuse import CONSIDERED, LOOP_NOT_USED, PRIORS, Fusion, fused
from .gather import LOOPS, CannotFuse
from .innovations import DELAY_OFF, KNOWN_OFF, UNEXPLAINED
from .whitening import Regression, regression

__all__ = [
    "CONSIDERED", "DELAY_OFF", "KNOWN_OFF", "LOOPS", "LOOP_NOT_USED", "PRIORS", "UNEXPLAINED", "AxisData",
    "CannotFuse", "Foreknown", "Fusion", "Regression", "fused", "hats", "regression",
]  # fmt: skip
