"""Leaking and weak thrusters, from momentum that ordered pulses do not explain."""

from .known import known_for
from .result import LeakResult
from .watch import LeakWatch, leak

__all__ = [
    "LeakResult", "LeakWatch", "known_for", "leak",
]  # fmt: skip
