"""The largest density: of the curve, of its draws, or of drawn jets; the published peaks; and the span in which gas is seen."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.flyby import published_peaks
from ...dynamics.plume import sources_passed
from ...kit.ensemble import spread
from ...telemetry.channels import AXES
from .parts import DensityPeak, Noticed, PeakRatio, total
from .peak import TIME_STEP_S, DrawnPeaks, draw_peaks

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby
    from ..torque import TorqueResult
    from .asked import Asked, Passage
    from .curve import Curve
    from .gas_torque import GasTorque

#: Gas is noticed where the density is this many sigma above what is left out, or so many of its draws are.  Assumed.
_NOTICED, _NOTICED_SHARE = 3.0, 0.995


def jets_peaks(asked: Asked, passage: Passage, gas: GasTorque, curve: Curve, torque: TorqueResult) -> DrawnPeaks | None:
    """Peaks of jets near the sources and a remainder; None where they are not asked for, or data or geometry do not allow it."""
    drag, flyby = curve.drag, passage.flyby
    if not asked.cusps or asked.printed or flyby.moon.atmosphere is not None:
        return None
    if flyby.latitude_south_rad is None or len(torque.evidence) < len(drag.axes):
        return None
    sources = sources_passed(flyby, asked.sources)
    data = []
    for i, j in enumerate(drag.axes):
        a = torque.evidence[AXES[j]]
        if gas.gravity_Nm is not None:
            a = a.without(gas.gravity_at(a.time_s - passage.closest_s, i))
        data.append(a)
    return draw_peaks(data, [partial(drag.about, j) for j in drag.axes], flyby, sources, passage.closest_s)


def peak_of(curve: Curve, flyby: Flyby, found: DrawnPeaks | None) -> DensityPeak:
    """By the jets where they were drawn, else by the curve, its time's sigma from its draws where there are any."""
    if found is not None:
        at, height = float(np.median(found.time_s)), float(np.median(found.density_kgm3))
        # all draws in one step of the lattice do not make the time exact
        when = float(np.hypot(float(spread(found.time_s)), TIME_STEP_S / 2))
        return _peak(curve, flyby, at, height, float(spread(found.density_kgm3)), when, "of jets and a remainder")
    k, sigma = curve.top, curve.sigma_kgm3
    at, height = float(curve.time_s[k]), float(curve.density_kgm3[k])
    if sigma is None or curve.drawn is None:
        return _peak(curve, flyby, at, height, None if sigma is None else float(sigma[k]), None)
    t, drawn, known = curve.drawn.time_s, curve.drawn.density_kgm3, curve.time_s[curve.known]
    inside = (t >= known[0]) & (t <= known[-1]) & np.isfinite(drawn).all(axis=0)
    tops = t[inside][np.argmax(drawn[:, inside], axis=1)]
    step = float(np.median(np.diff(curve.time_s))) / np.sqrt(12)
    when = float(np.linalg.norm([spread(tops), _flat_top(curve, float(sigma[k])), step]))
    return _peak(curve, flyby, at, height, float(sigma[k]), when)


def _peak(
    curve: Curve, flyby: Flyby, at: float, height: float, shape: float | None, when: float | None, way="of the curve"
) -> DensityPeak:
    altitudes = None if when is None else flyby.altitude(at + when * np.array([-1.0, 0.0, 1.0]))
    return DensityPeak(
        height,
        at,
        float(flyby.altitude(at)),
        shape,
        total(shape, curve.drag.scale_sigma, height),
        when,
        None if altitudes is None else float(np.ptp(altitudes)) / 2,
        way,
    )


def _flat_top(curve: Curve, sigma: float) -> float:
    """Half the span around the top in which the density stays within one sigma of its largest. [s]"""
    k, rho, t = curve.top, curve.density_kgm3, curve.time_s
    low = ~curve.known | (np.nan_to_num(rho, nan=-np.inf) < rho[k] - sigma)
    start, stop = _span_around(k, low)
    return 0.5 * float(t[stop] - t[start])


def _span_around(k: int, out: np.ndarray) -> tuple[int, int]:
    """First and last index around ``k`` up to the next ones that are out."""
    before, after = np.flatnonzero(out[:k]), np.flatnonzero(out[k:])
    return before[-1] + 1 if len(before) else 0, k + after[0] - 1 if len(after) else len(out) - 1


def noticed_in(curve: Curve, flyby: Flyby) -> Noticed | None:
    """The span around the curve's peak in which gas is seen above noise and torques not modelled (the plume paper's P and R)."""
    k, rho, sigma = curve.top, curve.density_kgm3, curve.sigma_kgm3
    if sigma is None:
        return None
    if curve.drawn is None:
        t, criterion = curve.time_s, f"density {_NOTICED:g} sigma above what other torques can mimic"
        out, middle = ~(rho > curve.left_out_kgm3 + _NOTICED * sigma), k
    else:
        t, drawn = curve.drawn.time_s, curve.drawn.density_kgm3
        criterion = f"{100 * _NOTICED_SHARE:g} % of drawn densities above what other torques can mimic"
        bound = np.interp(t, curve.time_s, curve.left_out_kgm3)
        out, middle = ~(np.mean(drawn > bound, axis=0) >= _NOTICED_SHARE), int(np.argmin(np.abs(t - curve.time_s[k])))
    if out[middle] or rho[k] < _NOTICED * sigma[k]:
        return None
    start, stop = _span_around(middle, out)
    return Noticed(float(t[start]), float(t[stop]), criterion, flyby.noticed_s)


def published_ratios(peak: DensityPeak, flyby: Flyby) -> tuple[PeakRatio, ...]:
    """This peak over every published one of the same flyby."""
    found = []
    for p in published_peaks():
        if p.flyby != flyby.name:
            continue
        theirs = p.middle_kgm3
        ratio, sigma = peak.density_kgm3 / theirs, None
        if peak.density_sigma_kgm3 is not None and p.sigma_kgm3 is not None:
            shares = np.hypot(peak.density_sigma_kgm3 / peak.density_kgm3, p.sigma_kgm3 / theirs)
            sigma = abs(ratio) * float(shares)
        found.append(PeakRatio(p, ratio, sigma, peak.time_s - p.time_s))
    return tuple(found)
