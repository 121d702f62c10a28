"""What may be wrong where momentum is not conserved: common mistakes in telemetry, tried one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.rigid_body import tensor_of
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.regression import memory
from ...kit.rotations import rotation
from ...kit.scatter import robust_sigma
from .misread import misread
from .motion import Layout, first_motion
from .plain import plain_fit

if TYPE_CHECKING:
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
    quaternion in the other direction, rates in another unit where no attitude shows it, and what ``misread`` tries of the wheels."""
    beta, left = plain_fit(record)
    limit = _TOO_MUCH**2 * _variance(record) * len(record.momentum.time_s)
    conserves = left <= limit
    if not conserves:
        mistake, mended, left = misread(record, slews, limit)
        if mended * _MENDED**2 < left:
            raise BadInput(
                f"momentum is not conserved, and would be {np.sqrt(left / max(mended, 1e-300)):.0f} times better if {mistake}",
                file=source,
                remedy="Correct the column names and units, the craft's wheel axes and spin inertia or the quaternion's direction, or leave "
                "the span out (--start, --stop).",
            )
    if slews and np.all(np.diag(tensor_of(beta[Layout.TENSOR])) < 0):
        raise BadInput(
            "the wheels turn with the body and not against it, as if its inertia were negative: momentum would be conserved if all of "
            "them turned the other way",
            file=source,
            remedy="Reverse the wheels' axes in the craft file, or the sense of their rates.",
        )
    if conserves:
        return record
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
