"""The inertia tensor where only the torque of the actuators is known: momentum balance in a frame that turns, with gravity.

    d/dt (R I w) = R (u + 3 mu / r^5  r x I r + T)        R: body to inertial, u: torque of the actuators on the body

Both sides are integrated once and averaged over blocks, so that no rate is differenced.  T, in body axes, is constant
plus once and twice an orbit, as the air's density and the Sun make it.

Where the craft only holds its attitude, u answers outside torques and the noise of the rates as much as it moves the
body, and least squares of one on the other is then wrong in a way its residuals do not show.  What does show it is the
length of the blocks: an answer that changes with it is no answer.  That change is part of the sigma.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.environment import gravity_gradient_regressor
from ...dynamics.rigid_body import ELEMENTS, elements_of, momentum_regressor, tensor_of
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.rotations import rotation
from ...kit.timeline import seconds_since, segments
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ...telemetry.telemetry import BRIDGED
from .excitation import Excitation
from .prior import MOMENT_SHARE, PRODUCT_SHARE, possible, prior_sigma
from .result import Answer, Evidence
from .surroundings import orbit_angle

if TYPE_CHECKING:
    from ...telemetry.telemetry import Telemetry
    from ..subject import Subject

#: Lengths of the blocks over which both sides are averaged; the first gives the answer, all of them its sigma. [s]
BLOCKS_S = (60.0, 120.0, 240.0)
#: Residuals are taken to be independent beyond this: what is not modelled changes over a good part of an orbit. [s]
_ALIKE_S = 1800.0
_FEWEST_ROWS = 20

COMMANDED_TORQUE = Kind(
    "inertia.commanded-torque", Severity.CAUTION,
    "only the commanded torque of the actuators is telemetered: a momentum balance over blocks, with the gravity gradient, is used",
    "Add wheel_rate_<WHEEL> or wheel_momentum_x|y|z.",
)  # fmt: skip
NOT_BY_DATA = Kind(
    "inertia.not-by-data", Severity.CAUTION,
    "the data alone do not identify {elements} to {moment_percent:.0f} % (products to {product_percent:.1f} % of the mean moment): "
    "blocks of {blocks} s give {estimates} kg m2. Their values rest on the craft's own tensor",
    "Take a record with slews.",
)  # fmt: skip


def by_torque(subject: Subject) -> Answer:
    """The balance, with the craft's own tensor as prior.  Raises BadInput where that is not known."""
    I_B = subject.known_inertia()
    found, sigma = balance(subject.telemetry), prior_sigma(I_B)
    known, unknown = identifiable(found, sigma)
    size = np.sqrt(np.diag(found.covariance))
    prior = np.append(size[:6] / sigma, np.zeros(3)) ** 2  # information, in units of the data's own sigmas
    information = np.linalg.inv(found.covariance / np.outer(size, size))
    covariance = np.linalg.inv(information + np.diag(prior))
    centre = np.append(elements_of(I_B), np.zeros(3)) / size
    beta = size * (covariance @ (information @ (found.solution / size) + prior * centre))
    covariance = covariance * np.outer(size, size)
    elements, impossible = possible(beta[:6], np.linalg.inv(covariance[:6, :6]))
    excited = Excitation(
        len(known), np.full(6, np.nan), known, unknown, np.eye(3), np.sqrt(np.mean(found.omega_B**2, axis=0))
    )
    evidence = Evidence(
        found.time_s, found.omega_B, np.cumsum(found.pushed_Nms, axis=0), found.residual_Nms, np.ones(len(found.time_s), bool)
    )  # fmt: skip
    doubts = [*subject.doubts, COMMANDED_TORQUE(), *_not_by_data(found, unknown), *impossible]
    return Answer(
        method="momentum balance",
        elements=elements,
        covariance=covariance[:6, :6],
        by_scale=np.stack([tensor_of(beta[:6]), -tensor_of(beta[:6])]),  # of the torque, and of the rates
        excitation=excited,
        torque_Nm=beta[6:],
        torque_sigma_Nm=np.sqrt(np.diag(covariance)[6:]),
        frame="body",
        evidence=evidence,
        settings={"by_block_kgm2": {f"{b:g}": v for b, v in found.by_block.items()}},
        doubts=doubts,
    )


def _not_by_data(found: Balance, unknown: tuple[str, ...]) -> Doubts:
    if not unknown:
        return Doubts()
    each = "; ".join(
        f"{n} {', '.join(f'{v[k]:.3g}' for v in found.by_block.values())}"
        for k, n in enumerate(ELEMENTS)
        if n in unknown
    )
    blocks = ", ".join(f"{b:g}" for b in found.by_block)
    share = {"moment_percent": 100 * MOMENT_SHARE, "product_percent": 100 * PRODUCT_SHARE}
    return Doubts([NOT_BY_DATA(elements=unknown, blocks=blocks, estimates=each, **share)])


@dataclass(frozen=True)
class Balance:
    """What the momentum balance alone says of six elements and of the constant part of T (9,).

    ``covariance`` (9, 9): from the scores' own scatter over half hours, and how much the answer moves with the length of
    the blocks; ``by_block``: elements (6,) for each length."""

    solution: np.ndarray
    covariance: np.ndarray
    by_block: dict[float, np.ndarray]
    time_s: np.ndarray  # (N,), of each row, from the epoch
    omega_B: np.ndarray  # (N, 3)
    pushed_Nms: np.ndarray  # (N, 3), impulse of the actuators from one block to the next
    residual_Nms: np.ndarray  # (N, 3)


