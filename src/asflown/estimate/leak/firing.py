"""What thrusters gave, by their counters: ordered on-times and pulses to impulses about the centre of mass.

On-times are sampled less often than rates.  Where a thruster fires between two readings, it is not known when: of the
instants in between only those nearest to a reading are used.  What a pulse has yet to give when its reading is taken (its
delay and its tail) is noise of that instant.

The room ``firing`` reads the same counters for a thrust, and otherwise: it guesses pulses that are not counted from the whole
record, interpolates counters of different instants, and refuses a record without the on-time of every thruster.  A monitor takes
a record as it grows, so that nothing said may change with what follows, and goes on with the counters there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import Valve, moment_matrix
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ..firing import check_clock, control_step_s

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

NO_ON_TIMES = Kind(
    "leak.no-on-times", Severity.CAUTION, "no on-times are in the telemetry: thrusters are assumed not to fire",
    "Add on_time_<THRUSTER> of every thruster, cumulative in seconds.",
)  # fmt: skip
ON_TIMES_MISSING = Kind(
    "leak.on-times-missing", Severity.CAUTION, "there is no on-time of {thrusters}: they are assumed not to fire",
    "Add on_time_<THRUSTER> of every thruster, cumulative in seconds.",
)  # fmt: skip
COUNTERS_JUMP = Kind(
    "leak.counters-jump", Severity.CAUTION,
    "on-times or pulse counts fall or jump {jumps} times, first at {first}: the momentum gained in those steps is not used",
    "Declare the wrap in a channel dictionary, or divide the record at the reset.",
)  # fmt: skip
PULSES_NOT_COUNTED = Kind(
    "leak.pulses-not-counted", Severity.NOTE,
    "pulses are not counted for every thruster: the number expected for that on-time is used, with cycles on at random",
    "Add pulse_count_<THRUSTER> of every thruster.",
)  # fmt: skip


@dataclass(frozen=True)
class Geometry:
    """Thrusters about a centre of mass: ``columns`` (3, j), torque per newton [m]; ``directions`` (3, j) of the force."""

    names: tuple[str, ...]
    columns: np.ndarray
    directions: np.ndarray
    delay_s: np.ndarray
    rise_s: np.ndarray
    fall_s: np.ndarray
    shortest_s: float


def geometry_of(craft: Craft) -> Geometry:
    """Raises BadInput for a craft without thrusters, or whose centre of mass is neither known nor assumed."""
    if not craft.thrusters:
        raise BadInput(
            f"{craft.name} has no thrusters", remedy="Describe them under [[thrusters]] in the craft's file."
        )
    if craft.stated_center is None:
        raise BadInput(
            f"{craft.name}'s centre of mass is not known, and thrusters turn it about that",
            remedy='Give it: --cm "x,y,z" in m, in the axes of the thrusters\' positions.',
        )
    along = np.array([t.direction for t in craft.thrusters], float)
    return Geometry(
        names=tuple(t.name for t in craft.thrusters),
        columns=moment_matrix([t.position for t in craft.thrusters], along, craft.stated_center),
        directions=along.T,
        delay_s=np.array([t.delay for t in craft.thrusters]),
        rise_s=np.array([t.rise for t in craft.thrusters]),
        fall_s=np.array([t.fall for t in craft.thrusters]),
        shortest_s=control_step_s(craft),
    )


def pulse_impulse(on_time_s, pulses, delay_s, rise_s, fall_s) -> np.ndarray:
    """Impulse over thrust of n pulses of T seconds in all, each of T/n (dynamics.pulses); of none, the on-time. [s]"""
    n, total = np.asarray(pulses, float), np.asarray(on_time_s, float)
    each = total / np.where(n > 0, n, 1.0)
    valve = Valve(delay_s, np.where(np.asarray(rise_s) > 0, rise_s, 1e-12), fall_s)
    return np.where(n > 0, n * valve.effective(each), total)


@dataclass(frozen=True)
class Firing:
    """Readings of the counters at K instants: on-time [s], its impulse [N s] and pulses since the first, (K, j); breaks so far, (K,)."""

    tai_ns: np.ndarray
    on: np.ndarray
    impulse: np.ndarray
    pulses: np.ndarray
    breaks: np.ndarray
    counted: np.ndarray  # (j,), by a pulse counter; else their number is a guess
    doubts: Doubts = Doubts()

    def at(self, tai_ns, geometry: Geometry, thrust_N: float):
        """Which instants count (M of N, indices), and there: impulse, pulses, variance of momentum (M, 3, 3) and breaks."""
        j = len(geometry.names)
        if len(self.tai_ns) < 2:
            n = len(tai_ns)
            return np.arange(n), np.zeros((n, j)), np.zeros((n, j)), np.zeros((n, 3, 3)), np.zeros(n)
        inside = np.flatnonzero((tai_ns >= self.tai_ns[0]) & (tai_ns <= self.tai_ns[-1]))
        start = self.tai_ns[0]
        t, at = (tai_ns[inside] - start) / NS, (self.tai_ns - start) / NS
        k = np.clip(np.searchsorted(at, t, side="right") - 1, 0, len(at) - 2)
        share = (t - at[k]) / np.diff(at)[k]
        gave, count = np.diff(self.impulse, axis=0), np.diff(self.pulses, axis=0)
        busy = (count > 0).any(axis=1) | (gave > 0).any(axis=1) | (np.diff(self.breaks) > 0)
        nearest = np.clip(np.searchsorted(t, at), 1, max(len(t) - 1, 1))
        nearest -= (at - t[nearest - 1] <= t[np.minimum(nearest, len(t) - 1)] - at).astype(int)
        keep = ~busy[k]
        keep[nearest] = True
        keep |= (share < 1e-9) | (share > 1 - 1e-9)
        k, share = k[keep], share[keep][:, None]
        given = self.impulse[k] + share * gave[k]
        pulses = self.pulses[k] + share * count[k]
        breaks = self.breaks[k] + (share[:, 0] > 1e-9) * np.diff(self.breaks)[k]
        # a reading may find a thruster on, or in the last 3 fall times of a pulse: its delay and its tail are owed then
        tail = thrust_N * (geometry.delay_s + geometry.fall_s)
        before = np.where(share < 1e-9, np.maximum(k - 1, 0)[:, None], k[:, None])[:, 0]
        owing = np.minimum((np.diff(self.on, axis=0) + 3 * geometry.fall_s * count) / np.diff(at)[:, None], 1.0)
        soon = np.maximum(owing[k], owing[before])
        variance = share * (1 - share) * gave[k] ** 2 + soon * tail**2
        c = geometry.columns
        return inside[keep], given, pulses, np.einsum("ij,nj,kj->nik", c, variance, c), breaks


def firing_of(tlm: Telemetry, geometry: Geometry, thrust_N: float) -> Firing:
    """Counters of every thruster, as impulses of a steady thrust.

    Raises BadInput for on-times never known together, or faster than the clock."""
    timed = [n for n in geometry.names if f"on_time_{n}" in tlm]
    j, doubts = len(geometry.names), []
    if not timed:
        nothing = np.zeros((0, j))
        return Firing(
            np.zeros(0, np.int64), nothing, nothing, nothing, np.zeros(0), np.ones(j, bool), Doubts([NO_ON_TIMES()])
        )
    if missing := [n for n in geometry.names if n not in timed]:
        doubts.append(ON_TIMES_MISSING(thrusters=missing))
    tai_ns, on, counts, counted = _readings(tlm, geometry, timed)
    used, interval = np.diff(on, axis=0), np.diff(tai_ns)[:, None] / NS
    fast, too_fast = check_clock(used, tai_ns, geometry.shortest_s, geometry.names, tlm)
    doubts += too_fast
    # pulses where they are not counted: runs of cycles on, cycles being on by chance as often as the on-time says
    pulses = np.maximum(used / geometry.shortest_s * (1 - used / interval), 0.0)
    pulses[:, counted] = np.diff(counts[:, counted], axis=0)
    broken = (used < 0).any(axis=1) | fast | (pulses < 0).any(axis=1)
    if broken.any():
        first = tlm.describe_time(int(tai_ns[1:][broken][0]))
        doubts.append(COUNTERS_JUMP(jumps=int(broken.sum()), first=first))
    if (used > 0).any() and counted.sum() < len(timed):
        doubts.append(PULSES_NOT_COUNTED())
    used[broken], pulses[broken] = 0.0, 0.0
    impulse = thrust_N * pulse_impulse(used, pulses, geometry.delay_s, geometry.rise_s, geometry.fall_s)
    on, given, begun, breaks = (_so_far(v) for v in (used, impulse, pulses, broken.astype(float)))
    return Firing(tai_ns, on, given, begun, breaks, counted, Doubts(doubts))


def _readings(tlm: Telemetry, geometry: Geometry, timed: list[str]):
    """Instants (K,) at which all counters are known, on-times and pulse counts there (K, j), and which thrusters' pulses are
    counted (j,).  Pulse counts known at fewer than half of the on-times' instants are not used."""
    on_names, counted = [f"on_time_{n}" for n in timed], [n for n in timed if f"pulse_count_{n}" in tlm]
    tai_ns, values = together(tlm, [*on_names, *(f"pulse_count_{n}" for n in counted)])
    only, on_only = together(tlm, on_names)
    if len(tai_ns) < 0.5 * len(only):
        tai_ns, values, counted = only, on_only, []
    if len(tai_ns) < 2:
        raise BadInput(
            "the thrusters' on-times are never known at the same instant",
            channel=on_names[0],
            remedy="Sample them at the same instants, or take a longer record.",
        )
    on, counts = np.zeros((2, len(tai_ns), len(geometry.names)))
    on[:, np.isin(geometry.names, timed)] = values[:, : len(timed)]
    counts[:, np.isin(geometry.names, counted)] = values[:, len(timed) :]
    return tai_ns, on, counts, np.isin(geometry.names, counted)


def _so_far(steps) -> np.ndarray:
    """Sums from the first reading on, which is zero; one row more than ``steps``."""
    return np.concatenate([np.zeros((1, *steps.shape[1:])), np.cumsum(steps, axis=0)])
