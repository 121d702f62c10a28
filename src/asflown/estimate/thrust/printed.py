"""Feldman & Lee, section V, as printed: thrust by least squares on on-times alone (eqs 14-23), to be divided by R of the pulses.

    I dw + dH + int w x (I w + H) dt = Q diag(F) on-time                                        eqs 15, 17

Z thrusters from the X and Y rows (eqs 18, 19), each by itself.  Y thrusters from the Z row: those of a pair have one
on-time, so their columns are proportional whatever the centre of mass and the rank is 2 of 4; eq 20 says it is because e_X is
small.  Each pair has one thrust then (eq 21; P_YY, P_ZZ are one), all four have one (eq 22), and all eight (eq 23, whose Y
and Z rows are printed corruptly; all of Q is taken).  Pulses are rectangles here: R makes up for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.pulses import moment_matrix
from ...kit.doubts import Doubt, Doubts, Kind, Severity

if TYPE_CHECKING:
    from ..firing import Firings

#: Singular values below this share of the largest are none.
_NONE = 1e-6


Z_NOT_SEPARATED = Kind(
    "thrust.z-thrusters-not-separated", Severity.CAUTION,
    "the X and Y rows do not separate {thrusters} (rank {rank} of {count})", "Use --method joint.",
)  # fmt: skip
PAIRS_NOT_SEPARATED = Kind(
    "thrust.pairs-not-separated", Severity.CAUTION, "the Z row does not separate the pairs that turn the craft about Z",
    "Use --method joint.",
)  # fmt: skip
ONE_THRUST_A_PAIR = Kind(
    "thrust.one-thrust-a-pair", Severity.NOTE,
    "thrusters of a pair about Z have the same on-times, so their columns are proportional and the rank is {rank} of {count}: a "
    "pair is given one thrust",
)  # fmt: skip


@dataclass(frozen=True)
class Printed:
    """Thrusts before R [N], by thruster and by pair; None for what is not separated."""

    single: dict[str, float]
    pairs: dict[tuple[str, ...], float]
    mean_others: float | None  # eq 22
    mean: float  # eq 23
    doubts: Doubts


def balance(f: Firings) -> np.ndarray:
    """Left side of eq 15 at every instant but the first, (N - 1, 3). [N m s]"""
    H = f.momentum
    turning = np.cross(f.rates, H) if f.rates is not None else np.zeros_like(H)
    return (H - H[0] + scipy.integrate.cumulative_trapezoid(turning, f.seconds, axis=0, initial=0))[1:]


def printed_thrust(records: list[Firings], center_m) -> Printed:
    """All records stacked, one set of thrusts; centre of mass (3,) [m] as given, the paper gives none."""
    thrusters = records[0].thrusters
    Q = moment_matrix([t.position for t in thrusters], [t.direction for t in thrusters], center_m)
    V = np.concatenate([balance(f)[~f.at_limit[1:]] for f in records])
    on = np.concatenate([(f.known.on_time_s[1:] - f.known.on_time_s[0])[~f.at_limit[1:]] for f in records])
    U = Q[None] * on[:, None, :]  # (N, 3, j)
    names = [t.name for t in thrusters]
    fired = on[-1] > 0 if len(records) == 1 else (on > 0).any(axis=0)
    along_z = np.array([abs(t.direction[2]) > 0.5 for t in thrusters])
    doubts: list[Doubt] = []
    z = np.flatnonzero(along_z & fired)
    single: dict[str, float] = {}
    if len(z):
        columns = U[:, :2, z].reshape(-1, len(z))
        solved = _solved(columns, V[:, :2].ravel())
        if solved is None:
            doubts.append(Z_NOT_SEPARATED(thrusters=[names[k] for k in z], rank=_rank(columns), count=len(z)))
        else:
            single = {names[k]: float(v) for k, v in zip(z, solved, strict=True)}
    y = np.flatnonzero(~along_z & fired)
    pairs: dict[tuple[str, ...], float] = {}
    mean_others = None
    if len(y):
        groups = _alike(on[:, y], y)
        solved = _solved(np.stack([U[:, 2, g].sum(axis=1) for g in groups], axis=1), V[:, 2])
        if solved is None:
            doubts.append(PAIRS_NOT_SEPARATED())
        else:
            pairs = {tuple(names[k] for k in g): float(v) for g, v in zip(groups, solved, strict=True)}
        mean_others = float(_one(U[:, 2, y].sum(axis=1), V[:, 2]))
        rank = _rank(U[:, 2, y])
        if rank < len(y):
            doubts.append(ONE_THRUST_A_PAIR(rank=rank, count=len(y)))
    return Printed(single, pairs, mean_others, float(_one(U.sum(axis=2).ravel(), V.ravel())), Doubts(doubts))


def _one(u, v) -> float:
    return (u @ v) / (u @ u)


def _rank(columns) -> int:
    size = np.linalg.svd(columns / np.maximum(np.abs(columns).max(axis=0), 1e-300), compute_uv=False)
    return int((size > _NONE * size[0]).sum())


def _solved(columns, v) -> np.ndarray | None:
    return None if _rank(columns) < columns.shape[1] else np.linalg.lstsq(columns, v, rcond=None)[0]


def _alike(on, which) -> list[list[int]]:
    """Thrusters whose on-times are the same throughout, together."""
    groups: list[list[int]] = []
    for k, column in zip(which, on.T, strict=True):
        for g in groups:
            if np.allclose(on[:, np.flatnonzero(which == g[0])[0]], column, rtol=0.02, atol=1e-9):
                g.append(int(k))
                break
        else:
            groups.append([int(k)])
    return groups
