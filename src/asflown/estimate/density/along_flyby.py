"""Density of the gas that a craft flies through, from the torque it exerts (plume paper sections V and VI).

    rho = (T - T_gravity) / (1/2 C_D V^2 A l)                                                  (plume paper eq 21)

Two errors are kept apart: that of the torque differs from instant to instant and spoils the shape; those of drag coefficient,
speed, area and arm stretch all densities alike.  Density is not constrained to be positive: below zero it shows the noise.

The torque is a vector, u x (r_CP - r_CM): where the arm is known about several axes, one density explains them all, each
axis weighted by its noise, and chi-square says whether they agree.  The plume paper takes one axis.

The gravity gradient is a large torque at closest approach.  It is taken off where flight direction and vertical are known in
body axes, and bounded by its worst attitude (plume paper eq 19) where not; sunlight, generators and magnetism are always
bounded.

The peak is that of densities drawn from the posterior of jets and a remainder (``peak``) where the fused method and the
flyby's geometry allow, else that of the estimated curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from ...dynamics.flyby import Flyby, flyby_called
from ...kit.doubts import Doubt, Doubts
from ...kit.errors import BadInput
from ...kit.result import inputs_of, recorded
from ..firing import gained
from ..fused import UNEXPLAINED
from ..subject import samples_of, subject_of
from .asked import Asked, passage_of
from .atmosphere import fit_atmosphere
from .curve import curve_of
from .doubts import (
    BODY_LEFT_OUT,
    GRAVITY_FIXED_ATTITUDE,
    LOW_CUSP_ON_TIMES,
    agreement_doubts,
    cusp_doubts,
    date_doubts,
    gas_doubts,
    gravity_doubts,
    span_doubts,
)
from .drag import DragGiven, flyby_drag
from .expected import peak_doubts
from .gas_torque import estimated_torque, gas_torque, without_rates
from .height import jets_peaks, noticed_in, peak_of, published_ratios
from .parts import MomentumHeld
from .result import DensityResult

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...dynamics.plume import Jet
    from ...telemetry.telemetry import Telemetry
    from ..firing import Gained
    from ..subject import Subject
    from ..torque import TorqueResult
    from .asked import Passage
    from .atmosphere import AtmosphereFit
    from .curve import Curve
    from .drag import DragAlong
    from .gas_torque import GasTorque
    from .parts import DensityPeak
    from .peak import DrawnPeaks

#: Share by which wheels alone, without the body's own momentum, came out too high on one simulated E3.
_WITHOUT_BODY = 0.2
#: Share by which the height of a cusp came out low on simulated flights E5 held by thrusters (studies/flyby_density.py).
_CUSP_ON_TIMES = 0.11


@recorded
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
    """Density of the gas along a flyby, from the torque it exerts on the craft (plume paper eq 21).

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates (or momentum), body rates and attitude errors; on-times where thrusters hold the craft.
    craft : Craft
        Its inertia, and under [aerodynamics] its drag coefficient, projected area and moment arm.
    flyby : Flyby or str
        The path past the moon, or the name of a known one: 'E3', 'E4', 'E5', 'E9', 'Titan'.
    closest_approach : str or float
        UTC, or seconds from the telemetry's epoch.
    axis : {'x', 'y', 'z'}, optional
        About which gas turns the craft; the craft's arm unless given, or all axes of ``drag_table``.
    method : str, optional
        Of ``torque``, or 'on-times'.  By default on-times where thrusters fire, transfer where there are attitude errors and
        no body rates, else fused.
    variant : {'corrected', 'printed'}
        'printed' is the plume paper: its constant for E3 about z, its judged errors, the torque of its reduced loop (unless a
        method is named), no gravity gradient.
    order : int
        Of the polynomial method.
    area_m2, arm_m : float, optional
        Projected area [m2] and moment arm [m], in place of the craft's.
    drag_table : path, optional
        CSV of time from closest approach, speed, area and arm vector, in place of all of these.
    velocity_B, up_B : array_like of shape (3,), optional
        Directions in body axes of flight, and from the moon's centre to the craft at closest approach, for a body that does
        not turn: they take the gravity gradient off.  Give both or none.
    sources : tuple of Jet, optional
        Jets near which the peak may have a cusp; the published ones unless given.
    cusps : bool
        Whether a cusp is looked for, which doubles the run time.

    Returns
    -------
    DensityResult
        Density (N,) [kg/m3] at times from closest approach [s], with its random sigma and the sigma of its scale.

    Raises
    ------
    BadInput
        Where drag is not known, the record is not of the flyby, or there is no torque in N m.
    """
    asked = Asked(
        flyby=flyby_called(flyby) if isinstance(flyby, str) else flyby,
        closest_approach=closest_approach,
        drag=DragGiven(axis, area_m2, arm_m, drag_table),
        method=method,
        variant=variant,
        order=order,
        velocity_B=velocity_B,
        up_B=up_B,
        sources=sources,
        cusps=cusps,
    )
    return density_along(subject_of(telemetry, craft), asked)


@dataclass(frozen=True)
class _Found:
    """What the steps of ``density_along`` make, one after the other."""

    passage: Passage
    torque: TorqueResult
    gas: GasTorque
    curve: Curve
    without_body: list[str]  # axes about which the body's own momentum is left out
    atmosphere: AtmosphereFit | None
    drawn_peaks: DrawnPeaks | None
    peak: DensityPeak


def density_along(subject: Subject, asked: Asked) -> DensityResult:
    """``density`` for a subject that is already built."""
    found = _found(subject, asked)
    doubts = Doubts(
        [
            *_gas_doubts(subject, asked, found),
            *_peak_doubts(subject, asked, found),
            *found.curve.drag.doubts,
            *asked.flyby.doubts.passed_on_by("trajectory"),
            *found.torque.doubts.passed_on_by("torque"),
        ]
    )
    return _result(subject, asked, found, doubts)


def _found(subject: Subject, asked: Asked) -> _Found:
    drag = flyby_drag(subject.craft.craft, asked.flyby, asked.drag, asked.variant)
    passage = passage_of(subject.telemetry, asked)
    torque = estimated_torque(subject, asked, drag)
    gas = gas_torque(subject, asked, passage, drag, torque)
    without_body = without_rates(subject, drag) if torque.method == "momentum" else []
    curve = curve_of(gas, drag, torque, passage.closest_s, _WITHOUT_BODY if without_body else 0.0)
    atmosphere = _atmosphere(subject, passage, gas, curve.drag, torque.gained)
    drawn_peaks = jets_peaks(asked, passage, gas, curve, torque)
    peak = peak_of(curve, passage.flyby, drawn_peaks)
    if torque.method == "on-times" and atmosphere is None:
        peak = peak.wider(_CUSP_ON_TIMES * abs(peak.density_kgm3), drag.scale_sigma)
    return _Found(passage, torque, gas, curve, without_body, atmosphere, drawn_peaks, peak)


def _atmosphere(
    subject: Subject, passage: Passage, gas: GasTorque, drag: DragAlong, steps: Gained | None
) -> AtmosphereFit | None:
    """The exponential atmosphere of a body that has one; ``steps``: of momentum, where they are already known."""
    if passage.flyby.moon.atmosphere is None:
        return None
    if len(drag.axes) > 1:
        raise BadInput("an atmosphere is fitted to the torque about one axis", remedy="Name one (--axis).")
    steps = steps or gained(subject, drag.names)
    taken_off = None if gas.gravity_Nm is None else (gas.time_s, gas.gravity_Nm[:, 0])
    return fit_atmosphere(steps, passage.flyby, passage.closest_s, partial(drag.about, drag.axes[0]), taken_off)


def _momentum(subject: Subject, passage: Passage, drag: DragAlong) -> MomentumHeld | None:
    try:
        s = samples_of(subject)
    except BadInput:
        return None  # actuators that are known by their torque only
    axes = list(drag.axes)
    t = subject.telemetry.seconds(s.tai_ns) - passage.closest_s
    return MomentumHeld(t, s.momentum[:, axes], s.body[:, axes], s.doubts)


def _gas_doubts(subject: Subject, asked: Asked, found: _Found) -> list[Doubt]:
    """Whether there is gas, whether what is known of it agrees, and what the torque's method leaves out."""
    unexplained = found.torque.doubts.has(UNEXPLAINED)
    doubts = [
        *gas_doubts(found.curve, unexplained=unexplained),
        *agreement_doubts(found.curve),
        *date_doubts(subject.telemetry, asked.flyby),
        *(() if found.atmosphere is None else found.atmosphere.doubts(asked.flyby.name)),
    ]
    if found.torque.method == "on-times" and found.atmosphere is None:
        doubts.append(LOW_CUSP_ON_TIMES(low_percent=100 * _CUSP_ON_TIMES))
    if found.without_body and found.curve.sigma_kgm3 is not None:
        channel = f"body_rate_{found.without_body[0]}"
        doubts.append(BODY_LEFT_OUT(high_percent=100 * _WITHOUT_BODY, channel=channel))
    return doubts


