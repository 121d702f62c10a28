"""Kalman filter and smoother in which every step may differ, with unknown constants regressed along the way.

    x[k] = A[k] x[k-1] + b[k] + w[k],   cov w[k] = sum_j scale[k, j] driven[j, kind[k]]
    y[m] = H[m] x + Z[m] beta + v[m],   var v[m] = R[m]

The filter is linear in what it is given, so it takes y and every column of Z through the same gains; generalized
least squares on the innovations then gives beta with no prior on it, exactly.  The backward pass is that of the
smoothed disturbances (de Jong 1989; modified Bryson-Frazier): its adjoint also gives the slope of the likelihood in
every variance, at the cost of one pass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import jit


@dataclass(frozen=True)
class Steps:
    """N steps of n states; measurements sorted by step, those of step k are [start[k], start[k + 1])."""

    A: np.ndarray  # (N, n, n); A[0] is not used
    b: np.ndarray  # (N, n); b[0] is not used
    driven: np.ndarray  # (J, kinds, n, n)
    kind: np.ndarray  # (N,) int
    scale: np.ndarray  # (N, J); scale[0] is not used
    start: np.ndarray  # (N + 1,) int
    H: np.ndarray  # (M, n)
    y: np.ndarray  # (M,)
    Z: np.ndarray  # (M, p)
    R: np.ndarray  # (M,)
    covariance: np.ndarray  # (n, n), of a first state whose mean is zero


@dataclass(frozen=True)
class Filtered:
    """Innovations of y and of every column of Z (M, 1 + p), their variance (M,), and what smoothing needs."""

    innovation: np.ndarray
    variance: np.ndarray
    product: np.ndarray  # (M, n), P H^T before each measurement
    mean: np.ndarray  # (N, n, 1 + p), before each step's measurements
    covariances: np.ndarray  # (N, n, n), likewise
    afterwards: np.ndarray  # (N, n, n), after them

    @property
    def information(self) -> np.ndarray:
        """Of y and beta together, (1 + p, 1 + p): E^T diag(1 / variance) E."""
        scaled = self.innovation / np.sqrt(np.where(self.variance > 0, self.variance, np.nan))[:, None]
        return scaled.T @ scaled

    def log_likelihood(self, beta: np.ndarray) -> float:
        e = self.innovation @ np.concatenate([[1.0], -beta])
        return float(-0.5 * np.sum(e**2 / self.variance + np.log(2 * np.pi * self.variance)))


@dataclass(frozen=True)
class Changes:
    """How steps change with T parameters: dA (T, kinds, n, n) of the transitions, and dQ likewise of the covariances of what is new."""

    A: np.ndarray
    Q: np.ndarray


@dataclass(frozen=True)
class Disturbances:
    """Smoothed at one beta: states (N, n), measurement errors (M,) over their R.

    ``by_noise`` (M,), ``by_drive`` (N, J): slope of the log likelihood in the log of each variance;
    ``by_first``: its matrix of slopes in the first state's covariance; ``by_change`` (T,): in each parameter of ``Changes``."""

    mean: np.ndarray
    error: np.ndarray
    by_noise: np.ndarray
    by_drive: np.ndarray
    by_first: np.ndarray
    by_change: np.ndarray


def run(steps: Steps) -> Filtered:
    """The forward pass."""
    given = np.column_stack([steps.y, steps.Z])
    return Filtered(*_forward(
        _c(steps.A), _entries(steps.A[1:]), _c(steps.b), _c(steps.driven), _drives(steps.driven), _i(steps.kind), _c(steps.scale),
        _i(steps.start), _c(steps.H), _c(given), _c(steps.R), _c(steps.covariance),
    ))  # fmt: skip


def smooth(steps: Steps, filtered: Filtered, beta: np.ndarray, changes: Changes | None = None) -> Disturbances:
    """The backward pass, for one value of the constants."""
    if changes is None:
        none = np.empty((0, steps.driven.shape[1], *steps.A.shape[1:]))
        changes = Changes(none, none)
    share = np.concatenate([[1.0], -np.asarray(beta, float)])
    e = filtered.innovation @ share
    mean = filtered.mean @ share
    return Disturbances(*_backward(
        _c(steps.A), _entries(steps.A[1:]), _c(steps.driven), _drives(steps.driven), _i(steps.kind), _c(steps.scale), _i(steps.start),
        _c(steps.H), _c(steps.R), _c(e), filtered.variance, filtered.product, _c(mean), filtered.covariances, filtered.afterwards,
        _c(changes.A), _drives(changes.A), _c(changes.Q), _drives(changes.Q),
    ))  # fmt: skip


