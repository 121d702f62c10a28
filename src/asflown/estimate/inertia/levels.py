"""Noise levels of a slew record, and a first guess of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.rotations import rotation
from ...kit.scatter import difference_sigma

if TYPE_CHECKING:
    from .record import SlewRecord


def first_levels(record: SlewRecord) -> Levels:
    """Rough ones, from third differences."""
    m, g, a = record.momentum, record.rates, record.attitude
    d = m.direction.round(9)
    of = [np.flatnonzero((d == u).all(axis=1)) for u in np.unique(d, axis=0)]
    wheel = _median([difference_sigma(m.value_Nms[i] / m.unit[i] * np.sqrt(m.count[i]), 3) for i in of], 1e-2)
    rate = _median([difference_sigma((g.value_rad_s * np.sqrt(g.count))[g.axis == j], 3) for j in range(3)], 1e-6)
    attitude = 1e-5
    if record.has_attitude:
        r = rotation(a.q_NB)
        steps = (r[:-1].inv() * r[1:]).as_rotvec() * np.sqrt(a.count[1:, None])
        attitude = _median([difference_sigma(np.cumsum(step), 3) for step in steps.T], 1e-5)
    jerk = np.median(np.abs(g.value_rad_s)) * 1e-3 + 1e-9 if record.has_rates else 1e-6
    return Levels(max(wheel, 1e-9), max(rate, 1e-12), max(attitude, 1e-9), max(attitude, 1e-9), 15.0, float(jerk))


@dataclass(frozen=True)
class Levels:
    """Standard deviations of what is random.

    ``jerk``: of the acceleration's walk, per root second [rad/s2/s^0.5];
    ``kick``: of the rate's, where wheels stick and tear loose [rad/s/s^0.5]; ``wander``: of the total momentum's,
    where outside torques vary [N m s/s^0.5]; ``slow``: of a slow outside torque that forgets itself over ``slow_s``.  These
    three are not modelled where they are zero."""

    wheel: float  # rad/s of one wheel, or N m s
    rate: float
    attitude: float
    coloured: float
    coloured_s: float  # its time constant
    jerk: float
    kick: float = 0.0
    wander: float = 0.0
    slow: float = 0.0  # N m
    slow_s: float = 300.0


def _median(sigmas: list[float], otherwise: float) -> float:
    known = [s for s in sigmas if np.isfinite(s)]
    return float(np.median(known)) if known else otherwise