def _peak_doubts(subject: Subject, asked: Asked, found: _Found) -> list[Doubt]:
    """Whether the peak is in the record, what the gravity gradient does to it, and how well its time is known."""
    gas, curve = found.gas, found.curve
    doubts = span_doubts(found.peak, found.drawn_peaks, curve.time_s[curve.known])
    if gas.gravity_Nm is None and not asked.printed:
        doubts += gravity_doubts(found.peak, gas.time_s, gas.bound_Nm)
    elif gas.gravity_Nm is not None and subject.slewing:
        doubts.append(GRAVITY_FIXED_ATTITUDE())
    if not curve.drag.signed or found.peak.density_kgm3 > 0:
        ratios = published_ratios(found.peak, found.passage.flyby)
        doubts += peak_doubts(found.peak, found.passage.flyby, ratios, own_sources=asked.sources is not None)
    if asked.cusps and found.atmosphere is None:
        doubts += cusp_doubts(found.peak, found.drawn_peaks)
    return doubts


def _result(subject: Subject, asked: Asked, found: _Found, doubts: Doubts) -> DensityResult:
    """What is near closest approach."""
    gas, curve, peak, torque, passage = found.gas, found.curve, found.peak, found.torque, found.passage
    drag, near = curve.drag, gas.near
    shown = slice(None) if len(drag.axes) > 1 else 0
    drawn = found.drawn_peaks
    return DensityResult(
        craft=subject.craft.craft.name,
        epoch=subject.telemetry.epoch_label,
        method=torque.method,
        variant=asked.variant,
        flyby=passage.flyby,
        closest_approach=passage.label,
        closest_s=passage.closest_s,
        axis=drag.names,
        time_s=curve.time_s[near],
        density_kgm3=curve.density_kgm3[near],
        density_sigma_shape_kgm3=None if curve.sigma_kgm3 is None else curve.sigma_kgm3[near],
        scale_sigma=drag.scale_sigma,
        bound_kgm3=curve.left_out_kgm3[near],
        torque_Nm=gas.torque_Nm[near][:, shown],
        gravity_gradient_Nm=None if gas.gravity_Nm is None else gas.gravity_Nm[near][:, shown],
        torque_per_density=tuple(float(k) for k in drag.at(peak.time_s)[list(drag.axes)]),
        peak=peak,
        drag=drag,
        noticed=None if asked.printed else noticed_in(curve, passage.flyby),
        agreement=curve.agreement,
        evidence={a: torque.evidence[a] for a in drag.names if a in torque.evidence},
        drawn_peaks=drawn,
        published=published_ratios(peak, passage.flyby),
        atmosphere=found.atmosphere,
        momentum=_momentum(subject, passage, drag),
        doubts=doubts,
        inputs=(*subject.telemetry.inputs, *subject.craft.craft.inputs, *inputs_of(asked.drag.table)),
        settings={
            "altitude_closest_m": passage.flyby.altitude_m,
            **drag.settings,
            "peak": None if drawn is None else drawn.record(),
            "torque": torque.settings,
        },
    )
