"""The closed loop on paper: its polynomial, its poles, its reductions."""

import numpy as np
import pytest
from scipy import signal

from asflown.dynamics.loop import (
    denominator,
    error_per_torque,
    filtered_rate,
    hankel_order_two,
    hankel_singular_values,
    low_order,
    wheel_momentum_rate_per_torque,
)
from flights import CASSINI

K = CASSINI.wheel_controller


def at(poly, f_hz):
    return np.polyval(poly, 2j * np.pi * f_hz)


def test_law_denominator_is_the_loop_worked_out_block_by_block():
    """theta'' = -KP KD theta - KD f2, f = two low-pass sections on theta': its characteristic polynomial."""
    w, z = K.rate_filter.natural_frequency, K.rate_filter.damping
    A = np.zeros((6, 6))
    A[0, 1] = 1
    A[1, 0], A[1, 4] = -K.kp_per_s * K.kd_per_s, -K.kd_per_s
    A[2, 3], A[3, 2], A[3, 3], A[3, 1] = 1, -(w**2), -2 * z * w, w**2
    A[4, 5], A[5, 4], A[5, 5], A[5, 2] = 1, -(w**2), -2 * z * w, w**2
    assert np.allclose(denominator(K), np.poly(A), rtol=1e-9)


def test_published_denominator_and_its_misprint():
    """000 eq 11b, coefficients recomputed; the printed s^4 coefficient is 3 KP KD too large."""
    exact = [1, 3.744768, 14.496809, 20.645433, 30.517210, 5.389423, 1.059063]
    assert np.allclose(denominator(K), exact, atol=5e-7)
    assert denominator(K, "printed")[2] == pytest.approx(14.602692, abs=5e-7)
    assert np.array_equal(np.delete(denominator(K, "printed"), 2), np.delete(denominator(K), 2))


def test_published_low_order_constants():
    low = low_order(K)
    assert (round(low.damping_per_s, 5), round(low.stiffness_per_s2, 5)) == (0.15548, 0.03529)  # 000 eq 16


def test_published_hankel_reduction():
    """The way of 004 eqs 9, 10; recomputed, since those equations are lost in the transcription."""
    assert np.allclose(hankel_singular_values(K)[:4], [24.737773, 10.553232, 0.039797, 0.022819], atol=1e-6)
    two = hankel_order_two(K)
    assert (round(two.gain, 6), round(two.damping_per_s, 6), round(two.stiffness_per_s2, 6)) == (
        1.125133,
        0.174991,
        0.039661,
    )
    assert 3640.4 / two.gain == pytest.approx(3235, abs=1)


@pytest.mark.parametrize(("f_hz", "error_percent"), [(1 / 120, -0.84), (1 / 60, -3.24), (0.0299, -0.87), (0.05, 11.49)])
def test_published_cost_of_the_low_order_inverse(f_hz, error_percent):
    num, den = error_per_torque(K, 1.0)
    s = 2j * np.pi * f_hz
    low = low_order(K)
    ratio = at(num, f_hz) / at(den, f_hz) * -(s * s + low.damping_per_s * s + low.stiffness_per_s2)
    assert 100 * (abs(ratio) - 1) == pytest.approx(error_percent, abs=0.01)


@pytest.mark.parametrize(
    ("f_hz", "gain", "delay_s"), [(1 / 120, 1.0788, 0.35), (1 / 60, 1.3200, 1.42), (0.0299, 1.6562, 4.26)]
)
def test_published_cost_of_leaving_the_body_out(f_hz, gain, delay_s):
    num, den = wheel_momentum_rate_per_torque(K)
    r = at(num, f_hz) / at(den, f_hz)
    assert abs(r) == pytest.approx(gain, abs=1e-4)
    assert -np.angle(r) / (2 * np.pi * f_hz) == pytest.approx(delay_s, abs=0.005)


def test_law_filtered_rate_is_the_filter_of_the_loop():
    """A sine through it comes out with F(jw)'s gain and phase."""
    f, step = 0.02, 1.0
    t = np.arange(0, 2000, step)
    out = filtered_rate(K, np.sin(2 * np.pi * f * t), step)
    section = [1.0, 2 * K.rate_filter.damping * K.rate_filter.natural_frequency, K.rate_filter.natural_frequency**2]
    F = (section[-1] / at(section, f)) ** 2
    late = t > 500
    # linear interpolation between 1-s samples costs sinc^2(f): 0.1 %
    assert np.allclose(out[late], np.imag(F * np.exp(2j * np.pi * f * t[late])), atol=3e-3)
    assert np.allclose(filtered_rate(K, np.full(50, 3.0), step), 3.0)


def test_law_the_loop_is_stable():
    assert np.all(np.roots(denominator(K)).real < 0)
    assert signal.TransferFunction(*error_per_torque(K, 5226.0)).poles.real.max() < -0.08  # 1/s
