"""Whether the wheels are what the craft file says: the momentum of body and wheels under every other reading of them.

A wheel whose axis is given the wrong way round, or two whose channels are exchanged, leave momentum that turns with the body.  In an
hour of nadir pointing most of that passes for a constant torque, for drag or for a dipole; what does not is many times the noise.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.rigid_body import momentum_regressor
from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput
from ...kit.regression import memory
from ..subject import GYRO_BIAS, actuators
from .believed import environment_of, inertia_sigma

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..subject import Samples, Subject

#: Another reading is spoken of where it is likelier by this, in log odds.  Of sound flights none comes to -10, of misread ones all beyond 20.
_LIKELIER = 12.0
_ROUNDS = 5
#: Instants of a record that are looked at, at most.
_MOST = 400

WHEELS_MISREAD = Kind(
    "environment.wheels-misread", Severity.SUSPECT,
    "the momentum of body and wheels is explained far better with {reading} (log odds {log_odds:.0f})",
    "Check the axes of these wheels in the craft file, and the signs and the order of their channels.",
)  # fmt: skip


def misread_wheels(
    y: np.ndarray, Z: np.ndarray, each: np.ndarray, directions: np.ndarray, names: Sequence[str]
) -> Doubt | None:
    """A doubt where another reading of the wheels explains the momentum far better.

    Parameters
    ----------
    y : ndarray, shape (K, 3)
        Momentum of body and wheels, body axes. [N m s]
    Z : ndarray, shape (K, 3, p)
        What one sigma of each unknown would add to it.
    each : ndarray, shape (K, n, 3)
        Momentum of each wheel, body axes. [N m s]
    directions : ndarray, shape (n, 3)
        Momentum of each wheel per unit of its rate.
    names : sequence of str
        Of the wheels.

    Returns
    -------
    Doubt or None
    """
    if not len(names) or len(y) <= 2 * Z.shape[2] / 3:
        return None
    asread = _left(y, Z)
    found = []
    for reading, change in _readings(each, directions, names):
        other = _left(y + change, Z)
        worth = len(y) / np.maximum(asread[1], other[1])
        found.append((0.5 * float(worth @ np.log(asread[0] / other[0])), reading))
    likelier, reading = max(found)
    return WHEELS_MISREAD(reading=reading, log_odds=likelier) if likelier > _LIKELIER else None


def misread_in(subject: Subject, s: Samples) -> Doubt | None:
    """The same of a subject: with what of its surroundings is known, a constant torque, its inertia and its gyros' bias."""
    if s.rates is None or s.attitude is None or subject.inertia_kgm2 is None or subject.relative or not s.each.shape[1]:
        return None
    use = np.unique(np.linspace(0, len(s.tai_ns) - 1, _MOST).round().astype(int))
    t, R = s.seconds[use], s.turned[use].as_matrix()
    try:
        around = environment_of(subject, s.tai_ns[use])
    except BadInput:
        return None
    torques = [np.broadcast_to(np.eye(3), (len(t), 3, 3))]
    direct = [-momentum_regressor(s.rates[use]) * inertia_sigma(subject), _alike(subject.inertia_kgm2, t) * GYRO_BIAS]
    for term in around.terms:
        if term.name == "gravity-gradient":
            direct[0] = direct[0] + _grown(R, t, term.design) * inertia_sigma(subject)
        else:
            torques.append(term.design)
        if term.name == "drag" and around.phase_rad is not None:
            torques += [term.design * f(around.phase_rad)[:, None, None] for f in (np.cos, np.sin)]
    y = s.momentum[use]
    known = around.term("gravity-gradient")
    if known is not None and known.torque_Nm is not None:
        y = y - _grown(R, t, known.torque_Nm[:, :, None])[:, :, 0]
    grown = _grown(R, t, np.concatenate(torques, axis=2))
    most = 10 * float(np.abs(y).max())
    free = most * grown / np.maximum(np.abs(grown).max(axis=(0, 1)), 1e-300)
    Z = np.concatenate([most * np.swapaxes(R, 1, 2), free, *direct], axis=2)
    stored = actuators(subject)[0]
    return misread_wheels(y, Z, s.each[use], np.array([d for _, d in stored]), [_of(c) for c, _ in stored])


def _of(channel) -> str:
    return channel.member if channel.kind.stem == "wheel_rate" else channel.name


def _alike(matrix: np.ndarray, t: np.ndarray) -> np.ndarray:
    return np.broadcast_to(matrix, (len(t), 3, 3))


def _grown(R: np.ndarray, t: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Momentum that torques (N, 3, p) have brought, body axes."""
    return np.swapaxes(R, 1, 2) @ scipy.integrate.cumulative_trapezoid(R @ torque, t, axis=0, initial=0)


def _readings(each: np.ndarray, directions: np.ndarray, names: Sequence[str]) -> Iterator[tuple[str, np.ndarray]]:
    """Other readings, and how each changes the momentum (K, 3)."""
    size = np.linalg.norm(directions, axis=1)
    rate = np.einsum("kni,ni->kn", each, directions) / size**2
    for n, name in enumerate(names):
        yield f"{name} turning the other way", -2 * each[:, n]
    for i, j in combinations(range(len(names)), 2):
        yield f"{names[i]} and {names[j]} exchanged", np.outer(rate[:, i] - rate[:, j], directions[j] - directions[i])
    if len(names) > 1:
        yield "all wheels turning the other way", -2 * each.sum(axis=1)


def _left(y: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Variance and memory of what the unknowns leave of a momentum, (3,) each."""
    floor = 1e-18 * float(np.mean(y**2)) + 1e-300
    variance = np.full(3, float(np.mean(y**2)) + floor)
    for _ in range(_ROUNDS):
        weighted = Z / variance[:, None]
        N = np.einsum("kij,kil->jl", weighted, Z) + np.eye(Z.shape[2])
        left = y - Z @ np.linalg.solve(N, np.einsum("kij,ki->j", weighted, y))
        variance = np.mean(left**2, axis=0) + floor
    return variance, np.array([memory(v - v.mean()) for v in left.T])
