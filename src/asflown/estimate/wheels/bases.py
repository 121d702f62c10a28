"""Three ways to a wheel's drag, the best one first: its run-downs, the flight software's estimate, the commanded torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.regression import robust_line
from .doubts import (
    COMMAND_INCOMPLETE,
    COMMAND_SHOWS_NONE,
    FOUND_BY_SHAPE,
    MISFIT,
    PER_SPIN_INERTIA,
)
from .result import COMMAND, FLIGHT_SOFTWARE, RUN_DOWN, DragFit, DragSamples, Spike
from .run_downs import FEWEST, STICTION_RATE, Coasting, common_law
from .samples import find_spikes, opposing

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .causes import Slowing
    from .record import RecordedWheels

#: Length over which commanded torque and momentum gained are compared [s], and how many of them it takes.
_BLOCK_S, _FEWEST_BLOCKS = 60.0, 6
#: Drag below this many sigma is none.
NONE = 3.0
#: Slow residuals this many times the noise are doubted.
_MISFIT = 2.0


def coasting_of(record: RecordedWheels, name: str, seen: list[Slowing]) -> tuple[Coasting | None, list[Doubt]]:
    """The law of drag of a wheel's run-downs; None where it has none."""
    finder, named, doubts = record.finders[name], name in record.run_down, _no_run_downs(record, name, seen)
    if named:
        spans = [(s.start, s.stop) for s in finder.stretches() if finder.falls(s.start, s.stop)]
    else:
        spans = [(s.first, s.end) for s in seen if s.cause is None]
    if not spans:
        return None, doubts
    found = common_law(finder, spans, named=named)
    if not named:
        first = found.run_downs[0]
        doubts.append(FOUND_BY_SHAPE(wheel=name, run_downs=len(spans), start_s=first.start_s, stop_s=first.stop_s))
    if found.misfit > _MISFIT**2:
        doubts.append(MISFIT(wheel=name, ratio=float(np.sqrt(found.misfit))))
    return found, doubts


def _no_run_downs(record: RecordedWheels, name: str, seen: list[Slowing]) -> list[Doubt]:
    """Steady slowings with another cause, a doubt a cause."""
    t, doubts = record.finders[name].t, []
    for cause in dict.fromkeys(s.cause for s in seen):
        stretches = [s for s in seen if s.cause == cause]
        longest = max(stretches, key=lambda s: s.end - s.first)
        # a wheel in the loop slows steadily for so short a time by chance
        if cause is not None and longest.end - longest.first >= 2 * FEWEST:
            start_s, stop_s = float(t[longest.first]), float(t[longest.end - 1])
            doubts.append(cause(wheel=name, spans=len(stretches), start_s=start_s, stop_s=stop_s))
    return doubts


def from_run_downs(record: RecordedWheels, name: str, coasting: Coasting) -> tuple[DragFit, list[Doubt]]:
    J = record.described(name).spin_inertia
    fit = DragFit.from_law(
        RUN_DOWN, coasting.values, coasting.covariance, coasting.rate, scale=1.0 if J is None else J, relative=J is None
    )
    return fit, [PER_SPIN_INERTIA(wheel=name)] if J is None else []


def from_command(
    record: RecordedWheels, name: str, coasts: list[tuple[float, float]]
) -> tuple[DragFit | None, list[Doubt]]:
    """Commanded torque less momentum gained, block by block: h_dot = commanded - drag.  ``coasts``: spans of any wheel's run-downs [s]."""
    commanded, J = record.commanded(name), record.described(name).spin_inertia
    if commanded is None or J is None:
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
