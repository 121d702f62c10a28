"""The disturbance torque on the body by every method, with its band and its doubts."""

from .answer import VARIANTS, Answer, Method
from .choice import METHODS, Automatic, chosen_method, method_called
from .compare import TorqueComparison, best_lag, peak_near, torque_comparison
from .fused import Fused
from .momentum import Momentum, smoothed_as_printed, splined_momentum
from .on_times import OnTimes
from .polynomial import Polynomial
from .reconstruct import torque, torque_of
from .result import TorqueResult
from .transfer import Transfer

__all__ = [
    "METHODS", "VARIANTS", "Answer", "Automatic", "Fused", "Method", "Momentum", "OnTimes", "Polynomial",
    "TorqueComparison", "TorqueResult", "Transfer", "best_lag", "chosen_method", "method_called", "peak_near",
    "smoothed_as_printed", "splined_momentum", "torque", "torque_comparison", "torque_of",
]  # fmt: skip
