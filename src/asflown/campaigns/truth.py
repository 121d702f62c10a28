"""How far a reconstruction is from a torque that is known: the papers' Tables 3 and 4, with signs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..estimate.torque import TorqueResult, best_lag, peak_near
from ..kit.peaks import PEAK_REACH_S
from ..telemetry.channels import AXES

#: The cover paper's Tables 3 and 4: unsigned percent errors of T_Hrwa at the six peaks, as printed.
PUBLISHED_PEAK_ERRORS = {
    "profile-1": (1.20, 2.38, 4.08, 5.97, 4.74, 2.81),
    "profile-2": (5.87, 9.91, 9.11, 4.38, 9.13, 5.89),
}


@dataclass(frozen=True)
class PeakErrors:
    """Signed percent error at each true peak, and two lags.

    ``lag_s``: shift of best correlation; ``peak_lag_s``: mean time between the true and found peaks;
    positive is late."""

    method: str
    variant: str
    peak_error_percent: tuple[float, ...]
    lag_s: float
    peak_lag_s: float
    rms_Nm: float

    def record(self) -> dict:
        return {
            "method": self.method, "variant": self.variant, "peak_error_percent": list(self.peak_error_percent),
            "lag_s": self.lag_s, "peak_lag_s": self.peak_lag_s, "rms_Nm": self.rms_Nm,
        }  # fmt: skip


def against_truth(result: TorqueResult, time_s, torque_Nm, peaks, axis: str) -> PeakErrors:
    """``time_s``, ``torque_Nm``: the true torque about ``axis``; ``peaks``: [(time_s, torque_Nm)] of it."""
    j = AXES.index(axis)
    times = [t for t, _ in peaks]
    reach = float(np.min(np.diff(times))) / 2 if len(times) > 1 else 30.0
    found = [peak_near(result, j, t, reach) for t in times]
    if result.paths_Nm is not None:  # a posterior says more of a peak's height than its mean curve does
        found = [(t, result.peak(t, PEAK_REACH_S, axis).torque_Nm) for t, _ in found]
    estimate = result.torque_Nm[:, j]
    true = np.interp(result.time_s, time_s, torque_Nm)
    lag, _ = best_lag(result.time_s, true, result.time_s, estimate)
    return PeakErrors(
        result.method,
        result.variant,
        tuple(100 * (v / p - 1) for (_, v), (_, p) in zip(found, peaks, strict=True)),
        lag,
        float(np.mean([t - tp for (t, _), tp in zip(found, times, strict=True)])) if times else float("nan"),
        float(np.sqrt(np.nanmean((estimate - true) ** 2))),
    )
