"""The disturbance torque on the body by every method, with its band and its doubts."""

from .compare import Comparison, best_lag, compare_torques, peak_near
from .momentum import smoothed_as_printed, splined_momentum
from .on_times import torque_on_times
from .reconstruct import METHODS, VARIANTS, disturbance_torque
from .result import TorqueResult
from .table import save_csv

__all__ = [
    "METHODS", "VARIANTS", "Comparison", "TorqueResult", "best_lag", "compare_torques", "disturbance_torque",
    "peak_near", "save_csv", "smoothed_as_printed", "splined_momentum", "torque_on_times",
]  # fmt: skip
