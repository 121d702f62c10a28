"""Bearing drag of every wheel, from the best that a record holds, and how the wheel was used.

Best first: a run-down (the motor is off, and the wheel's own course shows the drag); the flight software's estimate of the
drag; the torque commanded of the wheels.  With wheel rates alone and the wheels in the loop there is none: the loop
compensates whatever the drag is, so that the rates follow the torque on the body and nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts
from ...kit.errors import BadInput
from ...kit.result import recorded
from .bases import NONE, coasting_of, from_command, from_flight_software, from_motor, from_run_downs
from .causes import slowings
from .doubts import (
    BASES_DIFFER,
    DRAG_UNKNOWN,
    IN_GAPS,
    NEGATIVE_PART,
    NONE_LISTED_HERE,
    NOT_SEPARABLE,
    OVER_LIMIT,
    TOO_MANY_NAMED,
)
from .named import NamedRunDown, most_at_once, named_run_downs
from .record import RecordedWheels, record_of
from .result import DragFit, WheelDrag, WheelsResult
from .rivals import HOLDING
from .run_downs import FEWEST, STICTION_RATE, Coasting
from .senses import reversed_wheels
from .use import wheel_use

if TYPE_CHECKING:
    from collections.abc import Collection

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

#: 300 rpm.  Below some speed a bearing's oil film is too thin to part the balls from the race; none of the papers
#: gives it, so this is an assumption. [rad/s]
LOW_SPEED = 300 * 2 * np.pi / 60
#: Two ways to the same drag that differ by this many sigma are doubted.
_APART = 4.0


@recorded
def wheels(
    telemetry: Telemetry,
    craft: Craft,
    *,
    low_speed_rad_s: float = LOW_SPEED,
    run_down: Collection[str | NamedRunDown] = (),
) -> WheelsResult:
    """Bearing drag of each wheel that has a rate, drag spikes, and how the wheel was used.

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates; the flight software's drag torque, commanded torque and body rates where there are any.
    craft : Craft
        The wheels' axes, spin inertia and rate limits.
    low_speed_rad_s : float
        Below it a wheel dwells [rad/s]; 300 rpm, which is assumed.
    run_down : collection of str or NamedRunDown
        When a wheel's motor is off: "RW1,RW2" in all of this telemetry, "RW3:60-240" from 60 to 240 s, or a CSV file with the
        columns wheel, start, stop.  Otherwise run-downs are those in which its current is zero, or that only a bearing
        explains: of n wheels, more than three, at most n - 3 at a time.

    Returns
    -------
    WheelsResult
        Drag [N m] as a magnitude that opposes the rate, J du/dt = -(Coulomb + viscous u) with u = |rate|; per unit spin
        inertia where that is not known.

    Raises
    ------
    BadInput
        For telemetry without wheel rates, a wheel that the craft does not have, and one in ``run_down`` that does not slow down.
    """
    if not low_speed_rad_s > 0:
        raise BadInput(f"the low speed {low_speed_rad_s:g} rad/s is not positive", remedy='Give it as in "300 rpm".')
    record = record_of(telemetry, craft, run_down)
    seen, followers = slowings(record)
    coastings, doubts = {}, [*telemetry.doubts, *_of_named(record, run_down), *reversed_wheels(record), *followers]
    for name in record.finders:
        coastings[name], found = coasting_of(record, name, seen[name])
        doubts += found
    _check_slowing(record, coastings)
    of_each = []
    for name in record.finders:
        wheel, found = _wheel(record, name, coastings, low_speed_rad_s)
        of_each.append(wheel)
        doubts += found
    if unknown := [w.name for w in of_each if w.fit is None]:
        doubts.append(DRAG_UNKNOWN(wheels=unknown))
    return WheelsResult(
        craft=craft.name,
        epoch=telemetry.epoch_label,
        low_speed_rad_s=low_speed_rad_s,
        wheels=tuple(of_each),
        doubts=Doubts(doubts),
    )


def _check_slowing(record: RecordedWheels, coastings: dict[str, Coasting | None]) -> None:
    """Raises BadInput for a run-down that is named where the wheel does not slow down."""
    tlm = record.telemetry
    for n in record.named:
        start, stop = (float(tlm.seconds(x)) for x in n.span(tlm))
        coasting = coastings.get(n.wheel)
        slows = coasting is not None and any(r.start_s < stop and r.stop_s > start for r in coasting.run_downs)
        named_here = any(a < stop and b > start for a, b in record.run_down.get(n.wheel, ()))
        if named_here and not slows:
            raise BadInput(
                f"wheel {n.wheel} does not slow down from {start:.0f} to {stop:.0f} s",
                file=n.file or tlm.source or None,
                line=n.line,
                channel=None if n.file else f"wheel_rate_{n.wheel}",
                remedy=f"A run-down takes {FEWEST} samples above {STICTION_RATE * 30 / np.pi:.0f} rpm without a gap. "
                'Name its span, as in "RW3:60-240".',
            )


def _of_named(record: RecordedWheels, run_down) -> list[Doubt]:
    """Whether run-downs are named, but none in this telemetry, or more at once than can be in a hold."""
    named = sorted({n.wheel for n in named_run_downs(run_down)})
    if not record.run_down:
        return [NONE_LISTED_HERE(wheels=named)] if named else []
    together, start_s, stop_s = most_at_once(record.run_down)
    most = record.count - HOLDING
    # three wheels or fewer never hold the attitude while one coasts: that needs no word
    if most < 1 or len(together) <= most:
        return []
    return [TOO_MANY_NAMED(wheels=together, start_s=start_s, stop_s=stop_s, most=most)]


def _wheel(
    record: RecordedWheels, name: str, coastings: dict[str, Coasting | None], low_speed_rad_s: float
) -> tuple[WheelDrag, list[Doubt]]:
    coasting, described = coastings[name], record.described(name)
    fits: list[DragFit] = []
    doubts: list[Doubt] = []
    if coasting is not None:
        fit, found = from_run_downs(record, name, coasting)
        fits.append(fit)
        doubts += found
    own = [] if coasting is None else [(r.start_s, r.stop_s) for r in coasting.run_downs]
    of_motor, of_motor_found = from_motor(record, name, own)
    fits += of_motor
    doubts += of_motor_found
    spikes = samples = None
    if (software := from_flight_software(record, name)) is not None:
        fit, spikes, samples, found = software
        fits.append(fit)
    else:
        coasts = [(r.start_s, r.stop_s) for c in coastings.values() if c for r in c.run_downs]
        commanded, found = from_command(record, name, coasts)
        if commanded is not None:
            fits.append(commanded)
        elif fits:
            found = []  # the run-down shows the drag
    f = record.finders[name]
    wheel = WheelDrag(
        name=name,
        spin_inertia_kgm2=described.spin_inertia,
        rate_limit_rad_s=described.rate_limit,
        use=wheel_use(record.telemetry.channel(f"wheel_rate_{name}"), f.t, low_speed_rad_s),
        time_s=f.t,
        rate_rad_s=f.rate,
        fits=tuple(fits),
        run_downs=() if coasting is None else coasting.run_downs,
        spikes=spikes,
        samples=samples,
    )
    return wheel, [*doubts, *found, *_doubts(wheel)]


def _doubts(w: WheelDrag) -> list[Doubt]:
    """What the wheel's fits and use raise."""
    doubts = []
    for f in w.fits:
        if not f.separable:
            doubts.append(NOT_SEPARABLE(wheel=w.name, basis=f.basis, mean_rate_rad_s=f.mean_rate_rad_s))
        elif f.coulomb_Nm < -NONE * f.coulomb_sigma_Nm or f.viscous_Nms < -NONE * f.viscous_sigma_Nms:
            doubts.append(NEGATIVE_PART(wheel=w.name, basis=f.basis))
    for f in w.fits[1:]:
        g = w.fits[0]
        if f.relative == g.relative:
            at = g.mean_rate_rad_s
            off = float(f.drag(at) - g.drag_at_mean_Nm)
            if abs(off) > _APART * np.hypot(f.sigma(at), g.drag_at_mean_sigma_Nm):
                doubts.append(
                    BASES_DIFFER(wheel=w.name, basis=f.basis, best=g.basis, difference_Nm=off, mean_rate_rad_s=at)
                )
    if w.use.gaps_s > 0:
        doubts.append(IN_GAPS(wheel=w.name, gaps_s=w.use.gaps_s))
    if w.rate_limit_rad_s is not None and w.use.largest_rate_rad_s > w.rate_limit_rad_s:
        doubts.append(OVER_LIMIT(wheel=w.name, largest_rad_s=w.use.largest_rate_rad_s, limit_rad_s=w.rate_limit_rad_s))
    return doubts
