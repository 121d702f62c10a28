"""Body rates in a wrong unit where nothing but the wheels tells: the loop that would hold the craft then is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Kind, Severity
from ...telemetry.attitude import MISTAKEN_UNITS
from .motion import GYRO

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from ..subject import Subject
    from .motion import Motion

#: Damping that no loop has which holds a craft, and what a loop's is with the rates in their unit; share of the wheels' torque that
#: the loop must explain.
_NO_LOOP, _LOOP, _EXPLAINED = (0.2, 6.0), (0.35, 1.6), 0.9

#: Share of the wheels' torque that momentum leaves where the body's turn explains some of it, and how much more it leaves in a wrong unit.
_CONSERVED, _FAR_WORSE = 0.6, 100.0

OTHER_UNIT = Kind(
    "redundancy.rates-unit", Severity.SUSPECT,
    "the wheels' momentum does not turn with the body at the rate of the gyros: it would fit {times:.0f} times better (rms) if the body "
    "rates were {cause}",
    "Check the unit of the body rates.",
)  # fmt: skip
NO_LOOP = Kind(
    "redundancy.no-loop", Severity.SUSPECT,
    "about {axis} the wheels answer the body rates as a loop of damping {damping:.2g} would: no loop that holds a craft; in another "
    "unit of the rates it would be {better:.2g}: {cause}?",
    "Check the unit of the body rates, the wheels' spin inertia and the craft's inertia.",
)  # fmt: skip


def rates_unit(motion: Motion, wrong: set[str]) -> list[Doubt]:
    """Of a craft that turns steadily: its wheels' momentum turns with it, h' = -w x h, at another rate than the gyros say."""
    if GYRO not in motion.rates or GYRO in wrong or motion.stored is None:
        return []
    held = motion.stored.sum(axis=1)
    turn = np.concatenate([np.cross(motion.rates[GYRO][b].mean(axis=0), held[b]) for b in motion.blocks])
    given = np.concatenate([motion.gained()[b].sum(axis=1) for b in motion.blocks])
    size, before = float(np.sum(given**2)), float(np.sum((given + turn) ** 2))
    for factor, unit in MISTAKEN_UNITS.items():
        left = float(np.sum((given + turn / factor) ** 2))
        if left < _CONSERVED * size and before > _FAR_WORSE * left:
            return [OTHER_UNIT(times=float(np.sqrt(before / left)), cause=unit)]
    return []


def fitted_gains(rate: np.ndarray, angle: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, float]:
    """Gains of rate and angle, neither negative, of the loop that explains a torque about one axis best; the norm of what it leaves."""
    both = np.column_stack([rate, angle])
    size = np.maximum(np.linalg.norm(both, axis=0), 1e-300)
    gains, left = scipy.optimize.nnls(both / size, given)
    return gains / size, float(left)


def rates_too_large(subject: Subject, motion: Motion) -> list[Doubt]:
    """Where the craft describes no controller and only gyros tell the motion.

    A loop h' = D w + K a, a the angle, of a body of inertia I has the damping D / (2 sqrt(K I)).  Rates a factor f too large make it
    1/sqrt(f) of what it is."""
    I_B = subject.inertia_kgm2
    if (
        set(motion.rates) != {GYRO}
        or motion.stored is None
        or I_B is None
        or subject.craft.craft.wheel_controller is not None
    ):
        return []
    given = motion.quick(motion.gained().sum(axis=1))
    rate, angle = motion.quick(motion.rates[GYRO]), motion.quick(motion.angles[GYRO])
    for j, axis in enumerate("xyz"):
        if not (rate[:, j].any() and angle[:, j].any()):
            continue
        gains, left = fitted_gains(rate[:, j], angle[:, j], given[:, j])
        if left**2 > (1 - _EXPLAINED) * float(given[:, j] @ given[:, j]) or not (gains > 0).all():
            continue
        D, K = gains
        damping = float(D / (2 * np.sqrt(K * I_B[j, j])))
        for factor, unit in MISTAKEN_UNITS.items():
            better = damping * np.sqrt(factor)
            if not _NO_LOOP[0] < damping < _NO_LOOP[1] and _LOOP[0] < better < _LOOP[1]:
                return [NO_LOOP(axis=axis, damping=damping, better=better, cause=unit)]
    return []
