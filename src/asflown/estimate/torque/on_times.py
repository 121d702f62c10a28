"""The torque of the surroundings on a craft that thrusters hold: what momentum and on-times leave (``firing.impulse``), over time.

The torque is a piecewise linear curve whose slope is a Wiener process, so that it may bend anywhere; how much it bends, here and
there, is that for which the record is likeliest.  Thrust and fall time are solved for beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy

from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.timeline import NS
from ...telemetry.channels import AXES
from ..subject import Grid, Subject
from .answer import Answer, Method

if TYPE_CHECKING:
    from ..firing import Gained

_FEWEST, _LONGEST = 20, 2000  # steps, knots
_DRAWS = 300
#: Bends tried first, all alike: from nearly a straight line to one that follows every sample, as a share of the torque's size.
_BENDS = np.geomspace(1e-5, 0.1, 13)
#: Over so long the torque bends alike; rounds of finding how much; a bend is at least this share of the largest, squared.
_ALIKE_S, _ROUNDS, _LEAST = 6.0, 12, 1e-6


@dataclass(frozen=True)
class Smoothed:
    """Torque at knots (M,) [s from the epoch], its covariance, and the unknowns' values in sigmas (m,) with theirs."""

    time_s: np.ndarray
    step_s: float
    torque_Nm: np.ndarray
    unknowns: np.ndarray
    root: np.ndarray  # (M + m, M + m), of the covariance: root^T root

    @property
    def covariance(self) -> np.ndarray:
        """Of torque and unknowns, (M + m, M + m)."""
        return self.root.T @ self.root

    def draws(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Torques from the posterior, (count, M)."""
        return self.torque_Nm + rng.standard_normal((count, len(self.root))) @ self.root[:, : len(self.time_s)]


THRUST_NOT_FOUND = Kind(
    "torque.thrust-not-found", Severity.CAUTION,
    "the record hardly constrains the thrust: the value believed is used, and the torque's scale is as uncertain as that",
    "Take a longer record, with more firings.",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class OnTimes(Method):
    """The surroundings' torque about one axis, where thrusters hold the craft and how long each fired is telemetered."""

    name: ClassVar[str] = "on-times"

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:
        """With draws from the posterior; the impulse between samples is in ``settings``.

        Raises BadInput for several axes, where no thruster fires, where ``gained`` does, and for a record too short or long."""
        source = subject.telemetry.source or None
        if len(axes) != 1:
            raise BadInput("on-times tell the torque about one axis at a time", remedy="Name one (--axis).")
        if not subject.firing:
            raise BadInput(
                "no thruster fires in this record, so on-times tell nothing", file=source, remedy="Use --method fused."
            )
        from ..firing import gained

        j = axes[0]
        g = gained(subject, AXES[j])
        if len(g.impulse_Nms) < _FEWEST:
            raise BadInput(
                f"{len(g.impulse_Nms)} steps between samples of momentum and on-times are too few",
                file=source,
                remedy=f"Take a record of at least {_FEWEST}.",
            )
        s = smoothed(g)
        M = len(s.time_s)
        torque, sigma = np.full((2, M, 3), np.nan)
        torque[:, j] = s.torque_Nm
        sigma[:, j] = np.hypot(np.sqrt(np.diag(s.covariance)[:M]), g.inertia_share * s.torque_Nm)
        rng = np.random.default_rng(1)
        paths = np.full((_DRAWS, M, 3), np.nan)
        paths[:, :, j] = s.draws(_DRAWS, rng) * (1 + g.inertia_share * rng.standard_normal((_DRAWS, 1)))
        thrust = _thrust_found(g, s)
        unsure = thrust and thrust["thrust_sigma_N"] > 0.5 * _thrust_sigma(g)
        return Answer(
            by=self, grid=_grid(subject, s), torque_Nm=torque, sigma_Nm=sigma, paths_Nm=paths, gained=g,
            settings=g.settings | thrust | {"impulses": _impulses(g, s)},
            doubts=Doubts([*g.doubts, THRUST_NOT_FOUND() if unsure else None]),
        )  # fmt: skip


def _grid(subject: Subject, s: Smoothed) -> Grid:
    """The knots as a grid."""
    start_ns = subject.telemetry.epoch_ns + round(float(s.time_s[0]) * NS)
    return Grid(start_ns, s.step_s, len(s.time_s))


def smoothed(g: Gained) -> Smoothed:
    """Posterior of the torque and of what is not known of the thrusters."""
    step = max(1.0, float(np.median(np.diff(g.time_s))) / 2)
    count = int(np.floor((g.time_s[-1] - g.time_s[0]) / step + 1e-9)) + 1
    if count > _LONGEST:
        raise BadInput(
            f"{count} instants are too many for on-times at once",
            remedy="Narrow the span to the flyby with --start and --stop.",
        )
    knots = g.time_s[0] + step * np.arange(count)
    X = np.hstack([areas(g.time_s, knots), -g.columns])
    CX, Cy = g.covariance.solve(X), g.covariance.solve(g.impulse_Nms[:, None])[:, 0]
    N, b = X.T @ CX, X.T @ Cy
    # a level anywhere within ten times what the largest step would need
    size = 10 * float(np.abs(g.impulse_Nms / np.diff(g.time_s)).max())
    D = np.diff(np.eye(count), 2, axis=0) / step**1.5
    near = _nearby(count - 2, _ALIKE_S / step)

    def factored(variance):
        """Root of the precision under bends of these variances (M - 2,)."""
        P = N + np.diag(np.r_[np.zeros(count), np.ones(len(N) - count)])  # the unknowns are in sigmas
        P[:count, :count] += D.T @ (D / variance[:, None])
        P[:2, :2] += np.eye(2) / size**2
        return np.linalg.cholesky(P)

    def likelihood(variance) -> float:
        """Of the record, its logarithm but for a constant."""
        factor = factored(variance)
        # the first two knots and every bend are independent: the determinant is the product of their variances
        explained = np.sum(scipy.linalg.solve_triangular(factor, b, lower=True) ** 2) - np.sum(np.log(variance))
        return 0.5 * float(explained) - float(np.sum(np.log(np.diag(factor))))

    def posterior(variance):
        root = scipy.linalg.solve_triangular(factored(variance), np.eye(len(N)), lower=True)
        return root.T @ (root @ b), root

    variance = max((np.full(count - 2, (share * size) ** 2) for share in _BENDS), key=likelihood)
    for _ in range(_ROUNDS):  # expectation and maximization, the variance alike within _ALIKE_S
        x, root = posterior(variance)
        square = (D @ x[:count]) ** 2 + np.sum((root[:, :count] @ D.T) ** 2, axis=0)
        variance = np.maximum(near @ square, _LEAST * square.max())
    x, root = posterior(variance)
    return Smoothed(knots, step, x[:count], x[count:], root)


def _nearby(count: int, reach: float) -> np.ndarray:
    """Weights (count, count) of a mean over neighbours, falling to none at ``reach``."""
    k = np.arange(count)
    w = np.clip(1 - np.abs(k[:, None] - k) / reach, 0, None)
    return w / w.sum(axis=1, keepdims=True)


def areas(time_s, knots) -> np.ndarray:
    """Integrals between instants (K + 1,) of the hat functions on even knots (M,), (K, M); the last one is held beyond. [s]"""
    step = knots[1] - knots[0]
    z = (np.asarray(time_s)[:, None] - knots) / step
    ramp = np.where(z < 0, 0.5 * np.clip(1 + z, 0, 1) ** 2, 1 - 0.5 * np.clip(1 - z, 0, 1) ** 2)
    ramp[:, -1] = np.where(z[:, -1] > 0, 0.5 + z[:, -1], ramp[:, -1])
    return step * np.diff(ramp, axis=0)


def _impulses(g: Gained, s: Smoothed) -> list[dict]:
    """What the surroundings gave from each sample to the next, with the thrust found; sigma of the samples and of the thrust."""
    M = len(s.time_s)
    value = g.impulse_Nms + g.columns @ s.unknowns
    shared = np.einsum("km,mn,kn->k", g.columns, s.covariance[M:, M:], g.columns)
    sigma = np.sqrt(g.covariance.variance + shared)
    return [
        {"start_s": float(a), "stop_s": float(b), "impulse_Nms": float(v), "sigma_Nms": float(e)}
        for a, b, v, e in zip(g.time_s[:-1], g.time_s[1:], value, sigma, strict=True)
    ]


def _thrust_sigma(g: Gained) -> float:
    """Of the thrust believed. [N]"""
    return (g.thrust_believed_N or 0.0) * (g.thrust_share or 0.0)


def _thrust_found(g: Gained, s: Smoothed) -> dict:
    if "thrust" not in g.names or g.thrust_believed_N is None or g.thrust_share is None:
        return {}
    k, M = g.names.index("thrust"), len(s.time_s)
    found = g.thrust_believed_N * (1 + g.thrust_share * float(s.unknowns[k]))
    return {"thrust_N": found, "thrust_sigma_N": _thrust_sigma(g) * float(np.sqrt(s.covariance[M + k, M + k]))}
