"""The motion that several channels see: body rates by gyro, by attitude error and by quaternion, and what the wheels gain.

All are smoothed by the same local cubics, each at its own sample times, and then differentiated on one grid, so that what is lost
is lost alike and the channels can be set against each other sample by sample.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ...kit.regression import local_polynomial
from ...kit.rotations import rates_between
from ...kit.timeline import NS, runs
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ...telemetry.telemetry import Channel
from ..subject import Grid, grid_for

if TYPE_CHECKING:
    from ..subject import Subject

#: Half-widths of the local cubics: narrow enough for a loop of some hundredths of a hertz, and wider ones for sensors whose noise
#: hides all but slow motion.  A channel too coarse for one widens it to so many of its samples. [s]
HALF_WIDTHS_S, _SAMPLES = (12.0, 40.0, 80.0), 3.5
#: Motion slower than this is left out: biases of gyros, drag of wheels, the commanded turn of an orbit. [s], and half-widths
_SLOW_S, _SLOW_WIDTHS = 300.0, 12.0
#: A record is looked at in blocks, of at most so many such periods and at least so many half-widths; of a long one so many blocks.
_BLOCK, _SHORTEST, _MOST_BLOCKS = 6.0, 6.0, 6

#: Where a body rate comes from.
GYRO, ERROR, QUATERNION = "body_rate", "attitude_error", "quaternion"
NAMES = {GYRO: "body rates", ERROR: "attitude error", QUATERNION: "quaternion"}


@dataclass(frozen=True)
class Motion:
    """What channels say of one motion, in blocks of evenly spaced instants without a gap.

    ``rates``, ``angles``: source -> (N, 3) [rad/s], [rad], NaN about an axis that it lacks; ``stored``: momentum of each wheel
    (N, n, 3) [N m s], None without; ``blocks``: slices of the N instants; ``cadence_s``: the coarsest channel's."""

    grid: Grid
    blocks: tuple[slice, ...]
    rates: dict[str, np.ndarray]
    angles: dict[str, np.ndarray]
    stored: np.ndarray | None
    wheels: tuple[str, ...]
    slow_s: float
    cadence_s: float

    def quick(self, values: np.ndarray, slow_s: float | None = None) -> np.ndarray:
        """Values (N, ...) without their slow part, block by block, the blocks one after the other.

        ``slow_s``: in place of the motion's own; infinite: a line is taken off."""
        slow = self.slow_s if slow_s is None else slow_s
        return np.concatenate([_without_slow(values[b], self.grid.step_s, slow) for b in self.blocks])

    def gained(self) -> np.ndarray:
        """Rate of each wheel's momentum (N, n, 3). [N m]"""
        assert self.stored is not None
        return _slope(self.stored, self.blocks, self.grid.step_s)


def motion_of(subject: Subject, half_width_s: float = HALF_WIDTHS_S[0]) -> Motion | None:
    """None where fewer than two sources share enough of the record."""
    sources = _sources(subject)
    stored = _stored(subject)
    if len(sources) + bool(stored) < 2:
        return None
    angular = [c for s in sources.values() for c in s.values()]
    channels = [*angular, *(c for c, _ in stored)]
    try:
        grid = grid_for(channels)
        coarsest = max(c.usable.cadence_ns for c in channels) / NS
        width = max(half_width_s, _SAMPLES * coarsest)
    except BadInput:
        return None  # too short, or never at the same time
    known = np.logical_and.reduce([_covered(c.usable, grid, width) for c in channels])
    slow = max(_SLOW_S, _SLOW_WIDTHS * width)
    blocks = _blocks(known, round(_SHORTEST * width / grid.step_s), round(_BLOCK * slow / grid.step_s))
    if not blocks:
        return None
    smooth = {id(c): _smoothed(c.usable, grid, width, blocks) for c in channels}
    rates, angles = {}, {}
    for name, axes in sources.items():
        seen = np.column_stack([smooth[id(axes[j])] if j in axes else np.full(grid.count, np.nan) for j in range(3)])
        if name == GYRO:
            rates[name], angles[name] = seen, _total(seen, blocks, grid.step_s)
        else:
            rates[name], angles[name] = _slope(seen, blocks, grid.step_s), seen
    held = np.stack([np.outer(smooth[id(c)], d) for c, d in stored], axis=1) if stored else None
    names = tuple(c.member for c, _ in stored)
    return Motion(grid, tuple(blocks), rates, angles, held, names, slow, coarsest)


