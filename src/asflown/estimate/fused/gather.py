"""From telemetry to what the fused method smooths: every channel of an axis at its own sample times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS
from ...telemetry.channels import AXES
from ..subject import (
    GAPS_BRIDGED,
    Grid,
    Subject,
    actuators,
    gap_doubts,
    gaps_on_grid,
    grid_for,
    slews,
    splined,
    thrusters_firing,
)
from .series import ATTITUDE_ERROR, BODY_RATE, CONTROL_TORQUE, MOMENTUM, Series

if TYPE_CHECKING:
    from ...telemetry.telemetry import Channel

LOOPS = ("modelled", "measured")

#: Fewest samples a channel needs, and most instants of one pass.
_LEAST, _LONGEST = 25, 200_000

#: Momentum of the actuators in body axes (N, 3) at given instants.
Motion = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Record:
    """The series of every axis that can be solved, seconds from the grid's start.

    ``loop``: whether the controller is modelled, or what the actuators do only measured; ``pushed``: they are
    known by their torque, not their momentum; ``start_Nms``: their momentum (3,), taken off the series;
    ``together``: whether all actuators are read at the same instants."""

    grid: Grid
    loop: str
    pushed: bool
    series: dict[int, list[Series]]
    start_Nms: np.ndarray
    together: bool
    doubts: list[str]


def gather(subject: Subject, axes: tuple[int, ...], loop: str | None, motion: Motion | None = None) -> Record:
    """All axes where their channels are there, else those asked for.

    ``loop``: one of LOOPS, or None: modelled where everything that takes is there.  ``motion``: the actuators'
    momentum as known so far, which carries the samples of wheels read at different instants to common ones.

    Raises BadInput where a channel is missing, silent or short, and for a loop that cannot be modelled."""
    tlm = subject.telemetry
    stored, pushed, doubts = actuators(subject)
    doubts = list(doubts)
    if tlm.has_axes("body_rate"):
        axes = (0, 1, 2)
    why_not = _loop_unknown(subject, axes, bool(pushed))
    if loop == "modelled" and why_not:
        what, remedy = why_not
        raise BadInput(what, file=tlm.source or None, remedy=remedy)
    if loop is None and why_not:
        doubts.append(f"{why_not[0]}: what the actuators do is taken as measured, which makes a wider band")
    modelled = loop != "measured" and not why_not
    rows = [(BODY_RATE, "body_rate")]
    if modelled:
        rows.insert(0, (ATTITUDE_ERROR, "attitude_error"))
    if pushed:
        rows.append((CONTROL_TORQUE, "control_torque"))
    channels = {(row, j): tlm.channel(f"{stem}_{AXES[j]}") for row, stem in rows for j in axes}
    everything = [*channels.values(), *[c for c, _ in stored]]
    grid = grid_for(everything)
    if grid.count > _LONGEST:
        raise BadInput(
            f"{grid.count:,} instants are too many for one fused pass",
            remedy=f"Take at most {_LONGEST:,} with --start and --stop, or use --method momentum.",
        )
    for c in everything:
        _check_alive(c)
    series: dict[int, list[Series]] = {j: [] for j in axes}
    for (row, j), c in channels.items():
        series[j].append(_series(row, c, grid))
    start, together = np.zeros(3), True
    if stored:
        t, h, together = _momentum(stored, grid, doubts, motion)
        start = h[0].copy()
        count = np.sqrt(sum((c.count_size * d) ** 2 for c, d in stored))  # of the sum: quanta add as variances do
        for j in axes:
            series[j].append(Series(MOMENTUM, t, h[:, j] - start[j], float(count[j])))
    if not modelled:  # where wheels stick and tear loose, instants within the cadence begin to matter
        series = {j: [s.with_jumps() for s in of_axis] for j, of_axis in series.items()}
    silent = {g: c.name for c in everything for g in gaps_on_grid(c, grid)}
    doubts += gap_doubts(tlm, grid, silent, GAPS_BRIDGED)
    return Record(grid, "modelled" if modelled else "measured", bool(pushed), series, start, together, doubts)


def _loop_unknown(subject: Subject, axes, pushed: bool) -> tuple[str, str] | None:
    """Why the closed loop cannot be modelled, and what to do about it."""
    tlm = subject.telemetry
    if pushed or subject.relative:
        kind = "only the actuators' torque is" if pushed else "wheels of unknown spin inertia are"
        return f"{kind} in the telemetry", "Use --loop measured."
    if subject.craft.craft.wheel_controller is None:
        return (
            f"{subject.craft.craft.name} has no wheel controller described",
            "Describe it under [wheel_controller] in the craft file, or use --loop measured.",
        )
    missing = [f"attitude_error_{AXES[j]}" for j in axes if f"attitude_error_{AXES[j]}" not in tlm]
    if missing:
        return f"{some_of(missing)} is not in the telemetry", "Add the channel, or use --loop measured."
    if slews(tlm):
        return (
            "the craft slews, and the loop's commanded motion is not in the telemetry",
            "Narrow the window to a hold with --start and --stop, or use --loop measured.",
        )
    if thrusters_firing(tlm):
        return "thrusters fire, and may hold the attitude in place of the wheels", "Use --loop measured."
    return None


def _check_alive(c: Channel) -> None:
    u = c.usable.values
    if len(u) < _LEAST or np.ptp(u) == 0:
        why = "never changes" if len(u) >= _LEAST else f"has {len(u)} usable samples, fewer than {_LEAST}"
        raise BadInput(
            f"this channel {why}: the fused method cannot fit its noise",
            channel=c.name,
            remedy="Take a longer window, or use --method momentum.",
        )


def _series(row: int, channel: Channel, grid: Grid) -> Series:
    u = channel.usable
    s = grid.of(u.tai_ns)
    inside = (s >= 0) & (s <= grid.seconds[-1] + 1e-6)
    return Series(row, s[inside], u.values[inside], u.count_size)


def _momentum(stored, grid: Grid, doubts: list[str], motion: Motion | None):
    """Stored momentum in body axes at the sample times all actuators share, or at those of the first; and whether they share them."""
    lead = stored[0][0].usable
    common = lead.tai_ns
    for c, _ in stored[1:]:
        common = np.intersect1d(common, c.usable.tai_ns)
    last_ns = grid.start_ns + round(grid.seconds[-1] * NS)
    common = common[(common >= grid.start_ns) & (common <= last_ns)]
    if len(common) > 0.5 * len(lead.tai_ns):
        h = np.zeros((len(common), 3))
        for c, direction in stored:
            u = c.usable
            h += np.outer(u.values[np.searchsorted(u.tai_ns, common)], direction)
        return grid.of(common), h, True
    times = grid.of(lead.tai_ns)
    times = times[(times >= 0) & (times <= grid.seconds[-1])]
    if motion is None:
        doubts.append(
            "the wheels are sampled at different instants: the model carries their rates to those of the first"
        )
        fine = Grid(grid.start_ns, 0.125, int(grid.seconds[-1] * 8) + 1)
        h = np.sum([np.outer(np.interp(times, fine.seconds, splined(c, fine)), d) for c, d in stored], axis=0)
    else:
        h = _carried(stored, grid, times, motion)
    known = np.isfinite(h).all(axis=1)
    return times[known], h[known], False


def _carried(stored, grid: Grid, times: np.ndarray, motion: Motion) -> np.ndarray:
    """Each wheel's nearest sample, moved by what the momentum known so far makes of the time between."""
    share = np.linalg.pinv(np.array([d for _, d in stored]).T)  # rate of each wheel per momentum
    h = np.zeros((len(times), 3))
    for (c, direction), row in zip(stored, share, strict=True):
        u = c.usable
        t = grid.of(u.tai_ns)
        right = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
        nearest = np.where(times - t[right - 1] < t[right] - times, right - 1, right)
        moved = (motion(times) - motion(t[nearest])) @ row
        moved[np.abs(t[nearest] - times) > 1.5 * u.cadence_ns / NS] = np.nan
        h += np.outer(u.values[nearest] + moved, direction)
    return h
