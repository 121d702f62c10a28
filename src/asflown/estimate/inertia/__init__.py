"""The inertia tensor from slews, what the slews cannot tell, and which slew would tell it."""

from .plan import plan_slew, what_was_flown
from .prediction import compared_history
from .result import InertiaResult
from .tensor import inertia_tensor

__all__ = [
    "InertiaResult", "compared_history", "inertia_tensor", "plan_slew", "what_was_flown",
]  # fmt: skip