def _sources(subject: Subject) -> dict[str, dict[int, Channel]]:
    """Source -> axis -> channel: of rates, and of angles that grow with them."""
    tlm = subject.telemetry
    found: dict[str, dict[int, Channel]] = {}
    for stem in (GYRO, ERROR):
        axes = {j: tlm.channels[f"{stem}_{a}"] for j, a in enumerate(AXES) if f"{stem}_{a}" in tlm}
        # commanded minus estimated: the error falls as the body turns
        found[stem] = axes if stem == GYRO else {j: _derived(c.usable, -c.usable.values) for j, c in axes.items()}
    names = [f"quaternion_{m}" for m in "wxyz"]
    if all(n in tlm for n in names):
        tai_ns, q = together(tlm, names)
        if len(tai_ns) > 8:
            _, rate = rates_between((tai_ns - tai_ns[0]) / NS, q)
            angle = np.vstack([np.zeros(3), np.cumsum(rate * np.diff(tai_ns)[:, None] / NS, axis=0)])
            like = Channel("attitude_error_x", tai_ns, angle[:, 0], np.ones(len(tai_ns), bool))
            found[QUATERNION] = {j: _derived(like, angle[:, j]) for j in range(3)}
    return {n: a for n, a in found.items() if a}


def _covered(c: Channel, grid: Grid, half_width_s: float) -> np.ndarray:
    """Whether an instant of the grid lies in a stretch of the channel that is long enough."""
    t, at, out = grid.of(c.tai_ns), grid.seconds, np.zeros(grid.count, bool)
    for s in c.segments():
        if t[s][-1] - t[s][0] >= 2 * half_width_s:
            out |= (at >= t[s][0] - 1e-9) & (at <= t[s][-1] + 1e-9)
    return out


def _smoothed(c: Channel, grid: Grid, half_width_s: float, blocks) -> np.ndarray:
    """Values on the grid, NaN outside the blocks."""
    t, out = grid.of(c.tai_ns), np.full(grid.count, np.nan)
    for b in blocks:
        at = grid.step_s * np.arange(b.start, b.stop)
        # a block lies in one stretch: beyond its reach no sample counts
        s = slice(*np.searchsorted(t, [at[0] - 3 * half_width_s, at[-1] + 3 * half_width_s]))
        out[b] = local_polynomial(t[s], c.values[s], at, degree=3, half_width=half_width_s).value
    return out


def _derived(c: Channel, values: np.ndarray) -> Channel:
    return Channel(c.name, c.tai_ns, values, c.valid, count_size=c.count_size)


def _stored(subject: Subject) -> list[tuple[Channel, np.ndarray]]:
    """Wheel, momentum per unit; none where a wheel lacks its channel or its spin inertia."""
    tlm = subject.telemetry
    if tlm.members("wheel_rate") and not subject.relative:
        wheels = [w for w in subject.craft.wheels if f"wheel_rate_{w.name}" in tlm]
        if len(wheels) < len(subject.craft.wheels):
            return []
        return [(tlm.channels[f"wheel_rate_{w.name}"], w.spin_inertia * np.asarray(w.axis)) for w in wheels]
    if tlm.has_axes("wheel_momentum") and not tlm.members("wheel_rate"):
        return [(tlm.channels[f"wheel_momentum_{a}"], np.eye(3)[j]) for j, a in enumerate(AXES)]
    return []


def _blocks(known: np.ndarray, shortest: int, longest: int) -> list[slice]:
    """Stretches where all is known, cut evenly; of many, some spread over the record."""
    found = []
    for s in runs(known):
        n = s.stop - s.start
        if n >= shortest:
            cuts = np.linspace(s.start, s.stop, -(-n // longest) + 1).astype(int)
            found += [slice(int(a), int(b)) for a, b in itertools.pairwise(cuts)]
    if len(found) > _MOST_BLOCKS:
        found = [found[k] for k in np.linspace(0, len(found) - 1, _MOST_BLOCKS).astype(int)]
    return found


def _slope(values: np.ndarray, blocks, step_s: float) -> np.ndarray:
    out = np.full_like(values, np.nan)
    for b in blocks:
        out[b] = np.gradient(values[b], step_s, axis=0)
    return out


def _total(rate: np.ndarray, blocks, step_s: float) -> np.ndarray:
    out = np.full_like(rate, np.nan)
    for b in blocks:
        out[b] = np.cumsum(rate[b] - rate[b].mean(axis=0), axis=0) * step_s
    return out


def _without_slow(values: np.ndarray, step_s: float, slow_s: float) -> np.ndarray:
    """Less the best sum of a line and of half-cosines slower than ``slow_s``."""
    n = len(values)
    x = (np.arange(n) + 0.5) / n
    count = int(2 * n * step_s / slow_s)
    basis = np.column_stack([np.ones(n), x - 0.5, *(np.cos(np.pi * k * x) for k in range(1, count + 1))])
    q, _ = np.linalg.qr(basis)
    flat = values.reshape(n, -1)
    return (flat - q @ (q.T @ flat)).reshape(values.shape)
