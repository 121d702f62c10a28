"""Density of the gas that a craft flies through, from the torque it exerts (004 sections V and VI).

    rho = (T - T_gravity) / (1/2 C_D V^2 A l)                                                  (004 eq 21)

Two errors, kept apart: that of the torque differs from instant to instant and spoils the shape; those of drag coefficient,
speed, area and arm stretch all densities alike.  Density is not held to be positive: below zero it shows the noise.

Gravity gradient is no small torque at closest approach.  It is taken off where flight direction and vertical are known in
body axes, and bounded by its worst attitude (004 eq 19) where not; so are sunlight, generators and magnetism always.

The peak is that of the estimated curve.  Where torques are drawn from the posterior its time is uncertain by the spread of
theirs and, since no prior knows how blunt a plume's top is, by half the span in which the curve stays within one sigma of it.
"""

from __future__ import annotations

import numpy as np

from ..craft.model import Aerodynamics, Craft
from ..dynamics.drag import PRINTED_E3, torque_per_density
from ..dynamics.environment import gravity_gradient, gravity_gradient_bound
from ..dynamics.flyby import Flyby, flyby_called, published_peaks
from ..dynamics.plume import FARTHEST_M
from ..dynamics.trajectory import Trajectory
from ..kit.errors import BadInput
from ..kit.timeline import utc_label
from ..telemetry.telemetry import Telemetry
from .atmosphere import fit_atmosphere
from .density_result import Beside, DensityPeak, DensityResult
from .on_times import gained
from .result import AXES, TorqueResult, spread
from .subject import slews, subject_of, thrusters_firing
from .torque import disturbance_torque
from .torque_on_times import torque_on_times

#: What 004 judges its torque to be off by, and what else is (section VI): their root sum of squares is 7.73 %.
PRINTED_SHAPE, PRINTED_SCALE = 0.05, 0.059
#: The part of a record that a result shows, either side of closest approach. [s]
REACH_S = 600.0
_NOTICED = 3.0  # sigma
_FEWEST = 10  # instants


