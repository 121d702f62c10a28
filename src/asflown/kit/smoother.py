"""Kalman filter and fixed-interval smoother for linear Gaussian models, samples at any times.

Every scalar measurement is taken in at its own step, so channels may have any cadence and any sample
may be missing.  Process noise has a fixed part and driven parts whose size may differ from step to step.
The backward pass is the modified Bryson-Frazier form: it inverts nothing, so a singular covariance (a
known state, a deterministic part of the loop) is allowed.

Covariances and gains do not depend on what was measured, only on when.  Where the steps repeat with a
period, both passes settle into repeating theirs; from there on gains are reused and a step costs
its means alone, until a gap or a missing sample breaks the pattern.  Cost is linear in the number of steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import jit

#: Longest period of the steps that is searched for.  1 s and 64 s together are within it.
_LONGEST_PERIOD = 64
#: Two covariances are the same when no element differs by more, in units of both its sigmas.
_SAME = 1e-12


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
    times faster than a matrix exponential of twice the size, which would take most of the time of a fit."""
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


def forward(model: Model, data: Measurements):
    """The filter alone: log likelihood, means (N, n) and covariances (N, n, n) after each step's measurements, and
    of each measurement its innovation, that one's variance, and P H^T (n,) before it."""
    ll, means, covariances, innovation, variance, product, origin = _filter(*_arrays(model, data), True)
    moved = np.repeat(data.start[origin] - data.start[:-1], np.diff(data.start))
    return ll, means, covariances[origin], innovation, variance, product[np.arange(len(moved)) + moved]


def log_likelihood(model: Model, data: Measurements) -> float:
    """Of all measurements, by the innovations.  Memory does not grow with the record."""
    return float(_filter(*_arrays(model, data), False)[0])


@dataclass(frozen=True)
class Smoothed:
    """Mean (N, n) given all measurements; innovations over their sigma (M,).

    ``alone``: (M,), difference of each measurement from its prediction by all others, over its sigma.
    Covariances that repeat are held once: that of step k is ``matrices[case[k]]``."""

    mean: np.ndarray
    matrices: np.ndarray
    case: np.ndarray
    whitened: np.ndarray
    alone: np.ndarray
    log_likelihood: float

    @property
    def covariance(self) -> np.ndarray:
        """Of every step, (N, n, n)."""
        return self.matrices[self.case]


def smooth(model: Model, data: Measurements) -> Smoothed:
    """Fixed-interval smoothing.

    Memory written is n numbers a step and 2 a measurement, and n^2 a step and n a measurement more where the
    full recursions run; where gains repeat these are only set aside, which costs address space alone."""
    arrays = _arrays(model, data)
    ll, mean, covariances, innovation, variance, product, origin = _filter(*arrays, True)
    A, _, _, _, which, H, _, _, _, start, row, _, period, _ = arrays
    case, alone = _backward(A, which, H, start, row, period, mean, covariances, innovation, variance, product, origin)
    # a variance that rounding made negative (extreme values) becomes NaN, without a warning
    whitened = innovation / np.sqrt(np.where(variance > 0, variance, np.nan))
    return Smoothed(mean, covariances, case, whitened, alone, float(ll))


@dataclass(frozen=True)
class Score:
    """Log likelihood, and its derivatives by the model's matrices.

    By A (types, n, n), Q (types, n, n), R (rows,) and the covariance at the first step (n, n).  ``kick``: (N, n), of an impulse on
    each state as each step begins, the size that the data ask for over its sigma (the auxiliary residuals of de Jong and
    Penzer, J. Am. Stat. Assoc. 93 (1998) 796)."""

    log_likelihood: float
    A: np.ndarray
    Q: np.ndarray
    R: np.ndarray
    covariance: np.ndarray
    kick: np.ndarray

    def along(self, here: Model, there: Model) -> float:
        """Change of the log likelihood, to first order, from one model to another of the same H, neither with driven parts."""
        return float(
            np.sum(self.A * (there.A - here.A))
            + np.sum(self.Q * (there.Q - here.Q))
            + self.R @ np.subtract(there.R, here.R, where=np.isfinite(here.R), out=np.zeros_like(here.R))
            + np.sum(self.covariance * (there.covariance - here.covariance))
        )


