"""Two reconstructions of one torque, side by side: peaks, ratio and lag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...kit.digits import scaled_unit
from ...kit.errors import check_choice
from ...kit.result import Estimate
from ...kit.schema import Annotated, Doc, Number, TypedDict
from ...kit.table import Table
from ...telemetry.channels import AXES
from .result import TorqueResult, find_peaks


class PeakPairRecord(TypedDict):
    """One peak in both."""

    time_s: Number
    a_torque_Nm: Number
    b_torque_Nm: Number
    ratio: Annotated[Number, Doc("b's peak over a's")]
    peak_lag_s: Number


class TorqueComparisonRecord(TypedDict):
    """An element of ``comparison`` in the JSON of `asflown torque --compare`."""

    axis: str
    a: Annotated[str, Doc("method and variant")]
    b: str
    lag_s: Annotated[Number, Doc("shift of b of largest correlation; positive: b is later")]
    correlation: Number
    peaks: list[PeakPairRecord]


@dataclass(frozen=True, kw_only=True, repr=False)
class TorqueComparison(Estimate):
    """``b`` set against ``a`` on one axis; ``a`` and ``b`` are called by method and variant.

    ``lag_s``: the shift of b that maximises the correlation (positive: b is later);
    ``peak_lags_s``: times of b's peaks less a's; ``ratios``: b's peak over a's."""

    RECORD: ClassVar[type] = TorqueComparisonRecord

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

    def _pairs(self):
        return zip(
            self.peak_times_s, self.a_peaks_Nm, self.b_peaks_Nm, self.ratios, self.peak_lags_s, strict=True
        )  # fmt: skip

    def _tables(self) -> tuple[Table, ...]:
        factor, unit = scaled_unit(max(map(abs, self.a_peaks_Nm), default=0.0), "N m")
        rows = tuple(
            (f"{t:.0f}", f"{factor * x:+.4g}", f"{factor * y:+.4g}", f"{r:.2f}", f"{p:+.0f}") for t, x, y, r, p in self._pairs()
        )  # fmt: skip
        head = ("peak at [s]", f"{self.a} [{unit}]", f"{self.b} [{unit}]", "ratio", "later by [s]")
        title = f"{self.b} against {self.a}, axis {self.axis}: lag {self.lag_s:+.1f} s at correlation {self.correlation:.3f}"
        return (Table(title, rows, head if rows else ()),)

    def _record(self) -> dict:
        return {
            "axis": self.axis, "a": self.a, "b": self.b, "lag_s": self.lag_s, "correlation": self.correlation,
            "peaks": [
                {"time_s": t, "a_torque_Nm": x, "b_torque_Nm": y, "ratio": r, "peak_lag_s": p} for t, x, y, r, p in self._pairs()
            ],
        }  # fmt: skip


def torque_comparison(
    a: TorqueResult, b: TorqueResult, axis: str, *, peaks_at: list[float] | None = None
) -> TorqueComparison:
    """Peaks, ratio and lag of one torque against another.

    Parameters
    ----------
    a, b : TorqueResult
        Of the same epoch; ``b`` is set against ``a``.
    axis : {'x', 'y', 'z'}
        The body axis compared.
    peaks_at : list of float, optional
        Times [s from the epoch] to look for peaks at; a's own peaks unless given.

    Returns
    -------
    TorqueComparison
        With the doubts of both.

    Raises
    ------
    BadInput
        For an unknown axis.
    """
    check_choice(axis, AXES, "axis")
    j = AXES.index(axis)
    times = [p.time_s for p in find_peaks(a, j)] if peaks_at is None else list(peaks_at)
    reach = _reach(times)
    x = [peak_near(a, j, t, reach) for t in times]
    y = [peak_near(b, j, t, reach) for t in times]
    lag, correlation = best_lag(a.time_s, a.torque_Nm[:, j], b.time_s, b.torque_Nm[:, j])
    names = [f"{r.method} {r.variant}" for r in (a, b)]
    return TorqueComparison(
        craft=a.craft,
        epoch=a.epoch,
        method=f"{names[1]} against {names[0]}",
        inputs=tuple(dict.fromkeys((*a.inputs, *b.inputs))),
        doubts=a.doubts.passed_on_by(names[0]) + b.doubts.passed_on_by(names[1]),
        axis=axis,
        a=names[0],
        b=names[1],
        lag_s=lag,
        correlation=correlation,
        peak_times_s=tuple(times),
        a_peaks_Nm=tuple(v for _, v in x),
        b_peaks_Nm=tuple(v for _, v in y),
        peak_lags_s=tuple(tb - ta for (ta, _), (tb, _) in zip(x, y, strict=True)),
    )


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
