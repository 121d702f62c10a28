"""What there is to doubt of a density along a flyby."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.timeline import utc_label

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby
    from ...telemetry.telemetry import Telemetry
    from .curve import Curve
    from .parts import DensityPeak
    from .peak import DrawnPeaks

#: A density as far below zero as this is not noise. [sigma]  Assumed.
_NEGATIVE = 8.0
#: A largest density below this is not gas that is seen. [sigma]  Assumed.
_SEEN = 4.0
#: Where gas is expected, near closest approach. [s]  Assumed.
_PLUME_S = (-20.0, 60.0)
#: Share of drawn peaks at an end of the record beyond which the largest density may lie outside it.  Assumed.
_AT_AN_END = 0.05
#: Chance below which axes do not agree.  Assumed.
_DISAGREE = 1e-3

NO_GAS = Kind(
    "density.no-gas", Severity.VOID,
    "the largest density is less than four sigma: no gas is seen, and the peak is that of the noise",
)  # fmt: skip
NO_GAS_IN_SPAN = Kind(
    "density.no-gas-in-span", Severity.VOID,
    "the largest density is less than four sigma: no gas is seen from {start_s:+.0f} to {stop_s:+.0f} s, and the record tells of no other time",
    "Take a record that covers the plume, {plume_start_s:+.0f} to {plume_stop_s:+.0f} s from closest approach.",
)  # fmt: skip
UNTOLD_GAS = Kind(
    "density.gas-not-told", Severity.VOID,
    "the largest density is less than four sigma, but the model does not explain the telemetry: the result does not say whether there was gas",
    "Look at the doubts about the torque first.",
)  # fmt: skip
NEGATIVE = Kind(
    "density.negative", Severity.SUSPECT,
    "the density is negative: {density_kgm3:.2g} kg/m3 at {time_s:+.0f} s, {below_sigma:.0f} sigma below zero",
    "Check the sign of the arm in body axes (arm_x, arm_y, arm_z of the drag table).",
)  # fmt: skip
AXES_DISAGREE = Kind(
    "density.axes-disagree", Severity.SUSPECT,
    "one density does not explain the torque about {axes} (chi-square {chi_square:.1f} for {freedom:.0f} degrees of freedom)",
    "Check arm and area, look for another torque, or take one axis (--axis).",
)  # fmt: skip
WRONG_DATE = Kind(
    "density.wrong-date", Severity.SUSPECT, "{flyby} was on {date}, and this record is of {record_date}",
    "Check --flyby, and the epoch of the telemetry.",
)  # fmt: skip
JETS_DO_NOT_EXPLAIN = Kind(
    "density.jets-do-not-explain", Severity.SUSPECT,
    "jets near the given sources do not explain the density: the peak is that of a smooth curve, which is early at a cusp",
    "Give the sources with --source.",
)  # fmt: skip
SOURCES_LEAN = Kind(
    "density.sources-lean", Severity.SUSPECT,
    "jets from the given sources explain the density only where they lean or stand elsewhere: with a wrong source the peak of "
    "a simulated E4 came out 8 % low and 1.5 s early, five times its sigma",
    "Give the sources with --source.",
)  # fmt: skip
LOW_CUSP_ON_TIMES = Kind(
    "density.low-cusp-on-times", Severity.CAUTION,
    "from on-times the height of a cusp came out {low_percent:.0f} % low on simulated flights (that of a round peak did not): this "
    "is in the sigma of the peak, not in the band",
)  # fmt: skip
PEAK_AT_END = Kind(
    "density.peak-at-end", Severity.CAUTION,
    "the peak is at an end of what the record tells of a plume ({start_s:+.0f} to {stop_s:+.0f} s): the largest density may lie outside it",
    "Take a longer record.",
)  # fmt: skip
NO_CLOSEST_APPROACH = Kind(
    "density.no-closest-approach", Severity.CAUTION,
    "closest approach is not in the record, which tells of a plume from {start_s:+.0f} to {stop_s:+.0f} s",
    "Take a record that holds closest approach.",
)  # fmt: skip
GRAVITY_LEFT_OUT = Kind(
    "density.gravity-left-out", Severity.CAUTION,
    "the gravity gradient is not taken off: up to {peak_uNm:.0f} µN m at the peak, {closest_uNm:.0f} µN m at the instant nearest to closest approach",
    "Give the directions of flight and of the vertical: --velocity and --up.",
)  # fmt: skip
GRAVITY_FIXED_ATTITUDE = Kind(
    "density.gravity-fixed-attitude", Severity.CAUTION,
    "the craft slews in this record: the gravity gradient taken off is that of a fixed attitude",
    "Narrow the span to the hold with --start and --stop.",
)  # fmt: skip
SMOOTHED_CUSP = Kind(
    "density.smoothed-cusp", Severity.CAUTION,
    "the peak's time is that of a smoothed curve: it is 3 s early on simulated flights whose density has a cusp (plume paper, Table 3)",
)  # fmt: skip
PEAK_TIME_UNKNOWN = Kind(
    "density.peak-time-unknown", Severity.CAUTION, "this method does not give a sigma of the peak's time",
    "Use --method fused.",
)  # fmt: skip
BODY_LEFT_OUT = Kind(
    "density.body-left-out", Severity.CAUTION,
    "there are no body rates, so the body's own momentum is left out: this made a simulated E3 {high_percent:.0f} % too dense, which is in sigma",
    "Add {channel}.",
)  # fmt: skip


def date_doubts(telemetry: Telemetry, flyby: Flyby) -> list[Doubt]:
    """Whether the record is of the flyby's day."""
    day = utc_label(telemetry.epoch_ns)[:10] if telemetry.dated else ""
    if not day or not flyby.date or day == flyby.date:
        return []
    return [WRONG_DATE(flyby=flyby.name, date=flyby.date, record_date=day)]


