"""Inertia tensor by conservation of momentum, sample by sample: axis by axis, all axes at once, and with its noise.

Feldman and Lee, section IV.  Where the body turns at w and its wheels hold h, momentum before the slew, carried into today's body
axes, less what the wheels hold now is the body's own:  Q = R^T R(0) h(0) - h = I w  (eqs 6, 9).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.momentum import grown_by
from ...dynamics.rigid_body import elements_of, momentum_regressor, tensor_of
from ...kit.errors import BadInput
from ...kit.rotations import rotation
from .motion import Motion, first_motion

if TYPE_CHECKING:
    from .levels import Levels
    from .record import SlewRecord
    from .slews import Slew

#: Readings before a slew whose mean is its first momentum, and after it that still belong to it: one, as in the paper.
_BEFORE = 1


@dataclass(frozen=True)
class Rows:
    """Momentum of wheels and motion of the body at the wheels' instants, body axes."""

    time_s: np.ndarray  # (N,)
    h_B: np.ndarray  # (N, 3)
    motion: Motion
    arc: np.ndarray  # (N,)
    columns: np.ndarray  # (N, 3, 6), of h_B per unit of each element
    gravity: np.ndarray | None  # (N, 3, 6), what the gravity gradient adds to the momentum, inertial axes
    levers: np.ndarray  # (N, 3, 3 sources), what the levers of the surroundings add, inertial axes


@dataclass(frozen=True)
class Solved:
    """A tensor's elements (6,) with their random covariance (6, 6), and what went into them.

    ``products``: both estimates of every product of inertia, {'Ixy': (from one slew, from the other)}; NaN where
    there is none.  ``information``, ``pull`` (6, 6), (6,): the data's part alone, elements = information^-1 pull."""

    elements: np.ndarray
    covariance: np.ndarray
    information: np.ndarray
    pull: np.ndarray
    residual_Nms: np.ndarray  # (N, 3), body axes
    used: np.ndarray  # (N,) bool
    products: dict[str, tuple[float, float]]
    torque_Nm: np.ndarray  # (3,), NaN where it is not estimated
    torque_covariance: np.ndarray


def rows_of(record: SlewRecord) -> Rows:
    """Raises BadInput where the wheels are not read together."""
    m = record.momentum
    times, h, index = m.vectors(m.value_Nms)  # components along orthonormal directions, where all three are read
    whole = np.bincount(index, minlength=len(times)) == 3
    if whole.sum() < 0.5 * len(times):
        raise BadInput(
            "the wheels are read at different instants, and this method needs their momentum at common ones",
            remedy="Use --method consistent.",
        )
    arc = np.zeros(len(times), int)
    arc[index] = m.arc
    times, h, arc = times[whole], h[whole], arc[whole]
    motion = first_motion(record, times)
    R = rotation(motion.q_NB).as_matrix()
    around = record.surroundings
    levers = around.grown(times, R) if record.levers and around is not None else np.empty((len(times), 3, 0))
    columns = record.tensor_columns(times, R, motion.omega_B)
    return Rows(times, h, motion, arc, columns, record.grown_by_gravity(times, R), levers)


