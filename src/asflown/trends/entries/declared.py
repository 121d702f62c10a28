"""What an event list declares, against the event's own file: the motor's start, the date, and whether anything moved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.ensemble import spread
from ...kit.timeline import NS, utc_label, utc_to_tai_ns

if TYPE_CHECKING:
    from ...telemetry.telemetry import Telemetry
    from .events import Event
    from .figures import Actuation, Torque

#: A declared date without an hour may be a day off. [days]
_A_DAY = 1.5
#: A mechanism has moved where its angle changes by this share of its travel.
_MOVED = 0.05
#: A torque shows where it is so many sigma from zero.
_SEEN = 5.0
#: So long after its start a mechanism that turned at this share of its later speed was not yet started. [s]
_LONG_S, _HARDLY = 10.0, 0.02
#: A declared start may lie this far outside the samples between which the motor came on. [s]
_ROUNDED_S = 1.0
_ON = frozenset({"on", "1", "true", "enabled", "running"})

START_APART = Kind(
    "trends.start-apart", Severity.SUSPECT,
    "the motor is listed to start at {listed_s:.4g} s, and {channel} shows it to come on between {after_s:.4g} and {before_s:.4g} s",
    "Correct motor_on_s in the event list; times count from the file's epoch.",
)  # fmt: skip
ANGLE_APART = Kind(
    "trends.angle-apart", Severity.SUSPECT, "the motor is listed to start at {listed_s:.4g} s, and the mechanism's angle {how} that",
    "Correct motor_on_s in the event list; times count from the file's epoch.",
)  # fmt: skip
DATE_APART = Kind(
    "trends.date-apart", Severity.SUSPECT,
    "the event is dated {listed}, and its telemetry {told}: {days:.0f} days apart",
    "Correct the date in the event list, or the epoch in the file.",
)  # fmt: skip
NOTHING_MOVES = Kind(
    "trends.nothing-moves", Severity.SUSPECT, "nothing moves in this record: {what}",
    "Check the file and the times of this event; list it only if something was moved.",
)  # fmt: skip


def contradictions(listed: Event, telemetry: Telemetry, actuation: Actuation, torque: Torque) -> list[Doubt]:
    """Doubts about one event as it is listed.  ``torque``: about the hinge, from the listed start on."""
    found = [_date(listed, telemetry), _still(actuation, torque)]
    if listed.motor_on_sigma_s == 0 and found[1] is None:
        found.append(_start(listed, actuation) or _at_rest(listed, actuation))
    return [d for d in found if d is not None]


def _date(listed: Event, telemetry: Telemetry) -> Doubt | None:
    if listed.date is None or not telemetry.dated:
        return None
    told = telemetry.epoch_ns + round(listed.motor_on_s * NS)
    days = abs(int(utc_to_tai_ns(listed.date)) - told) / NS / 86_400
    return DATE_APART(listed=listed.date[:10], told=utc_label(told)[:10], days=days) if days > _A_DAY else None


def _still(actuation: Actuation, torque: Torque) -> Doubt | None:
    angle = actuation.samples("cover_angle")
    travel = abs(actuation.mechanism.deployed - actuation.mechanism.stowed)
    if angle is not None and len(angle[1]) > 1:
        moved = float(np.ptp(angle[1]))
        if moved < _MOVED * travel:
            return NOTHING_MOVES(
                what=f"the angle of {actuation.mechanism.name} changes by {moved:.2g} of {travel:.3g} rad"
            )
        return None
    current = actuation.samples("motor_current")
    if current is not None and len(current[1]) > 1 and float(np.ptp(current[1])) == 0:
        return NOTHING_MOVES(what="the motor's current does not change")
    seen, sigma = _seen(torque)
    if sigma is not None and not (seen & (torque.drawn_time_s > 0) & (torque.drawn_time_s < actuation.running_s)).any():
        return NOTHING_MOVES(what="while the motor runs no torque about the hinge is seen")
    return None


def _start(listed: Event, actuation: Actuation) -> Doubt | None:
    """The motor's state, or its current, sampled on both sides of its start."""
    for stem in ("motor_on", "motor_current"):
        samples = actuation.samples(stem)
        if samples is None or len(samples[0]) < 2:
            continue
        t, values = samples[0] + listed.motor_on_s, samples[1]
        if stem == "motor_on":
            on = np.array([str(v).strip().lower() in _ON for v in values])
        else:
            on = values > 0.3 * np.max(values)
        rises = np.flatnonzero(~on[:-1] & on[1:])
        if not len(rises):
            continue
        near = rises[np.argmin(np.abs(t[rises + 1] - listed.motor_on_s))]
        after, before = float(t[near]), float(t[near + 1])
        if not after - _ROUNDED_S <= listed.motor_on_s <= before + _ROUNDED_S:
            return START_APART(listed_s=listed.motor_on_s, channel=stem, after_s=after, before_s=before)
    return None


def _at_rest(listed: Event, actuation: Actuation) -> Doubt | None:
    """The angle: a part that has hardly moved long after the start and then moves fast was started later; one that moved before,
    earlier.  A part that gathers speed as the fifth power of time still passes."""
    samples = actuation.samples("cover_angle")
    if samples is None or len(samples[0]) < 3:
        return None
    t, angle = samples[0], np.abs(np.asarray(samples[1], float) - float(samples[1][0]))
    running = np.flatnonzero((t > _LONG_S) & (t < actuation.running_s))
    travel = abs(actuation.mechanism.deployed - actuation.mechanism.stowed)
    early = angle[t < -_ROUNDED_S]
    if len(early) and early.max() > _MOVED * travel:
        return ANGLE_APART(listed_s=listed.motor_on_s, how=f"has moved by {early.max():.2g} rad before")
    if not len(running) or running[0] + 1 >= len(t):
        return None
    k = int(running[0])
    then = (angle[k + 1] - angle[k]) / (t[k + 1] - t[k])
    if angle[k] / t[k] < _HARDLY * then:
        return ANGLE_APART(listed_s=listed.motor_on_s, how=f"has moved by {angle[k]:.2g} rad only {t[k]:.0f} s after")
    return None


def _seen(torque: Torque) -> tuple[np.ndarray, np.ndarray | None]:
    """Where the torque is plain, and its sigma; None where it has none."""
    if not len(torque.drawn_Nm):
        return np.zeros(0, bool), None
    sigma = spread(torque.drawn_Nm)
    return np.abs(torque.drawn_Nm.mean(axis=0)) > _SEEN * sigma, sigma
