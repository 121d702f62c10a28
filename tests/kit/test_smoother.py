"""The smoother against batch least squares, and with gains that repeat against the full recursions."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.kit.smoother import Measurements, Model, discretize, forward, log_likelihood, score, smooth


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


def regular(steps=2400, lost=()):
    """A loop of one body: position every step, rate every second, momentum every fourth; 300 steps dark."""
    rng = np.random.default_rng(7)
    F = np.array([[0.0, 1, 0, 0], [-0.04, -0.3, 0, 1], [0.04, 0.3, 0, 0], [0, 0, 0, -0.05]])
    A, Q = discretize(F, np.diag([0, 1e-4, 1e-4, 1e-2]), [0.5, 1.0])
    start, row = [0], []
    for k in range(steps):
        dark = 900 <= k < 1200
        row += [r for r, every in enumerate((1, 2, 4)) if k % every == 0 and not dark and (k, r) not in lost]
        start.append(len(row))
    H = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0]])
    driven = np.zeros((1, 2, 4, 4))
    driven[0, :, 3, 3] = 0.01
    row, R = np.array(row), np.array([1e-2, 1e-3, 1e-2])
    which = (np.arange(steps) % 4 == 3).astype(int)
    model = Model(A, Q, driven, np.ones((steps, 1)), which, H, R, np.zeros(4), np.diag([1.0, 1, 100, 1]))
    return model, Measurements(np.array(start), row, np.sqrt(R[row]) * rng.normal(size=len(row)))


def without_repeats(model):
    """The same model, every step of a kind of its own: no gains can be reused."""
    kinds = model.which
    return replace(
        model, A=model.A[kinds], Q=model.Q[kinds], driven=model.driven[:, kinds], which=np.arange(len(kinds))
    )


@pytest.mark.parametrize("lost", [(), ((1500, 0), (1501, 0), (1600, 2)), ((2398, 1), (3, 0))])
def test_law_repeated_gains_equal_the_full_recursions(lost):
    model, data = regular(lost=lost)
    fast, full = smooth(model, data), smooth(without_repeats(model), data)
    assert len(np.unique(fast.case)) < 0.7 * len(fast.case) and len(np.unique(full.case)) == len(full.case)
    assert log_likelihood(model, data) == pytest.approx(log_likelihood(without_repeats(model), data), rel=1e-10)
    assert fast.log_likelihood == pytest.approx(full.log_likelihood, rel=1e-10)
    sigma = np.sqrt(np.einsum("kii->ki", full.covariance))
    assert np.abs((fast.mean - full.mean) / sigma).max() < 1e-9
    assert np.abs((fast.covariance - full.covariance) / sigma[:, :, None] / sigma[:, None]).max() < 1e-9
    assert np.abs(fast.whitened - full.whitened).max() < 1e-9
    for a, b in zip(forward(model, data), forward(without_repeats(model), data), strict=True):
        assert np.allclose(a, b, rtol=1e-9, atol=1e-9 * np.abs(b).max())


def test_law_a_changed_scale_ends_the_repeats():
    model, data = regular()
    scale = model.scale.copy()
    scale[500:600] = 9.0
    changed = replace(model, scale=scale)
    fast, full = smooth(changed, data), smooth(without_repeats(changed), data)
    assert np.allclose(fast.covariance, full.covariance, rtol=1e-9, atol=1e-12)
    assert np.allclose(fast.mean, full.mean, rtol=1e-9, atol=1e-10)
    assert fast.covariance[550, 3, 3] > 1.5 * smooth(model, data).covariance[550, 3, 3]


def test_law_innovations_of_data_from_the_model_are_white():
    rng = np.random.default_rng(0)
    n = 2
    A, Q = discretize(np.array([[0.0, 1], [0, 0]]), np.diag([0.0, 1.0]), [1.0])
    N = 3000
    x, y = np.zeros(n), []
    L = np.linalg.cholesky(Q[0])
    for k in range(N):
        if k:
            x = A[0] @ x + L @ rng.normal(size=n)
        y.append(x[0] + 0.1 * rng.normal())
    model = Model(
        A, Q, np.zeros((0, 1, n, n)), np.ones((N, 0)), np.zeros(N, int), np.array([[1.0, 0]]), np.array([0.01]),
        np.zeros(n), np.eye(n),
    )  # fmt: skip
    s = smooth(model, Measurements(np.arange(N + 1), np.zeros(N, int), np.array(y)))
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


def test_law_each_measurement_against_all_the_others():
    """As found by leaving it out and predicting it."""
    model, data = problem(2)
    s = smooth(model, data)
    step = np.searchsorted(data.start, np.arange(len(data.row)), side="right") - 1
    for i in (0, 7, len(data.row) - 1):
        keep = np.arange(len(data.row)) != i
        start = data.start - (data.start > i)
        mean, covariance, _ = batch(model, Measurements(start, data.row[keep], data.value[keep]))
        n, h = len(model.mean), model.H[data.row[i]]
        at = slice(step[i] * n, (step[i] + 1) * n)
        sigma = np.sqrt(h @ covariance[at, at] @ h + model.R[data.row[i]])
        assert s.alone[i] == pytest.approx((data.value[i] - h @ mean[at]) / sigma, rel=1e-8)


@pytest.mark.parametrize("steps", [25, 2000], ids=["full recursions", "gains that repeat"])
def test_law_the_score_is_the_likelihoods_slope(steps):
    """By A, Q, R and the first covariance, along a random direction of each."""
    rng = np.random.default_rng(3)
    model, data = problem(1, drives=0)
    if steps > 25:  # every second step measured the same: both passes settle
        start = np.arange(steps + 1)
        model = replace(model, which=np.zeros(steps, int), scale=np.empty((steps, 0)))
        data = Measurements(start, np.arange(steps) % 2, rng.normal(size=steps))
    found = score(model, data)
    assert found.log_likelihood == pytest.approx(log_likelihood(model, data), rel=1e-12)

    def symmetric(shape):
        x = rng.normal(size=shape)
        return x + np.swapaxes(x, -1, -2)

    for change in (
        {"A": rng.normal(size=model.A.shape)}, {"Q": symmetric(model.Q.shape)}, {"R": rng.normal(size=2)},
        {"covariance": symmetric(model.covariance.shape)},
    ):  # fmt: skip
        ((name, d),) = change.items()
        step = 1e-6
        sides = [replace(model, **{name: getattr(model, name) + s * step * d}) for s in (1, -1)]
        slope = (log_likelihood(sides[0], data) - log_likelihood(sides[1], data)) / (2 * step)
        assert found.along(sides[1], sides[0]) / (2 * step) == pytest.approx(slope, rel=1e-4, abs=1e-4), name
