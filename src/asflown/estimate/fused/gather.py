"""From telemetry to what the fused method smooths: every channel of an axis at its own sample times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS
from ...telemetry.channels import AXES
from ..subject import GAPS_BRIDGED, Grid, Subject, actuators, gap_doubts, gaps_on_grid, grid_for, splined
from .command import Command, command_of, errors_from_quaternions, has_attitudes, has_command, hold_of
from .feed import Feed
from .series import ATTITUDE_ERROR, BODY_RATE, CONTROL_TORQUE, MOMENTUM, Series

if TYPE_CHECKING:
    from ...telemetry.telemetry import Channel, Telemetry
    from .feed import Foreknown

LOOPS = ("modelled", "measured")

#: Fewest samples a channel needs, and most instants of one pass.
_LEAST, _LONGEST = 25, 200_000

#: Momentum of the actuators in body axes (N, 3) at given instants.
Stored = Callable[[np.ndarray], np.ndarray]

LOOP_MEASURED = Kind(
    "fused.loop-measured", Severity.NOTE,
    "{why}: the actuators' action is taken as measured, which makes a wider band", "{remedy}",
)  # fmt: skip
WHEELS_CARRIED = Kind(
    "fused.wheels-carried", Severity.NOTE,
    "the wheels are sampled at different instants: the model carries their rates to those of the first",
)  # fmt: skip


class CannotFuse(BadInput):
    """The record lacks what the fused method needs, or cannot be fitted; another method may do."""


@contextmanager
def needed() -> Iterator[None]:
    """For what only the fused method needs: a complaint about it becomes ``CannotFuse``."""
    try:
        yield
    except BadInput as why:
        raise CannotFuse(
            why.what, remedy=why.remedy, file=why.file, channel=why.channel, time=why.time, line=why.line
        ) from why


@dataclass(frozen=True)
class Record:
    """The series of every axis that can be solved, seconds from the grid's start.

    ``loop``: whether the controller is modelled, or the actuators' action only measured; ``pushed``: they are
    known by their torque, not their momentum; ``start_Nms``: their momentum (3,), taken off the series;
    ``together``: whether all actuators are read at the same instants; ``command``: the motion taken off the series of a
    modelled loop, where the craft is commanded to move or its actuators do something beside the law; ``feed``: torques known beforehand."""

    grid: Grid
    loop: str
    pushed: bool
    series: dict[int, list[Series]]
    start_Nms: np.ndarray
    together: bool
    doubts: Doubts
    command: Command | None = None
    feed: Feed | None = None

    @property
    def still(self) -> bool:
        """Whether the craft is modelled as holding a fixed attitude."""
        return self.loop == "modelled" and (self.command is None or self.command.still)


def gather(
    subject: Subject,
    axes: tuple[int, ...],
    loop: str | None = None,
    stored_Nms: Stored | None = None,
    *,
    follow: bool = False,
    foreknown: Foreknown | None = None,
) -> Record:
    """All axes where their channels are there, else those asked for.

    ``loop``: one of LOOPS, or None: modelled where that is possible.  ``stored_Nms``: the actuators' momentum as known so
    far, which carries the samples of wheels read at different instants to common ones.  ``follow``: the craft is commanded
    to turn, also where the telemetry does not say so.  ``foreknown``: torques known beforehand.

    Raises CannotFuse where a channel is missing, silent or short, BadInput for a loop that cannot be modelled."""
    tlm = subject.telemetry
    stored, pushed, found = _actuators(subject)
    if tlm.has_axes("body_rate"):
        axes = (0, 1, 2)
    loop, not_modelled = _loop(subject, axes, loop, pushed=bool(pushed))
    pointed = loop == "modelled" and not _missing_errors(tlm, axes)
    rows = [(ATTITUDE_ERROR, "attitude_error")] if pointed else []
    rows += [(BODY_RATE, "body_rate"), *([(CONTROL_TORQUE, "control_torque")] if pushed else [])]
    with needed():
        channels = {(row, j): tlm.channel(f"{stem}_{AXES[j]}") for row, stem in rows for j in axes}
        everything = [*channels.values(), *[c for c, _ in stored]]
        grid = grid_for(everything)
    _check(grid, everything)
    series = {j: [_series(row, c, grid) for (row, i), c in channels.items() if i == j] for j in axes}
    if loop == "modelled" and not pointed:
        from_attitude = errors_from_quaternions(subject, grid)
        series = {j: [from_attitude[j], *of_axis] for j, of_axis in series.items()}
    momentum = _momentum(stored, grid, stored_Nms)
    for j, of_axis in momentum.series().items():
        if j in series:
            series[j].append(of_axis)
    if loop == "measured":  # where wheels stick and tear loose, the jitter of sampling instants matters
        series = {j: [s.with_jumps() for s in of_axis] for j, of_axis in series.items()}
    command: Command | None = None
    if (
        loop == "modelled"
        and len(series) == 3
        and (follow or has_command(subject) or not subject.controller().tracking)
    ):
        command = command_of(subject, grid, series, (momentum.seconds, momentum.values_Nms))
    elif loop == "modelled":
        command = hold_of(subject, grid, series)
    if command is not None:
        series = command.taken_off(series)
    silent = {g: c.name for c in everything for g in gaps_on_grid(c, grid)}
    carried = None if momentum.together or stored_Nms is not None else WHEELS_CARRIED()
    told = () if command is None else command.doubts
    doubts = Doubts([*found, not_modelled, carried, *told, *gap_doubts(tlm, grid, silent, GAPS_BRIDGED)])
    feed = None if foreknown is None else Feed.of(foreknown, grid)
    return Record(grid, loop, bool(pushed), series, momentum.start, momentum.together, doubts, command, feed)


def _actuators(subject: Subject):
    """As ``actuators``; that the record says nothing of them is no fault of the record."""
    tlm = subject.telemetry
    if tlm.members("wheel_rate") or tlm.has_axes("wheel_momentum") or tlm.has_axes("control_torque"):
        return actuators(subject)
    with needed():
        found = actuators(subject)
    if not found[0] and not found[1]:
        raise CannotFuse(
            f"{subject.craft.craft.name} has no wheels, and no control torque is telemetered: nothing to fuse with the body rates",
            remedy="Use --method momentum.",
        )
    return found


def _loop(subject: Subject, axes, loop: str | None, *, pushed: bool) -> tuple[str, Doubt | None]:
    """Which of LOOPS to take, and the doubt where it could not be chosen freely."""
    why_not = _loop_unknown(subject, axes, pushed=pushed)
    if loop == "measured" or why_not is None:
        return loop or "modelled", None
    what, remedy = why_not
    if loop == "modelled":
        raise BadInput(what, file=subject.telemetry.source or None, remedy=f"{remedy}, or use --loop measured.")
    return "measured", LOOP_MEASURED(why=what, remedy=f"{remedy}.")


def _loop_unknown(subject: Subject, axes, *, pushed: bool) -> tuple[str, str] | None:
    """Why the closed loop cannot be modelled, and what to do about it."""
    tlm = subject.telemetry
    if pushed:
        return "only the actuators' torque is in the telemetry", "Add wheel rates or wheel momentum"
    if subject.relative:
        return "wheels of unknown spin inertia are in the telemetry", "Give spin_inertia in the craft file"
    if subject.craft.craft.wheel_controller is None:
        what = f"{subject.craft.craft.name} has no wheel controller described"
        return what, "Describe it under [wheel_controller] in the craft file"
    missing = _missing_errors(tlm, axes)
    if missing and not has_attitudes(subject):
        return f"{some_of(missing)} is not in the telemetry", "Add the channel"
    if subject.slewing and not (has_command(subject) and tlm.has_axes("body_rate")):
        what = "the craft slews, and the loop's commanded motion is not in the telemetry"
        return what, "Narrow the window to a hold with --start and --stop"
    if subject.firing:
        return "thrusters fire, and may hold the attitude in place of the wheels", "Narrow the window to a span without"
    return None


def _missing_errors(tlm: Telemetry, axes) -> list[str]:
    return [f"attitude_error_{AXES[j]}" for j in axes if f"attitude_error_{AXES[j]}" not in tlm]


def _check(grid: Grid, everything: list[Channel]) -> None:
    """Raises CannotFuse for a grid too long for one pass, and for channels that hold too little."""
    if grid.count > _LONGEST:
        raise CannotFuse(
            f"{grid.count:,} instants are too many for one fused pass",
            remedy=f"Take at most {_LONGEST:,} with --start and --stop, or use --method momentum.",
        )
    for c in everything:
        u = c.usable.values
        if len(u) < _LEAST or np.ptp(u) == 0:
            why = "never changes" if len(u) >= _LEAST else f"has {len(u)} usable samples, fewer than {_LEAST}"
            raise CannotFuse(
                f"this channel {why}: the fused method cannot fit its noise",
                channel=c.name,
                remedy="Take a longer window, or use --method momentum.",
            )


def _series(row: int, channel: Channel, grid: Grid) -> Series:
    u = channel.usable
    s = grid.of(u.tai_ns)
    inside = (s >= 0) & (s <= grid.seconds[-1] + 1e-6)
    return Series(row, s[inside], u.values[inside], u.count_size)


@dataclass(frozen=True)
class _Momentum:
    """Stored momentum (N, 3) in body axes at instants (N,) from the grid's start; its smallest steps (3,)."""

    seconds: np.ndarray
    values_Nms: np.ndarray
    quantum_Nms: np.ndarray
    together: bool = True

    @property
    def start(self) -> np.ndarray:
        return self.values_Nms[0].copy() if len(self.values_Nms) else np.zeros(3)

    def series(self) -> dict[int, Series]:
        """Of every axis, less the start; none where the actuators' momentum is not told."""
        if not len(self.seconds):
            return {}
        changed = self.values_Nms - self.start
        return {j: Series(MOMENTUM, self.seconds, changed[:, j], float(self.quantum_Nms[j])) for j in range(3)}


