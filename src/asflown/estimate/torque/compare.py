"""Two reconstructions of one torque, side by side: peaks, ratio, lag, and what their signs betray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...telemetry.channels import AXES
from .result import TorqueResult, find_peaks


@dataclass(frozen=True)
class Comparison:
    """``b`` set against ``a`` on one axis.

    ``lag_s``: the shift of b that maximises the correlation (positive: b is later);
    ``peak_lags_s``: times of b's peaks less a's; ``ratios``: b's peak over a's."""

    axis: str
    a: str
    b: str
    lag_s: float
    correlation: float
    peak_times_s: tuple[float, ...]
    a_peaks_Nm: tuple[float, ...]
    b_peaks_Nm: tuple[float, ...]
    peak_lags_s: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        return tuple(b / a for a, b in zip(self.a_peaks_Nm, self.b_peaks_Nm, strict=True))

    def __str__(self) -> str:
        lines = [
            f"  {self.b} against {self.a}, axis {self.axis}: lag {self.lag_s:+.1f} s at correlation {self.correlation:.3f}"
        ]
        for t, x, y, r, p in zip(
            self.peak_times_s, self.a_peaks_Nm, self.b_peaks_Nm, self.ratios, self.peak_lags_s, strict=True
        ):
            lines.append(
                f"      at {t:6.0f} s {x:+11.4g} and {y:+11.4g} N m   ratio {r:5.2f}   {p:+4.0f} s between peaks"
            )
        return "\n".join(lines)

    def record(self) -> dict:
        return {
            "axis": self.axis, "a": self.a, "b": self.b, "lag_s": self.lag_s, "correlation": self.correlation,
            "peaks": [
                {"time_s": t, "a_torque_Nm": x, "b_torque_Nm": y, "ratio": r, "peak_lag_s": p}
                for t, x, y, r, p in zip(self.peak_times_s, self.a_peaks_Nm, self.b_peaks_Nm, self.ratios,
                                         self.peak_lags_s, strict=True)
            ],
        }  # fmt: skip


def compare_torques(a: TorqueResult, b: TorqueResult, axis: str, peaks_at: list[float] | None = None) -> Comparison:
    """Peaks, ratio and lag of ``b`` against ``a``.  ``peaks_at``: where to look, else a's own peaks."""
    j = AXES.index(axis)
    times = [p.time_s for p in find_peaks(a, j)] if peaks_at is None else list(peaks_at)
    reach = _reach(times)
    x = [peak_near(a, j, t, reach) for t in times]
    y = [peak_near(b, j, t, reach) for t in times]
    lag, correlation = best_lag(a.time_s, a.torque_Nm[:, j], b.time_s, b.torque_Nm[:, j])
    return Comparison(
        axis, f"{a.method} {a.variant}", f"{b.method} {b.variant}", lag, correlation, tuple(times),
        tuple(v for _, v in x), tuple(v for _, v in y), tuple(tb - ta for (ta, _), (tb, _) in zip(x, y, strict=True)),
    )  # fmt: skip


def _reach(times) -> float:
    """How far from a peak another method's may be: half the way to the next one, at most 30 s."""
    return min(30.0, float(np.min(np.diff(sorted(times)))) / 2) if len(times) > 1 else 30.0


def peak_near(result: TorqueResult, axis: int, time_s: float, reach_s: float) -> tuple[float, float]:
    """The extremum within ``reach_s`` of a time, of the sign that the torque has there."""
    near = (np.abs(result.time_s - time_s) <= reach_s) & np.isfinite(result.torque_Nm[:, axis])
    if not near.any():
        return float("nan"), float("nan")
    t, v = result.time_s[near], result.torque_Nm[near, axis]
    sign = np.sign(v[np.argmin(np.abs(t - time_s))]) or 1.0
    k = int(np.argmax(sign * v))
    return float(t[k]), float(v[k])


def best_lag(ta, a, tb, b, most_s: float = 15.0, step_s: float = 0.1) -> tuple[float, float]:
    """The shift of b, in steps of 0.1 s, at which it correlates best with a; and that correlation."""
    good_a, good_b = np.isfinite(a), np.isfinite(b)
    if good_a.sum() < 8 or good_b.sum() < 8:
        return float("nan"), float("nan")
    inner = ta[good_a]
    inner = inner[(inner >= tb[good_b][0] + most_s) & (inner <= tb[good_b][-1] - most_s)]
    if len(inner) < 8:
        return float("nan"), float("nan")
    x = np.interp(inner, ta[good_a], a[good_a])
    lags = np.arange(-most_s, most_s + step_s / 2, step_s)
    shifted = np.interp(inner[:, None] + lags, tb[good_b], b[good_b])
    x = x - x.mean()
    shifted = shifted - shifted.mean(axis=0)
    size = np.sqrt((x @ x) * np.sum(shifted**2, axis=0))
    if not np.any(size > 0):
        return float("nan"), float("nan")
    r = np.where(size > 0, x @ shifted / np.where(size > 0, size, 1), -2.0)
    k = int(np.argmax(r))
    return round(float(lags[k]), 6), float(r[k])
