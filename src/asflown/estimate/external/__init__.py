"""The steady external torque, from the momentum that craft and wheels gain."""

from .result import AXES, ExternalTorque
from .steady import external_torque

__all__ = [
    "AXES", "ExternalTorque", "external_torque",
]  # fmt: skip
