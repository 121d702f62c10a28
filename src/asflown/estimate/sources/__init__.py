"""What a craft's torque is made of: residual dipole, levers of sunlight and drag, a constant, and what an arc cannot tell apart."""

from .fit import SOURCES, sources
from .result import SourcesResult

__all__ = ["SOURCES", "SourcesResult", "sources"]
