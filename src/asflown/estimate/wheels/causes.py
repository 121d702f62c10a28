"""What else than its bearing may slow a wheel steadily: a command, a torque on the body, the turning of its momentum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...telemetry.channels import AXES
from .doubts import MOTOR_AT_WORK, SLOWS_AS_DRIVEN, SLOWS_BY_COMMAND, SLOWS_WITH_OTHERS
from .rivals import without_followers
from .run_downs import CURRENT, FEWEST
from .slowing import Slowing

if TYPE_CHECKING:
    from ...kit.doubts import Doubt, Kind
    from ...telemetry.telemetry import Channel
    from .record import RecordedWheels
    from .run_downs import Finder

#: Torque that turning the momentum with the body takes, as a share of a wheel's slowing: above it, it may be the cause.
_TURNING = 0.2
#: Momentum that wheels which do not coast gain meanwhile, as a share of what this one loses: above it, a torque acts.
_SHARED = 0.5
#: An idle motor's torque as a share of what slows the wheel, over each of so many blocks, and how many sigma are sure.
_IDLE, _BLOCKS, _SURE = 0.1, 16, 4.0
#: Chance of doubting an idle motor for its sensor's noise.
_CHANCE = 1e-4
#: An idle motor's torque, with its sensor's noise, has at most this share of what slows the wheel (root mean square).
_QUIET = 0.25
#: Above this share the motor, or a sensor that shows nothing of use, is at work.
_LOUD = 0.5
#: Share of a slowing that the commanded torque explains: above it the motor is at work.
_COMMANDED = 0.5


def slowings(record: RecordedWheels) -> tuple[dict[str, list[Slowing]], list[Doubt]]:
    """Of each wheel the stretches in which it slows steadily, but for those in which its momentum turns with the body: then all
    wheels do.  None of wheels whose run-down the user names.  With doubts about those that follow another wheel."""
    seen = {n: [] if n in record.run_down else _of_one(record, n) for n in record.finders}
    seen, doubts = without_followers(record, seen)
    seen = {
        n: [s if s.cause or s.found_by == CURRENT else s._replace(cause=_shared(record, n, seen, s)) for s in stretches]
        for n, stretches in seen.items()
    }
    return seen, doubts


def _of_one(record: RecordedWheels, name: str) -> list[Slowing]:
    """With a cause that the wheel alone shows."""
    f, found = record.finders[name], []
    for a, b in f.found():
        start, stop = float(f.t[a]), float(f.t[b - 1])
        slowing = float(np.abs(f.rate[a]) - np.abs(f.rate[b - 1])) / (stop - start)
        off = motor_off(record, name, start, stop, slowing)
        if off:
            found.append(Slowing(a, b, None, CURRENT))
            continue
        if _turning(record, name, start, stop) > _TURNING * slowing:
            continue
        cause = None
        if off is False:
            cause = MOTOR_AT_WORK
        elif _by_command(record, name, np.sign(f.rate[a]), start, stop) > _COMMANDED * slowing:
            cause = SLOWS_BY_COMMAND
        elif not f.is_bearing(a, b):
            cause = SLOWS_AS_DRIVEN
        found.append(Slowing(a, b, cause))
    return found


def motor_off(record: RecordedWheels, name: str, start_s: float, stop_s: float, slowing: float) -> bool | None:
    """Whether the current shows that the motor is off, or at work, while the wheel slows so fast [rad/s^2]; None where it does
    not tell."""
    known, J = record.motor_torque(name), record.described(name).spin_inertia
    if known is None or J is None:
        return None
    t, torque = known
    inside = (t > start_s) & (t < stop_s)
    if inside.sum() < FEWEST // 2:
        return None
    blocks = np.array_split(torque[inside], int(np.clip(inside.sum() // 6, 2, _BLOCKS)))
    means = np.array([float(np.mean(b)) for b in blocks])
    scatter = float(np.sqrt(np.mean([np.var(b, ddof=1) for b in blocks])))
    errors = max(scatter, 1e-12) / np.sqrt([len(b) for b in blocks])
    drag = J * slowing
    if np.any(np.abs(means) > _IDLE * drag + _SURE * errors):
        return False
    mean, size = abs(float(np.mean(torque[inside]))), float(np.sqrt(np.mean(torque[inside] ** 2)))
    of_all = scatter / np.sqrt(float(inside.sum()))
    if size > _LOUD * drag or mean > _IDLE * drag + _SURE * of_all:
        return False
    if float(np.sum((means / errors) ** 2)) > scipy.special.chdtri(len(means), _CHANCE):
        return None
    return True if mean < 0.5 * _IDLE * drag and size < _QUIET * drag else None


def _by_command(record: RecordedWheels, name: str, way: float, start_s: float, stop_s: float) -> float:
    """Slowing that the commanded torque gives a wheel turning this ``way``; 0 where it is not known. [rad/s^2]

    A command of the wheel's own counts double, and its scatter too: it is surer than a share of the torque on the body."""
    commanded, J = record.commanded(name), record.described(name).spin_inertia
    if commanded is None or J is None:
        return 0.0
    t, torque = commanded
    inside = (t >= start_s) & (t <= stop_s)
    if not inside.any():
        return 0.0
    mean = -way * float(np.mean(torque[inside])) / J
    if record.commanded_of_wheel(name) is None:
        return mean
    return 2 * max(mean, float(np.std(torque[inside])) / J)


