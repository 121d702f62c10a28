"""Local regression: against a reference, and against what polynomials must give."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from asflown.kit.errors import BadInput
from asflown.kit.regression import local_polynomial, loess, memory, noise_sigma


def reference(x, y, span):
    """scikit-misc's loess with direct evaluation."""
    from skmisc.loess import loess as published

    fit = published(x, y, span=(span + 1e-3) / len(x), degree=2, surface="direct")
    fit.fit()
    return fit.outputs.fitted_values


@pytest.mark.parametrize(("samples", "span"), [(481, 39), (529, 43), (101, 9), (60, 59)])
def test_law_loess_equals_the_reference_on_an_even_record(samples, span):
    x = np.arange(samples, dtype=float)
    y = np.sin(x / 20) + 0.1 * np.random.default_rng(samples).normal(size=samples)
    assert np.abs(loess(y, span) - reference(x, y, span)).max() < 1e-12


def test_law_loess_equals_the_reference_with_samples_missing():
    rng = np.random.default_rng(5)
    x = np.delete(np.arange(1500.0), rng.choice(np.arange(1, 1499), 60, replace=False))
    y = np.sin(x / 20) + 0.1 * rng.normal(size=len(x))
    assert np.abs(local_polynomial(x, y, x, degree=2, neighbors=39).value - reference(x, y, 39)).max() < 1e-12


def test_law_loess_equals_the_reference_on_an_uneven_record():
    rng = np.random.default_rng(3)
    x = np.sort(rng.uniform(0, 100, 300))
    x = x[(x < 40) | (x > 55)]  # a gap
    y = np.sin(x / 10) + 0.1 * rng.normal(size=len(x))
    ours = local_polynomial(x, y, x, degree=2, neighbors=31).value
    assert np.abs(ours - reference(x, y, 31)).max() < 1e-12


@pytest.mark.parametrize("lost", [[], [30, 31, 50, 77, 78, 79]])
def test_law_correlation_over_complete_windows_equals_direct_evaluation(monkeypatch, lost):
    from asflown.kit import regression

    t = np.delete(np.arange(0, 484, 4.0), lost)
    y = np.sin(t / 30) + 1e-6 * t**3
    at = np.arange(0, 481.0)
    fast = local_polynomial(t, y, at, degree=3, half_width=14)
    monkeypatch.setattr(regression, "_complete_windows", lambda *every: None)
    slow = local_polynomial(t, y, at, degree=3, half_width=14)
    assert np.abs(fast.derivatives - slow.derivatives).max() < 1e-12
    assert np.abs(fast.gain - slow.gain).max() < 1e-12


@given(
    st.lists(st.floats(-3, 3), min_size=4, max_size=4),
    st.integers(12, 60),
    st.floats(0.5, 5.0),
    st.integers(0, 2**31),
)
def test_law_a_cubic_is_reproduced_with_its_derivatives(c, n, dt, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(dt * rng.choice([1, 1, 1, 2], n))  # single samples missing
    x = t / t[-1]
    y = c[0] + c[1] * x + c[2] * x**2 + c[3] * x**3
    at = rng.uniform(t[0], t[-1], 20)
    f = local_polynomial(t, y, at, degree=3, half_width=4 * dt)
    u = at / t[-1]
    assert np.allclose(f.value, c[0] + c[1] * u + c[2] * u**2 + c[3] * u**3, atol=1e-6)
    assert np.allclose(f.slope * t[-1], c[1] + 2 * c[2] * u + 3 * c[3] * u**2, atol=1e-3)


def test_law_variance_of_slope_is_what_repeated_noise_shows():
    t, at = np.arange(0, 200, 4.0), np.array([0.0, 50.0, 101.0, 196.0])
    rng = np.random.default_rng(0)
    slopes = [local_polynomial(t, rng.normal(size=50), at, degree=3, half_width=20).slope for _ in range(2000)]
    told = local_polynomial(t, np.zeros(50), at, degree=3, half_width=20).variance([0, 1, 0])
    assert np.std(slopes, axis=0) == pytest.approx(np.sqrt(told), rel=0.06)  # 4 sigma for 2000 draws


def test_recovery_noise_sigma():
    t = np.arange(0, 8000, 4.0)
    y = 5 * np.sin(t / 60) + 0.3 * np.random.default_rng(1).normal(size=len(t))
    assert noise_sigma(t, y, degree=3, half_width=16) == pytest.approx(0.3, rel=0.08)


def test_too_few_samples_is_one_clear_error():
    with pytest.raises(BadInput, match="too few"):
        local_polynomial([0, 1, 2], [0, 0, 0], [1.0], degree=3, half_width=10)


def test_law_the_order_of_the_instants_does_not_matter():
    t, rng = np.arange(200.0), np.random.default_rng(8)
    y, shuffled = rng.normal(size=200), rng.permutation(200)
    straight = local_polynomial(t, y, t, degree=2, neighbors=39)
    mixed = local_polynomial(t, y, t[shuffled], degree=2, neighbors=39)
    assert np.allclose(mixed.derivatives, straight.derivatives[:, shuffled], rtol=0, atol=1e-14)
    assert np.allclose(mixed.gain, straight.gain[shuffled], rtol=0, atol=1e-14)


def test_memory_of_coloured_noise():
    """(1 + keep) / (1 - keep) samples are worth one."""
    for keep in (0.0, 0.5, 0.8):
        found = []
        for seed in range(30):
            e = np.random.default_rng(seed).standard_normal(4000)
            for k in range(1, len(e)):
                e[k] += keep * e[k - 1]
            found.append(memory(e))
        assert np.mean(found) == pytest.approx((1 + keep) / (1 - keep), rel=0.15)
