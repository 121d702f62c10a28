"""The inertia tensor from slews, what the slews cannot identify, and which slew would."""

from .history import InertiaHistoryResult, InertiaWindow, inertia_history
from .plan import PlannedTurn, SlewPlanResult, slew_plan
from .result import InertiaResult
from .tensor import inertia

__all__ = [
    "InertiaHistoryResult", "InertiaResult", "InertiaWindow", "PlannedTurn", "SlewPlanResult", "inertia",
    "inertia_history", "slew_plan",
]  # fmt: skip