def by_axis(rows: Rows, slews: list[Slew]) -> Solved:
    """Eqs 6-8: from slews about one body axis at a time a column of the tensor each; products found twice are averaged.

    Elements that no slew identifies are NaN.  The random covariance counts the noise of the slew's first momentum, which
    all its rows share."""
    column, variance = np.full((3, 3), np.nan), np.full((3, 3), np.nan)
    residual, used = np.full((len(rows.time_s), 3), np.nan), np.zeros(len(rows.time_s), bool)
    pulled = None if rows.gravity is None else _plain_elements(rows)
    for k in range(3):
        square, pull, shared, spans = 0.0, np.zeros(3), 0.0, []
        for slew in (s for s in slews if s.about == "xyz"[k]):
            here, Q = _gained(rows, slew)
            if here is None:
                continue
            if pulled is not None:  # small beside the slew's own momentum: the tensor of all rows will do
                Q = Q + _brought(rows, here) @ pulled
            w = rows.motion.omega_B[here, k]
            square += w @ w
            pull += w @ Q
            shared += np.sum(w) ** 2 / _BEFORE
            spans.append((here, w, Q))
        if square == 0:
            continue
        column[:, k] = pull / square
        for here, w, Q in spans:
            residual[here], used[here] = Q - np.outer(w, column[:, k]), True
        left = np.concatenate([Q - np.outer(w, column[:, k]) for _, w, Q in spans])
        noise = np.sum(left**2, axis=0) / max(len(left) - 1, 1)
        variance[:, k] = noise * (1 + shared / square) / square
    both = np.stack([column, column.T])
    found = np.isfinite(both)
    known = found.any(axis=0)
    count = np.maximum(found.sum(axis=0), 1)
    I_B = np.where(known, np.nansum(both, axis=0) / count, np.nan)
    v = np.stack([variance, variance.T])
    sigma2 = np.where(known, np.nansum(v, axis=0) / count**2, np.nan)
    np.fill_diagonal(sigma2, np.diag(variance))
    covariance = np.diag(elements_of(sigma2))
    products = {f"I{'xyz'[i]}{'xyz'[j]}": (column[i, j], column[j, i]) for i in range(3) for j in range(i + 1, 3)}
    elements = elements_of(I_B)
    information = np.diag(np.where(np.isfinite(np.diag(covariance)), 1 / np.diag(covariance), 0.0))
    return Solved(
        elements, covariance, information, information @ np.nan_to_num(elements), residual, used, products,
        np.full(3, np.nan), np.full((3, 3), np.nan),
    )  # fmt: skip


def all_axes(rows: Rows, slews: list[Slew]) -> Solved:
    """Eqs 9-11: six elements at once, pi = (S^T S)^-1 S^T Gamma, from slews about any axes.

    The paper's third condition for a solution, 'rank of S is 3 N', must read 6; and 'some multi-axis slews' are not
    enough: the rates must span three directions."""
    square, pull, shared, spans = np.zeros((6, 6)), np.zeros(6), np.zeros((6, 6)), []
    residual, used = np.full((len(rows.time_s), 3), np.nan), np.zeros(len(rows.time_s), bool)
    for slew in slews:
        here, Q = _gained(rows, slew)
        if here is None:
            continue
        S = momentum_regressor(rows.motion.omega_B[here])
        if rows.gravity is not None:
            S = S - _brought(rows, here)
        square += np.einsum("nik,nil->kl", S, S)
        pull += np.einsum("nik,ni->k", S, Q)
        total = S.sum(axis=0)  # the first momentum's error enters every row of the slew
        shared += total.T @ total / _BEFORE
        spans.append((here, S, Q))
    inverse = np.linalg.pinv(square, rcond=1e-10, hermitian=True)
    elements = inverse @ pull
    for here, S, Q in spans:
        residual[here], used[here] = Q - S @ elements, True
    count = 3 * used.sum() - 6
    noise = np.nansum(residual**2) / max(count, 1)
    covariance = noise * (inverse + inverse @ shared @ inverse)
    information = np.linalg.pinv(covariance, rcond=1e-10, hermitian=True)
    return Solved(
        elements, covariance, information, information @ elements, residual, used, {}, np.full(3, np.nan),
        np.full((3, 3), np.nan),
    )  # fmt: skip


