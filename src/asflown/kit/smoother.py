"""Kalman filter and fixed-interval smoother for linear Gaussian models, samples at any times.

Every scalar measurement is taken in at its own step, so channels may have any cadence and any sample
may be missing.  Process noise has a fixed part and driven parts whose size may differ from step to step.  The backward pass is the modified Bryson-Frazier form: it inverts nothing, so a
singular covariance (a state that is known, a deterministic part of the loop) does no harm.  Cost is
linear in the number of steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import jit


@dataclass(frozen=True)
class Measurements:
    """Scalar measurements y = H[row] x + noise, sorted by step; those of step k are [start[k], start[k+1])."""

    start: np.ndarray  # (N + 1,) int
    row: np.ndarray  # (M,) int
    value: np.ndarray  # (M,)


@dataclass(frozen=True)
class Model:
    """x[k] = A[c] x[k-1] + w with c = which[k]; cov w = Q[c] + sum_j scale[k, j] driven[j, c]; y = H x + v, var v = R.

    ``which[0]`` and ``scale[0]`` are not used."""

    A: np.ndarray  # (types, n, n)
    Q: np.ndarray  # (types, n, n)
    driven: np.ndarray  # (J, types, n, n); J may be 0
    scale: np.ndarray  # (N, J)
    which: np.ndarray  # (N,) int
    H: np.ndarray  # (rows, n)
    R: np.ndarray  # (rows,)
    mean: np.ndarray  # (n,), at the first step
    covariance: np.ndarray  # (n, n)


def discretize(F: np.ndarray, Qc: np.ndarray, steps_s) -> tuple[np.ndarray, np.ndarray]:
    """Exact A and Q of dx = F x dt + white noise of spectral density Qc, for each step.

    Series over a short span, then doubling: A(2t) = A(t)^2, Q(2t) = Q(t) + A(t) Q(t) A(t)^T.  Many
    times faster than a matrix exponential of twice the size, which would be most of a fit's time."""
    F, Qc = np.ascontiguousarray(F, float), np.ascontiguousarray(Qc, float)
    return _discretize(F, Qc, np.ascontiguousarray(steps_s, float))


@jit
def _discretize(F, Qc, steps):
    n = len(F)
    A, Q = np.empty((len(steps), n, n)), np.empty((len(steps), n, n))
    size = np.abs(F).sum(axis=1).max()
    for k in range(len(steps)):
        doublings = 0
        while size * steps[k] / 2.0**doublings > 0.1:
            doublings += 1
        t = steps[k] / 2.0**doublings
        a, term = np.eye(n), np.eye(n)
        q, part = Qc * t, Qc * t
        for i in range(1, 11):  # 0.1^11 / 11! is below rounding
            term = term @ F * (t / i)
            a = a + term
            part = (F @ part + part @ F.T) * (t / (i + 1))
            q = q + part
        for _ in range(doublings):
            q = q + a @ q @ a.T
            a = a @ a
        A[k] = a
        Q[k] = 0.5 * (q + q.T)
    return A, Q


def log_likelihood(model: Model, data: Measurements) -> float:
    """Of all measurements, by the innovations."""
    return float(_filter(*_arrays(model, data), False)[0])


@dataclass(frozen=True)
class Smoothed:
    """Mean (N, n) and covariance (N, n, n) given all measurements; innovations over their sigma (M,).

    ``drive``: (N, J), the expected square of each driven noise over its variance at scale 1, given all
    measurements: what an update of ``scale`` needs."""

    mean: np.ndarray
    covariance: np.ndarray
    whitened: np.ndarray
    drive: np.ndarray
    log_likelihood: float


def smooth(model: Model, data: Measurements) -> Smoothed:
    """Fixed-interval smoothing."""
    arrays = _arrays(model, data)
    ll, mean, covariance, innovation, variance, product = _filter(*arrays, True)
    A, _, driven, scale, which, H, _, _, _, start, row, _ = arrays
    drive = _backward(A, driven, scale, which, H, start, row, mean, covariance, innovation, variance, product)
    # a variance that rounding drove below zero (values of absurd size) shows as NaN, without noise
    whitened = innovation / np.sqrt(np.where(variance > 0, variance, np.nan))
    return Smoothed(mean, covariance, whitened, drive, float(ll))


def draw(model: Model, data: Measurements, rng: np.random.Generator) -> np.ndarray:
    """One path of the states (N, n) from their joint distribution given all measurements.

    A path and its measurements are simulated, and the smoothed difference between the true and the
    simulated measurements is added to it (Durbin and Koopman's simulation smoother)."""
    steps, n = len(model.which), len(model.mean)
    noise = np.einsum("krc,kc->kr", _roots(model.Q)[model.which], rng.standard_normal((steps, n)))
    for j, D in enumerate(model.driven):
        part = np.einsum("krc,kc->kr", _roots(D)[model.which], rng.standard_normal((steps, n)))
        noise += np.sqrt(model.scale[:, j, None]) * part
    noise[0] = model.mean + _roots(model.covariance[None])[0] @ rng.standard_normal(n)
    reading = np.sqrt(model.R[data.row]) * rng.standard_normal(len(data.row))
    A, Q, driven, scale, which, H, R, mean, covariance, start, row, value = _arrays(model, data)
    path, simulated = _simulate(A, which, H, start, row, noise, reading)
    kept = _filter(A, Q, driven, scale, which, H, R, 0 * mean, covariance, start, row, value - simulated, True)
    return path + _backward_mean(A, which, H, start, row, *kept[1:])


def _roots(Q: np.ndarray) -> np.ndarray:
    """Matrices B with B B^T = Q, also for singular Q."""
    w, V = np.linalg.eigh(Q)
    return V * np.sqrt(np.maximum(w, 0.0))[:, None, :]


