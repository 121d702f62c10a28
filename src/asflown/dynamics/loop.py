"""The wheel controller's closed loop, one axis: how a disturbance torque shows in attitude error.

Cassini's loop (000 section IV, 004 section III): proportional-derivative control on a rate that has
passed a fourth-order low-pass F(s) = w^4 / (s^2 + 2 z w s + w^2)^2.  In a hold,

    e/T = -(1/I) / (s^2 + KD F(s) s + KP KD)                                  (000 eq 11)

with e = commanded minus estimated attitude and T the torque on the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from ..craft.model import WheelController


def filter_section(controller: WheelController) -> np.ndarray:
    """s^2 + 2 z w s + w^2 of the rate filter, highest power first; 1 where there is none."""
    f = controller.rate_filter
    if f is None:
        return np.array([1.0])
    return np.array([1.0, 2 * f.damping * f.natural_frequency, f.natural_frequency**2])


def denominator(controller: WheelController, variant: str = "corrected") -> np.ndarray:
    """Den(s) of 000 eq 11b, coefficients of s^6 … s^0.

    ERR in print (000 eq 11b and 004 eq 4): the s^4 coefficient reads 4 w^2 z^2 + 2 w^2 + 4 KP KD;
    its last term is KP KD.  ``variant='printed'`` gives the coefficient as printed; the effect on
    e(f) is at most 0.02 % at the loop's bandwidth, 0.2 % at 0.1 Hz."""
    section = filter_section(controller)
    kp, kd = controller.kp_per_s, controller.kd_per_s
    both = np.polymul(section, section)
    den = np.polyadd(np.polymul([1.0, 0.0, kp * kd], both), [kd * section[-1] ** 2, 0.0])
    if variant == "printed":
        den[2] += 3 * kp * kd
    return den


def error_per_torque(controller: WheelController, inertia_kgm2: float, variant: str = "corrected"):
    """Numerator and denominator of e/T, the closed loop of 000 eq 11a. [rad / N m]"""
    section = filter_section(controller)
    return -np.polymul(section, section) / inertia_kgm2, denominator(controller, variant)


def wheel_momentum_rate_per_torque(controller: WheelController):
    """Numerator and denominator of (dh/dt)/T: what the wheels take up of a disturbance torque.

    h is the wheel momentum about the axis, dh/dt = -(control torque).  Neglecting I w (000 eq 6)
    takes this for 1; it is 1.32, 1.4 s late, at 1/60 Hz."""
    section = filter_section(controller)
    kp, kd, w4 = controller.kp_per_s, controller.kd_per_s, section[-1] ** 2
    both = np.polymul(section, section)
    return np.polyadd(kp * kd * both, [kd * w4, 0.0]), denominator(controller)


@dataclass(frozen=True)
class SecondOrder:
    """-I e/T = gain / (s^2 + damping s + stiffness), so T = -I/gain (e'' + damping e' + stiffness e)."""

    gain: float
    damping_per_s: float
    stiffness_per_s2: float


def low_order(controller: WheelController) -> SecondOrder:
    """The filter left out (000 eqs 14-16, 004 eq 5)."""
    return SecondOrder(1.0, controller.kd_per_s, controller.kp_per_s * controller.kd_per_s)


def hankel_singular_values(controller: WheelController) -> np.ndarray:
    """Hankel singular values of -I e/T, largest first. [s^2]"""
    return _balanced(controller)[0]


def hankel_order_two(controller: WheelController) -> SecondOrder:
    """Balanced truncation of the sixth-order loop to two states (the way of 004 eqs 9, 10).

    Those equations are not in the transcription; recomputed here.  The truncated numerator has a
    term in s, -0.0117 s against 1.125: a zero at 97 rad/s, dropped."""
    _, A, B, C = _balanced(controller)
    num, den = scipy.signal.ss2tf(A[:2, :2], B[:2], C[:, :2], np.zeros((1, 1)))
    return SecondOrder(float(num[0, 2]), float(den[1]), float(den[2]))


def _balanced(controller: WheelController):
    num, den = error_per_torque(controller, 1.0)
    A, B, C, _ = scipy.signal.tf2ss(-num, den)
    # a companion form is badly scaled: balance it before the Gramians
    scaled, T = scipy.linalg.matrix_balance(A, permute=False)
    A, B, C = scaled, np.linalg.solve(T, B), C @ T
    Lc = _root(scipy.linalg.solve_continuous_lyapunov(A, -B @ B.T))
    Lo = _root(scipy.linalg.solve_continuous_lyapunov(A.T, -C.T @ C))
    U, values, Vt = np.linalg.svd(Lo.T @ Lc)
    to = Lc @ Vt.T / np.sqrt(values)
    back = (U / np.sqrt(values)).T @ Lo.T
    return values, back @ A @ to, back @ B, C @ to


def _root(gramian):
    w, V = np.linalg.eigh((gramian + gramian.T) / 2)
    return V * np.sqrt(np.maximum(w, 0))


def _sampled_section(section: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator in 1/z of w^2 / ``section`` for an input that is linear between samples.

    As scipy.signal's cont2discrete with its method "foh", whose package takes longer to load than this takes to write."""
    A, B, C = np.array([-section[1:], [1.0, 0.0]]), np.array([[1.0], [0.0]]), np.array([[0.0, section[-1]]])
    whole = np.zeros((4, 4))
    whole[:2, :2], whole[:2, 2:3], whole[2, 3] = step_s * A, step_s * B, 1.0
    moved = scipy.linalg.expm(whole)
    A, held, ramp = moved[:2, :2], moved[:2, 2:3], moved[:2, 3:]
    B, D = held - ramp + A @ ramp, float((C @ ramp).item())
    den = np.poly(A)
    return np.poly(A - B @ C) + (D - 1) * den, den


def filtered_rate(controller: WheelController, rate: np.ndarray, step_s: float) -> np.ndarray:
    """F(s) applied to an evenly sampled rate (linear between samples), at rest at its first value."""
    if controller.rate_filter is None:
        return np.array(rate, float)
    num, den = _sampled_section(filter_section(controller), step_s)
    out, first = np.array(rate, float), rate[0]
    banded = np.repeat(den[:, None], len(out), axis=1)
    for _ in range(2):  # den(1/z) y = num(1/z) u, all samples at once
        out = first + scipy.linalg.solve_banded((2, 0), banded, np.convolve(num, out - first)[: len(out)])
    return out
