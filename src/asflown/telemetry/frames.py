"""Attitudes in other axes than they are said to be in: the quaternion against the body rates, the commanded one against the quaternion.

How else they may be meant is tried and named; where nothing fits, that is said.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kit.rotations import (
    angle_between,
    attitude_error,
    best_rotation,
    lvlh_to_inertial,
    quaternion,
    rotation,
    words_of,
)
from .channels import AXES
from .findings import COMMAND_APART, NO_READING, OTHER_FRAME

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..kit.doubts import Doubt

#: Scalar-first quaternions (N, 4) as they are meant, where they are not what their columns say.
READINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "its conjugate": lambda q: q * np.array([1.0, -1.0, -1.0, -1.0]),
    "its scalar-last reading": lambda q: q[:, [3, 0, 1, 2]],
    "its scalar-first reading": lambda q: q[:, [1, 2, 3, 0]],
}


#: Axes further apart than this are other ones: mountings are known to a degree, and a gyro's bias in low orbit makes some more. [rad]
_OTHER = np.radians(6.0)
#: A turn into other axes is named where it takes away this share of the squared misfit, and nothing fits where all leave the second.
_MENDED, _LEFT = 0.75, 0.5
#: Slower mean rates may be a gyro's bias. [rad/s]
_TURNING = 3e-4
#: Means over so many blocks, which have hardly any noise.
_BLOCKS = 30

#: An attitude commanded is far from the one held beyond this; a reading explains it within the second. [rad]
_FAR, _NEAR = np.radians(15.0), np.radians(3.0)
#: Attitude errors of this size are compared in direction; quaternions make them opposite below minus this correlation. [rad]
_SEEN, _OPPOSITE = 2e-6, 0.8
_FEWEST = 10


def readings_of(q: np.ndarray, orbit: tuple[np.ndarray, np.ndarray] | None) -> dict[str, np.ndarray]:
    """Other readings of quaternions (N, 4), the conjugate first; ``orbit``: position and velocity, (N, 3) each, or None."""
    made = {words: read(q) for words, read in READINGS.items()}
    if orbit is not None:
        made["an attitude relative to the orbit's axes (LVLH)"] = quaternion(lvlh_to_inertial(*orbit) * rotation(q))
    return made


def against_rates(rate: np.ndarray, w: np.ndarray) -> Doubt | None:
    """Whether the quaternion turns about other axes than the body rates do.

    ``rate``, ``w``: of the quaternion and of the gyros at the same instants, (M, 3).  In means over blocks, and up to a positive
    factor: a wrong unit is no other frame."""
    if len(w) < _BLOCKS:
        return None
    r, g = (np.array([p.mean(axis=0) for p in np.array_split(x, _BLOCKS)]) for x in (rate, w))
    size = float(np.sum(g**2))
    if np.sqrt(size / _BLOCKS) < _TURNING:
        return None
    declared = _misfit(g, r)
    turn, told = best_rotation(g, r) if np.any(r) else (rotation([1.0, 0, 0, 0]), True)
    best = _misfit(g, turn.apply(r))
    if turn.magnitude() > _OTHER and best < (1 - _MENDED) * declared and best < _LEFT * size:
        by = words_of(turn) + ("" if told else ", or any turn more about that axis: the body turns about one alone")
        return OTHER_FRAME(turn=by, left_percent=100 * np.sqrt(best / size))
    if min(declared, best) > _LEFT * size:
        rms = [float(np.sqrt(np.mean(np.sum(x**2, axis=1)))) for x in (g, r)]
        return NO_READING(rates_rad_s=rms[0], quaternion_rad_s=rms[1])
    return None


def _misfit(w: np.ndarray, rate: np.ndarray) -> float:
    size = float(np.sum(rate**2))
    factor = max(0.0, float(np.sum(w * rate))) / size if size > 0 else 0.0
    return float(np.sum((w - factor * rate) ** 2))


def commanded_doubt(q: np.ndarray, q_c: np.ndarray, told: np.ndarray | None, orbit) -> Doubt | None:
    """Whether the commanded attitude contradicts the one held, or its error the one telemetered.

    ``q``, ``q_c``: (N, 4), scalar first; ``told``: the attitude error telemetered at the same instants, (N, 3), or None; ``orbit``:
    position and velocity there, (N, 3) each, or None."""
    if len(q) < _FEWEST:
        return None
    error = attitude_error(q_c, q)
    names = [f"commanded_quaternion_{m}" for m in "wxyz"]
    off = float(np.median(np.linalg.norm(error, axis=1)))
    if off < _FAR:
        return _against_error(names, error, told)
    lefts = {words: _median_angle(other, q) for words, other in readings_of(q_c, orbit).items()}
    nearest = min(lefts, key=lambda k: lefts[k])
    if lefts[nearest] < _NEAR:
        how = f"it fits the quaternion to {np.degrees(lefts[nearest]):.2g} degrees as {nearest}"
    else:
        apart = rotation(q_c).inv() * rotation(q)
        mean = apart.mean()
        scatter = float(np.median((mean.inv() * apart).magnitude()))
        how = (
            f"it would fit to {np.degrees(scatter):.2g} degrees if its body axes were turned by {words_of(mean)}"
            if scatter < _NEAR
            else "it fits under no reading"
        )
    return COMMAND_APART(channels=names, off_deg=float(np.degrees(off)), how=how)


def _median_angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.median(np.linalg.norm(attitude_error(a, b), axis=1)))


def _against_error(names: list[str], error: np.ndarray, told: np.ndarray | None) -> Doubt | None:
    """The error between the quaternions against the one telemetered."""
    if told is None:
        return None
    sizes = [float(np.sqrt(np.mean(np.sum(x**2, axis=1)))) for x in (error, told)]
    if min(sizes) < _SEEN:
        return None
    alike = float(np.sum(error * told)) / (len(error) * sizes[0] * sizes[1])
    if alike > -_OPPOSITE:
        return None
    names = [*names, *(f"attitude_error_{a}" for a in AXES)]
    how = "its error against the quaternion is opposite to the attitude error telemetered (commanded minus estimated)"
    return COMMAND_APART(channels=names, off_deg=float(np.degrees(np.median(angle_between(error, told)))), how=how)
