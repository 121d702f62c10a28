"""What may be wrong where momentum is not conserved: common mistakes in telemetry, tried one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.rigid_body import tensor_of
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.regression import memory
from ...kit.rotations import rotation
from ...kit.scatter import robust_sigma
from ...telemetry.attitude import MISTAKEN_UNITS
from .motion import Layout, first_motion
from .plain import left_of_slow, plain_fit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .record import SlewRecord
    from .slews import Slew

#: Momentum left over, as a share of what the wheels' varies by, from which mistakes are looked for.
_TOO_MUCH = 0.02
#: A step of momentum is plain where it takes this much off the squared residuals, in their own variance.  More than is asked of
#: one in the whole motion's own covariance (consistent._STEP_KEPT): here motion is rough, and the variance that of quick residuals.
_STEP_SEEN = 60.0
MOST_STEPS = 5
#: A mistake is named where mending it takes away this much of what is left over (rms).
_MENDED = 5.0

WANDERS = Kind(
    "inertia.momentum-wanders", Severity.SUSPECT,
    "momentum is not conserved to {percent:.0f} % of the variation of the wheels': external torques vary. Method consistent models "
    "the total momentum as a random walk, so that only quick exchanges between wheels and body inform the tensor",
    "Check wheel axes, spin inertia and units where external torques are known to be small.",
)  # fmt: skip


def conserved(record: SlewRecord, slews: list[Slew], source: str | None) -> SlewRecord:
    """The record with its arcs parted where the momentum plainly steps; it wanders where it is not conserved even then.  In orbit a
    slow torque is tried first: there is always one.

    Raises BadInput, naming the likeliest mistake, where another reading of the data conserves it far better.  Tried: the
    quaternion in the other direction, rates in another unit where no attitude shows it, one wheel turning the other
    way, two wheels mistaken for each other, in all of the record or after one of its slews."""
    beta, left = plain_fit(record)
    if slews and np.all(np.diag(tensor_of(beta[Layout.TENSOR])) < 0):
        raise BadInput(
            "the wheels turn with the body and not against it, as if its inertia were negative: momentum would be conserved if all of "
            "them turned the other way",
            file=source,
            remedy="Reverse the wheels' axes in the craft file, or the sense of their rates.",
        )
    limit = _TOO_MUCH**2 * _variance(record) * len(record.momentum.time_s)
    if left <= limit:
        return record
    # in orbit outside torques are at work beside the mistake, and would hide how much mending it helps
    left_of = left_of_slow if record.orbit is not None else lambda r: plain_fit(r)[1]
    left = left_of(record)
    tried = {what: left_of(other) for what, other in _others(record, slews)}
    best = min(tried, key=lambda w: tried[w], default=None)
    if best is not None and tried[best] * _MENDED**2 < left:
        raise BadInput(
            f"momentum is not conserved, and would be {np.sqrt(left / max(tried[best], 1e-300)):.0f} times better if {best}",
            file=source,
            remedy="Correct the column names and units, the craft's wheel axes or the quaternion's direction, or leave the span out "
            "(--start, --stop).",
        )
    if record.orbit is not None and left <= limit:
        return replace(record, slow=True)
    parted = record
    for _ in range(MOST_STEPS):
        at = _step_of_momentum(*_residual(parted))
        if at is None:
            break
        parted = parted.split_at(at)
        if plain_fit(parted)[1] <= limit:
            return parted
    return replace(record, wanders=True, doubts=Doubts([*record.doubts, WANDERS(percent=100 * _TOO_MUCH)]))


def _variance(record: SlewRecord) -> float:
    """Of one component of the wheels' momentum."""
    m = record.momentum
    return float(np.mean([np.var(m.value_Nms[(m.direction == d).all(axis=1)]) for d in np.unique(m.direction, axis=0)]))