def density(
    telemetry: Telemetry,
    craft: Craft,
    flyby: Flyby | str,
    closest_approach: str | float,
    *,
    axis: str | None = None,
    method: str | None = None,
    variant: str = "corrected",
    area_m2: float | None = None,
    arm_m: float | None = None,
    velocity_B=None,
    up_B=None,
) -> DensityResult:
    """Density along a flyby. [kg/m3]

    ``closest_approach``: UTC, or seconds from the telemetry's epoch.  ``axis``: about which gas turns the craft.  ``method``:
    of ``disturbance_torque``.  ``variant``: 'corrected', or 'printed': 004's constant for E3, its judged errors, its torque (by
    the reduced loop unless a method is named), no gravity gradient.  ``area_m2``, ``arm_m``: in place of the craft's.
    ``velocity_B``, ``up_B``: direction of flight, and from the moon to the craft at closest approach, in the axes of a body
    that does not turn; both, or none.

    Raises BadInput where drag is not known, the record is not of the flyby, or the torque cannot be had."""
    where = flyby_called(flyby) if isinstance(flyby, str) else flyby
    if (velocity_B is None) != (up_B is None):
        raise BadInput(
            "the gravity gradient needs the direction of flight and the vertical, and only one is given",
            remedy="Give both (--velocity and --up), or none: then it is bounded.",
        )
    printed, steps = variant == "printed", None
    air, about = _drag(craft, where, axis, area_m2, arm_m, printed)
    closest_ns = telemetry.moment(closest_approach)
    first, last = (float(telemetry.seconds(t)) for t in telemetry.span())
    middle = float(telemetry.seconds(closest_ns))
    if not first - REACH_S < middle < last + REACH_S:
        raise BadInput(
            f"closest approach ({telemetry.describe_time(closest_ns)}) is not in this record",
            file=telemetry.source or None,
            remedy=f"The telemetry runs from {first:g} to {last:g} s of its epoch, {telemetry.epoch_label}.",
        )
    if printed and method is None:
        torque = disturbance_torque(telemetry, craft, method="transfer", model="hankel", variant=variant, axis=about)
    elif not printed and (method == "on-times" or (method is None and thrusters_firing(telemetry))):
        torque, steps = torque_on_times(telemetry, craft, about)
    else:
        torque = disturbance_torque(telemetry, craft, method=method, variant=variant, axis=about)
    subject = subject_of(telemetry, craft)
    if torque.relative or subject.craft.relative:
        raise BadInput(
            "inertia and torque are known per unit spin inertia only, and a density needs the torque in N m",
            remedy="Give the wheels' spin inertia and the inertia in kg m2 in the craft file.",
        )
    j = AXES.index(about)
    time_s = torque.time_s - middle
    near = np.abs(time_s) <= REACH_S
    # a plume is looked for as far as 004's models of it reach: further out a method's own swings are the largest
    known = near & np.isfinite(torque.torque_Nm[:, j]) & (where.altitude(time_s) <= FARTHEST_M)
    if known.sum() < _FEWEST:
        raise BadInput(
            f"the torque is known at {known.sum()} instants within {FARTHEST_M / 1e3:g} km of {where.name}'s moon: too few",
            file=telemetry.source or None,
            remedy="Take a longer record, or check --closest-approach.",
        )
    doubts = [
        *torque.doubts,
        *where.doubts,
        *_date_doubts(telemetry, where),
        *_drag_doubts(air, where, area_m2, arm_m, printed),
    ]
    T, gravity = torque.torque_Nm[:, j], None
    I_B = subject.known_inertia()
    bound = np.full(len(T), where.moon.small_torques_Nm)
    if velocity_B is not None and not printed:
        gravity = gravity_gradient(I_B, where.position(time_s, up_B, velocity_B), where.moon.mu_m3_s2)[:, j]
        if slews(telemetry):
            doubts.append("the craft slews in this record: the gravity gradient taken off is that of a fixed attitude")
    else:
        bound = bound + gravity_gradient_bound(I_B, where.distance(time_s), where.moon.mu_m3_s2)
    of_gas = T if gravity is None else T - gravity
    sign = float(np.sign(of_gas[known][np.argmax(np.abs(of_gas[known]))])) or 1.0
    per_density = sign * (
        PRINTED_E3
        if printed
        else float(torque_per_density(air.drag_coefficient, where.speed_m_s, air.projected_area, air.moment_arm))
    )
    scale, of_scale = (PRINTED_SCALE, []) if printed else _scale(air)
    doubts += of_scale
    swept = (where.speed(time_s) / where.speed_m_s) ** 2  # the torque per density is that of closest approach
    rho = of_gas / (per_density * swept)
    if printed:
        sigma = PRINTED_SHAPE * np.abs(rho)
    else:
        sigma = None if torque.sigma_Nm is None else torque.sigma_Nm[:, j] / (abs(per_density) * swept)
    atmosphere = None
    if where.moon.atmosphere is not None:
        steps = steps or gained(telemetry, craft, about)
        taken_off = None if gravity is None else (time_s, gravity)
        atmosphere = fit_atmosphere(steps, where, middle, per_density, taken_off)
    peak = _peak(torque, j, time_s, rho, sigma, scale, where, per_density * swept, gravity, known)
    doubts += _peak_doubts(peak, time_s, bound, known, gravity is not None, printed)
    return DensityResult(
        craft=craft.name,
        epoch=telemetry.epoch_label,
        flyby=where,
        closest_approach=f"{utc_label(closest_ns)} UTC" if telemetry.dated else f"{middle:g} s",
        method=torque.method,
        variant=variant,
        axis=about,
        time_s=time_s[near],
        density_kgm3=rho[near],
        sigma_shape_kgm3=None if sigma is None else sigma[near],
        scale=scale,
        bound_kgm3=(bound / (abs(per_density) * swept))[near],
        torque_Nm=T[near],
        gravity_gradient_Nm=None if gravity is None else gravity[near],
        torque_per_density=per_density,
        peak=peak,
        noticed_s=None if sigma is None or printed else _noticed(time_s[near], rho[near], sigma[near], peak.time_s),
        beside=_beside(peak, where),
        atmosphere=atmosphere,
        doubts=tuple(dict.fromkeys(doubts)),
        settings={
            "speed_m_s": where.speed_m_s, "altitude_closest_m": where.altitude_m,
            "drag_coefficient": None if printed else air.drag_coefficient,
            "projected_area_m2": None if printed else air.projected_area,
            "moment_arm_m": None if printed else air.moment_arm,
            "torque": torque.settings,
        },
    )  # fmt: skip


