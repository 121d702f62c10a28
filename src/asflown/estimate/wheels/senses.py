"""Whether each wheel turns the way the craft file has it: the momentum of wheels against that of the body, where the body moves.

    d(I w)/dt + w x (I w) + sum of s J (a drho/dt + rho w x a) = torque,    s = 1, or -1 for a wheel that is reversed

The torque is taken as straight in time.  A body that is held says nothing: an exchange among wheels, or a torque that they take
up, can look alike for several choices of s."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ...kit.timeline import NS
from ...telemetry.channels import AXES
from .doubts import REVERSED

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .record import RecordedWheels

#: Blocks in which rates are averaged, at most, and samples of the coarsest channel in each at least; fewest blocks that tell.
_BLOCKS, _SAMPLES, _FEWEST = 300, 3, 30
#: Instants in a block at which channels are read.
_INSTANTS = 12
#: Wheels that are tried in all combinations.
_MOST = 8
#: Share of the body's own change that the best choice may leave (variances), how much more the file's must leave, and any other.
_LEFT, _WORSE, _APART = 0.05, 10.0, 2.0


def reversed_wheels(record: RecordedWheels) -> list[Doubt]:
    """A doubt where the body's motion fits wheels of which some are reversed, and not the wheels as described."""
    I_B, wheels, tlm = record.now.inertia_kgm2, record.now.wheels, record.telemetry
    names = [w.name for w in wheels]
    if (
        I_B is None
        or not names
        or len(names) > _MOST
        or not tlm.has_axes("body_rate")
        or not set(names) <= set(record.finders)
    ):
        return []
    channels = [f"body_rate_{a}" for a in AXES] + [f"wheel_rate_{n}" for n in names]
    means, length = _in_blocks(record, channels)
    if means is None:
        return []
    omega, rate = means[:, :3], means[:, 3:]
    parts = [_balance(omega, omega @ I_B, length)]
    parts += [
        _balance(omega, np.outer(rate[:, k], (w.spin_inertia or 1.0) * np.array(w.axis)), length)
        for k, w in enumerate(wheels)
    ]
    body, of_wheels = parts[0], np.array(parts[1:])
    if len(body) < _FEWEST:
        return []
    left = {s: float(np.sum((body + np.tensordot(s, of_wheels, 1)) ** 2)) for s in product((1, -1), repeat=len(names))}
    best, as_described = min(left, key=left.__getitem__), left[(1,) * len(names)]
    second = min(v for s, v in left.items() if s != best)
    if (
        left[best] > _LEFT * float(np.sum(body**2))
        or as_described < _WORSE * left[best]
        or second < _APART * left[best]
    ):
        return []
    turned = [n for n, s in zip(names, best, strict=True) if s < 0]
    return [REVERSED(wheels=turned, ratio=float(np.sqrt(as_described / max(left[best], 1e-300))))]


def _in_blocks(record: RecordedWheels, names: list[str]) -> tuple[np.ndarray | None, float]:
    """Means of channels in equal blocks (B, columns), NaN where one has no sample, and the blocks' length [s]."""
    tlm = record.telemetry
    used = [tlm.channel(n).usable for n in names]
    if any(len(c.tai_ns) < _FEWEST for c in used):
        return None, 0.0
    times = [tlm.seconds(c.tai_ns) for c in used]
    start, stop = max(t[0] for t in times), min(t[-1] for t in times)
    length = max((stop - start) / _BLOCKS, _SAMPLES * max(c.cadence_ns for c in used) / NS)
    count = int((stop - start) / length)
    if count < _FEWEST:
        return None, 0.0
    # all at the same instants: means over samples of different cadence would be of different times
    at = start + length * (np.arange(_INSTANTS * count) + 0.5) / _INSTANTS
    means = np.column_stack([
        np.interp(at, t, c.values).reshape(count, _INSTANTS).mean(axis=1) for t, c in zip(times, used, strict=True)
    ])  # fmt: skip
    for k, t in enumerate(times):
        seen = np.bincount(np.clip(((t - start) / length).astype(int), 0, count - 1), minlength=count)
        means[seen == 0, k] = np.nan
    return means, length


def _balance(omega: np.ndarray, momentum: np.ndarray, length: float) -> np.ndarray:
    """What a momentum in body axes changes by in space from block to block (M, 3), less what is straight in time."""
    turning = np.cross(omega, momentum)
    change = np.diff(momentum, axis=0) + 0.5 * length * (turning[1:] + turning[:-1])
    good = np.isfinite(omega).all(axis=1)
    good = good[1:] & good[:-1] & np.isfinite(change).all(axis=1)
    change = change[good]
    if len(change) < _FEWEST:
        return change[:0]
    line = np.column_stack([np.ones(good.sum()), np.flatnonzero(good)])
    return change - line @ np.linalg.lstsq(line, change, rcond=None)[0]
