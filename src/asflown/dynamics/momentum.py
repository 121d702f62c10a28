"""Angular momentum of a body with wheels, and the torque that its change reveals.

All vectors in body axes, shape (N, 3).  I_B includes the wheels as if they did not spin; wheel
rates are relative to the body.  Sign: h_w is what the wheels hold; the body feels the opposite of
its change.
"""

from __future__ import annotations

import numpy as np


def wheel_momentum(axes_B, spin_inertia_kgm2, wheel_rate) -> np.ndarray:
    """h_w = sum_i a_i J_i rho_i  (000 eq 7 with T = [a_1 a_2 a_3]). [N m s], (N, 3)

    axes_B (n, 3), spin_inertia (n,), wheel_rate (N, n) in rad/s."""
    return np.asarray(wheel_rate) @ (np.asarray(spin_inertia_kgm2)[:, None] * np.asarray(axes_B))


def external_torque(I_B, omega_B, alpha_B, h_w_B, hdot_w_B) -> np.ndarray:
    """Torque about the centre of mass, T = I alpha + dh_w/dt + w x (I w + h_w). [N m]

    000 eqs 1-3, 9 with the terms its eq 6 and 8 leave out."""
    H_B = omega_B @ I_B + h_w_B  # I_B is symmetric
    return alpha_B @ I_B + hdot_w_B + np.cross(omega_B, H_B)


def stored_momentum(time_s, control_torque_B, omega_B, h0_B) -> np.ndarray:
    """Momentum stored by an actuator known only by its torque u on the body: dh/dt = -u - w x h.

    Trapezoidal in u, exact rotation over each step.  Returns h (N, 3) for h(0) = h0_B.  The map is
    affine in h0_B."""
    from scipy.spatial.transform import Rotation

    dt = np.diff(time_s)
    turn = Rotation.from_rotvec(-0.5 * (omega_B[1:] + omega_B[:-1]) * dt[:, None]).as_matrix()
    push = -0.5 * dt[:, None] * (control_torque_B[1:] + np.einsum("nij,nj->ni", turn, control_torque_B[:-1]))
    h = np.empty((len(time_s), 3))
    h[0] = h0_B
    for k in range(len(dt)):
        h[k + 1] = turn[k] @ h[k] + push[k]
    return h


def grown_by(time_s, R, frame: str) -> np.ndarray:
    """What a unit torque about each axis, constant in ``frame`` ('body' or 'inertial'), adds to the momentum since the
    first instant, inertial axes. (N, 3, 3) [s]

    R (N, 3, 3): body to inertial."""
    from scipy.integrate import cumulative_trapezoid

    if frame == "inertial":
        return np.eye(3) * (np.asarray(time_s) - time_s[0])[:, None, None]
    return cumulative_trapezoid(R, time_s, axis=0, initial=0)