def balance(telemetry: Telemetry) -> Balance:
    """Raises BadInput where a channel is missing, and where too little of the record is without gaps."""
    names = [f"quaternion_{m}" for m in "wxyz"]
    names += [f"{stem}_{a}" for stem in ("body_rate", "control_torque", "orbit_position") for a in AXES]
    for name in names:
        telemetry.channel(name)
    tai_ns, values = together(telemetry, names)
    cadence = int(np.median(np.diff(tai_ns))) if len(tai_ns) > 1 else 0
    angle = orbit_angle(values[:, 10:13])
    stretches = [
        _Stretch.of(seconds_since(tai_ns[s], telemetry.epoch_ns), values[s], angle[s])
        for s in segments(tai_ns, BRIDGED, cadence)
        if s.stop - s.start > 2
    ]
    found = {}
    for block_s in BLOCKS_S:
        rows = [row for s in stretches for row in s.rows(block_s)]
        if len(rows) >= _FEWEST_ROWS:
            found[block_s] = _least_squares(rows)
    if len(found) < 2:
        raise BadInput(
            f"too little of the record is without gaps for a momentum balance over blocks of {BLOCKS_S[0]:g} and {BLOCKS_S[1]:g} s",
            file=telemetry.source or None,
            remedy="Take an orbit or more, with quaternion, rates, torque and position at the same instants.",
        )
    best = found[min(found)]
    spread = np.std([f.solution for f in found.values()], axis=0, ddof=1)
    return Balance(
        best.solution, best.covariance + np.diag(spread**2), {b: f.solution[:6] for b, f in found.items()}, best.time_s,
        best.omega_B, best.pushed_Nms, best.residual_Nms,
    )  # fmt: skip


@dataclass(frozen=True)
class _Stretch:
    """A stretch without gaps: columns of the unknowns and the known side, integrated, inertial axes."""

    time_s: np.ndarray
    R: np.ndarray
    omega_B: np.ndarray
    columns: np.ndarray  # (n, 3, 21): elements, T's constant, and cos, sin of the orbit's angle and of twice it
    pushed: np.ndarray  # (n, 3)

    @classmethod
    def of(cls, t, values, angle) -> _Stretch:
        r = rotation(values[:, :4])
        R, omega, u = r.as_matrix(), values[:, 4:7], values[:, 7:10]
        pull = gravity_gradient_regressor(r.inv().apply(values[:, 10:13]))
        waves = [np.ones_like(angle), *(f(n * angle) for n in (1, 2) for f in (np.cos, np.sin))]
        steady = [np.eye(3) * w[:, None, None] for w in waves]
        columns = -scipy.integrate.cumulative_trapezoid(
            R @ np.concatenate([pull, *steady], axis=2), t, axis=0, initial=0
        )
        columns[:, :, :6] += R @ momentum_regressor(omega)
        return cls(
            t,
            R,
            omega,
            columns,
            scipy.integrate.cumulative_trapezoid(np.einsum("nij,nj->ni", R, u), t, axis=0, initial=0),
        )

    def rows(self, block_s: float):
        """(time, X (3, 21), y (3,), rate) of each pair of neighbouring blocks, axes of the body between them."""
        block = np.floor((self.time_s - self.time_s[0]) / block_s).astype(int)
        edges = np.flatnonzero(np.diff(block, prepend=-1, append=block[-1] + 1))
        spans = [slice(a, b) for a, b in pairwise(edges) if b - a > 0.5 * np.median(np.diff(edges))]
        for one, other in pairwise(spans):
            if block[other.start] == block[one.start] + 1:
                to_body = self.R[other.start].T
                X = to_body @ (self.columns[other].mean(axis=0) - self.columns[one].mean(axis=0))
                y = to_body @ (self.pushed[other].mean(axis=0) - self.pushed[one].mean(axis=0))
                yield float(self.time_s[other.start]), X, y, self.omega_B[one.start : other.stop].mean(axis=0)


def _least_squares(rows) -> Balance:
    """Each axis weighted by its own scatter; covariance from the scores summed over half hours."""
    time_s, X, y, omega = (np.array(column) for column in zip(*rows, strict=True))
    scale, size = np.ones(3), np.ones(X.shape[2])
    for _ in range(4):
        A, b = (X / scale[:, None]).reshape(-1, X.shape[2]), (y / scale).ravel()
        size = np.linalg.norm(A, axis=0)
        size[size == 0] = 1.0
        solution = np.linalg.lstsq(A / size, b, rcond=1e-12)[0] / size
        residual = y - X @ solution
        scale = np.maximum(np.sqrt(np.mean(residual**2, axis=0)), 1e-300)
    A = (X / scale[:, None]) / size
    score = np.einsum("nik,ni->nk", A, residual / scale)
    group = np.floor((time_s - time_s[0]) / _ALIKE_S)
    sums = np.array([score[group == g].sum(axis=0) for g in np.unique(group)])
    flat = A.reshape(-1, X.shape[2])
    bread = np.linalg.pinv(flat.T @ flat, rcond=1e-14, hermitian=True)
    covariance = bread @ (sums.T @ sums) @ bread / np.outer(size, size)
    return Balance(solution[:9], covariance[:9, :9], {}, time_s, omega, y, residual)


def identifiable(found: Balance, sigma: np.ndarray) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Elements that the balance alone knows better than these sigmas (6,), and those that it does not."""
    alone = np.sqrt(np.diag(found.covariance)[:6])
    known = tuple(n for n, s, limit in zip(ELEMENTS, alone, sigma, strict=True) if s < limit)
    return known, tuple(n for n in ELEMENTS if n not in known)
