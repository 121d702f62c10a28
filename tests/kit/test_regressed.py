"""Laws of the regressing filter: the same as dense generalized least squares, and slopes that are slopes."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.kit.regressed import Changes, Steps, run, smooth


def system(seed=3, steps=12) -> Steps:
    rng = np.random.default_rng(seed)
    n, p, J, kinds = 3, 2, 2, 2
    per_step = rng.integers(0, 3, steps)
    start = np.concatenate([[0], np.cumsum(per_step)])
    M = start[-1]
    half = rng.standard_normal((J, kinds, n, n))
    return Steps(
        np.eye(n) + 0.2 * rng.standard_normal((steps, n, n)), 0.1 * rng.standard_normal((steps, n)), half @ np.swapaxes(half, 2, 3),
        rng.integers(0, kinds, steps), rng.uniform(0.2, 2, (steps, J)), start, rng.standard_normal((M, n)),
        rng.standard_normal(M), rng.standard_normal((M, p)), rng.uniform(0.1, 1, M), 2 * np.eye(n),
    )  # fmt: skip


def dense(s: Steps):
    """Mean (M,) and covariance (M, M) of the readings, and those of all states with the readings, at beta = 0."""
    N, n = len(s.kind), s.A.shape[1]
    mean, P = np.zeros((N, n)), np.zeros((N, n, N, n))
    P[0, :, 0] = s.covariance
    for k in range(1, N):
        mean[k] = s.A[k] @ mean[k - 1] + s.b[k]
        for j in range(k):
            P[k, :, j] = s.A[k] @ P[k - 1, :, j]
            P[j, :, k] = P[k, :, j].T
        Q = sum(s.scale[k, i] * s.driven[i, s.kind[k]] for i in range(s.driven.shape[0]))
        P[k, :, k] = s.A[k] @ P[k - 1, :, k - 1] @ s.A[k].T + Q
    step = np.repeat(np.arange(N), np.diff(s.start))
    G = np.zeros((len(s.y), N * n))
    for m, k in enumerate(step):
        G[m, k * n : (k + 1) * n] = s.H[m]
    P = P.reshape(N * n, N * n)
    return G @ mean.ravel(), G @ P @ G.T + np.diag(s.R), mean.ravel(), P @ G.T


def test_law_the_filter_is_generalized_least_squares():
    s = system()
    mean, C, first, cross = dense(s)
    W = np.linalg.inv(C)
    f = run(s)
    beta = np.linalg.solve(f.information[1:, 1:], f.information[1:, 0])
    assert beta == pytest.approx(np.linalg.solve(s.Z.T @ W @ s.Z, s.Z.T @ W @ (s.y - mean)))
    assert f.information[1:, 1:] == pytest.approx(s.Z.T @ W @ s.Z)
    left = s.y - mean - s.Z @ beta
    expected = -0.5 * (left @ W @ left + np.linalg.slogdet(2 * np.pi * C)[1])
    assert f.log_likelihood(beta) == pytest.approx(expected)
    smoothed = smooth(s, f, beta)
    assert smoothed.mean.ravel() == pytest.approx(first + cross @ W @ left)
    assert smoothed.error == pytest.approx(W @ left)  # the pull of every reading: R^-1 of its smoothed error


def test_law_the_backward_pass_gives_the_slopes_of_the_likelihood():
    s, beta, h = system(), np.array([0.3, -0.2]), 1e-5
    found = smooth(s, run(s), beta)

    def at(**changes):
        return run(replace(s, **changes)).log_likelihood(beta)

    for m in (0, 4, len(s.y) - 1):
        up = s.R.copy()
        up[m] *= np.exp(h)
        assert found.by_noise[m] == pytest.approx((at(R=up) - at()) / h, rel=1e-3, abs=1e-6)
    for k, j in ((1, 0), (7, 1)):
        up = s.scale.copy()
        up[k, j] *= np.exp(h)
        assert found.by_drive[k, j] == pytest.approx((at(scale=up) - at()) / h, rel=1e-3, abs=1e-6)
    grown = s.covariance + h * np.diag([1.0, 0, 0])
    assert found.by_first[0, 0] == pytest.approx((at(covariance=grown) - at()) / h, rel=1e-3, abs=1e-6)


def test_law_the_backward_pass_gives_the_slopes_in_what_shapes_a_step():
    s, beta, h = system(), np.array([0.3, -0.2]), 1e-6
    rng = np.random.default_rng(1)
    dA, half = rng.standard_normal((2, 2, 3, 3)), rng.standard_normal((2, 2, 3, 3))
    dQ = half + np.swapaxes(half, 2, 3)
    found = smooth(s, run(s), beta, Changes(dA, dQ)).by_change
    for t in range(2):
        driven = np.concatenate([s.driven, dQ[t : t + 1]])
        moved = [
            replace(
                s, A=s.A + x * dA[t, s.kind], driven=driven, scale=np.column_stack([s.scale, np.full(len(s.kind), x)])
            )
            for x in (-h, h)
        ]
        low, high = (run(m).log_likelihood(beta) for m in moved)
        assert found[t] == pytest.approx((high - low) / (2 * h), rel=1e-5)


def test_law_covariances_stay_covariances_where_rounding_bites():
    s = system()
    sharp = replace(s, R=1e-8 * s.R, covariance=1e6 * np.eye(3), scale=1e-12 * s.scale)
    f = run(sharp)
    assert np.all(f.variance > 0)
    assert min(np.linalg.eigvalsh(P)[0] for P in f.covariances) > -1e-9 * 1e6


def test_law_what_is_left_of_a_loose_step_is_not_negative():
    """E[w Q^-1 w] = 3 + 2 by_drive of one axis.  Rates known to 1e-9 of a motion whose steps are ten thousand million times
    looser here and there: multiplied out, the adjoint's covariance rounded it down to -4, and corners came and went."""
    N, dt = 400, np.array([0.98, 0.02])
    kind = np.arange(N) % 2
    A = np.array([[[1, d, d**2 / 2], [0, 1, d], [0, 0, 1]] for d in dt[kind]])
    walk = [[[d**5 / 20, d**4 / 8, d**3 / 6], [d**4 / 8, d**3 / 3, d**2 / 2], [d**3 / 6, d**2 / 2, d]] for d in dt]
    scale = np.full((N, 1), 4e-14)
    scale[100::50] *= 1e10
    H, R = np.tile([[1.0, 0, 0], [0.3, 1.0, 0]], (N, 1)), np.tile([1e-6, 1e-18], N)
    y = np.random.default_rng(0).standard_normal(2 * N) * np.sqrt(R)
    first = np.diag([1e-4, 1e-6, 1e-6])
    s = Steps(
        A, np.zeros((N, 3)), np.array([walk]), kind, scale, 2 * np.arange(N + 1), H, y, np.zeros((2 * N, 0)), R, first
    )
    assert (3 + 2 * smooth(s, run(s), np.empty(0)).by_drive).min() > -1e-3
