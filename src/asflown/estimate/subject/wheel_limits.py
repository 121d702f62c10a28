"""Wheels at their limits: a reading that stops where the wheel's rate does not takes momentum out of the balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Kind, Severity
from ...kit.timeline import runs

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .subject import Subject

#: Share of a wheel's rate limit at which its motor, and perhaps its telemetry, saturates.
_SATURATED = 0.995
#: So many readings in a row that are the record's largest, to the last digit, are a reading that has stopped, where of the
#: others this share differ from each other.
_STILL, _NOISY = 8, 0.5


AT_LIMIT = Kind(
    "subject.wheel-at-limit", Severity.CAUTION,
    "wheel {wheel} is at its rate limit from {first} to {last}: its reading may saturate there, and momentum is not used "
    "until it is below the limit again",
)  # fmt: skip
STANDS_STILL = Kind(
    "subject.wheel-reading-stuck", Severity.SUSPECT,
    "the reading of wheel {wheel} is constant at its maximum, {largest_rpm:.0f} rpm, from {first} to {last}: if it saturates "
    "there, momentum is missing", "Narrow the span, or give the craft file the wheel's rate_limit.",
)  # fmt: skip


def at_limit(subject: Subject, tai_ns) -> tuple[np.ndarray, list[Doubt]]:
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
        doubts.append(AT_LIMIT(wheel=wheel.name, first=first, last=last))
    return out, doubts


def stopped(subject: Subject) -> list[Doubt]:
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
                STANDS_STILL(wheel=wheel.name, largest_rpm=float(size.max() * 30 / np.pi), first=first, last=last)
            )
    return doubts


def _wheels(subject: Subject):
    return subject.wheels() if subject.telemetry.members("wheel_rate") else []