def score(model: Model, data: Measurements) -> Score:
    """The likelihood's exact derivatives from one smoothing: of all parameters for the price of two or three likelihoods.

    With r and N the smoother's adjoint and its variance at a step, d/dQ = (r r^T - N)/2 and d/dA = r x^T - N A P, x and P the
    smoothed mean and the filtered covariance a step before (Koopman and Shephard, Biometrika 79 (1992) 823; no inverse of Q)."""
    arrays = _arrays(model, data)
    ll, mean, covariances, innovation, variance, product, origin = _filter(*arrays, True)
    A, _, _, _, which, H, R, _, _, start, row, _, period, _ = arrays
    found = _slopes(A, which, H, len(R), start, row, period, mean, covariances, innovation, variance, product, origin)
    return Score(float(ll), *found)


def _arrays(model: Model, data: Measurements):
    which, start, row = (np.ascontiguousarray(x, dtype=np.int64) for x in (model.which, data.start, data.row))
    return (
        np.ascontiguousarray(model.A), np.ascontiguousarray(model.Q), np.ascontiguousarray(model.driven),
        np.ascontiguousarray(model.scale, dtype=float), which,
        np.ascontiguousarray(model.H), np.ascontiguousarray(model.R, dtype=float),
        np.ascontiguousarray(model.mean, dtype=float), np.ascontiguousarray(model.covariance, dtype=float),
        start, row, np.ascontiguousarray(data.value, dtype=float), _period(which, start, row),
        int(np.max(np.diff(start), initial=0)),
    )  # fmt: skip


@jit
def _period(which, start, row):
    """The period with which most steps repeat, 0 where none does."""
    steps = len(which)
    kind = which.copy()  # a number for what happens at each step; a rare clash costs only a worse period
    for k in range(steps):
        for i in range(start[k], start[k + 1]):
            kind[k] = 31 * kind[k] + row[i] + 1
    best, most = 0, 0
    for p in range(1, min(_LONGEST_PERIOD, steps - 1) + 1):
        count = 0
        for k in range(p, steps):
            count += kind[k] == kind[k - p]
        if count > most:
            best, most = p, count
    return best


@jit
def _same_step(k, other, which, scale, start, row):
    """Whether two steps do the same to a covariance."""
    if which[k] != which[other] or start[k + 1] - start[k] != start[other + 1] - start[other]:
        return False
    for i in range(start[k + 1] - start[k]):
        if row[start[k] + i] != row[start[other] + i]:
            return False
    same = True
    for j in range(scale.shape[1]):
        same &= scale[k, j] == scale[other, j]
    return same


@jit
def _same_matrix(P, other):
    for r in range(len(P)):
        for c in range(r, -1, -1):
            if not abs(P[r, c] - other[r, c]) <= _SAME * np.sqrt(P[r, r] * P[c, c]):  # NaN is never the same
                return False
    return True


@jit
def _apply(a, x, work):
    """x = a x, in place."""
    for r in range(len(x)):
        work[r] = x[r]
    for r in range(len(x)):
        t = 0.0
        for c in range(len(x)):
            t += a[r, c] * work[c]
        x[r] = t


@jit
def _add(P, factor, other):
    """P += factor other, without a temporary."""
    for r in range(len(P)):
        for c in range(len(P)):
            P[r, c] += factor * other[r, c]


