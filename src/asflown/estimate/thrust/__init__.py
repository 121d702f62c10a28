"""Thrust as flown, fall time and centre of mass, from wheel biasing, run-downs and burns."""

from .methods import thrust
from .result import EventSeen, Pair, ThrustResult

__all__ = ["EventSeen", "Pair", "ThrustResult", "thrust"]
