"""The smallest leak that the monitor would find, by its age."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from .likelihood import Evidence, Monitor

#: Ages of a leak for which the smallest detectable one is given. [s]
WINDOWS_S = (60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0)
POWER = 0.9  # of the smallest detectable leak


def smallest_leaks(
    monitor: Monitor, evidence: Evidence, time_s: np.ndarray, window_s: float
) -> dict[float, np.ndarray]:
    """Leak of each thruster (j,) [N] that the monitor finds with POWER, by its age [s]: WINDOWS_S and ``window_s``, as far as
    the record goes.  A leak of F shifts d / sqrt c by F sqrt c."""
    n = evidence.degrees
    if len(evidence.onset) < 2:
        return {}
    raw = n / 2 * np.expm1(2 * monitor.threshold / n)
    needed = np.sqrt(2 * raw) + scipy.special.ndtri(POWER)
    age = (time_s[evidence.instant] - time_s[evidence.onset - 1])[::-1]
    c = evidence.c[::-1, : len(monitor.geometry.names)]
    return {
        w: np.array(
            [needed / np.exp(0.5 * np.interp(np.log(w), np.log(age), np.log(c[:, j]))) for j in range(c.shape[1])]
        )
        for w in sorted({*WINDOWS_S, window_s})
        if age[0] <= w <= age[-1]
    }
