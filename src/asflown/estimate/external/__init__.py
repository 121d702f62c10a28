"""The steady external torque, from the momentum that craft and wheels gain."""

from .result import ExternalTorqueResult
from .steady import external_torque

__all__ = ["ExternalTorqueResult", "external_torque"]