@jit
def _sandwich(a, P, out, work):
    """out = a P a^T, exactly symmetric, by plain loops: at these sizes a library call costs as much."""
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
def _filter(A, Q, driven, scale, which, H, R, m0, P0, start, row, value, period, most, keep):
    """Log likelihood and, if ``keep``, all of it; ``origin``: the step whose covariances and gains each step has.

    Covariances and products are filled in at their origins only."""
    n, steps, count = len(m0), len(which), len(value)
    size, stored = (steps, count) if keep else (1, 1)
    means, covariances, origin = np.empty((size, n)), np.empty((size, n, n)), np.empty(size, np.int64)
    innovation, variance, product = np.empty(stored), np.empty(stored), np.empty((stored, n))
    # of the last period's steps: covariance, P H^T and the innovations' variances
    phases = max(period, 1)
    past, Ph, S = np.zeros((phases, n, n)), np.zeros((phases, most, n)), np.ones((phases, most))
    m, P, moved, work, line = m0.copy(), P0.copy(), np.empty((n, n)), np.empty((n, n)), np.empty(n)
    ll, settled, again = 0.0, False, False  # settled: the covariance is that of one period ago
    for k in range(steps):
        phase = k % phases
        was, again = again, settled and _same_step(k, k - period, which, scale, start, row)
        if k > 0:
            a = A[which[k]]
            _apply(a, m, line)
            if not again:
                if was:
                    P[:] = past[(k - 1) % phases]
                _sandwich(a, P, moved, work)
                P, moved = moved, P
                _add(P, 1.0, Q[which[k]])
                for j in range(len(driven)):
                    _add(P, scale[k, j], driven[j, which[k]])
        for i in range(start[k], start[k + 1]):
            j, h = i - start[k], row[i]
            if not again:
                S[phase, j] = _take_in(P, H[h], R[h], Ph[phase, j])
            v = value[i]
            for r in range(n):
                v -= H[h, r] * m[r]
            u = v / S[phase, j]
            for r in range(n):
                m[r] += Ph[phase, j, r] * u
            ll -= 0.5 * (np.log(2 * np.pi * S[phase, j]) + v * u)
            if keep:
                innovation[i], variance[i] = v, S[phase, j]
                if not again:
                    product[i] = Ph[phase, j]
        if not again:
            settled = 0 < period <= k and _same_matrix(P, past[phase])
            past[phase] = P
        if keep:
            means[k] = m
            origin[k] = origin[k - period] if again else k
            if not again:
                covariances[k] = P
    return ll, means, covariances, innovation, variance, product, origin


@jit
def _take_in(P, h, noise, Ph):
    """Covariance after one measurement and, before it, P h^T, in place; returns the innovation's variance."""
    n, S = len(P), noise
    for c in range(n):
        Ph[c] = 0.0
    for r in range(n):
        if h[r] != 0.0:
            for c in range(n):
                Ph[c] += h[r] * P[r, c]
    for r in range(n):
        S += h[r] * Ph[r]
    part = 1 / S
    for r in range(n):
        for c in range(n):
            P[r, c] -= Ph[r] * Ph[c] * part  # exactly symmetric
    return S


@jit
def _backward(A, which, H, start, row, period, mean, covariances, innovation, variance, product, origin):
    """Smooth the filtered means in place; lay smoothed covariances beside or over the filtered ones.

    Returns where that of each step lies, and each measurement compared with all the others (de Jong's u / sqrt D).  A step that repeats another's has its own place free, and no step
    reads the place of a later one that did not."""
    steps, n = mean.shape
    case, phases = np.empty(steps, np.int64), max(period, 1)
    alone, weight = np.empty(len(row)), np.empty(len(row))  # weight: D, the inverse of the variance given all others
    past = np.zeros((phases, n, n))  # information from beyond each of the next period's steps
    adjoint, line, N = np.zeros(n), np.empty(n), np.zeros((n, n))
    turned, work, back = np.empty((n, n)), np.empty((n, n)), np.empty(A.shape)
    for c in range(len(A)):
        back[c] = A[c].T
    settled, again = False, False  # settled: the information from beyond is that of one period on
    for k in range(steps - 1, -1, -1):
        was, again = again, settled and origin[k + period] == origin[k]
        P = covariances[origin[k]]
        for r in range(n):
            t = 0.0
            for c in range(n):
                t += P[r, c] * adjoint[c]
            mean[k, r] -= t
        if again:
            case[k] = case[k + period]
        else:
            case[k] = k
            if was:
                N[:] = past[k % phases]
            past[k % phases] = N
            _sandwich(P, N, turned, work)  # P is symmetric
            for r in range(n):
                for c in range(n):
                    covariances[k, r, c] = P[r, c] - turned[r, c]
        for i in range(start[k + 1] - 1, start[k] - 1, -1):
            own, h = start[origin[k]] + i - start[k], row[i]
            u = innovation[i]
            for r in range(n):
                u += product[own, r] * adjoint[r]
            u /= variance[i]
            for r in range(n):
                adjoint[r] -= H[h, r] * u
            if again:
                weight[i] = weight[start[k + period] + i - start[k]]
            else:
                weight[i] = _give_back(N, H[h], product[own], variance[i], line)
            alone[i] = u / np.sqrt(weight[i])
        if k > 0:
            _apply(back[which[k]], adjoint, line)
            if not again:
                _sandwich(back[which[k]], N, turned, work)
                N, turned = turned, N
                settled = 0 < period <= steps - k and _same_matrix(N, past[(k - 1) % phases])
    return case, alone


