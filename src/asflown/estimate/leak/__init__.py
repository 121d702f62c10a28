"""Leaking and weak thrusters, from momentum that ordered pulses do not explain."""

from .known import leak_known
from .result import LeakResult
from .watch import LeakWatch, leak

__all__ = ["LeakResult", "LeakWatch", "leak", "leak_known"]