def gas_doubts(curve: Curve, *, unexplained: bool) -> list[Doubt]:
    """Whether gas is seen at all, by the curve itself.  ``unexplained``: the torque's model does not explain the telemetry."""
    if curve.sigma_kgm3 is None:
        return []
    rho, sigma, t = (v[curve.known] for v in (curve.density_kgm3, curve.sigma_kgm3, curve.time_s))
    size = rho / sigma
    low = int(np.argmin(size))
    if curve.drag.signed and size[low] < -_NEGATIVE and -rho[low] > rho.max():
        return [NEGATIVE(density_kgm3=float(rho[low]), time_s=float(t[low]), below_sigma=-float(size[low]))]
    if rho.max() >= _SEEN * sigma[np.argmax(rho)]:
        return []
    if unexplained:
        return [UNTOLD_GAS()]
    if not t[0] <= _PLUME_S[0] < _PLUME_S[1] <= t[-1]:
        return [
            NO_GAS_IN_SPAN(
                start_s=float(t[0]), stop_s=float(t[-1]), plume_start_s=_PLUME_S[0], plume_stop_s=_PLUME_S[1]
            )
        ]
    return [NO_GAS()]


def agreement_doubts(curve: Curve) -> list[Doubt]:
    a = curve.agreement
    if a is None or a.p >= _DISAGREE:
        return []
    return [AXES_DISAGREE(axes=list(curve.drag.names), chi_square=a.chi_square, freedom=a.freedom)]


def span_doubts(peak: DensityPeak, found: DrawnPeaks | None, time_s: np.ndarray) -> list[Doubt]:
    """Whether the record holds the peak; ``time_s``: where it tells of a plume, from closest approach."""
    doubts, t = [], time_s
    at_end = min(peak.time_s - t[0], t[-1] - peak.time_s) < 1e-9
    if found is not None:
        at_end = bool(np.mean((found.time_s <= t[0] + 1) | (found.time_s >= t[-1] - 1)) > _AT_AN_END)
    if at_end:
        doubts.append(PEAK_AT_END(start_s=float(t[0]), stop_s=float(t[-1])))
    if not t[0] <= 0 <= t[-1]:
        doubts.append(NO_CLOSEST_APPROACH(start_s=float(t[0]), stop_s=float(t[-1])))
    return doubts


def gravity_doubts(peak: DensityPeak, time_s: np.ndarray, bound_Nm: np.ndarray) -> list[Doubt]:
    """Of a gravity gradient that is only bounded."""
    at = int(np.argmin(np.abs(time_s)))
    return [
        GRAVITY_LEFT_OUT(
            peak_uNm=1e6 * float(np.interp(peak.time_s, time_s, bound_Nm)), closest_uNm=1e6 * float(bound_Nm[at])
        )
    ]


def cusp_doubts(peak: DensityPeak, found: DrawnPeaks | None) -> list[Doubt]:
    """What there is to doubt of the peak's time."""
    if peak.time_sigma_s is None:
        return [PEAK_TIME_UNKNOWN()]
    if found is None:
        return [SMOOTHED_CUSP()]
    if found.jets_probability < 0.5:
        return [JETS_DO_NOT_EXPLAIN()]
    if found.leaning_probability > 0.9:
        return [SOURCES_LEAN()]
    return []
