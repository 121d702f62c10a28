"""Prediction of what was held back: exact under the model, and of unit size there."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.estimate.fused.body import AxisData
from asflown.estimate.fused.free_body import FreeBody, FreeLevels
from asflown.estimate.fused.held_back import APART, between_ends, blocks, hold_back, predict
from asflown.estimate.fused.series import BODY_RATE, CONTROL_TORQUE, MOMENTUM, Series, arrange
from asflown.estimate.fused.smooth_torque import gaussian_torque, widened
from asflown.kit.smoother import smooth

BODY = FreeBody(inertia_kgm2=100.0)
LEVELS = FreeLevels(0.02, 40.0, 2e-6, 2e-3, 0.05, 4.0, 6.0, 10.0, 2e-6, 5.0, 0.1)
SECONDS = np.arange(480.0)


def drawn(seed: int) -> list[Series]:
    """One axis of the model itself: rate and momentum every second."""
    rng = np.random.default_rng(seed)
    times, _ = arrange([Series(r, SECONDS, np.zeros(len(SECONDS))) for r in (BODY_RATE, MOMENTUM)])
    m = BODY.smooth_model(LEVELS, times)
    start = np.sqrt(np.diag(m.covariance))
    start[0] = start[5] = 1e-5  # the rate and the rate held; nothing was measured yet, so the model names no size
    x, values = start * rng.standard_normal(len(start)), []
    for k in range(len(SECONDS)):
        if k:
            x = m.A[m.which[k]] @ x + rng.multivariate_normal(np.zeros(len(x)), m.Q[m.which[k]], method="svd")
        values.append(m.H @ x)
    v = np.array(values)
    return [Series(r, SECONDS, v[:, r] + np.sqrt(m.R[r]) * rng.standard_normal(len(v))) for r in (BODY_RATE, MOMENTUM)]


def test_law_prediction_is_the_smoothing_of_the_rest():
    """Pulls agree with a pass in which the held-back samples are missing."""
    series = drawn(0)
    held = blocks(series, [BODY_RATE], 2)
    found = predict(BODY, LEVELS, series, held)
    rest = [Series(s.row, s.seconds[~h], s.values[~h]) for s, h in zip(series, held, strict=True)]
    times, data = arrange(rest, SECONDS)
    model = BODY.smooth_model(LEVELS, times)
    best, h = smooth(model, data), model.H[BODY_RATE]
    at = np.flatnonzero(held[0])
    variance = np.einsum("i,kij,j->k", h, best.covariance[at], h) + model.R[BODY_RATE]
    assert found.seconds.tolist() == SECONDS[at].tolist()
    assert found.pull == pytest.approx((series[0].values[at] - best.mean[at] @ h) / np.sqrt(variance), abs=1e-3)
    assert found.whitened[0] == pytest.approx(found.pull[0], abs=1e-9)  # nothing held back came before it


def test_recovery_held_back_samples_of_the_model_itself_are_unit_normal():
    """Known levels, 4 draws: whitened pulls of unit size and white within 4 sigma of chance; rows apart."""
    pulls, white = [], {BODY_RATE: [], MOMENTUM: []}
    for seed in range(4):
        series = drawn(seed)
        for rows in ([BODY_RATE], [MOMENTUM], [BODY_RATE, MOMENTUM]):
            for turn in range(APART):
                found = hold_back(BODY, series, blocks(series, rows, turn), LEVELS)
                pulls.append(found.pull)
                for r in rows:
                    white[r].append(found.whitened[found.row == r])
    for parts in white.values():
        v = np.concatenate(parts)
        assert len(v) == 4 * 2 * len(SECONDS)
        assert np.mean(v**2) == pytest.approx(1, abs=4 * np.sqrt(2 / len(v)))
        assert np.mean(v[1:] * v[:-1]) == pytest.approx(0, abs=4 / np.sqrt(len(v)))
    assert np.std(np.concatenate(pulls)) == pytest.approx(1, abs=0.15)  # neighbours are nearly equal


def test_recovery_a_whole_channel_with_levels_fitted_to_the_rest():
    series = drawn(1)
    found = hold_back(BODY, series, between_ends(series, BODY_RATE, 120.0))
    assert len(found.pull) == 360 and set(found.row) == {BODY_RATE}
    assert np.std(found.whitened) == pytest.approx(1, abs=0.25)


def test_law_a_scale_that_is_not_learnt_widens_the_band_and_leaves_the_mean():
    """2 % of a commanded torque: the mean stays, and the band's variance gains that of 2 % of the torque's answer."""
    momentum = drawn(2)[1].values
    series = [drawn(2)[0], Series(CONTROL_TORQUE, SECONDS, -np.gradient(momentum))]
    axis = AxisData.of(BODY, LEVELS, series)
    times, data, model = axis.times, axis.data, axis.model
    post = gaussian_torque(axis, 2000, np.random.default_rng(0))
    best = smooth(model, data).mean
    steps = np.repeat(np.arange(len(times.seconds)), np.diff(data.start))
    pushed = best[steps] @ model.H[CONTROL_TORQUE]
    column = 0.02 * np.where(data.row == CONTROL_TORQUE, pushed, 0.0)[:, None]
    wide = widened(post, replace(axis, columns=column), np.random.default_rng(1))
    assert np.array_equal(wide.mean, post.mean) and wide.considered.std() == pytest.approx(1, abs=0.1)
    moved = smooth(model, replace(data, value=column[:, 0])).mean[:, BODY.torque] * BODY.inertia_kgm2
    assert wide.paths.var(axis=0) == pytest.approx(post.paths.var(axis=0) + moved**2, rel=0.25)
