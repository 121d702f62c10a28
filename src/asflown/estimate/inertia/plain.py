"""The tensor by plain least squares of momentum: a first answer, and a test of what was read."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.rotations import rotation
from .motion import Layout, first_motion

if TYPE_CHECKING:
    from .record import SlewRecord


#: A slow torque changes over this time or longer [s]; degrees of the polynomial that stands for it.
_SLOW_S, _MOST_DEGREES = 200.0, 12


def plain_fit(record: SlewRecord, beta: np.ndarray | None = None, skew_s: float = 0.0) -> tuple[np.ndarray, float]:
    """Tensor and momenta by least squares of momentum alone, wheels ``skew_s`` later: beta, and the squares left over.

    ``beta``: constants to start from, of which the rates' time offset counts; zeros unless given."""
    beta, columns, value = _equations(record, beta, skew_s)
    return _solved(beta, columns, value, rounds=3)  # a few wild readings must not decide where the fit starts


def of_momentum(record: SlewRecord) -> tuple[np.ndarray, np.ndarray]:
    """What least squares of momentum is made of: columns (M, p) and values (M,).

    In orbit the momentum may also change slowly, by polynomials of time, one degree for every ``_SLOW_S``: outside torques are
    at work there beside a mistake, and would hide how much mending it helps."""
    _, columns, value = _equations(record, None, 0.0)
    if record.orbit is None:
        return columns, value
    m = record.momentum
    times = np.unique(m.time_s)
    span = times[-1] - times[0]
    degree = int(np.clip(span / _SLOW_S, 2, _MOST_DEGREES))
    powers = np.polynomial.legendre.legvander(2 * (m.time_s - times[0]) / span - 1, degree)[:, 1:]
    motion = first_motion(record, times)
    inertial = rotation(motion.q_NB[np.searchsorted(times, m.time_s)]).apply(m.direction)
    return np.column_stack([columns, (inertial[:, :, None] * powers[:, None, :]).reshape(len(value), -1)]), value


def fit_of_changes(record: SlewRecord, beta: np.ndarray, skew_s: float) -> tuple[np.ndarray, float]:
    """The same from changes of momentum between successive readings, in which external torques hardly show."""
    beta, columns, value = _equations(record, beta, skew_s)
    m = record.momentum
    order = np.lexsort((m.time_s, *m.direction.T, m.arc))
    same = (m.direction[order[1:]] == m.direction[order[:-1]]).all(axis=1) & (np.diff(m.arc[order]) == 0)
    return _solved(beta, np.diff(columns[order], axis=0)[same], np.diff(value[order])[same], rounds=1)


def _equations(record: SlewRecord, beta: np.ndarray | None, skew_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """beta with the wheels' offset put in; columns of tensor and momenta (M, 6 + 3 arcs), and momentum (M,)."""
    layout = Layout.of(record)
    beta = np.zeros(layout.size) if beta is None else beta.copy()
    beta[layout.skew_wheels] = skew_s
    m = record.momentum
    times = np.unique(m.time_s + skew_s)
    motion = first_motion(shifted(record, beta), times)
    k = np.searchsorted(times, m.time_s + skew_s)
    columns = np.zeros((len(k), 6 + 3 * layout.arcs))
    R = rotation(motion.q_NB).as_matrix()
    columns[:, :6] = np.einsum("ni,nik->nk", m.direction, record.tensor_columns(times, R, motion.omega_B)[k])
    inertial = rotation(motion.q_NB[k]).apply(m.direction)
    for arc in range(layout.arcs):
        here = m.arc == arc
        columns[here, layout.momentum(arc)] = inertial[here]
    return beta, columns, m.value_Nms


def _solved(beta: np.ndarray, columns: np.ndarray, value: np.ndarray, *, rounds: int) -> tuple[np.ndarray, float]:
    """Least squares; after each round outliers are left out."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    size[size == 0] = 1.0
    good = np.ones(len(value), bool)
    for _ in range(rounds):
        found, *_ = np.linalg.lstsq(columns[good] / size, value[good], rcond=1e-6)
        left = value - columns @ (found / size)
        good = np.abs(left) <= 8 * np.median(np.abs(left)) + 1e-300
    beta[: len(found)] = found / size
    return beta, float(np.sum(left[good] ** 2))


def shifted(record: SlewRecord, beta: np.ndarray) -> SlewRecord:
    """The record with the rates' time stamps corrected."""
    skew = Layout.of(record).skew_rates
    if skew is None or beta[skew] == 0:
        return record
    return replace(record, rates=replace(record.rates, time_s=record.rates.time_s + beta[skew]))
