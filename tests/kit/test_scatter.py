import numpy as np
import pytest

from asflown.kit.scatter import difference_sigma, robust_sigma


def test_recovery_robust_sigma_with_outliers():
    x = np.random.default_rng(1).normal(0, 0.3, (20_000, 2))
    assert robust_sigma(x) == pytest.approx(0.3, rel=0.02)
    x[:200] = 100.0
    assert robust_sigma(x, axis=0) == pytest.approx([0.3, 0.3], rel=0.04)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_recovery_difference_sigma_under_a_slow_signal(order):
    t = np.linspace(0, 1, 20_000)
    assert difference_sigma(np.sin(3 * t) + np.random.default_rng(2).normal(0, 0.3, len(t)), order) == pytest.approx(
        0.3, rel=0.03
    )


def test_only_differences_that_count_are_taken():
    x = np.random.default_rng(3).normal(0, 1, 1000)
    x[500:] *= 50
    assert difference_sigma(x, 2, np.arange(998) < 498) == pytest.approx(1.0, rel=0.1)
    assert np.isnan(difference_sigma(x, 2, np.zeros(998, bool)))
    assert np.isnan(difference_sigma(x[:3], 3))