def _c(x) -> np.ndarray:
    return np.ascontiguousarray(x, dtype=float)


def _i(x) -> np.ndarray:
    return np.ascontiguousarray(x, dtype=np.int64)


def _entries(matrices: np.ndarray) -> np.ndarray:
    """Row and column of every entry that is not zero in all of them (K, n, n): (E, 2).  Most are, in a chain of integrals."""
    return _i(np.argwhere(np.any(matrices != 0, axis=0)))


def _drives(driven: np.ndarray) -> np.ndarray:
    """Drive, row and column of every entry of the drives that is not zero. (E, 3)"""
    return _i(np.argwhere(np.any(driven != 0, axis=1)))


@jit
def _times(A, entries, x, out):
    """out = A x."""
    out[:] = 0.0
    for e in range(len(entries)):
        i, j = entries[e, 0], entries[e, 1]
        a = A[i, j]
        for c in range(x.shape[1]):
            out[i, c] += a * x[j, c]


@jit
def _turned(A, entries, P, half, out):
    """out = A P A^T of a symmetric P."""
    _times(A, entries, P, half)
    n = len(P)
    out[:] = 0.0
    for e in range(len(entries)):
        i, j = entries[e, 0], entries[e, 1]
        a = A[i, j]
        for c in range(n):
            out[i, c] += a * half[c, j]


@jit
def _evened(P):
    """Takes off what rounding made unlike on both sides of the diagonal."""
    for i in range(len(P)):
        for c in range(i):
            P[i, c] = P[c, i] = 0.5 * (P[i, c] + P[c, i])


@jit
def _forward(A, entries, b, driven, drives, kind, scale, start, H, given, R, first):
    N, n = len(kind), A.shape[1]
    M, columns = given.shape
    innovation, variance, product = np.empty((M, columns)), np.empty(M), np.empty((M, n))
    mean, covariances, afterwards = np.empty((N, n, columns)), np.empty((N, n, n)), np.empty((N, n, n))
    x, P, left = np.zeros((n, columns)), first.copy(), np.empty(n)
    moved, half, turned = np.empty((n, columns)), np.empty((n, n)), np.empty((n, n))
    for k in range(N):
        if k > 0:
            _times(A[k], entries, x, moved)
            x[:] = moved
            _turned(A[k], entries, P, half, turned)
            P[:] = turned
            for i in range(n):
                x[i, 0] += b[k, i]
            for d in range(len(drives)):
                j, i, c = drives[d, 0], drives[d, 1], drives[d, 2]
                P[i, c] += scale[k, j] * driven[j, kind[k], i, c]
        mean[k] = x
        covariances[k] = P
        for m in range(start[k], start[k + 1]):
            s = R[m]
            left[:] = 0.0
            innovation[m] = given[m]
            for c in range(n):
                h = H[m, c]
                if h != 0.0:
                    for i in range(n):
                        left[i] += h * P[c, i]
                    for i in range(columns):
                        innovation[m, i] -= h * x[c, i]
            for i in range(n):
                product[m, i] = left[i]
                s += H[m, i] * left[i]
            variance[m] = s
            for i in range(n):
                gain = product[m, i] / s
                for c in range(columns):
                    x[i, c] += gain * innovation[m, c]
            # (1 - K h) P (1 - K h)^T + K R K^T: stays a covariance where the plain difference would round below zero
            for i in range(n):
                gain = product[m, i] / s
                for c in range(n):
                    P[i, c] -= gain * product[m, c]
            left[:] = 0.0
            for c in range(n):
                h = H[m, c]
                if h != 0.0:
                    for i in range(n):
                        left[i] += h * P[i, c]
            for i in range(n):
                gain = product[m, i] * R[m] / s - left[i]
                for c in range(n):
                    P[i, c] += gain * product[m, c] / s
            _evened(P)
        afterwards[k] = P
    return innovation, variance, product, mean, covariances, afterwards


