"""The tensor by plain least squares of momentum: a first answer, and a test of what was read."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.rigid_body import momentum_regressor
from ...kit.rotations import rotation
from .motion import Layout, first_motion

if TYPE_CHECKING:
    from .record import SlewRecord


def plain_fit(
    record: SlewRecord, layout: Layout, beta: np.ndarray, skew: float, quick: bool = False
) -> tuple[np.ndarray, float]:
    """Tensor and momenta by least squares of momentum alone, wheels ``skew`` s later: beta and the squares left over.

    ``quick``: of its changes from one reading to the next, in which outside torques hardly show."""
    beta = beta.copy()
    beta[layout.skew_wheels] = skew
    m = record.momentum
    times = np.unique(m.time_s + skew)
    motion = first_motion(_shifted(record, layout, beta), times)
    k = np.searchsorted(times, m.time_s + skew)
    columns = np.zeros((len(k), 6 + 3 * layout.arcs))
    columns[:, :6] = -np.einsum("ni,nik->nk", m.direction, momentum_regressor(motion.omega_B[k]))
    inertial = rotation(motion.q_NB[k]).apply(m.direction)
    for arc in range(layout.arcs):
        here = m.arc == arc
        columns[here, layout.momentum(arc)] = inertial[here]
    value = m.value_Nms
    if quick:
        order = np.lexsort((m.time_s, *m.direction.T, m.arc))
        same = (m.direction[order[1:]] == m.direction[order[:-1]]).all(axis=1) & (np.diff(m.arc[order]) == 0)
        value = np.diff(value[order])[same]
        columns = np.diff(columns[order], axis=0)[same]
    size = np.sqrt(np.sum(columns**2, axis=0))
    size[size == 0] = 1.0
    good = np.ones(len(value), bool)
    for _ in range(1 if quick else 3):  # a few wild readings must not decide where the fit starts
        found, *_ = np.linalg.lstsq(columns[good] / size, value[good], rcond=1e-6)
        left = value - columns @ (found / size)
        good = np.abs(left) <= 8 * np.median(np.abs(left)) + 1e-300
    beta[: len(found)] = found / size
    return beta, float(np.sum(left[good] ** 2))


def _shifted(record: SlewRecord, layout: Layout, beta) -> SlewRecord:
    """Rates at mended times."""
    if layout.skew_rates is None or beta[layout.skew_rates] == 0:
        return record
    return replace(record, rates=replace(record.rates, time_s=record.rates.time_s + beta[layout.skew_rates]))
