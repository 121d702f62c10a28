"""Where the craft slews: spans of a record in which the body turns, and about which axis.

``subject.slews`` says whether a record is no hold.  Here every turn above the noise counts, a slow or a steady one too: what it
tells of the inertia is counted by its sigma."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kit.timeline import runs
from ...telemetry.channels import AXES
from ..subject import without_spikes

#: A slew's rate is above this share of the fastest one ...
_SHARE = 0.05
#: ... and above this many sigmas of the rates' noise.
_SIGMAS = 8.0
#: It begins and ends where the rate is down to these shares of both.
_EDGE = 0.05
#: About one axis alone: the other two components stay below this share of the rate.
_ALONE = 0.1


@dataclass(frozen=True)
class Slew:
    """One turn: seconds from the epoch, mean axis in body axes (unit vector, in the sense of the turn), and its size."""

    start_s: float
    stop_s: float
    axis: tuple[float, float, float]
    rate_rad_s: float  # largest
    angle_rad: float

    @property
    def about(self) -> str:
        """'x', 'y' or 'z' where it is about one body axis alone, else 'skew'."""
        size = np.abs(self.axis)
        lead = int(np.argmax(size))
        others = np.delete(size, lead)
        return AXES[lead] if np.all(others < _ALONE * size[lead]) else "skew"

    def record(self) -> dict:
        return {
            "start_s": self.start_s, "stop_s": self.stop_s, "about": self.about, "axis": list(self.axis),
            "rate_rad_s": self.rate_rad_s, "angle_rad": self.angle_rad,
        }  # fmt: skip


def find_slews(time_s: np.ndarray, omega_B: np.ndarray, noise_rad_s: float) -> list[Slew]:
    """Turns in rates (N, 3) [rad/s] whose noise has this sigma; single spikes do not count.

    A turn that changes its axis or its sense is parted there."""
    if len(time_s) < 5:
        return []
    smooth = without_spikes(omega_B)
    rate = np.linalg.norm(smooth, axis=1)
    least = max(_SHARE * rate.max(), _SIGMAS * noise_rad_s)
    moving = rate > max(_EDGE * _SHARE * rate.max(), 0.3 * _SIGMAS * noise_rad_s)
    found = []
    for span in (s for s in runs(moving) if rate[s].max() > least):
        for part in _by_axis(smooth[span], span.start):
            if part.stop - part.start < 3 or rate[part].max() <= least:
                continue
            turned = np.trapezoid(omega_B[part], time_s[part], axis=0)
            angle = float(np.linalg.norm(turned))
            if angle > 0:
                x, y, z = (float(v) for v in turned / angle)
                largest = float(rate[part].max())
                found.append(Slew(float(time_s[part.start]), float(time_s[part.stop - 1]), (x, y, z), largest, angle))
    return found


def _by_axis(omega: np.ndarray, first: int) -> list[slice]:
    """Stretches of a turn over which its direction stays within 60 degrees of their own mean."""
    direction = omega / np.linalg.norm(omega, axis=1, keepdims=True)
    parts, start = [], 0
    mean = direction[0].copy()
    for k in range(1, len(direction)):
        if direction[k] @ mean < 0.5 * np.linalg.norm(mean):
            parts.append(slice(first + start, first + k))
            start, mean = k, direction[k].copy()
        else:
            mean += direction[k]
    return [*parts, slice(first + start, first + len(omega))]
