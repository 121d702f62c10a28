"""The papers' error monitor of excessive thruster commanding (Feldman & Lee 2006, section IV): residual momentum beyond a threshold.

Momentum that orders do not explain, gained within a stated time and larger about some axis than a stated threshold, is a
leak; which thruster leaks is read off the signs of its three parts.  The papers give no numbers for either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from .firing import Geometry
    from .noise import Noise
    from .residual import Steps

#: A part smaller than this share of the largest counts as none: a Z thruster turns nothing about z, noise a little.
_NONE = 1 / 3


@dataclass(frozen=True)
class ErrorMonitor:
    """``gained_Nms`` (N, 3): residual momentum gained within ``duration_s`` up to each instant, body axes.
    ``alarm``: the first instant beyond the threshold, an index; ``signs``: of the three parts then, as in '+-0'."""

    threshold_Nms: float
    duration_s: float
    gained_Nms: np.ndarray
    alarm: int | None
    thruster: str | None
    signs: str


def signs_of(torque) -> str:
    """'+-0' of a torque, an impulse or a column of the geometry."""
    v = np.asarray(torque, float)
    return "".join("0" if abs(x) < _NONE * np.abs(v).max() else "+-"[int(x < 0)] for x in v)


def threshold_at_rate(noise: Noise, rate_per_instant: float) -> float:
    """Residual momentum that the difference of two readings exceeds so often, about any axis. [N m s]

    Three axes at two sides, each taken to be as noisy as the worst: the rate is an upper bound."""
    return float(np.sqrt(2) * noise.sigma.max() * -scipy.special.ndtri(rate_per_instant / 6))


def error_monitor(steps: Steps, geometry: Geometry, threshold_Nms: float, duration_s: float) -> ErrorMonitor:
    """The monitor over a whole record."""
    t = steps.seconds
    since = np.searchsorted(t, t - duration_s - 1e-9)
    broken = np.flatnonzero(steps.lost)
    if len(broken):  # nothing is compared across a loss
        last = np.searchsorted(broken, np.arange(len(t)), side="right") - 1
        since = np.maximum(since, np.where(last >= 0, broken[last], 0))
    gained = np.einsum("nji,nj->ni", steps.turned, steps.residual - steps.residual[since])
    beyond = np.flatnonzero(np.abs(gained).max(axis=1) > threshold_Nms)
    if not len(beyond):
        return ErrorMonitor(threshold_Nms, duration_s, gained, None, None, "")
    signs = signs_of(gained[beyond[0]])
    named = [n for n, c in zip(geometry.names, geometry.columns.T, strict=True) if signs_of(c) == signs]
    thruster = named[0] if len(named) == 1 else None
    return ErrorMonitor(threshold_Nms, duration_s, gained, int(beyond[0]), thruster, signs)
