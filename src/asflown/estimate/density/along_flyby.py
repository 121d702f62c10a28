"""Density of the gas that a craft flies through, from the torque it exerts (004 sections V and VI).

    rho = (T - T_gravity) / (1/2 C_D V^2 A l)                                                  (004 eq 21)

Two errors, kept apart: that of the torque differs from instant to instant and spoils the shape; those of drag coefficient,
speed, area and arm stretch all densities alike.  Density is not held to be positive: below zero it shows the noise.

The torque is a vector, u x (r_CP - r_CM): where the arm is known about several axes, one density explains them all, each
axis weighed by its noise, and chi-square says whether they agree.  004 takes one axis.

Gravity gradient is no small torque at closest approach.  It is taken off where flight direction and vertical are known in
body axes, and bounded by its worst attitude (004 eq 19) where not; so are sunlight, generators and magnetism always.

The peak is that of densities drawn from the posterior of jets and a remainder (``density_peak``) where the fused method and
the flyby's geometry allow, else that of the estimated curve.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.environment import gravity_gradient, gravity_gradient_bound
from ...dynamics.flyby import Flyby, flyby_called, published_peaks
from ...dynamics.plume import FARTHEST_M, Jet, sources_passed
from ...kit.ensemble import spread
from ...kit.errors import BadInput, some_of
from ...kit.timeline import utc_label
from ...telemetry.channels import AXES
from ..firing import gained
from ..subject import check_on_times, slews, subject_of, thrusters_firing
from ..torque import METHODS, disturbance_torque, torque_on_times
from .atmosphere import fit_atmosphere
from .axes import agreement_of, drawn_densities, tells, weights
from .drag import PRINTED_SHAPE, DragAlong, flyby_drag
from .peak import TIME_STEP_S, DrawnPeaks, draw_peaks
from .result import Beside, DensityPeak, DensityResult, Noticed, total

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

#: The part of a record that a result shows, either side of closest approach. [s]
REACH_S = 600.0
_NOTICED = 3.0  # sigma
_NOTICED_SHARE = 0.995  # of drawn densities above zero
_FEWEST = 10  # instants
#: A density as far below zero as this is no noise. [sigma]
_NEGATIVE = 8.0
#: Chi-square of a step beyond which an atmosphere does not explain the record.
_MISFIT = 3.0
#: Share by which wheels alone, without the body's own momentum, came out too high on a simulated E3.
_WITHOUT_BODY = 0.2
#: Share by which the height of a cusp came out low on simulated flights E5 held by thrusters.
_CUSP_ON_TIMES = 0.11
#: Where gas is to be met, near closest approach. [s]
_PLUME_S = (-20.0, 60.0)
#: Of drawn peaks at an end of the record, beyond which the largest density may lie outside it.
_AT_AN_END = 0.05


def density(
    telemetry: Telemetry,
    craft: Craft,
    flyby: Flyby | str,
    closest_approach: str | float,
    *,
    axis: str | None = None,
    method: str | None = None,
    variant: str = "corrected",
    order: int = 12,
    area_m2: float | None = None,
    arm_m: float | None = None,
    drag_table=None,
    velocity_B=None,
    up_B=None,
    sources: tuple[Jet, ...] | None = None,
    cusps: bool = True,
) -> DensityResult:
    """Density along a flyby. [kg/m3]

    ``closest_approach``: UTC, or seconds from the telemetry's epoch.  ``axis``: about which gas turns the craft.  ``method``:
    of ``disturbance_torque``.  ``variant``: 'corrected', or 'printed': 004's constant for E3, its judged errors, its torque (by
    the reduced loop unless a method is named), no gravity gradient.  ``order``: of the polynomial method.  ``area_m2``, ``arm_m``: in place of the craft's.
    ``drag_table``: CSV of time from closest approach, speed, area and arm vector, in place of all of them; all its axes together
    unless ``axis`` names one.  ``velocity_B``, ``up_B``: direction of flight, and from the moon to the craft at closest approach,
    in the axes of a body that does not turn; both, or none.  ``sources``: of jets near which a peak may have a cusp, those
    published unless given; ``cusps``: whether one is looked for, which takes as long as all else.

    Raises BadInput where drag is not known, the record is not of the flyby, or the torque cannot be had."""
    where = flyby_called(flyby) if isinstance(flyby, str) else flyby
    if (velocity_B is None) != (up_B is None):
        raise BadInput(
            "the gravity gradient needs the direction of flight and the vertical, and only one is given",
            remedy="Give both (--velocity and --up), or none: then it is bounded.",
        )
    if method is not None and method not in (*METHODS, "on-times"):
        raise BadInput(f"method {method!r} is not known", remedy=f"Choose one of: {some_of((*METHODS, 'on-times'))}.")
    printed, steps = variant == "printed", None
    drag = flyby_drag(craft, where, axis, area_m2, arm_m, drag_table, printed)
    closest_ns = telemetry.moment(closest_approach)
    first, last = (float(telemetry.seconds(t)) for t in telemetry.span())
    middle = float(telemetry.seconds(closest_ns))
    if not first - REACH_S < middle < last + REACH_S:
        raise BadInput(
            f"closest approach ({telemetry.describe_time(closest_ns)}) is not in this record",
            file=telemetry.source or None,
            remedy=f"The telemetry runs from {first:g} to {last:g} s of its epoch, {telemetry.epoch_label}.",
        )
    check_on_times(telemetry, craft)
    about = drag.names if len(drag.axes) == 1 else "all"
    firing = thrusters_firing(telemetry)
    bodiless = [a for a in drag.names if f"body_rate_{a}" not in telemetry]
    if (
        bodiless
        and method is None
        and not printed
        and f"attitude_error_{bodiless[0]}" in telemetry
        and craft.wheel_controller is not None
        and not firing
    ):
        method = "transfer"  # answers to the body's motion too, as wheels alone do not
    if not printed and (method == "on-times" or (method is None and firing)):
        if about == "all":
            raise BadInput(
                f"on-times tell the torque about one axis at a time, and gas turns the craft about {', '.join(drag.names)}",
                remedy="Name one (--axis).",
            )
        torque, steps = torque_on_times(telemetry, craft, about)
    else:
        how = {"method": "transfer", "model": "hankel"} if printed and method is None else {"method": method}
        torque = disturbance_torque(telemetry, craft, variant=variant, axis=about, order=order, **how)
    subject = subject_of(telemetry, craft)
    if torque.relative or subject.craft.relative:
        raise BadInput(
            "inertia and torque are known per unit spin inertia only, and a density needs the torque in N m",
            remedy="Give the wheels' spin inertia and the inertia in kg m2 in the craft file.",
        )
    axes = list(drag.axes)
    time_s = torque.time_s - middle
    near = np.abs(time_s) <= REACH_S
    # a plume is looked for as far as 004's models of it reach: further out a method's own swings are the largest
    known = near & np.isfinite(torque.torque_Nm[:, axes]).all(axis=1) & (where.altitude(time_s) <= FARTHEST_M)
    if known.sum() < _FEWEST:
        raise BadInput(
            f"the torque is known at {known.sum()} instants within {FARTHEST_M / 1e3:g} km of {where.name}'s moon: too few",
            file=telemetry.source or None,
            remedy="Take a longer record, or check --closest-approach.",
        )
    doubts = [*torque.doubts, *where.doubts, *_date_doubts(telemetry, where), *drag.doubts]
    gravity = None
    I_B = subject.known_inertia()
    bound = np.full(len(time_s), where.moon.small_torques_Nm)
    if velocity_B is not None and not printed:
        gravity = gravity_gradient(I_B, where.position(time_s, up_B, velocity_B), where.moon.mu_m3_s2)[:, axes]
        if slews(telemetry):
            doubts.append("the craft slews in this record: the gravity gradient taken off is that of a fixed attitude")
    else:
        bound = bound + gravity_gradient_bound(I_B, where.distance(time_s), where.moon.mu_m3_s2)
    of_gas = torque.torque_Nm[:, axes] - (0.0 if gravity is None else gravity)
    sign = 1.0
    if not drag.signed:
        sign = float(np.sign(of_gas[known, 0][np.argmax(np.abs(of_gas[known, 0]))])) or 1.0
    K = sign * drag.at(time_s)[:, axes]
    known &= tells(K)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = of_gas / K
        of_each = None if torque.sigma_Nm is None else torque.sigma_Nm[:, axes] / np.abs(K)
        left_out = bound / np.linalg.norm(K, axis=1)
    weight = weights(K, of_each)
    rho = np.where(weight.any(axis=1), np.sum(weight * np.where(weight > 0, each, 0.0), axis=1), np.nan)
    sigma: np.ndarray | None = None
    if printed:
        sigma = PRINTED_SHAPE * np.abs(rho)
    elif of_each is not None:
        sigma = np.sqrt(np.sum((weight * np.where(weight > 0, of_each, 0.0)) ** 2, axis=1))
    if bodiless and torque.method == "momentum" and sigma is not None:
        sigma = np.hypot(sigma, _WITHOUT_BODY * np.abs(rho))
        doubts.append(
            f"without body rates the body's own momentum is left out, which made a simulated E3 {100 * _WITHOUT_BODY:.0f} % too dense: that is in sigma (add body_rate_{bodiless[0]})"
        )
    agreement = agreement_of(each[near], None if of_each is None else of_each[near], rho[near], known[near])
    if agreement is not None and agreement.p < 1e-3:
        doubts.append(
            f"one density does not explain the torque about {', '.join(drag.names)} (chi-square {agreement.chi_square:.1f} for {agreement.freedom:.0f}): arm, area, or another torque?"
        )
    drawn_s, drawn = drawn_densities(torque, axes, middle, time_s, K, weight, gravity)
    atmosphere = None
    if where.moon.atmosphere is not None:
        if len(axes) > 1:
            raise BadInput("an atmosphere is fitted to the torque about one axis", remedy="Name one (--axis).")
        steps = steps or gained(telemetry, craft, about)
        taken_off = None if gravity is None else (time_s, gravity[:, 0])
        atmosphere = fit_atmosphere(steps, where, middle, partial(_about, drag, sign, axes[0]), taken_off)
        if atmosphere.misfit > _MISFIT:
            doubts.append(
                f"no exponential atmosphere explains the momentum gained (chi-square {atmosphere.misfit:.1f} for each step): is this record of {where.name}?"
            )
    found = None
    cusps = cusps and atmosphere is None
    if cusps and not printed and where.latitude_south_rad is not None and len(torque.evidence) >= len(axes):
        found = _cusps(torque, drag, sign, where, middle, gravity, time_s, sources)
    peak = _peak(time_s, rho, sigma, drag.scale, where, known, drawn_s, drawn, found)
    if torque.method == "on-times" and atmosphere is None:
        peak = peak.wider(_CUSP_ON_TIMES * abs(peak.density_kgm3), drag.scale)
        doubts.append(
            f"from on-times a cusp's height comes out {100 * _CUSP_ON_TIMES:.0f} % low on simulated flights (a round top's does not): that is in the peak's sigma, not in the band"
        )
    unexplained = any("the model does not explain" in d for d in torque.doubts)
    doubts += _gas_doubts(time_s, rho, sigma, known, drag.signed, unexplained)
    doubts += _peak_doubts(peak, found, time_s, bound, known, gravity is not None, printed)
    doubts += _cusp_doubts(peak, found) if cusps else []
    at_peak = sign * drag.at(peak.time_s)[axes]
    one = len(axes) == 1
    return DensityResult(
        craft=craft.name,
        epoch=telemetry.epoch_label,
        flyby=where,
        closest_approach=f"{utc_label(closest_ns)} UTC" if telemetry.dated else f"{middle:g} s",
        method=torque.method,
        variant=variant,
        axis=drag.names,
        time_s=time_s[near],
        density_kgm3=rho[near],
        sigma_shape_kgm3=None if sigma is None else sigma[near],
        scale=drag.scale,
        bound_kgm3=left_out[near],
        torque_Nm=torque.torque_Nm[near][:, axes[0] if one else axes],
        gravity_gradient_Nm=None if gravity is None else gravity[near][:, 0 if one else slice(None)],
        torque_per_density=tuple(float(k) for k in at_peak),
        peak=peak,
        noticed=_noticed(time_s, rho, None if printed else sigma, left_out, known, drawn_s, drawn, where),
        beside=_beside(peak, where),
        atmosphere=atmosphere,
        doubts=tuple(dict.fromkeys(doubts)),
        agreement=agreement,
        settings={"altitude_closest_m": where.altitude_m, **drag.settings, "peak": None if found is None else found.record(),
                  "torque": torque.settings},
        drag=drag,
        sign=sign,
        evidence={a: torque.evidence[a] for a in drag.names if a in torque.evidence},
    )  # fmt: skip


def _cusps(torque, drag: DragAlong, sign, flyby, middle, gravity, time_s, sources) -> DrawnPeaks:
    known = sources_passed(flyby, sources)
    data, per_density = [], []
    for i, j in enumerate(drag.axes):
        a = torque.evidence[AXES[j]]
        if gravity is not None:
            a = a.without(np.interp(a.time_s - middle, time_s, gravity[:, i]))
        data.append(a)
        per_density.append(partial(_about, drag, sign, j))
    return draw_peaks(data, per_density, flyby, known, middle)


def _about(drag: DragAlong, sign: float, j: int, time_s) -> np.ndarray:
    return sign * drag.at(time_s)[..., j]


def _peak(time_s, rho, sigma, scale, flyby, known, drawn_s, drawn, cusps: DrawnPeaks | None) -> DensityPeak:
    k = int(np.flatnonzero(known)[np.argmax(rho[known])])
    at, height = float(time_s[k]), float(rho[k])
    shape = None if sigma is None else float(sigma[k])
    when, way = None, "of the curve"
    if cusps is not None:
        at, height, way = (
            float(np.median(cusps.time_s)),
            float(np.median(cusps.density_kgm3)),
            "of jets and a remainder",
        )
        shape, when = float(spread(cusps.density_kgm3)), float(spread(cusps.time_s))
        when = float(np.hypot(when, TIME_STEP_S / 2))  # all draws on one step do not make it exact
    elif drawn is not None and sigma is not None:
        inside = (drawn_s >= time_s[known][0]) & (drawn_s <= time_s[known][-1]) & np.isfinite(drawn).all(axis=0)
        tops = drawn_s[inside][np.argmax(drawn[:, inside], axis=1)]
        step = float(np.median(np.diff(time_s))) / np.sqrt(12)
        when = float(np.linalg.norm([spread(tops), _blunt(time_s, rho, known, k, shape), step]))
    return DensityPeak(
        height, at, float(flyby.altitude(at)), shape, total(shape, scale, height),
        when, None if when is None else float(np.ptp(flyby.altitude(at + when * np.array([-1.0, 0.0, 1.0])))) / 2, way,
    )  # fmt: skip


def _blunt(time_s, rho, known, k: int, sigma) -> float:
    """Half the span around instant k in which the density stays within one sigma of what it is there. [s]"""
    low = ~known | (np.nan_to_num(rho, nan=-np.inf) < rho[k] - sigma)
    before, after = np.flatnonzero(low[:k]), np.flatnonzero(low[k:])
    start = before[-1] + 1 if len(before) else 0
    stop = k + after[0] - 1 if len(after) else len(rho) - 1
    return 0.5 * float(time_s[stop] - time_s[start])


def _noticed(time_s, rho, sigma, left_out, known, drawn_s, drawn, flyby) -> Noticed | None:
    """The span around the curve's peak in which the gas stands out from noise and torques not modelled (004's points P and R)."""
    if sigma is None:
        return None
    if drawn is None:
        t, out = time_s, ~(rho > left_out + _NOTICED * sigma)
        criterion = f"density {_NOTICED:g} sigma above what other torques may feign"
        k = int(np.flatnonzero(known)[np.argmax(rho[known])])
    else:
        t, criterion = drawn_s, f"{100 * _NOTICED_SHARE:g} % of drawn densities above what other torques may feign"
        out = ~(np.mean(drawn > np.interp(drawn_s, time_s, left_out), axis=0) >= _NOTICED_SHARE)
        k = int(np.argmin(np.abs(t - time_s[known][np.argmax(rho[known])])))
    if out[k] or rho[known].max() < _NOTICED * sigma[known][np.argmax(rho[known])]:
        return None
    before, after = np.flatnonzero(out[:k]), np.flatnonzero(out[k:])
    start = before[-1] + 1 if len(before) else 0
    stop = k + after[0] - 1 if len(after) else len(t) - 1
    return Noticed(float(t[start]), float(t[stop]), criterion, flyby.noticed_s)


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


def _gas_doubts(time_s, rho, sigma, known, signed: bool, unexplained: bool) -> list[str]:
    """Whether gas is seen at all, by the curve itself."""
    if sigma is None:
        return []
    size = rho[known] / sigma[known]
    low = int(np.argmin(size))
    if signed and size[low] < -_NEGATIVE and -rho[known][low] > rho[known].max():
        return [
            f"the density is negative, {rho[known][low]:.2g} kg/m3 at {time_s[known][low]:+.0f} s and {-size[low]:.0f} sigma below zero: has the arm the sign it should have in body axes?"
        ]
    if rho[known].max() >= 4 * sigma[known][np.argmax(rho[known])]:
        return []
    if unexplained:
        return [
            "the largest density is below four sigma, but the model does not explain the telemetry: this says nothing of whether there was gas"
        ]
    t = time_s[known]
    if not t[0] <= _PLUME_S[0] < _PLUME_S[1] <= t[-1]:
        return [
            f"the largest density is below four sigma of its noise: no gas is seen from {t[0]:+.0f} to {t[-1]:+.0f} s, which is all that the record tells"
        ]
    return ["the largest density is below four sigma of its noise: no gas is seen, the peak is the noise's"]


def _peak_doubts(
    peak: DensityPeak, found: DrawnPeaks | None, time_s, bound, known, gravity: bool, printed: bool
) -> list[str]:
    doubts = []
    t = time_s[known]
    at_end = min(peak.time_s - t[0], t[-1] - peak.time_s) < 1e-9
    if found is not None:
        at_end = bool(np.mean((found.time_s <= t[0] + 1) | (found.time_s >= t[-1] - 1)) > _AT_AN_END)
    if at_end:
        doubts.append(
            f"the peak is at an end of what the record tells of a plume ({t[0]:+.0f} to {t[-1]:+.0f} s): the largest density may lie outside it"
        )
    if not t[0] <= 0 <= t[-1]:
        doubts.append(
            f"closest approach is not in the record, which tells of a plume from {t[0]:+.0f} to {t[-1]:+.0f} s"
        )
    if not gravity and not printed:
        at = int(np.argmin(np.abs(time_s)))
        doubts.append(
            f"gravity gradient is not taken off: up to {1e6 * np.interp(peak.time_s, time_s, bound):.0f} µN m at the peak, "
            f"{1e6 * bound[at]:.0f} at the instant nearest to closest approach (--velocity and --up would tell)"
        )
    return doubts


def _cusp_doubts(peak: DensityPeak, found: DrawnPeaks | None) -> list[str]:
    """What there is to doubt of the peak's time."""
    if peak.sigma_time_s is None:
        return ["this method does not say how well the peak's time is known"]
    if found is None:
        return [
            "the peak's time is that of a smoothed curve: simulated flights whose density has a cusp (004 Table 3) give it 3 s early"
        ]
    if found.jets_probability < 0.5:
        return [
            "jets near the sources named do not explain the density: its peak is that of a smooth curve, early at a cusp"
        ]
    if found.leaning_probability > 0.9:
        return [
            "jets from the sources named explain the density only where they lean, or stand elsewhere: with a wrong source a simulated E4's peak came out 8 % low and 1.5 s early, five times its sigma"
        ]
    return []