def _momentum(stored, grid: Grid, known: Stored | None) -> _Momentum:
    """At the sample times all actuators share, or at those of the first."""
    if not stored:
        return _Momentum(np.zeros(0), np.zeros((0, 3)), np.zeros(3))
    quantum = np.sqrt(sum((c.count_size * d) ** 2 for c, d in stored))  # of the sum: quanta add as variances do
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
        return _Momentum(grid.of(common), h, quantum)
    times = grid.of(lead.tai_ns)
    times = times[(times >= 0) & (times <= grid.seconds[-1])]
    if known is None:
        fine = Grid(grid.start_ns, 0.125, int(grid.seconds[-1] * 8) + 1)
        h = np.sum([np.outer(np.interp(times, fine.seconds, splined(c, fine)), d) for c, d in stored], axis=0)
    else:
        h = _carried(stored, grid, times, known)
    sound = np.isfinite(h).all(axis=1)
    return _Momentum(times[sound], h[sound], quantum, together=False)


def _carried(stored, grid: Grid, times: np.ndarray, known: Stored) -> np.ndarray:
    """Each wheel's nearest sample, moved by what the momentum known so far makes of the time between."""
    share = np.linalg.pinv(np.array([d for _, d in stored]).T)  # rate of each wheel per momentum
    h = np.zeros((len(times), 3))
    for (c, direction), row in zip(stored, share, strict=True):
        u = c.usable
        t = grid.of(u.tai_ns)
        right = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
        nearest = np.where(times - t[right - 1] < t[right] - times, right - 1, right)
        moved = (known(times) - known(t[nearest])) @ row
        moved[np.abs(t[nearest] - times) > 1.5 * u.cadence_ns / NS] = np.nan
        h += np.outer(u.values[nearest] + moved, direction)
    return h
