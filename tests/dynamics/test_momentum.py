"""Momentum: the paper's wheel figures, and conservation."""

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.dynamics.momentum import external_torque, stored_momentum, wheel_momentum

RPM = 2 * np.pi / 60


def test_published_three_tenths_about_y_turn_the_wheels_by_order_of_ten_rpm():
    """000 section III: 'on the order of 10 rpm per RWA'; recomputed with 0.16 kg m2."""
    wheels = load_craft("cassini@001-drift").at(None).wheels
    axes = np.array([w.axis for w in wheels])
    rpm = np.linalg.solve(axes.T, [0, 0.30, 0]) / 0.16 / RPM
    assert rpm == pytest.approx([14.62, -7.31, -7.31], abs=0.005)
    assert wheel_momentum(axes, [0.16] * 3, [rpm * RPM])[0] == pytest.approx([0, 0.30, 0], abs=1e-12)


def test_law_no_torque_on_a_body_whose_momentum_is_fixed_in_space():
    """H fixed inertially, body turning at w: dH/dt in body axes is -w x H, and the torque is zero."""
    rng = np.random.default_rng(0)
    I_B = np.diag([7000.0, 5000, 3500])
    w, alpha = rng.normal(size=(2, 50, 3)) * 1e-3
    h = rng.normal(size=(50, 3)) * 20
    hdot = -(alpha @ I_B) - np.cross(w, w @ I_B + h)
    assert np.abs(external_torque(I_B, w, alpha, h, hdot)).max() < 1e-12


def test_law_stored_momentum_keeps_its_size_without_torque():
    t = np.arange(0, 600, 1.0)
    w = np.column_stack([1e-3 * np.sin(t / 50), np.full_like(t, 1.1e-3), 2e-4 * t / 600])
    h = stored_momentum(t, np.zeros((len(t), 3)), w, [3000.0, -500, 200])
    assert np.linalg.norm(h, axis=1) == pytest.approx(np.linalg.norm(h[0]), rel=1e-12)


def test_law_stored_momentum_converges_with_the_step():
    """Second order: a quarter of the step leaves a sixteenth of the error."""

    def final(dt):
        t = np.arange(0, 400 + dt / 2, dt)
        u = np.column_stack([np.sin(t / 20), np.cos(t / 35), 0.2 * t / 400])
        w = np.column_stack([0.01 * np.cos(t / 30), np.full_like(t, 0.012), 0.004 * np.sin(t / 25)])
        return stored_momentum(t, u, w, [10.0, -5, 2])[-1]

    best = final(0.01)
    coarse, fine = np.linalg.norm(final(4.0) - best), np.linalg.norm(final(1.0) - best)
    assert 10 < coarse / fine < 25