@jit
def _of_changes(k, r, S, A, entries, kind, afterwards, dA, turns, dQ, grows, by_change):
    """Adds what one step tells of a change of A and Q, but for the part of the smoothed mean.

    Of what is new at this step, w, and of the state before it, x: cov w x^T = -Q S A P, and E w = Q r."""
    for d in range(len(grows)):
        t, i, c = grows[d, 0], grows[d, 1], grows[d, 2]
        by_change[t] += 0.5 * dQ[t, kind[k], i, c] * (r[i] * r[c] - S[i, c])
    for d in range(len(turns)):
        t, i, c = turns[d, 0], turns[d, 1], turns[d, 2]
        total = 0.0
        for f in range(len(entries)):
            total += S[i, entries[f, 0]] * A[k, entries[f, 0], entries[f, 1]] * afterwards[k - 1, entries[f, 1], c]
        by_change[t] -= dA[t, kind[k], i, c] * total


@jit
def _through_means(dA, turns, kind, adjoint, smoothed, by_change):
    """The part that ``_of_changes`` leaves: of a change of A, through the smoothed mean."""
    for k in range(1, len(kind)):
        for d in range(len(turns)):
            t, i, c = turns[d, 0], turns[d, 1], turns[d, 2]
            by_change[t] += dA[t, kind[k], i, c] * adjoint[k, i] * smoothed[k - 1, c]


@jit
def _backward(
    A, entries, driven, drives, kind, scale, start, H, R, e, variance, product, mean, covariances, afterwards, dA, turns, dQ, grows,
):  # fmt: skip
    N, n = len(kind), A.shape[1]
    error, by_noise = np.empty(len(R)), np.empty(len(R))
    by_drive = np.zeros(scale.shape)
    r, S = np.zeros(n), np.zeros((n, n))  # adjoint and its covariance
    gain, Sg = np.empty(n), np.empty(n)
    before, half, turned = np.empty(n), np.empty((n, n)), np.empty((n, n))
    smoothed, adjoint, by_change = np.empty((N, n)), np.empty((N, n)), np.zeros(len(dA))
    backward = np.ascontiguousarray(entries[:, ::-1])
    for k in range(N - 1, -1, -1):
        for m in range(start[k + 1] - 1, start[k] - 1, -1):
            s = variance[m]
            pull, weight = e[m] / s, 1.0 / s
            for i in range(n):
                gain[i] = product[m, i] / s
            for i in range(n):
                total = 0.0
                for c in range(n):
                    total += S[i, c] * gain[c]
                Sg[i] = total
            for i in range(n):
                pull -= gain[i] * r[i]
                weight += gain[i] * Sg[i]
            error[m] = pull  # E[v] = R pull, var v = R - R^2 weight
            by_noise[m] = 0.5 * R[m] * (pull**2 - weight)
            # (1 - h g^T)^T S (1 - g h^T) + h h^T / s, one side after the other: multiplied out, it rounds below zero
            for i in range(n):
                h = H[m, i]
                if h != 0.0:
                    r[i] += h * pull
                    for c in range(n):
                        S[i, c] -= h * Sg[c]
            for i in range(n):
                total = 0.0
                for c in range(n):
                    total += S[i, c] * gain[c]
                Sg[i] = total
            for i in range(n):
                gained = H[m, i] / s - Sg[i]
                for c in range(n):
                    S[i, c] += gained * H[m, c]
            _evened(S)
        smoothed[k] = mean[k] + covariances[k] @ r
        if k > 0:
            for d in range(len(drives)):
                j, i, c = drives[d, 0], drives[d, 1], drives[d, 2]
                by_drive[k, j] += 0.5 * scale[k, j] * driven[j, kind[k], i, c] * (r[i] * r[c] - S[i, c])
            _of_changes(k, r, S, A, entries, kind, afterwards, dA, turns, dQ, grows, by_change)
            adjoint[k] = r
            before[:] = 0.0
            for d in range(len(entries)):
                before[entries[d, 1]] += A[k, entries[d, 0], entries[d, 1]] * r[entries[d, 0]]
            r[:] = before
            _turned(A[k].T, backward, S, half, turned)
            S[:] = turned
    _through_means(dA, turns, kind, adjoint, smoothed, by_change)
    return smoothed, error, by_noise, by_drive, 0.5 * (np.outer(r, r) - S), by_change