def _shared(record: RecordedWheels, name: str, seen: dict[str, list[Slowing]], s: Slowing) -> Kind | None:
    """Whether other wheels, which do not coast, change as much meanwhile, as a torque on the body would change them.

    Wheels that only trade momentum with this one keep the sum, and are no sign of such a torque."""
    f = record.finders[name]
    start, stop = float(f.t[s.first]), float(f.t[s.end - 1])
    own, others = _gained(record, name, f, start, stop), np.zeros(3)
    for n, g in record.finders.items():
        coasts = any(a < stop and b > start for a, b in record.run_down.get(n, ())) or any(
            g.t[o.first] < stop and g.t[o.end - 1] > start and o.cause is None for o in seen[n]
        )
        if n != name and not coasts and len(g.t) and g.t[0] <= start and g.t[-1] >= stop:
            others += _gained(record, n, g, start, stop)
    limit = _SHARED * float(np.linalg.norm(own))
    acts = np.linalg.norm(others) > limit and np.linalg.norm(own + others) > limit
    return SLOWS_WITH_OTHERS if acts else None


def _gained(record: RecordedWheels, name: str, finder: Finder, start_s: float, stop_s: float) -> np.ndarray:
    """Momentum that a wheel gains from one time to another, body axes; per unit spin inertia where that is not known."""
    w = record.described(name)
    first, last = np.interp([start_s, stop_s], finder.t, finder.rate)
    return (w.spin_inertia or 1.0) * (last - first) * np.array(w.axis)


def _turning(record: RecordedWheels, name: str, start_s: float, stop_s: float) -> float:
    """Size of what the wheel takes on as the momentum turns with the body, (w x h).a / J. [rad/s^2]"""
    tlm = record.telemetry
    if not tlm.has_axes("body_rate"):
        return 0.0

    def middle(c: Channel) -> float:
        t = tlm.seconds(c.usable.tai_ns)
        inside = c.usable.values[(t >= start_s) & (t <= stop_s)]
        return float(np.median(inside)) if len(inside) else 0.0

    omega = np.array([middle(tlm.channel(f"body_rate_{a}")) for a in AXES])
    h = np.zeros(3)
    for n in record.finders:
        w = record.described(n)
        h += (w.spin_inertia or 1.0) * middle(tlm.channel(f"wheel_rate_{n}")) * np.array(w.axis)
    own = record.described(name)
    return float(abs(np.cross(omega, h) @ own.axis)) / (own.spin_inertia or 1.0)