def _residual(record: SlewRecord):
    """What plain least squares leaves over: time (N,), momentum (N, 3), inertial axes, and arc (N,)."""
    layout, m = Layout.of(record), record.momentum
    beta, _ = plain_fit(record)
    times, held, index = m.vectors(m.value_Nms)
    motion = first_motion(record, times)
    r = rotation(motion.q_NB)
    arc = np.zeros(len(times), int)
    arc[index] = m.arc
    total = r.apply(held - record.tensor_columns(times, r.as_matrix(), motion.omega_B) @ beta[layout.TENSOR])
    return times, total - layout.momenta(beta)[arc], arc


def _step_of_momentum(time_s: np.ndarray, residual_N: np.ndarray, arc: np.ndarray) -> float | None:
    """Where one step would take most off a residual momentum (N, 3), inertial axes, if it is plain. [s]"""
    quick = residual_N - scipy.ndimage.median_filter(
        residual_N, size=(31, 1), mode="nearest"
    )  # without the step itself
    noise = np.sqrt(max(memory(column) for column in quick.T))  # neighbours that err alike are worth less
    noise *= robust_sigma(quick)
    best, at = _STEP_SEEN, None
    for k in np.unique(arc):
        here = np.flatnonzero(arc == k)
        n = len(here)
        if n < 20:
            continue
        total = np.cumsum(residual_N[here], axis=0)[9:-10]
        before = np.arange(10, n - 9)[:, None]
        mean = residual_N[here].mean(axis=0)
        gain = np.sum((total - before * mean) ** 2 / (before * (n - before) / n), axis=1) / max(noise, 1e-150) ** 2
        if gain.max() > best:
            j = int(np.argmax(gain)) + 10
            best, at = float(gain.max()), float(0.5 * (time_s[here[j - 1]] + time_s[here[j]]))
    return at


def _others(record: SlewRecord, slews: list[Slew]) -> Iterator[tuple[str, SlewRecord]]:
    if record.has_attitude:
        turned = record.attitude.q_NB * np.array([1.0, -1.0, -1.0, -1.0])
        yield "the quaternion were its conjugate", replace(record, attitude=replace(record.attitude, q_NB=turned))
    else:
        for factor, unit in MISTAKEN_UNITS.items():
            rates = replace(record.rates, value_rad_s=record.rates.value_rad_s / factor)
            yield f"the body rates were {unit}", replace(record, rates=rates)
    n = len(record.axes)
    if record.spins is None and (n != 3 or abs(np.linalg.det(record.axes)) < 1e-9 * np.abs(record.axes).max() ** 3):
        return
    times = [None, *[0.5 * (a.stop_s + b.start_s) for a, b in pairwise(slews)]]
    for after in times:
        when = "" if after is None else f" from {after:.0f} s of the record on"
        for k, name in enumerate(record.wheels):
            flipped = record.axes.copy()
            flipped[k] *= -1
            yield f"wheel {name} turned the other way{when}", _read_as(record, flipped, after)
        for i, j in combinations(range(n), 2):
            swapped = record.axes.copy()
            swapped[[i, j]] = swapped[[j, i]]
            what = f"wheels {record.wheels[i]} and {record.wheels[j]} were mistaken for each other{when}"
            yield what, _read_as(record, swapped, after)


def _read_as(record: SlewRecord, axes: np.ndarray, after: float | None) -> SlewRecord:
    """The same readings, the wheels' momentum along other axes (n, 3)."""
    m = record.momentum
    _, h, index = m.vectors(m.value_Nms)
    if record.spins is None:
        change = h @ np.linalg.inv(record.axes) @ axes - h
        other = np.sum(m.direction * change[index], axis=1)
    else:
        at, readings = record.spins
        change = readings @ (axes - record.axes)
        other = np.sum(m.direction * change[np.searchsorted(at, m.time_s)], axis=1)
    late = np.ones(len(index), bool) if after is None else m.time_s > after
    value = m.value_Nms + np.where(late, other, 0.0)
    return replace(record, momentum=replace(m, value_Nms=value))
