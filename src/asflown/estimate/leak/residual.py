"""Residual momentum: what craft and wheels gained beyond what ordered pulses gave, and how well that is known.

    y = R (I w + h_w) - int R sum_j a_j J_j                  in the axes the body had at the first instant (Feldman & Lee 2006, section IV)

A leak makes it grow, and so do pulses that give more or less than ordered.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ...kit.timeline import NS
from ..firing import check_thrusters
from ..subject import Subject, at_limit, samples_of
from .firing import Geometry, firing_of

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from ...kit.doubts import Doubts

#: A leak shows about two axes, each with a noise of its own to know: its size is known by the readings of both.
AXES_IN_A_LEAK = 2
GUESS_SHARE = 0.5  # one sigma of a number of pulses that is not counted


@dataclass(frozen=True)
class Steps:
    """What a monitor takes, an instant a row (N)."""

    tai_ns: np.ndarray
    residual: np.ndarray  # (N, 3), y [N m s]
    turned: np.ndarray  # (N, 3, 3), body to the axes of y
    body_rate: np.ndarray  # (N, 3)
    in_wheels: np.ndarray  # (N, 3, n), each wheel's momentum, body axes
    ordered: np.ndarray  # (N, j), impulse that pulses ordered since the last instant should have given [N s]
    pulses: np.ndarray  # (N, j), how many those were
    guessed: np.ndarray  # (N, j), relative variance of ``ordered`` where pulses are not counted
    unsure: np.ndarray  # (N, 3, 3), variance of y that firing adds, body axes
    lost: np.ndarray  # (N,), what was ordered or gained since the last instant is not known
    doubts: Doubts

    @property
    def seconds(self) -> np.ndarray:
        return (self.tai_ns - self.tai_ns[0]) / NS

    def first(self, count: int) -> Steps:
        rows = {f.name: getattr(self, f.name)[: max(count, 0)] for f in fields(self) if f.name != "doubts"}
        return replace(self, **rows)

    @cached_property
    def quiet(self) -> np.ndarray:
        """Nothing fired since the last instant, nor is owed."""
        return ~self.lost & (self.ordered == 0).all(axis=1) & (self.unsure == 0).all(axis=(1, 2))


def steps_of(subject: Subject, geometry: Geometry, thrust_N: float) -> Steps:
    """Residual momentum of a whole record.

    Raises BadInput where inertia, spin inertia or channels are missing, or a channel names a thruster that the craft does not have."""
    subject.known_inertia()
    if subject.relative:
        raise BadInput(
            "the wheels' spin inertia is not known, so momentum is not in N m s",
            remedy="Give the craft's file the wheels' spin_inertia.",
        )
    s = samples_of(subject)
    check_thrusters(subject)
    fired, turned = firing_of(subject.telemetry, geometry, thrust_N), s.turned
    kept, given, pulses, unsure, lost = fired.at(s.tai_ns, geometry, thrust_N)
    step, begun = (np.diff(v, axis=0, prepend=v[:1]) for v in (given, pulses))
    middle = _halfway(turned[kept])
    taken = np.cumsum(np.einsum("nij,nj->ni", middle, step @ geometry.columns.T), axis=0)
    limited, of_wheels = at_limit(subject, s.tai_ns[kept])
    axes = np.array([w.axis for w in subject.craft.wheels])
    share = s.stored[kept] @ np.linalg.pinv(axes)  # exact for three wheels; of four, the nearest split
    return Steps(
        tai_ns=s.tai_ns[kept],
        residual=turned[kept].apply(s.momentum[kept]) - taken,
        turned=turned[kept].as_matrix(),
        body_rate=np.zeros_like(s.stored[kept]) if s.rates is None else s.rates[kept],
        in_wheels=share[:, None, :] * axes.T,
        ordered=step,
        pulses=begun,
        guessed=_guessed(begun * ~fired.counted, step, geometry, thrust_N),
        unsure=unsure,
        lost=(np.diff(lost, prepend=lost[:1]) > 0) | limited | np.r_[False, limited[:-1]],
        doubts=s.doubts + fired.doubts + of_wheels,
    )


def _guessed(begun, ordered, geometry: Geometry, thrust_N: float) -> np.ndarray:
    """Relative variance of impulses whose pulses are not counted."""
    impulse = GUESS_SHARE * thrust_N * begun * np.abs(geometry.fall_s - geometry.rise_s)
    return np.divide(impulse, ordered, out=np.zeros_like(ordered), where=ordered > 0) ** 2


def _halfway(turned: Rotation) -> np.ndarray:
    """Mean of each instant's axes and the last one's, (N, 3, 3)."""
    m = turned.as_matrix()
    return 0.5 * (m + np.concatenate([m[:1], m[:-1]]))
