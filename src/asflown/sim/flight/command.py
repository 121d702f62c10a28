"""What the attitude commander asks for: a hold, or a sequence of rest-to-rest slews."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ...kit.rotations import rotation
from .pointing import pointed_motion

if TYPE_CHECKING:
    from ..scenario import Scenario, Slew
    from .world import Along


def ordered_motion(scenario: Scenario, along: Along | None, times):
    """What is commanded throughout a flight: slews, upon the pointings where there are any.  As ``commanded_motion``."""
    q, w, alpha = commanded_motion(scenario.slews, times)
    if not scenario.pointings:
        return q, w, alpha
    carried, rate, acceleration = pointed_motion(scenario.pointings, along, times)
    back = rotation(q).inv()
    rate = back.apply(rate)
    # the rate that carries the craft turns in its axes while it slews
    return _times(carried, q), w + rate, alpha + back.apply(acceleration) + np.cross(rate, w)


def slew_time(slew: Slew) -> float:
    """How long it takes: a trapezoid of rate, or a triangle where the rate limit is not reached. [s]"""
    ramp, coast = _phases(slew)
    return 2 * ramp + coast


def _phases(slew: Slew) -> tuple[float, float]:
    angle = abs(slew.angle)
    ramp = min(slew.rate / slew.acceleration, np.sqrt(angle / slew.acceleration))
    coast = angle / (slew.acceleration * ramp) - ramp if angle > 0 else 0.0
    return ramp, coast


def commanded_motion(slews: tuple[Slew, ...], times, first_attitude=(1.0, 0.0, 0.0, 0.0)):
    """Commanded attitude (N, 4), rate (N, 3) [rad/s] and acceleration (N, 3) [rad/s2], body axes.

    Consistent to rounding: the rate is the attitude's derivative, the acceleration the rate's.
    Raises BadInput where a slew starts before the one before it has ended."""
    times = np.asarray(times, float)
    q = np.tile(np.asarray(first_attitude, float), (len(times), 1))
    w, alpha = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    ended = -np.inf
    for slew in sorted(slews, key=lambda s: s.start):
        if slew.start < ended:
            raise BadInput(
                f"the slew at {slew.start:g} s starts before the last one ends, at {ended:g} s",
                remedy="Start it later, or raise the rate or acceleration of the one before.",
            )
        axis = np.array(slew.axis) / np.linalg.norm(slew.axis) * np.sign(slew.angle)
        angle, rate, acceleration = _turn(slew, times - slew.start)
        q = _times(q, np.column_stack([np.cos(angle / 2), np.sin(angle / 2)[:, None] * axis]))
        w += rate[:, None] * axis
        alpha += acceleration[:, None] * axis
        ended = slew.start + slew_time(slew)
    return q, w, alpha


def _turn(slew: Slew, t):
    """Angle, rate, acceleration (all of them about the slew's own axis), ``t`` after its start."""
    ramp, coast = _phases(slew)
    a, end = slew.acceleration, 2 * ramp + coast
    up, left = np.clip(t, 0, ramp), np.clip(end - t, 0, ramp)
    angle = 0.5 * a * up**2 + a * ramp * np.clip(t - ramp, 0, coast) + 0.5 * a * (ramp**2 - left**2)
    rate = np.where(t < end - ramp, a * up, a * left)
    # at a corner the acceleration is that of the piece which begins there
    acceleration = np.where((t >= 0) & (t < ramp), a, 0.0) - np.where((t >= ramp + coast) & (t < end), a, 0.0)
    return angle, rate, acceleration


def _times(p, q):
    """Hamilton products, row by row."""
    p0, pv, q0, qv = p[:, :1], p[:, 1:], q[:, :1], q[:, 1:]
    scalar = p0 * q0 - np.sum(pv * qv, axis=1, keepdims=True)
    return np.hstack([scalar, p0 * qv + q0 * pv + np.cross(pv, qv)])
