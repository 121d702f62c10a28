"""Telemetry against telemetry: channels that see one motion, and what they say of each other's sign, size, axes and time."""

from .check import redundancy

__all__ = ["redundancy"]
