"""Wheels at their limits: a reading that stops where the wheel's rate does not takes momentum out of the balance."""

from __future__ import annotations

import numpy as np

from ...kit.timeline import runs
from .subject import Subject

#: Share of a wheel's rate limit at which its motor, and perhaps its telemetry, saturates.
_SATURATED = 0.995
#: So many readings in a row that are the record's largest, to the last digit, are a reading that has stopped, where of the
#: others this share differ from each other.
_STILL, _NOISY = 8, 0.5


def at_limit(subject: Subject, tai_ns) -> tuple[np.ndarray, list[str]]:
    """Whether any wheel may be at its rate limit, (N,) bool, and what to say of it: momentum is not known there."""
    out, doubts = np.zeros(len(tai_ns), bool), []
    for c, wheel in _wheels(subject):
        high = np.abs(c.usable.values) > _SATURATED * (np.inf if wheel.rate_limit is None else wheel.rate_limit)
        if not high.any():
            continue
        t = c.usable.tai_ns
        near = np.interp((tai_ns - t[0]).astype(float), (t - t[0]).astype(float), high.astype(float)) > 0
        out |= near
        first, last = (subject.telemetry.describe_time(int(v)) for v in (t[high][0], t[high][-1]))
        doubts.append(
            f"wheel {wheel.name} is at its rate limit from {first} to {last}: its reading may stop there while the rate does not, "
            "and momentum is not used until it is below again"
        )
    return out, doubts


def stopped(subject: Subject) -> list[str]:
    """Wheels whose reading stands still at its largest value, in words: to be said where momentum does not balance."""
    doubts = []
    for c, wheel in _wheels(subject):
        size = np.abs(c.usable.values)
        if len(size) < 2 * _STILL:
            continue
        top = size == size.max()
        longest = max(runs(top), key=lambda s: s.stop - s.start)
        others = size[~top]
        if longest.stop - longest.start >= _STILL and len(np.unique(others)) > _NOISY * max(len(others), 1):
            first, last = (
                subject.telemetry.describe_time(int(c.usable.tai_ns[k])) for k in (longest.start, longest.stop - 1)
            )
            doubts.append(
                f"the reading of wheel {wheel.name} stands still at its largest, {size.max() * 30 / np.pi:.0f} rpm, from {first} to "
                f"{last}: if it stops there while the wheel does not (saturation), momentum is missing. Narrow the span, or give the "
                "craft file the wheel's rate_limit"
            )
    return doubts


def _wheels(subject: Subject):
    return subject.wheels() if subject.telemetry.members("wheel_rate") else []
