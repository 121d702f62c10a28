"""A density against what is known beforehand: peaks published for the same flyby, the body's atmosphere, the craft's size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ...craft.model import Aerodynamics
    from ...dynamics.flyby import Flyby
    from .parts import DensityPeak, PeakRatio

#: A plume or an atmosphere changes by less than this factor from what is known of it, over the range that instruments give. Assumed.
_UNLIKE = 2.5
#: Jets met elsewhere, or smoothed, move a peak by less than this. [s]  Assumed.
_MOVED_S, _SIGMAS = 20.0, 4.0
#: A projected area differs by less than this factor from attitude to attitude; an arm is no longer than so many widths of the craft.
_OTHER_AREA, _WIDTHS = 3.0, 1.5

FAR_FROM_KNOWN = Kind(
    "density.far-from-known", Severity.SUSPECT,
    "the peak is {ratio:.2g} times the nearest known value, {known}: area, arm, drag coefficient, spin inertia or a unit may be off by that factor",
    "Check --area, --arm, the drag table, and units of the telemetry.",
)  # fmt: skip
PEAK_ELSEWHEN = Kind(
    "density.peak-elsewhen", Severity.SUSPECT,
    "the peak is {apart_s:.0f} s {when} than {known}: closest approach may be off by as much, and the peak's height with it",
    "Check --closest-approach and the epoch of the telemetry; with jets that differ from the published ones, give --source.",
)  # fmt: skip
AREA_FAR = Kind(
    "density.area-far", Severity.SUSPECT,
    "the projected area is {ratio:.2g} times the {known_m2:.3g} m2 of the craft file, more than an attitude changes it",
    "Check the area and its unit (--area, the drag table).",
)  # fmt: skip
ARM_FAR = Kind(
    "density.arm-far", Severity.SUSPECT,
    "an arm of {arm_m:.3g} m reaches beyond the craft, whose projected area is {area_m2:.3g} m2",
    "Check the arm and its unit (--arm, the drag table): it is from the centre of mass to the centre of pressure.",
)  # fmt: skip


def size_doubts(air: Aerodynamics, area_m2, arm_m) -> Iterator[Doubt]:
    """Of area and arm along the flyby, scalars or arrays."""
    area, arm = float(np.median(area_m2)), float(np.median(np.abs(arm_m)))
    known = air.projected_area
    if known and not 1 / _OTHER_AREA <= area / known <= _OTHER_AREA:
        yield AREA_FAR(ratio=area / known, known_m2=known)
    if arm > _WIDTHS * np.sqrt(min(area, known or area)):
        yield ARM_FAR(arm_m=arm, area_m2=area)


def peak_doubts(peak: DensityPeak, flyby: Flyby, ratios: Sequence[PeakRatio], *, own_sources: bool) -> list[Doubt]:
    """Of the peak's height and time.  ``own_sources``: the user gave jets of his own, so that the time may be another."""
    air, t = flyby.moon.atmosphere, peak.time_s
    if air is not None:
        heights = {
            f"that of {flyby.moon.name}'s atmosphere there": peak.density_kgm3 / float(air.density(flyby.altitude(t)))
        }
        times = {"closest approach, at which an atmosphere is densest": t}
    else:
        heights = {f"the one published for {flyby.name} ({r.published.instrument})": r.ratio for r in ratios}
        times = {f"the one published for {flyby.name} ({r.published.instrument})": r.later_s for r in ratios}
    doubts = []
    if heights:
        known, ratio = min(heights.items(), key=lambda h: abs(np.log(max(h[1], 1e-300))))
        if not 1 / _UNLIKE <= ratio <= _UNLIKE:
            doubts.append(FAR_FROM_KNOWN(ratio=ratio, known=known))
    if times and not own_sources:
        known, later = min(times.items(), key=lambda h: abs(h[1]))
        if abs(later) > max(_MOVED_S, _SIGMAS * (peak.time_sigma_s or 0.0)):
            doubts.append(PEAK_ELSEWHEN(apart_s=abs(later), when="later" if later > 0 else "earlier", known=known))
    return doubts
