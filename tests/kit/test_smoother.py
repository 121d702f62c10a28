"""The smoother against batch least squares: same means, covariances, likelihood, and drives."""

import numpy as np
import pytest

from asflown.kit.smoother import Measurements, Model, discretize, draw, log_likelihood, smooth


def problem(seed, n=4, steps=25, drives=1):
    rng = np.random.default_rng(seed)
    F = 0.3 * rng.normal(size=(n, n)) - np.eye(n)
    which = rng.integers(0, 2, steps)
    A, Q = discretize(F, 0.2 * np.eye(n), [1.0, 0.4])
    driven = np.zeros((drives, 2, n, n))
    driven[:, :, -1, -1] = 0.5
    start, row, value = [0], [], []
    for _ in range(steps):
        for r in range(2):
            if rng.random() < 0.6:  # any sample may be missing
                row.append(r)
                value.append(rng.normal())
        start.append(len(row))
    model = Model(A, Q, driven, rng.uniform(0.2, 2, (steps, drives)), which, rng.normal(size=(2, n)), np.array([0.1, 0.3]),
                  np.zeros(n), np.eye(n))  # fmt: skip
    return model, Measurements(np.array(start), np.array(row), np.array(value))


def batch(model, data):
    """All states and all measurements at once; noises as unknowns, so that their posterior comes out too."""
    N, n = len(model.which), len(model.mean)
    C = np.zeros((N * n, N * n))
    T = np.eye(N * n)
    C[:n, :n] = model.covariance
    for k in range(1, N):
        s = slice(k * n, (k + 1) * n)
        c = model.which[k]
        C[s, s] = model.Q[c] + np.einsum("j,jrc->rc", model.scale[k], model.driven[:, c])
        T[s, (k - 1) * n : k * n] = -model.A[c]
    Ti = np.linalg.inv(T)
    H = np.zeros((len(data.row), N * n))
    for k in range(N):
        for i in range(data.start[k], data.start[k + 1]):
            H[i, k * n : (k + 1) * n] = model.H[data.row[i]]
    G = H @ Ti
    S = G @ C @ G.T + np.diag(model.R[data.row])
    gain = C @ G.T @ np.linalg.inv(S)
    noise, left = gain @ data.value, C - gain @ G @ C
    ll = -0.5 * (np.linalg.slogdet(2 * np.pi * S)[1] + data.value @ np.linalg.solve(S, data.value))
    return Ti @ noise, Ti @ left @ Ti.T, ll


@pytest.mark.parametrize("seed", range(3))
def test_law_smoother_equals_batch_least_squares(seed):
    model, data = problem(seed)
    s = smooth(model, data)
    mean, covariance, ll = batch(model, data)
    n = len(model.mean)
    assert np.allclose(s.mean.ravel(), mean, atol=1e-11)
    for k in range(len(model.which)):
        assert np.allclose(s.covariance[k], covariance[k * n : (k + 1) * n, k * n : (k + 1) * n], atol=1e-11)
    assert s.log_likelihood == pytest.approx(ll, abs=1e-9) and log_likelihood(model, data) == pytest.approx(
        ll, abs=1e-9
    )


def test_law_a_gap_widens_the_band():
    model, data = problem(1, steps=40)
    start, row, value = data.start.copy(), [], []
    for k in range(40):
        inside = range(data.start[k], data.start[k + 1]) if not 15 <= k < 25 else ()
        row += [data.row[i] for i in inside]
        value += [data.value[i] for i in inside]
        start[k + 1] = len(row)
    s = smooth(model, Measurements(start, np.array(row), np.array(value)))
    whole = smooth(model, data)
    assert np.all(s.covariance[20].diagonal() > whole.covariance[20].diagonal())


def test_law_expected_drive_averages_to_one_for_data_from_the_model():
    """E[w^2]/q over noise drawn from the prior is 1: the fixed point of a scale update."""
    rng = np.random.default_rng(0)
    n = 2
    A, Q = discretize(np.array([[0.0, 1], [0, 0]]), np.zeros((n, n)), [1.0])
    _, D = discretize(np.array([[0.0, 1], [0, 0]]), np.diag([0.0, 1.0]), [1.0])
    N = 3000
    x, y = np.zeros(n), []
    L = np.linalg.cholesky(D[0])
    for k in range(N):
        if k:
            x = A[0] @ x + L @ rng.normal(size=n)
        y.append(x[0] + 0.1 * rng.normal())
    model = Model(
        A, Q, D[None], np.ones((N, 1)), np.zeros(N, int), np.array([[1.0, 0]]), np.array([0.01]), np.zeros(n), np.eye(n)
    )
    s = smooth(model, Measurements(np.arange(N + 1), np.zeros(N, int), np.array(y)))
    assert s.drive[1:].mean() == pytest.approx(1.0, abs=0.06)
    assert np.std(s.whitened) == pytest.approx(1.0, abs=0.05)


def test_law_discretization_is_exact():
    """Against the matrix exponential of the doubled system (van Loan)."""
    from scipy.linalg import expm

    rng = np.random.default_rng(2)
    F, L = rng.normal(size=(6, 6)) * 3, rng.normal(size=(6, 2))
    Qc = L @ L.T
    A, Q = discretize(F, Qc, [0.125, 1.0])
    for a, q, dt in zip(A, Q, (0.125, 1.0), strict=True):
        block = np.block([[-F, Qc], [np.zeros((6, 6)), F.T]]) * dt
        E = expm(block)
        assert np.allclose(a, E[6:, 6:].T, rtol=1e-9) and np.allclose(q, E[6:, 6:].T @ E[:6, 6:], rtol=1e-8)


def test_law_draws_have_the_smoothed_mean_and_covariance():
    model, data = problem(4, steps=12)
    s, rng = smooth(model, data), np.random.default_rng(0)
    paths = np.array([draw(model, data, rng) for _ in range(4000)])
    sigma = np.sqrt(np.einsum("kii->ki", s.covariance))
    assert np.abs((paths.mean(axis=0) - s.mean) / sigma).max() < 5 / np.sqrt(4000)
    assert np.allclose(paths.std(axis=0) / sigma, 1, atol=0.06)
    between = np.mean((paths[:, 3, 0] - s.mean[3, 0]) * (paths[:, 8, 1] - s.mean[8, 1]))  # and across time
    _, covariance, _ = batch(model, data)
    assert between == pytest.approx(covariance[3 * 4, 8 * 4 + 1], abs=5 * sigma[3, 0] * sigma[8, 1] / np.sqrt(4000))
