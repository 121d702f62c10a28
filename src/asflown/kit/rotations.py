"""Quaternions and small angles, in one stated convention.

Scalar first, Hamilton product.  R(q) takes body vectors to inertial ones, v_N = R(q_NB) v_B: the
numbers are the same as those of the passive inertial-to-body form.  The algebra is SciPy's.
"""

from __future__ import annotations

import numpy as np
import scipy


def rotation(q_NB) -> scipy.spatial.transform.Rotation:
    """SciPy's rotation for scalar-first quaternions, shape (4,) or (N, 4)."""
    return scipy.spatial.transform.Rotation.from_quat(np.asarray(q_NB, float), scalar_first=True)


def quaternion(r: scipy.spatial.transform.Rotation) -> np.ndarray:
    return r.as_quat(scalar_first=True)


def euler(order: str, angles_rad) -> scipy.spatial.transform.Rotation:
    """Three rotations (N, 3) [rad] in SciPy's order: 'ZYX' about the axes as turned before, 'zyx' about fixed ones.

    'ZYX' with yaw, pitch and roll takes body vectors to those of the frame."""
    return scipy.spatial.transform.Rotation.from_euler(order, np.asarray(angles_rad, float))


def attitude_error(q_commanded, q_estimated) -> np.ndarray:
    """Commanded minus estimated, a small-angle vector in body axes. [rad], shape (..., 3)

    q_c = q_e (x) [1, e/2]: rotating the body by +e brings it to the commanded attitude."""
    return (rotation(q_estimated).inv() * rotation(q_commanded)).as_rotvec()


def rates_between(time_s, q_NB) -> tuple[np.ndarray, np.ndarray]:
    """Mean body rate between successive attitudes. [rad/s]

    Returns the mid times (N-1,) and rates (N-1, 3) in body axes.  q and -q are the same attitude."""
    r = rotation(q_NB)
    step = (r[:-1].inv() * r[1:]).as_rotvec()
    dt = np.diff(time_s)
    # half a step on, the body axes have turned by half the angle: the rate vector is the same in both
    return np.asarray(time_s[:-1]) + dt / 2, step / dt[:, None]


def turned_by(time_s, omega_B) -> scipy.spatial.transform.Rotation:
    """Attitudes (N) from body rates (N, 3) alone, body to the axes it had at the first instant: rates linear between samples.

    Products of neighbours, then of neighbours' products: each attitude is the product of all steps before it."""
    w, dt = np.asarray(omega_B, float), np.diff(time_s)
    steps = 0.5 * (w[1:] + w[:-1]) * dt[:, None]
    r = scipy.spatial.transform.Rotation.from_rotvec(np.vstack([np.zeros(3), steps]))
    reach = 1
    while reach < len(w):
        r = scipy.spatial.transform.Rotation.concatenate([r[:reach], r[:-reach] * r[reach:]])
        reach *= 2
    return r


def lvlh_to_inertial(position_N, velocity_N) -> scipy.spatial.transform.Rotation:
    """LVLH axes (z to the planet, y against the orbit normal, x along the velocity) to inertial.

    position, velocity: (N, 3), any consistent unit."""
    r, v = np.asarray(position_N, float), np.asarray(velocity_N, float)
    z = -r / np.linalg.norm(r, axis=1, keepdims=True)
    y = -np.cross(r, v)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return scipy.spatial.transform.Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2))


def angle_between(a, b) -> np.ndarray:
    """Angles between vectors, (N, 3) each. [rad]"""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(np.multiply(a, b), axis=-1))


#: Directions span a plane, so that a rotation is told by them, where the second singular value is this share of the first.
_SPANS = 0.02


def best_rotation(a, b) -> tuple[scipy.spatial.transform.Rotation, bool]:
    """The rotation that turns vectors b nearest to a, (N, 3) each, by least squares, and whether they tell it.

    Wahba's problem by singular values (Markley 1988).  Vectors of one direction leave the turn about it open: the smallest is given."""
    u, size, v = np.linalg.svd(np.einsum("ni,nj->ij", a, b))
    told = bool(size[1] > _SPANS * size[0])
    if not told:
        x, y = u[:, 0] * size[0], v[0]
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        axis = np.cross(y, x)
        if np.linalg.norm(axis) < 1e-9:  # alike, or opposite: about any axis across
            axis = np.cross(y, np.eye(3)[np.argmin(np.abs(y))])
        return scipy.spatial.transform.Rotation.from_rotvec(angle_between(y, x) * axis / np.linalg.norm(axis)), False
    flip = np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(v)])
    return scipy.spatial.transform.Rotation.from_matrix(u @ flip @ v), True


def words_of(turn: scipy.spatial.transform.Rotation) -> str:
    """A rotation in words: '90 deg about +z, (x, y, z) -> (-y, x, z)'."""
    v = turn.as_rotvec()
    angle = float(np.linalg.norm(v))
    if angle < 1e-9:
        return "0 deg"
    axis, said = v / angle, ""
    k = int(np.argmax(np.abs(axis)))
    about = (
        f"{'+' if axis[k] > 0 else '-'}{'xyz'[k]}" if abs(axis[k]) > 0.998 else "({:.2f}, {:.2f}, {:.2f})".format(*axis)
    )
    M = turn.as_matrix()
    if np.abs(M - np.round(M)).max() < 0.1:
        rows = [
            f"{'-' if row[j] < 0 else ''}{'xyz'[j]}" for row, j in zip(M, np.argmax(np.abs(M), axis=1), strict=True)
        ]
        said = f", (x, y, z) -> ({', '.join(rows)})"
    return f"{np.degrees(angle):.0f} deg about {about}{said}"
