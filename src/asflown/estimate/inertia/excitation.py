"""Which parts of its inertia tensor a body's turns identify (Feldman and Lee eqs 9-11).

Momentum of the body is I w, linear in the six components of I: one row of three for each instant, stacked in a
matrix S (3N x 6).  Which components are identifiable depends on the directions of w alone: one direction gives a row of
the tensor (rank 3, whether it is a body axis or a skew one), two give all but the moment about the normal of their
plane (rank 5, however many turns there are in that plane), three give all (rank 6).

The paper states the condition as "the rank of S is 3Ns"; S has six columns, and it must be 6 (docs/errata.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of
from ...kit.errors import BadInput

#: Where each element of the tensor stands among the six.
_PLACE = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])

#: A direction counts when the rate about it is more than this share of the largest, rms.  In single turns of the
#: simulated flights the rate about the other axes is 0.1 to 0.2 % of the turn's with nominal noise, 0.2 to 0.3 % with
#: double; booms, friction and a wrong inertia in the controller add nothing to see.  2.5 % is eight times that, and an
#: axis of turn that is off by a degree.
FRACTION = 0.025
#: ... and than this many times the noise of a rate sample, which by itself makes 1.
_ABOVE_NOISE = 2.0
#: A component is identifiable where it shares less than this with the directions in the null space, and not identifiable where
#: it shares all but as little.
_FREE = 0.1
_RANK = (0, 3, 5, 6)  # by directions that count
_COUNTED = ("no direction", "one direction", "two directions", "three directions")


@dataclass(frozen=True)
class Excitation:
    """How well a record of body rates shows each part of the inertia tensor.

    ``singular_values``: (6,) of S / sqrt(N), falling [rad/s].  ``identifiable``, ``not_identifiable``: names of components, and
    words for combinations where the directions are not body axes.  ``directions``: (3, 3), rows, body axes, and
    ``rate_rms_rad_s``: (3,), the rate about each, falling."""

    rank: int
    singular_values: np.ndarray
    identifiable: tuple[str, ...]
    not_identifiable: tuple[str, ...]
    directions: np.ndarray
    rate_rms_rad_s: np.ndarray

    @property
    def seen(self) -> np.ndarray:
        """Projector (3, 3) onto the directions that count."""
        counted = self.directions[: _RANK.index(self.rank)]
        return counted.T @ counted

    @property
    def counted(self) -> str:
        """'no direction', 'one direction', …: about how many the body turns."""
        return _COUNTED[_RANK.index(self.rank)]


def excitation(omega_B, sigma_rad_s: float = 0.0) -> Excitation:
    """Rank and singular values of S (Feldman and Lee eq 11) from body rates (N, 3) [rad/s]; rows that are not finite do not count.

    ``sigma_rad_s``: noise of a rate sample, which must not pass for turning.
    Raises BadInput where there is no sample."""
    w = np.asarray(omega_B, float).reshape(-1, 3)
    w = w[np.isfinite(w).all(axis=1)]
    if not len(w):
        raise BadInput("there is no sample of body rates", remedy="Take a record with body_rate_x, _y and _z.")
    square = w.T @ w / len(w)
    values, vectors = np.linalg.eigh(square)
    rms = np.sqrt(np.maximum(values[::-1], 0.0))
    directions = np.array([_pointed(v) for v in vectors.T[::-1]])
    counted = int(np.sum(rms > max(FRACTION * rms[0], _ABOVE_NOISE * sigma_rad_s)))
    singular = np.sqrt(np.maximum(np.linalg.eigvalsh(normal_matrix(square))[::-1], 0.0))
    return Excitation(_RANK[counted], singular, *_identifiable(directions, counted), directions, rms)


def normal_matrix(square, weights=(1.0, 1.0, 1.0)) -> np.ndarray:
    """S^T W S (6, 6) from the sum of w w^T (3, 3): each row of the tensor meets the same rates (Feldman and Lee eqs 10, 11).

    ``weights``: of the momentum about x, y and z."""
    out = np.zeros((6, 6))
    for places, weight in zip(_PLACE, weights, strict=True):
        out[np.ix_(places, places)] += weight * np.asarray(square)
    return out


def _identifiable(directions, counted: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of what is identifiable and of what is not, from the directions (rows) of which the first few count."""
    blind = directions[counted:]
    if not len(blind):
        return ELEMENTS, ()
    # tensors that give no momentum at any rate seen: u v^T + v u^T for u, v across all of these
    hidden = [elements_of(np.outer(u, v) + np.outer(v, u)) for u, v in combinations_with_replacement(blind, 2)]
    basis, _ = np.linalg.qr(np.array(hidden).T)
    share = np.linalg.norm(basis, axis=1)
    known = tuple(n for n, s in zip(ELEMENTS, share, strict=True) if s < _FREE)
    unknown = tuple(n for n, s in zip(ELEMENTS, share, strict=True) if s > np.sqrt(1 - _FREE**2))
    if len(unknown) == len(hidden):
        return known, unknown
    mixed = ", ".join(n for n, s in zip(ELEMENTS, share, strict=True) if s >= _FREE)
    if counted == 2:
        return known, (f"the moment about {named(blind[0])}, which mixes {mixed}",)
    axis = named(directions[0])
    return (
        (*known, f"the moment about {axis} and its products with the axes across"),
        (*unknown, f"both moments and the product across {axis}, which mix {mixed}"),
    )


def named(direction) -> str:
    """'x' for a body axis, else the unit vector in body axes."""
    d = np.asarray(direction, float)
    if np.abs(d).max() > 0.9999:
        return "xyz"[int(np.argmax(np.abs(d)))]
    return "(" + ", ".join(f"{v:.2f}" for v in d + 0.0) + ")"


def _pointed(v) -> np.ndarray:
    """A direction with its largest part positive: of v and -v, always the same."""
    return v * np.sign(v[int(np.argmax(np.abs(v)))])