def _arrays(model: Model, data: Measurements):
    return (
        np.ascontiguousarray(model.A), np.ascontiguousarray(model.Q), np.ascontiguousarray(model.driven),
        np.ascontiguousarray(model.scale, dtype=float), model.which.astype(np.int64),
        np.ascontiguousarray(model.H), np.ascontiguousarray(model.R, dtype=float),
        np.ascontiguousarray(model.mean, dtype=float), np.ascontiguousarray(model.covariance, dtype=float),
        data.start.astype(np.int64), data.row.astype(np.int64), np.ascontiguousarray(data.value, dtype=float),
    )  # fmt: skip


@jit
def _sandwich(a, P, out, work):
    """out = a P a^T by plain loops: at these sizes a library call costs more than the sums."""
    n = len(a)
    for r in range(n):
        for c in range(n):
            work[r, c] = 0.0
        for i in range(n):
            x = a[r, i]
            if x != 0.0:
                for c in range(n):
                    work[r, c] += x * P[i, c]
    for r in range(n):
        for c in range(r + 1):
            t = 0.0
            for i in range(n):
                t += work[r, i] * a[c, i]
            out[r, c] = t
            out[c, r] = t


@jit
def _filter(A, Q, driven, scale, which, H, R, m0, P0, start, row, value, keep):
    n, steps, count = len(m0), len(which), len(value)
    size = steps if keep else 1
    means, covariances = np.zeros((size, n)), np.zeros((size, n, n))
    stored = count if keep else 1
    innovation, variance, product = np.zeros(stored), np.ones(stored), np.zeros((stored, n))
    m, P, predicted, work, Ph = m0.copy(), P0.copy(), np.empty((n, n)), np.empty((n, n)), np.empty(n)
    ll = 0.0
    for k in range(steps):
        if k > 0:
            c0 = which[k]
            m = A[c0] @ m
            _sandwich(A[c0], P, predicted, work)
            P, predicted = predicted, P
            P += Q[c0]
            for j in range(len(driven)):
                P += scale[k, j] * driven[j, c0]
        for i in range(start[k], start[k + 1]):
            h = H[row[i]]
            S, v = R[row[i]], value[i]
            for r in range(n):
                t = 0.0
                for c in range(n):
                    if h[c] != 0.0:
                        t += P[r, c] * h[c]
                Ph[r] = t
                S += h[r] * t
                v -= h[r] * m[r]
            ll -= 0.5 * (np.log(2 * np.pi * S) + v * v / S)
            for r in range(n):
                gain = Ph[r] / S
                m[r] += gain * v
                for c in range(n):
                    P[r, c] -= gain * Ph[c]
            if keep:
                innovation[i], variance[i] = v, S
                product[i] = Ph
        if keep:
            means[k] = m
            covariances[k] = 0.5 * (P + P.T)
    return ll, means, covariances, innovation, variance, product


@jit
def _backward(A, driven, scale, which, H, start, row, mean, covariance, innovation, variance, product):
    """Turn filtered means and covariances into smoothed ones, in place; return the expected squared drives."""
    steps, n = mean.shape
    drive = np.ones((steps, len(driven)))
    adjoint, information, turned, work = np.zeros(n), np.zeros((n, n)), np.empty((n, n)), np.empty((n, n))
    for k in range(steps - 1, -1, -1):
        P = covariance[k].copy()
        mean[k] = mean[k] - P @ adjoint
        _sandwich(P, information, turned, work)  # P is symmetric
        covariance[k] = P - turned
        for i in range(start[k + 1] - 1, start[k] - 1, -1):
            h = H[row[i]]
            S = variance[i]
            K = product[i] / S
            adjoint = adjoint - h * (innovation[i] / S + K @ adjoint)
            Kinformation = K @ information
            both = K @ Kinformation + 1 / S
            for r in range(n):
                for c in range(n):
                    information[r, c] += h[r] * h[c] * both - h[r] * Kinformation[c] - Kinformation[r] * h[c]
        if k > 0:
            for j in range(len(driven)):
                # seen at the state the noise enters most: the last one it moves (the torque's slope)
                D = driven[j, which[k]]
                top = 0
                for r in range(n):
                    if D[r, r] > 0:
                        top = r
                q = np.ascontiguousarray(D[top]) * scale[k, j]
                w = -(q @ adjoint)
                left = q[top] - q @ information @ q
                drive[k, j] = (w * w + left) / D[top, top]
            back = A[which[k]].T.copy()
            adjoint = back @ adjoint
            _sandwich(back, information, turned, work)
            information, turned = turned, information
    return drive


@jit
def _simulate(A, which, H, start, row, noise, reading):
    """A path driven by ``noise`` (N, n; its first row is the start) and its measurements."""
    path = noise.copy()
    simulated = reading.copy()
    for k in range(len(which)):
        if k > 0:
            path[k] += A[which[k]] @ path[k - 1]
        for i in range(start[k], start[k + 1]):
            simulated[i] += H[row[i]] @ path[k]
    return path, simulated


@jit
def _backward_mean(A, which, H, start, row, mean, covariance, innovation, variance, product):
    """Smoothed means alone."""
    steps, n = mean.shape
    out = mean.copy()
    adjoint = np.zeros(n)
    for k in range(steps - 1, -1, -1):
        out[k] = mean[k] - covariance[k] @ adjoint
        for i in range(start[k + 1] - 1, start[k] - 1, -1):
            S = variance[i]
            dot = 0.0
            for r in range(n):
                dot += product[i, r] * adjoint[r]
            gain = (innovation[i] + dot) / S
            for r in range(n):
                adjoint[r] -= H[row[i], r] * gain
        if k > 0:
            adjoint = A[which[k]].T.copy() @ adjoint
    return out
