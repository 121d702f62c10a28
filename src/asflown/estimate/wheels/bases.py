"""Three ways to a wheel's drag, the best one first: its run-downs, the flight software's estimate, the commanded torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.regression import robust_line
from .causes import motor_off
from .doubts import (
    COMMAND_INCOMPLETE,
    COMMAND_SHOWS_NONE,
    FOLLOWS,
    FOUND_BY_SHAPE,
    MISFIT,
    NAMED_BUT_DRIVEN,
    PER_SPIN_INERTIA,
    TORQUE_SCALE,
    TORQUE_ZERO,
)
from .motor import ZERO_SHARE, assumed_zero, motor_law, steps_of, zero_beforehand
from .result import COMMAND, FLIGHT_SOFTWARE, MOTOR_CURRENT, WHEEL_COMMAND, DragFit, DragSamples, Spike
from .run_downs import CURRENT, FEWEST, NAMED, SHAPE, STICTION_RATE, Coasting, common_law
from .samples import find_spikes, opposing

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .record import RecordedWheels
    from .slowing import Slowing

#: Length over which commanded torque and momentum gained are compared [s], and how many of them it takes.
_BLOCK_S, _FEWEST_BLOCKS = 60.0, 6
#: A named span reaches this far to samples beside it: dates are rounded. [s]
_EDGE = 1e-3
#: The motor's torque is off its scale by more than this share, and by this many sigma.
_SCALE, _SCALE_SIGMAS = 0.05, 5.0
#: A torque's zero that the record narrows by less than this is as assumed.
_ZERO_UNTOLD = 0.9
#: Drag below this many sigma is none.
NONE = 3.0


def coasting_of(record: RecordedWheels, name: str, seen: list[Slowing]) -> tuple[Coasting | None, list[Doubt]]:
    """The law of drag of a wheel's run-downs; None where it has none."""
    finder, doubts = record.finders[name], _no_run_downs(record, name, seen)
    if name in record.run_down:
        spans, found_by = _named_spans(record, name), NAMED
        doubts += _driven(record, name, spans)
    else:
        coasts = [s for s in seen if s.cause is None]
        sure = [s for s in coasts if s.found_by == CURRENT]
        spans, found_by = [(s.first, s.end) for s in sure or coasts], CURRENT if sure else SHAPE
    if not spans:
        return None, doubts
    found = common_law(finder, spans, found_by)
    if found_by == SHAPE:
        first = found.run_downs[0]
        doubts.append(FOUND_BY_SHAPE(wheel=name, run_downs=len(spans), start_s=first.start_s, stop_s=first.stop_s))
    if (ratio := found.law.misfits) is not None:
        doubts.append(MISFIT(wheel=name, ratio=ratio))
    return found, doubts


def _named_spans(record: RecordedWheels, name: str) -> list[tuple[int, int]]:
    """Samples in which the user says that a wheel coasts, and it does slow."""
    finder, found = record.finders[name], []
    for start, stop in record.run_down[name]:
        first, end = np.searchsorted(finder.t, [start - _EDGE, stop + _EDGE])
        for s in finder.stretches():
            a, b = max(s.start, int(first)), min(s.stop, int(end))
            if b - a >= FEWEST and finder.falls(a, b):
                found.append((a, b))
    return sorted(set(found))


def _driven(record: RecordedWheels, name: str, spans: list[tuple[int, int]]) -> list[Doubt]:
    """Named run-downs in which the current shows a motor at work."""
    finder, found = record.finders[name], []
    for a, b in spans:
        start, stop = float(finder.t[a]), float(finder.t[b - 1])
        slowing = float(np.abs(finder.rate[a]) - np.abs(finder.rate[b - 1])) / (stop - start)
        if motor_off(record, name, start, stop, slowing) is False:
            t, torque = record.motor_torque(name)  # type: ignore[misc]
            mean = float(np.mean(torque[(t > start) & (t < stop)]))
            found.append(NAMED_BUT_DRIVEN(wheel=name, start_s=start, stop_s=stop, torque_Nm=mean))
    return found


def _no_run_downs(record: RecordedWheels, name: str, seen: list[Slowing]) -> list[Doubt]:
    """Steady slowings with another cause, a doubt a cause."""
    t, doubts = record.finders[name].t, []
    for cause in dict.fromkeys(s.cause for s in seen):
        stretches = [s for s in seen if s.cause == cause]
        longest = max(stretches, key=lambda s: s.end - s.first)
        # a wheel in the loop slows steadily for so short a time by chance
        if cause not in (None, FOLLOWS) and longest.end - longest.first >= 2 * FEWEST:
            start_s, stop_s = float(t[longest.first]), float(t[longest.end - 1])
            doubts.append(cause(wheel=name, spans=len(stretches), start_s=start_s, stop_s=stop_s))
    return doubts


def from_run_downs(record: RecordedWheels, name: str, coasting: Coasting) -> tuple[DragFit, list[Doubt]]:
    J = record.described(name).spin_inertia
    return DragFit.of_run_downs(coasting.law, J), [PER_SPIN_INERTIA(wheel=name)] if J is None else []