def generalized(rows: Rows, levels: Levels, unit_kgm2: np.ndarray, frame: str) -> Solved:
    """All rows of all arcs, each arc's momentum free (it is common to the arc's rows, and no one reading gives it), a
    constant external torque, levers of the surroundings where a slow torque acts, and every row's own noise: wheels, rates through
    the tensor, attitude through the momentum.

    ``unit_kgm2`` (3, 3): covariance of h for unit variance of a wheel reading.
    White noise is assumed; the covariance is scaled by what is left over."""
    t = rows.time_s
    R = rotation(rows.motion.q_NB).as_matrix()
    arcs, index = np.unique(rows.arc, return_inverse=True)
    p = 6 + 3 * len(arcs)
    pushed = np.concatenate([grown_by(t, R, frame), rows.levers], axis=2)
    X = np.zeros((len(t), 3, p + pushed.shape[2]))
    X[:, :, :6] = rows.columns
    for k in range(len(t)):
        X[k, :, 6 + 3 * index[k] : 9 + 3 * index[k]] = R[k].T
    X[:, :, p:] = np.swapaxes(R, 1, 2) @ pushed
    elements = _plain_elements(rows)
    for _ in range(4):
        W = np.linalg.inv(np.linalg.cholesky(_row_covariance(rows, levels, unit_kgm2, elements)))
        A, y = (W @ X).reshape(-1, X.shape[2]), np.einsum("nij,nj->ni", W, rows.h_B).ravel()
        size = np.sqrt(np.sum(A**2, axis=0))
        size[size == 0] = 1.0
        A /= size
        normal = A.T @ A
        inverse = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
        beta = (inverse @ (A.T @ y)) / size
        elements = beta[:6]
    chi2 = float(np.sum((y - A @ (beta * size)) ** 2) / max(len(y) - X.shape[2], 1))
    covariance = chi2 * inverse / np.outer(size, size)
    information = np.linalg.pinv(covariance[:6, :6], rcond=1e-12, hermitian=True)
    residual = rows.h_B - X @ beta
    return Solved(
        elements, covariance[:6, :6], information, information @ elements, residual, np.ones(len(t), bool), {},
        beta[p : p + 3], covariance[p : p + 3, p : p + 3],
    )  # fmt: skip


def _row_covariance(rows: Rows, levels: Levels, unit_kgm2: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Of each row's momentum at a tensor's elements. (N, 3, 3)"""
    I_B = tensor_of(elements)
    L = rows.h_B + rows.motion.omega_B @ I_B
    cross = np.zeros((len(L), 3, 3))
    for i, (a, b, sign) in enumerate([(1, 2, -1), (2, 0, -1), (0, 1, -1)]):
        cross[:, a, b], cross[:, b, a] = sign * L[:, i], -sign * L[:, i]
    C = levels.wheel**2 * unit_kgm2 + levels.rate**2 * I_B @ I_B.T
    return C + levels.attitude**2 * cross @ np.swapaxes(cross, 1, 2)


def _plain_elements(rows: Rows) -> np.ndarray:
    """A rough tensor to start from: momentum free, ordinary least squares."""
    R = rotation(rows.motion.q_NB).as_matrix()
    X = np.concatenate([rows.columns, np.swapaxes(R, 1, 2)], axis=2).reshape(-1, 9)
    return np.linalg.lstsq(X, rows.h_B.ravel(), rcond=1e-8)[0][:6]


def _brought(rows: Rows, here: np.ndarray) -> np.ndarray:
    """Momentum that the gravity gradient has brought since the reading before a slew, per unit of each element, body axes. (n, 3, 6)"""
    assert rows.gravity is not None  # asked for only where there is an orbit
    since = rows.gravity[here] - rows.gravity[here[0] - _BEFORE : here[0]].mean(axis=0)
    return np.swapaxes(rotation(rows.motion.q_NB[here]).as_matrix(), 1, 2) @ since


def _gained(rows: Rows, slew: Slew):
    """Which rows belong to a slew, and the momentum its body took from the wheels (n, 3); None where it has no start."""
    start = np.searchsorted(rows.time_s, slew.start_s - 1e-6)
    stop = np.searchsorted(rows.time_s, slew.stop_s + 1e-6)
    begin = start - _BEFORE
    if begin < 0 or stop - start < 3 or len(np.unique(rows.arc[begin:stop])) > 1:
        return None, None
    r = rotation(rows.motion.q_NB)
    h0_N = r[begin:start].apply(rows.h_B[begin:start]).mean(axis=0)
    here = np.arange(start, stop)
    return here, r[here].inv().apply(h0_N) - rows.h_B[here]