def _drag(craft: Craft, flyby: Flyby, axis, area_m2, arm_m, printed: bool) -> tuple[Aerodynamics, str]:
    """The craft's drag with what the user gives in its place, and the axis it turns about."""
    air = craft.aerodynamics
    if air is None:
        raise BadInput(
            f"the drag of {craft.name} is not known",
            remedy="Describe it under [aerodynamics] in the craft file: drag_coefficient, projected_area, moment_arm.",
        )
    about = axis or air.axis
    if about not in AXES:
        raise BadInput(f"axis {about!r} is not known", remedy="Choose one of: x, y, z.")
    if printed and (flyby.name != "E3" or area_m2 is not None or arm_m is not None or about != "z"):
        raise BadInput(
            "the printed torque per density is that of E3 about z, with its own area and arm",
            remedy="Use --variant corrected.",
        )
    if about != air.axis and arm_m is None:
        raise BadInput(
            f"the moment arm of {craft.name} is known about {air.axis} only", remedy=f"Give that about {about}: --arm."
        )
    given = {"projected_area": area_m2, "moment_arm": arm_m}
    for name, value in given.items():
        if value is not None and not 0 < value < 1e6:
            raise BadInput(f"a {name.replace('_', ' ')} of {value:g} is not possible", remedy="Give a positive size.")
    return air.model_copy(update={n: v for n, v in given.items() if v is not None}), about


def _scale(air: Aerodynamics) -> tuple[float, list[str]]:
    """One sigma of the torque per density, as a share."""
    if air.scale_sigma is not None:
        return air.scale_sigma, []
    doubt = "only the drag coefficient's error is in the scale: area and arm count as exact (scale_sigma in the craft file would hold all)"
    return air.drag_coefficient_sigma / air.drag_coefficient, [doubt]


def _peak(torque: TorqueResult, j, time_s, rho, sigma, scale, flyby, per_density, gravity, known) -> DensityPeak:
    k = int(np.flatnonzero(known)[np.argmax(rho[known])])
    at, height = float(time_s[k]), float(rho[k])
    shape = None if sigma is None else float(sigma[k])
    when = None
    if torque.paths_Nm is not None and sigma is not None:
        t = torque.paths_time_s - (torque.time_s[0] - time_s[0])
        off = 0.0 if gravity is None else np.interp(t, time_s, gravity)
        inside = (np.abs(t) <= REACH_S) & (flyby.altitude(t) <= FARTHEST_M)
        drawn = ((torque.paths_Nm[:, :, j] - off) / np.interp(t, time_s, per_density))[:, inside]
        late = spread(t[inside][np.argmax(np.nan_to_num(drawn, nan=-np.inf), axis=1)])
        when = float(np.hypot(late, _blunt(time_s, rho, known, k, shape)))
    return DensityPeak(
        height, at, float(flyby.altitude(at)), shape, None if shape is None else float(np.hypot(shape, scale * height)),
        when, None if when is None else abs(float(flyby.climb_rate(at))) * when,
    )  # fmt: skip