@jit
def _slopes(A, which, H, rows, start, row, period, mean, covariances, innovation, variance, product, origin):
    """Derivatives of the log likelihood by A, Q, R and the first covariance, and ``Score.kick``; ``_backward``'s passage without its smoothed covariances."""
    steps, n = mean.shape
    phases = max(period, 1)
    by_A, by_Q, by_R, first = np.zeros(A.shape), np.zeros(A.shape), np.zeros(rows), np.zeros((n, n))
    kick = np.zeros((steps, n))
    weight = np.empty(len(row))
    # of the next period's steps: information from beyond, the same with the step's own, and N A P
    past, whole, crossed = np.zeros((phases, n, n)), np.zeros((phases, n, n)), np.zeros((phases, n, n))
    adjoint, later, x, line, N = np.zeros(n), np.zeros(n), np.empty(n), np.empty(n), np.zeros((n, n))
    turned, work, back = np.empty((n, n)), np.empty((n, n)), np.empty(A.shape)
    for c in range(len(A)):
        back[c] = A[c].T
    settled, again, crossed_again = False, False, False
    for k in range(steps - 1, -1, -1):
        was, again = again, settled and origin[k + period] == origin[k]
        P = covariances[origin[k]]
        for r in range(n):
            x[r] = mean[k, r]
            for c in range(n):
                x[r] -= P[r, c] * adjoint[c]
        if k < steps - 1:  # the step from here on
            kind, phase = which[k + 1], (k + 1) % phases
            if not (crossed_again and origin[k + period] == origin[k]):
                multiply(whole[phase], A[kind], work, n)
                multiply(work, P, crossed[phase], n)
            for r in range(n):
                for c in range(n):
                    by_A[kind, r, c] -= later[r] * x[c] + crossed[phase, r, c]
        phase = k % phases
        if not again:
            if was:
                N[:] = past[phase]
            past[phase] = N
        for i in range(start[k + 1] - 1, start[k] - 1, -1):
            own, h = start[origin[k]] + i - start[k], row[i]
            u = innovation[i]
            for r in range(n):
                u += product[own, r] * adjoint[r]
            u /= variance[i]
            for r in range(n):
                adjoint[r] -= H[h, r] * u
            if again:
                weight[i] = weight[start[k + period] + i - start[k]]
            else:
                weight[i] = _give_back(N, H[h], product[own], variance[i], line)
            by_R[h] += 0.5 * (u * u - weight[i])
        if not again:
            whole[phase] = N
        crossed_again = again
        into = by_Q[which[k]] if k > 0 else first
        for r in range(n):
            for c in range(n):
                into[r, c] += 0.5 * (adjoint[r] * adjoint[c] - whole[phase, r, c])
            later[r] = adjoint[r]
            if whole[phase, r, r] > 0:
                kick[k, r] = -adjoint[r] / np.sqrt(whole[phase, r, r])
        if k > 0:
            _apply(back[which[k]], adjoint, line)
            if not again:
                _sandwich(back[which[k]], N, turned, work)
                N, turned = turned, N
                settled = 0 < period <= steps - k and _same_matrix(N, past[(k - 1) % phases])
    return by_A, by_Q, by_R, first, kick


@jit
def multiply(a, b, out, columns):
    """out = a b for the first ``columns`` columns, zeros of a skipped."""
    n = len(a)
    for r in range(n):
        for c in range(columns):
            out[r, c] = 0.0
        for i in range(n):
            f = a[r, i]
            if f != 0.0:
                for c in range(columns):
                    out[r, c] += f * b[i, c]


@jit
def _give_back(N, h, Ph, S, KN):
    """N = (1 - K h)^T N (1 - K h) + h^T h / S in place, with K = P h^T / S; returns 1 / S + K^T N K as it was."""
    n = len(N)
    for c in range(n):
        KN[c] = 0.0
    for r in range(n):
        gain = Ph[r] / S
        for c in range(n):
            KN[c] += gain * N[r, c]
    half = 1.0
    for r in range(n):
        half += KN[r] * Ph[r]
    half /= 2 * S
    for r in range(n):
        if h[r] != 0.0:
            for c in range(n):
                change = h[r] * (h[c] * half - KN[c])
                N[r, c] += change
                N[c, r] += change
    return 2 * half