def from_motor(
    record: RecordedWheels, name: str, coasts: list[tuple[float, float]]
) -> tuple[list[DragFit], list[Doubt]]:
    """From the motor's own torque, by its current and as commanded.  ``coasts``: spans of this wheel's run-downs [s], which show
    the drag by themselves."""
    J, fits, doubts = record.described(name).spin_inertia, [], []
    ways = ((MOTOR_CURRENT, record.motor_torque(name)), (WHEEL_COMMAND, record.commanded_of_wheel(name)))
    for basis, known in ways:
        if known is None or J is None:
            continue
        steps = steps_of(record.finders[name], *known, J, coasts)
        zero = zero_beforehand(*known, coasts if basis == MOTOR_CURRENT else [])
        law = None if steps is None else motor_law(steps, zero)
        if law is None:
            continue
        fit = DragFit.from_law(basis, law.values, law.covariance, law.rate)
        if basis == WHEEL_COMMAND and fit.drag_at_mean_Nm <= NONE * fit.drag_at_mean_sigma_Nm:
            sizes = {"drag_Nm": fit.drag_at_mean_Nm, "drag_sigma_Nm": fit.drag_at_mean_sigma_Nm}
            doubts.append(COMMAND_SHOWS_NONE(wheel=name, **sizes))
            continue
        fits.append(fit)
        if basis == WHEEL_COMMAND:
            doubts.append(COMMAND_INCOMPLETE(wheel=name))
        if law.zero[1] > _ZERO_UNTOLD * assumed_zero(known[1]):
            doubts.append(TORQUE_ZERO(wheel=name, basis=basis, sigma_Nm=law.zero[1], share_percent=100 * ZERO_SHARE))
        if law.scale is not None and abs(law.scale[0] - 1) > max(_SCALE, _SCALE_SIGMAS * law.scale[1]):
            doubts.append(TORQUE_SCALE(wheel=name, basis=basis, scale=law.scale[0], scale_sigma=law.scale[1]))
    return fits, doubts


def from_command(
    record: RecordedWheels, name: str, coasts: list[tuple[float, float]]
) -> tuple[DragFit | None, list[Doubt]]:
    """Commanded torque less momentum gained, block by block: h_dot = commanded - drag.  ``coasts``: spans of any wheel's run-downs [s]."""
    commanded, J = record.commanded(name), record.described(name).spin_inertia
    if commanded is None or J is None or record.commanded_of_wheel(name) is not None:
        return None, []
    rate, drag = _in_blocks(record, name, *commanded, J, coasts)
    if len(rate) < _FEWEST_BLOCKS:
        return None, []
    u = np.abs(rate)
    values, covariance, used = robust_line(u, np.sign(rate) * drag)
    fit = DragFit.from_law(COMMAND, values, covariance, float(u[used].mean()))
    if fit.drag_at_mean_Nm > NONE * fit.drag_at_mean_sigma_Nm:
        return fit, [COMMAND_INCOMPLETE(wheel=name)]
    none = COMMAND_SHOWS_NONE(wheel=name, drag_Nm=fit.drag_at_mean_Nm, drag_sigma_Nm=fit.drag_at_mean_sigma_Nm)
    return None, [none]


def _in_blocks(record: RecordedWheels, name: str, t, torque, J: float, coasts) -> tuple[np.ndarray, np.ndarray]:
    """Mean rate and drag in blocks, (B,) each; without those in which the wheel nearly stands."""
    finder, rate, drag = record.finders[name], [], []
    for s in finder.gapless:
        ts, ws = finder.t[s], finder.rate[s]
        if len(ts) < 6:
            continue
        length = max(_BLOCK_S, 8 * float(np.median(np.diff(ts))))
        for start in np.arange(ts[0], ts[-1] - length + 1e-9, length):
            inside, block = (t >= start) & (t < start + length), (ts >= start) & (ts < start + length)
            # what is commanded of a coasting wheel is done by something else
            coasting = any(a < start + length and b > start for a, b in coasts)
            if coasting or inside.sum() < 6 or block.sum() < 6 or np.max(np.diff(t[inside])) > length / 3:
                continue
            x, w = ts[block] - ts[block].mean(), ws[block]
            if np.min(np.abs(w)) >= STICTION_RATE:
                rate.append(float(w.mean()))
                drag.append(float(torque[inside].mean()) - J * float(x @ w / (x @ x)))
    return np.array(rate), np.array(drag)


def from_flight_software(
    record: RecordedWheels, name: str
) -> tuple[DragFit, tuple[Spike, ...], DragSamples, list[Doubt]] | None:
    """The flight software's estimates of the drag, and the spikes in them; None where there are too few."""
    tlm, finder, channel = record.telemetry, record.finders[name], f"wheel_drag_torque_{name}"
    if channel not in tlm:
        return None
    c = tlm.channel(channel).usable
    t = tlm.seconds(c.tai_ns)
    seen = np.zeros(len(t), bool)
    for s in finder.gapless:
        seen |= (t >= finder.t[s][0]) & (t <= finder.t[s][-1])
    t, drag = t[seen], c.values[seen]
    rate = np.interp(t, finder.t, finder.rate) if len(t) else t
    moving = np.abs(rate) >= STICTION_RATE
    if moving.sum() < _FEWEST_BLOCKS:
        return None
    drag, convention = opposing(rate, drag, STICTION_RATE)
    u = np.abs(rate[moving])
    values, covariance, kept = robust_line(u, drag[moving])
    fit = DragFit.from_law(FLIGHT_SOFTWARE, values, covariance, float(u[kept].mean()))
    used = moving.copy()
    used[moving] = kept
    spikes = tuple(Spike(*s) for s in find_spikes(t, drag - fit.drag(rate), drag, moving, used))
    samples = DragSamples(t, rate, drag, used, _spiked(t, spikes))
    return fit, spikes, samples, [convention(channel=channel)] if convention else []


def _spiked(t, spikes: tuple[Spike, ...]) -> np.ndarray:
    within = [(t >= s.time_s) & (t <= s.time_s + s.duration_s) for s in spikes]
    return np.any(within, axis=0) if within else np.zeros(len(t), bool)
