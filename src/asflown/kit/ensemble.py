"""Many records through one filter: columns of measurements that share a model share its gains.

The covariances of a linear Gaussian model do not depend on what was measured.  They are run once; a
further column costs only its means, with the innermost loop over columns.  A design matrix of responses,
or hundreds of paths, is therefore cheap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import jit
from .smoother import Measurements, Model, forward, multiply

#: Columns taken through at a time: means of every step are kept for the backward pass.
_BATCH_VALUES = 4_000_000


@dataclass(frozen=True)
class Gains:
    """A model's filter over the instants of ``data``, ready for any values measured there."""

    model: Model
    data: Measurements
    variance: np.ndarray  # (M,), of the innovations
    product: np.ndarray  # (M, n), P H^T before each measurement
    covariance: np.ndarray  # (N, n, n), filtered
    own: np.ndarray  # (M,), the data's own innovations over their sigma
    log_likelihood: float


def gains(model: Model, data: Measurements) -> Gains:
    """Run the covariances, and the data's own values with them."""
    ll, _, covariance, innovation, variance, product = forward(model, data)
    return Gains(model, data, variance, product, covariance, innovation / np.sqrt(variance), float(ll))


def whiten(g: Gains, values: np.ndarray, begin: np.ndarray | None = None) -> np.ndarray:
    """Innovations over their sigma, (M, C), of columns of measurements (M, C) under a start of mean zero.

    ``begin``: first step at which each column differs from zero, ascending; saves the steps before it."""
    values = np.ascontiguousarray(values, float)
    begin = np.zeros(values.shape[1], np.int64) if begin is None else np.asarray(begin, np.int64)
    m, d = g.model, g.data
    return _whiten(m.A, m.which, m.H, d.start, d.row, g.variance, g.product, values, begin)


def respond(A: np.ndarray, model: Model, data: Measurements, state: int, slope: int, torque: np.ndarray) -> np.ndarray:
    """Measurements (M, C), without noise, of a craft at rest driven by known torques, columns of (N, C).

    Between steps each torque is a straight line: it is laid on the states ``state`` and ``slope`` of
    transitions ``A`` in which the one is the other's integral."""
    steps_s = A[:, state, slope]  # of such a pair, that entry is the step's length
    torque = np.ascontiguousarray(torque, float)
    rise = np.zeros_like(torque)
    rise[:-1] = np.diff(torque, axis=0) / steps_s[model.which[1:], None]
    return _respond(A, model.which, model.H, data.start, data.row, state, slope, torque, rise)


def smoothed(g: Gains, values: np.ndarray, states) -> np.ndarray:
    """Smoothed means (N, S, C) of some states, of columns of measurements (M, C) under a start of mean zero."""
    m, d = g.model, g.data
    return _smooth(
        m.A, m.which, m.H, d.start, d.row, g.variance, g.product, g.covariance,
        np.ascontiguousarray(values, float), np.asarray(states, np.int64),
    )  # fmt: skip


def simulate(model: Model, data: Measurements, states, count: int, rng: np.random.Generator):
    """``count`` flights of a model from a start of mean zero: some states (N, S, K), and what is measured (M, K)."""
    steps, n = len(model.which), len(model.mean)
    noise = _roots(model.Q)[model.which] @ rng.standard_normal((steps, n, count))
    for j, D in enumerate(model.driven):
        part = _roots(D)[model.which] @ rng.standard_normal((steps, n, count))
        noise += np.sqrt(model.scale[:, j, None, None]) * part
    noise[0] = _roots(model.covariance[None])[0] @ rng.standard_normal((n, count))
    reading = np.sqrt(model.R[data.row])[:, None] * rng.standard_normal((len(data.row), count))
    states = np.asarray(states, np.int64)
    return _simulate(model.A, model.which, model.H, data.start, data.row, noise, reading, states)


