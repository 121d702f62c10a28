"""What thrusters gave, by their counters: ordered on-times and pulses to impulses about the centre of mass.

On-times come more seldom than rates.  Where a thruster fires between two readings, when it fired is not known: of the
instants in between only those nearest to a reading count.  What a pulse still owes when its reading is taken (its delay
and its tail) is noise of that instant.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import Valve, moment_matrix
from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS
from ...telemetry.attitude import together

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

#: Shortest pulse where the craft's control period is not known. [s]
_SHORTEST_PULSE = 0.125


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
    period = craft.wheel_controller.period if craft.wheel_controller else _SHORTEST_PULSE
    return Geometry(
        names=tuple(t.name for t in craft.thrusters),
        columns=moment_matrix([t.position for t in craft.thrusters], along, craft.stated_center),
        directions=along.T,
        delay_s=np.array([t.delay for t in craft.thrusters]),
        rise_s=np.array([t.rise for t in craft.thrusters]),
        fall_s=np.array([t.fall for t in craft.thrusters]),
        shortest_s=period,
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
    doubts: tuple[str, ...] = ()

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
    named = [*tlm.members("on_time"), *tlm.members("pulse_count")]
    if unknown := [n for n in dict.fromkeys(named) if n not in geometry.names]:
        raise BadInput(
            f"the craft has no thruster {unknown[0]!r}",
            file=tlm.source or None,
            channel=next(c.name for c in tlm.channels.values() if c.member == unknown[0]),
            remedy=f"Its thrusters: {some_of(geometry.names)}. Rename the column, or name the right --craft.",
        )
    timed = [n for n in geometry.names if f"on_time_{n}" in tlm]
    j, none = len(geometry.names), np.zeros(0, np.int64)
    nothing = np.zeros((0, j))
    if not timed:
        doubt = "no on-times are in the telemetry: thrusters are taken not to fire"
        return Firing(none, nothing, nothing, nothing, np.zeros(0), np.ones(j, bool), (doubt,))
    doubts = []
    if len(timed) < j:
        missing = [n for n in geometry.names if n not in timed]
        doubts.append(f"no on-time of {some_of(missing)}: taken not to fire")
    on_names, counted = [f"on_time_{n}" for n in timed], [n for n in timed if f"pulse_count_{n}" in tlm]
    tai_ns, values = together(tlm, [*on_names, *(f"pulse_count_{n}" for n in counted)])
    only, on_only = together(tlm, on_names)
    if len(tai_ns) < 0.5 * len(only):
        tai_ns, values, counted = only, on_only, []
    if len(tai_ns) < 2:
        raise BadInput(
            "the thrusters' on-times are never known together",
            channel=on_names[0],
            remedy="Sample them at the same instants, or take a longer record.",
        )
    on, where = np.zeros((len(tai_ns), j)), [geometry.names.index(n) for n in timed]
    on[:, where] = values[:, : len(timed)]
    used = np.diff(on, axis=0)
    interval = np.diff(tai_ns)[:, None] / NS
    # pulses where they are not counted: runs of cycles on, cycles being on by chance as often as the on-time says
    pulses = np.maximum(used / geometry.shortest_s * (1 - used / interval), 0.0)
    in_count = np.isin(geometry.names, counted)
    if counted:
        pulses[:, in_count] = np.diff(values[:, len(timed) :], axis=0)
    broken = (
        (used < 0).any(axis=1) | (used > 1.05 * interval + geometry.shortest_s).any(axis=1) | (pulses < 0).any(axis=1)
    )
    if broken.any():
        doubts.append(
            f"on-times or pulse counts fall or jump {int(broken.sum())} times, first at "
            f"{tlm.describe_time(int(tai_ns[1:][broken][0]))}: momentum is taken up anew there"
        )
    if (used > 0).any() and len(counted) < len(timed):
        doubts.append("pulses are not counted for every thruster: their number is what such an on-time lets expect")
    used[broken], pulses[broken] = 0.0, 0.0
    impulse = thrust_N * pulse_impulse(used, pulses, geometry.delay_s, geometry.rise_s, geometry.fall_s)

    def so_far(steps):
        return np.concatenate([np.zeros((1, *steps.shape[1:])), np.cumsum(steps, axis=0)])

    return Firing(
        tai_ns, so_far(used), so_far(impulse), so_far(pulses), so_far(broken.astype(float)), in_count, tuple(doubts)
    )
