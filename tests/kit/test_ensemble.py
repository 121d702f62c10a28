"""Many columns through one filter: the same as one by one."""

import numpy as np
import pytest

from asflown.kit.ensemble import gains, paths, respond, simulate, smoothed, whiten
from asflown.kit.smoother import Measurements, forward, smooth
from kit.test_smoother import batch, problem


def columns_of(data, count, seed=0):
    return np.column_stack([data.value, np.random.default_rng(seed).normal(size=(len(data.row), count - 1))])


def test_law_whitened_columns_are_the_filters_innovations():
    model, data = problem(3)
    values = columns_of(data, 5)
    found = whiten(gains(model, data), values)
    for k in range(5):
        _, _, _, innovation, variance, _ = forward(model, Measurements(data.start, data.row, values[:, k]))
        assert np.allclose(found[:, k], innovation / np.sqrt(variance), atol=1e-12)


def test_law_a_column_may_be_skipped_while_it_is_zero():
    model, data = problem(5, steps=30)
    values = columns_of(data, 6)
    begin = np.array([0, 0, 5, 5, 12, 29])
    for k, first in enumerate(begin):
        values[: data.start[first], k] = 0
    g = gains(model, data)
    assert np.allclose(whiten(g, values, begin), whiten(g, values), atol=1e-12)


def test_law_smoothed_columns_are_those_of_the_smoother():
    model, data = problem(4)
    values = columns_of(data, 4)
    found = smoothed(gains(model, data), values, [0, 2])
    for k in range(4):
        mean = smooth(model, Measurements(data.start, data.row, values[:, k])).mean
        assert np.allclose(found[:, :, k], mean[:, [0, 2]], atol=1e-11)


def test_law_paths_have_the_smoothed_mean_and_covariance():
    model, data = problem(4, steps=12)
    s, rng = smooth(model, data), np.random.default_rng(0)
    drawn = paths(gains(model, data), np.repeat(data.value[:, None], 4000, axis=1), [0, 1, 2, 3], rng)
    covariance = s.covariance
    sigma = np.sqrt(np.einsum("kii->ki", covariance))
    assert np.abs((drawn.mean(axis=0) - s.mean) / sigma).max() < 5 / np.sqrt(4000)
    assert np.allclose(drawn.std(axis=0) / sigma, 1, atol=0.06)
    between = np.mean((drawn[:, 3, 0] - s.mean[3, 0]) * (drawn[:, 8, 1] - s.mean[8, 1]))  # and across time
    _, joint, _ = batch(model, data)
    assert between == pytest.approx(joint[3 * 4, 8 * 4 + 1], abs=5 * sigma[3, 0] * sigma[8, 1] / np.sqrt(4000))


def test_law_simulated_flights_are_white_to_their_own_filter():
    model, data = problem(6, steps=40)
    _, measured = simulate(model, data, [0], 3000, np.random.default_rng(1))
    w = whiten(gains(model, data), measured)
    assert np.abs(w.mean(axis=1)).max() < 5 / np.sqrt(3000) and np.allclose(w.std(axis=1), 1, atol=0.07)
    assert np.abs(np.corrcoef(w)[0, 1:]).max() < 5 / np.sqrt(3000)


def test_law_a_straight_line_of_torque_is_integrated_exactly():
    """Rate' = T: a ramp of slope 2 gives t^2."""
    from asflown.kit.smoother import Model, discretize

    F = np.array([[0.0, 1, 0], [0, 0, 1], [0, 0, 0]])
    A, Q = discretize(F, np.zeros((3, 3)), [0.5])
    model = Model(A, Q, np.zeros((0, 1, 3, 3)), np.ones((9, 0)), np.zeros(9, int), np.eye(3)[:1], np.ones(1), np.zeros(3), np.eye(3))  # fmt: skip
    data = Measurements(np.arange(10), np.zeros(9, int), np.zeros(9))
    t = 0.5 * np.arange(9)
    assert np.allclose(respond(A, model, data, 1, 2, 2 * t[:, None])[:, 0], t**2, atol=1e-12)