def paths(g: Gains, residual: np.ndarray, states, rng: np.random.Generator) -> np.ndarray:
    """Paths of some states, (K, N, S), one given each column of measurements (M, K).

    A path and its measurements are simulated and the smoothed difference to the true ones added (Durbin
    and Koopman's simulation smoother)."""
    steps, n = len(g.model.which), len(g.model.mean)
    batch = max(1, _BATCH_VALUES // (n * steps))
    parts = []
    for k in range(0, residual.shape[1], batch):
        some = residual[:, k : k + batch]
        drawn, simulated = simulate(g.model, g.data, states, some.shape[1], rng)
        parts.append(np.moveaxis(drawn + smoothed(g, some - simulated, states), 2, 0))
    return np.ascontiguousarray(np.concatenate(parts))


def _roots(Q: np.ndarray) -> np.ndarray:
    """Matrices B with B B^T = Q, also for singular Q and rows of very different size."""
    size = np.sqrt(np.diagonal(Q, axis1=1, axis2=2))
    size = np.where(size > 0, size, 1.0)
    w, V = np.linalg.eigh(Q / (size[:, :, None] * size[:, None, :]))
    return size[:, :, None] * V * np.sqrt(np.maximum(w, 0.0))[:, None, :]


@jit
def _innovate(h, x, value, out, active):
    """out = value - h x."""
    for c in range(active):
        out[c] = value[c]
    for r in range(len(h)):
        f = h[r]
        if f != 0.0:
            for c in range(active):
                out[c] -= f * x[r, c]


@jit
def _whiten(A, which, H, start, row, variance, product, values, begin):
    n, columns = A.shape[1], values.shape[1]
    out = np.zeros(values.shape)
    x, y, v = np.zeros((n, columns)), np.zeros((n, columns)), np.zeros(columns)
    active = 0
    for k in range(len(which)):
        if k > 0:
            multiply(A[which[k]], x, y, active)
            x, y = y, x
        while active < columns and begin[active] <= k:
            for r in range(n):
                x[r, active] = 0.0  # the buffer may hold another column's past
            active += 1
        for i in range(start[k], start[k + 1]):
            _innovate(H[row[i]], x, values[i], v, active)
            root = np.sqrt(variance[i])
            for c in range(active):
                out[i, c] = v[c] / root
            for r in range(n):
                gain = product[i, r] / variance[i]
                for c in range(active):
                    x[r, c] += gain * v[c]
    return out


@jit
def _respond(A, which, H, start, row, state, slope, torque, rise):
    n, columns = A.shape[1], torque.shape[1]
    out = np.zeros((len(row), columns))
    x, y = np.zeros((n, columns)), np.zeros((n, columns))
    for k in range(len(which)):
        if k > 0:
            multiply(A[which[k]], x, y, columns)
            x, y = y, x
        for c in range(columns):
            x[state, c], x[slope, c] = torque[k, c], rise[k, c]
        for i in range(start[k], start[k + 1]):
            for r in range(n):
                f = H[row[i], r]
                if f != 0.0:
                    for c in range(columns):
                        out[i, c] += f * x[r, c]
    return out


@jit
def _simulate(A, which, H, start, row, noise, reading, states):
    """Chosen states of paths driven by ``noise`` (N, n, K; its first step is the start), and their measurements."""
    steps, n, columns = noise.shape
    kept = np.empty((steps, len(states), columns))
    x, y = np.zeros((n, columns)), np.zeros((n, columns))
    for k in range(steps):
        if k > 0:
            multiply(A[which[k]], x, y, columns)
            x, y = y, x
        for r in range(n):
            for c in range(columns):
                x[r, c] += noise[k, r, c]
        for s in range(len(states)):
            for c in range(columns):
                kept[k, s, c] = x[states[s], c]
        for i in range(start[k], start[k + 1]):
            for r in range(n):
                f = H[row[i], r]
                if f != 0.0:
                    for c in range(columns):
                        reading[i, c] += f * x[r, c]
    return kept, reading


@jit
def _smooth(A, which, H, start, row, variance, product, covariance, values, states):
    """Smoothed means of chosen states, (N, S, K), under a start of mean zero."""
    steps, n, columns = len(which), A.shape[1], values.shape[1]
    kept = np.empty((steps, len(states), columns))
    innovation = np.empty(values.shape)
    x, y = np.zeros((n, columns)), np.zeros((n, columns))
    for k in range(steps):
        if k > 0:
            multiply(A[which[k]], x, y, columns)
            x, y = y, x
        for i in range(start[k], start[k + 1]):
            _innovate(H[row[i]], x, values[i], innovation[i], columns)
            for r in range(n):
                gain = product[i, r] / variance[i]
                for c in range(columns):
                    x[r, c] += gain * innovation[i, c]
        for s in range(len(states)):
            for c in range(columns):
                kept[k, s, c] = x[states[s], c]
    adjoint, turned, dot = np.zeros((n, columns)), np.zeros((n, columns)), np.empty(columns)
    for k in range(steps - 1, -1, -1):
        for s in range(len(states)):
            for r in range(n):
                p = covariance[k, states[s], r]
                for c in range(columns):
                    kept[k, s, c] -= p * adjoint[r, c]
        for i in range(start[k + 1] - 1, start[k] - 1, -1):
            for c in range(columns):
                dot[c] = innovation[i, c]
            for r in range(n):
                p = product[i, r]
                for c in range(columns):
                    dot[c] += p * adjoint[r, c]
            for r in range(n):
                f = H[row[i], r] / variance[i]
                if f != 0.0:
                    for c in range(columns):
                        adjoint[r, c] -= f * dot[c]
        if k > 0:
            multiply(A[which[k]].T, adjoint, turned, columns)
            adjoint, turned = turned, adjoint
    return kept


#: Share of pulls within one sigma of a normal distribution.
_ONE_SIGMA = 0.6827


def spread(samples: np.ndarray) -> np.ndarray:
    """One sigma of samples (K, ...) with tails: the mean of the estimates from their middle 68 % and 95 %.

    A posterior of corners is narrow with long tails: its standard deviation is that of the tails, its
    68 % interval that of the middle.  Normal samples give their standard deviation."""
    low95, low68, high68, high95 = np.quantile(samples, [0.025, 0.1587, 0.8413, 0.975], axis=0)
    return 0.25 * ((high68 - low68) + (high95 - low95) / 1.96)
