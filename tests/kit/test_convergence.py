"""Convergence of chains: analytic cases."""

import numpy as np
import pytest
from scipy import stats

from asflown.kit.convergence import convergence, worst


def first_order(correlation: float, chains: int, draws: int, rng) -> np.ndarray:
    """Chains of unit variance whose neighbours correlate."""
    x = rng.standard_normal((chains, draws))
    for k in range(1, draws):
        x[:, k] = correlation * x[:, k - 1] + np.sqrt(1 - correlation**2) * x[:, k]
    return x


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_law_effective_draws_of_a_first_order_process(correlation):
    """Of the mean: N (1 - r) / (1 + r)."""
    found = convergence(first_order(correlation, 4, 20_000, np.random.default_rng(1)))
    assert found.bulk == pytest.approx(80_000 * (1 - correlation) / (1 + correlation), rel=0.1)
    assert found.r_hat < 1.005 and found.tail < 1.1 * 80_000


def test_law_r_hat_of_chains_that_lie_apart():
    """Two pairs of halves a sigma each side of nought: B / W of normal scores, worked out from their distribution's mixture."""
    rng = np.random.default_rng(2)
    chains = rng.standard_normal((4, 5000)) + np.array([[-1.0], [-1.0], [1.0], [1.0]])
    x = np.linspace(-9, 9, 20_001)
    score = stats.norm.ppf(0.5 * (stats.norm.cdf(x + 1) + stats.norm.cdf(x - 1)))
    density = stats.norm.pdf(x - 1)
    mean = np.trapezoid(score * density, x)
    within = np.trapezoid((score - mean) ** 2 * density, x)
    between = mean**2 * 8 / 7  # of eight half chains
    assert convergence(chains).r_hat == pytest.approx(np.sqrt(1 + between / within), rel=0.01)
    assert convergence(chains).bulk < 20


def test_law_r_hat_sees_chains_of_another_width():
    """Means agree, widths do not: the folded draws tell."""
    chains = np.random.default_rng(3).standard_normal((4, 2000)) * np.array([[1.0], [1.0], [1.0], [3.0]])
    assert convergence(chains).r_hat > 1.05
    assert worst([chains, chains / 4]).r_hat == pytest.approx(convergence(chains).r_hat)


def test_a_constant_has_converged():
    assert convergence(np.ones((4, 10))).r_hat == 1.0