def _blunt(time_s, rho, known, k: int, sigma) -> float:
    """Half the span around instant k in which the density stays within one sigma of what it is there. [s]"""
    low = ~known | (np.nan_to_num(rho, nan=-np.inf) < rho[k] - sigma)
    before, after = np.flatnonzero(low[:k]), np.flatnonzero(low[k:])
    start = before[-1] + 1 if len(before) else 0
    stop = k + after[0] - 1 if len(after) else len(rho) - 1
    return 0.5 * float(time_s[stop] - time_s[start])


def _noticed(time_s, rho, sigma, peak_s: float) -> tuple[float, float] | None:
    """The span around the peak in which the density stands out."""
    k = int(np.argmin(np.abs(time_s - peak_s)))
    out = ~(rho > _NOTICED * sigma)
    if out[k]:
        return None
    before, after = np.flatnonzero(out[:k]), np.flatnonzero(out[k:])
    start = before[-1] + 1 if len(before) else 0
    stop = k + after[0] - 1 if len(after) else len(rho) - 1
    return float(time_s[start]), float(time_s[stop])


def _beside(peak: DensityPeak, flyby: Flyby) -> tuple[Beside, ...]:
    found = []
    for p in published_peaks():
        if p.flyby != flyby.name:
            continue
        theirs = float(np.mean(p.density_kgm3))
        ratio = peak.density_kgm3 / theirs
        sigma = None
        if peak.sigma_kgm3 is not None and p.sigma_kgm3 is not None:
            sigma = abs(ratio) * float(np.hypot(peak.sigma_kgm3 / peak.density_kgm3, p.sigma_kgm3 / theirs))
        found.append(Beside(p, ratio, sigma, peak.time_s - p.time_s))
    return tuple(found)


def _date_doubts(telemetry: Telemetry, flyby: Flyby) -> list[str]:
    if not telemetry.dated or not flyby.date or utc_label(telemetry.epoch_ns)[:10] == flyby.date:
        return []
    return [f"{flyby.name} was on {flyby.date}, and this record is of {utc_label(telemetry.epoch_ns)[:10]}"]


def _drag_doubts(air: Aerodynamics, flyby: Flyby, area_m2, arm_m, printed: bool) -> list[str]:
    doubts = []
    if air.flyby and air.flyby != flyby.name and None in (area_m2, arm_m):
        doubts.append(
            f"projected area and moment arm are those of the attitude at {air.flyby}, not at {flyby.name}: the density's scale is not known (--area, --arm)"
        )
    constant = "area and arm count" if isinstance(flyby, Trajectory) else "speed, area and arm count"
    doubts.append(f"{constant} as constant through the flyby")
    if printed:
        doubts.append("printed method: sigma is 004's judgement of 5 % (shape) and 5.9 % (scale), not this record's")
    return doubts


def _peak_doubts(peak: DensityPeak, time_s, bound, known, gravity: bool, printed: bool) -> list[str]:
    doubts = []
    if peak.sigma_shape_kgm3 is not None and peak.density_kgm3 < 4 * peak.sigma_shape_kgm3:
        doubts.append("the largest density is below four sigma of its noise: no gas is seen, the peak is the noise's")
    t = time_s[known]
    if min(peak.time_s - t[0], t[-1] - peak.time_s) < 1e-9:
        doubts.append("the peak is at an end of the span in which a plume is looked for: is it one?")
    if not gravity and not printed:
        at = int(np.argmin(np.abs(time_s)))
        doubts.append(
            f"gravity gradient is not taken off: up to {1e6 * np.interp(peak.time_s, time_s, bound):.0f} µN m at the peak, "
            f"{1e6 * bound[at]:.0f} at the instant nearest to closest approach (--velocity and --up would tell)"
        )
    if peak.sigma_time_s is None:
        doubts.append("this method does not say how well the peak's time is known")
    else:
        doubts.append(
            "the peak's time is that of a smoothed curve: simulated flights whose density has a cusp (004 Table 3) give it 3 s early"
        )
    return doubts
