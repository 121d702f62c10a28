"""Disturbance torque from all channels at once: one smoothing of the loop with a torque in it.

Wheels, body rates and attitude error each see the torque through the same closed loop.  A model of one axis
(``held_body`` where the controller is known, ``free_body`` where it is not) holds that loop, the slow error
of the attitude estimate, and the torque as a random process; sizes, times and noise levels are those of
largest marginal likelihood (``levels``).  Nothing is splined or differenced, a missing sample is a missing
update, and a gap only widens the band.

What the torque may be is a prior: ``edges``, straight lines between corners with a roughness where the data
need one (``corners``); ``matern`` or ``wiener``, a Gaussian process (``smooth_torque``).  What is taken as known
(inertia, gains, spin inertia) is off by an unknown amount, which the band contains, and which the data narrow where
the controller is known.

Each axis is fitted by itself.  Its motion gives the gyroscopic torque w x H and the products of inertia's
share, which a one-axis model would take for a disturbance; a second pass solves with these taken off.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.ensemble import spread
from ...kit.smoother import smooth
from ...telemetry.channels import AXES
from ..subject import INERTIA_SHARE, SPIN_SHARE, Grid, Subject
from .body import AxisData, Body, Known
from .corners import all_candidates, draw_torques, is_slow
from .free_body import FreeBody
from .gather import CannotFuse, Record, gather, needed
from .held_body import HeldBody
from .innovations import Innovations, by_channel, considered_doubts, innovation_doubts
from .levels import AxisFit, fit_doubts, fit_levels, unfitted
from .series import ATTITUDE_ERROR
from .smooth_torque import gaussian_torque, widened
from .suspects import freed
from .turning import COMMAND_SMOOTHED, CommandNotKnown, check_turn

if TYPE_CHECKING:
    from .command import Command
    from .feed import Feed, Foreknown

PRIORS = ("edges", "matern", "wiener")

#: One-sigma uncertainty of what is taken as known: shares, and the loop's delay in seconds.  Gains are software constants, what
#: delivers them is not; a digital loop is late by up to a cycle of 0.125 s.
CONSIDERED = {
    "inertia": INERTIA_SHARE, "spin_inertia": SPIN_SHARE, "kp": 0.005, "kd": 0.005, "delay_s": 0.1, "control_torque": 0.01,
}  # fmt: skip

#: Torques drawn from the posterior.
PATHS = 400
_SEED = 20160913
#: Directions of the inertia's uncertainty that move the torque by less than this share of the largest are left out.
_COUNTS = 1e-3

NOT_ALL_AXES = Kind(
    "fused.gyroscopic-not-taken-off", Severity.CAUTION,
    "w x H and the products of inertia are not taken off, since not all axes have body rates: they are in the torque",
    "Add body_rate_x, _y and _z.",
)  # fmt: skip
LOOP_NOT_USED = Kind(
    "fused.loop-not-used", Severity.SUSPECT,
    "the loop as the craft file describes it is not used, and the actuators' action is taken as measured: that loop does not "
    "explain {channel} about {axis} (correlation of the innovations {correlation:+.2f})",
    "Check inertia and gains, and whether the span holds a commanded motion or a thruster firing.",
)  # fmt: skip
CORNERS_DO_NOT_EXPLAIN = Kind(
    "fused.corners-do-not-explain", Severity.CAUTION,
    "straight lines between corners do not explain the torque about {axis}: a smooth torque is taken instead",
)  # fmt: skip


CHAINS_APART = Kind(
    "fused.chains-apart", Severity.SUSPECT,
    "the chains that look for corners about {axis} do not agree (R-hat {r_hat:.2f}, {draws:.0f} effective draws): other corners "
    "explain the data as well, and the band is widened by that",
    "Use --prior matern to see a smooth torque, or narrow the window with --start and --stop.",
)  # fmt: skip
#: Chains do not agree above this R-hat, or with fewer effective draws.  With the few hundred of a usual event the largest R-hat of many
#: instants is above 1.01 by chance; below this its share of the band is a few percent.
_APART, _FEW = 1.1, 40


@dataclass(frozen=True)
class Fusion:
    """The torque by the fused method, body axes; NaN for axes not asked for.

    ``torque_Nm``, ``sigma_Nm``, ``momentum_Nms``: (M, 3), on the grid; ``paths_Nm``: (K, F, 3), drawn jointly, on the grid or
    one twice as fine.  By axis: ``peak_scales``, by what the spread of drawn peaks is to be multiplied, and ``evidence``.
    ``unexplained``: the doubts about channels that the model does not explain; they are among the doubts."""

    grid: Grid
    torque_Nm: np.ndarray
    sigma_Nm: np.ndarray
    momentum_Nms: np.ndarray
    paths_Nm: np.ndarray
    peak_scales: dict[str, float]
    evidence: dict[str, AxisData]
    loop: str
    unexplained: Doubts
    settings: dict
    doubts: Doubts


@dataclass(frozen=True)
class _Solved:
    """One axis: the torque's posterior at the wanted instants (paths (K, F)), and innovations."""

    mean: np.ndarray
    paths: np.ndarray
    peak_scale: float
    considered: dict[str, tuple[float, float]]  # share off, mean and sigma
    innovations: dict[str, Innovations]
    unexplained: list[Doubt]
    settings: dict
    doubts: list[Doubt]
    data: AxisData


@dataclass(frozen=True)
class _Motion:
    """The craft's motion on the grid, (M, 3), from all axes' smoothed states."""

    rate: np.ndarray
    rate_variance: np.ndarray
    acceleration: np.ndarray
    stored_Nms: np.ndarray
    torque_sigma_Nm: np.ndarray  # (3,), the median over the grid


@dataclass(frozen=True)
class _Coupling:
    """What a model of one axis leaves out, on the grid, (M, 3): w x H and the products of inertia's torque.

    ``variance``: of w x H, by the rates' uncertainty; that of H does not matter.  ``unsure_Nm``: (M, 3, K), by what it is off for one
    sigma of each element of the inertia.  ``beside_Nm``: (3,), one sigma of what the actuators do beside the law;
    ``feed``: torques known beforehand."""

    torque_Nm: np.ndarray
    variance: np.ndarray
    momentum_Nms: np.ndarray
    unsure_Nm: np.ndarray
    beside_Nm: np.ndarray
    feed: Feed | None

    @classmethod
    def of(
        cls, motion: _Motion, I_B: np.ndarray, share: float, command: Command | None, feed: Feed | None, *, whole: bool
    ) -> _Coupling:
        """``share``: one sigma of the inertia; ``whole``: all axes' motion is known; else no torque is taken off."""
        H = motion.rate @ I_B + motion.stored_Nms
        torque, unsure = np.zeros_like(H), np.zeros((*H.shape, 0))
        if whole:
            torque = motion.acceleration @ (I_B - np.diag(np.diag(I_B))) + np.cross(motion.rate, H)
            unsure = _by_inertia(motion, I_B, share)
        variance = motion.rate_variance @ (np.mean(H**2, axis=0) * (1 - np.eye(3)))
        beside = np.zeros(3)
        if command is not None:
            variance = variance + command.variance[1] * np.diag(I_B) ** 2
            torque += command.acceleration * np.diag(I_B) - command.feed_Nm
            beside = command.beside_Nm
        return cls(torque, variance, H, unsure, beside, feed)

    def known(self, grid: Grid, j: int) -> Known | None:
        """The torque about an axis that has to be taken off first; None for none."""
        column, feed = self.torque_Nm[:, j], self.feed
        if feed is None:
            return (lambda t: -np.interp(t, grid.seconds, column)) if np.any(column) else None
        return lambda t: feed.known(j)(t) - np.interp(t, grid.seconds, column)

    def considered(self, grid: Grid, j: int, axis: AxisData) -> np.ndarray:
        """What one sigma of each thing that the coupling takes as known does to an axis's measurements, (M, K)."""
        left, size, _ = np.linalg.svd(self.unsure_Nm[:, j], full_matrices=False)  # a hold's are all alike: one will do
        counts = size > _COUNTS * size.max(initial=0.0)
        torques = (left * size)[:, counts].T
        torques = [np.interp(axis.times.seconds, grid.seconds, c) for c in torques]
        torques += [] if self.feed is None else self.feed.unsure(j, axis.times.seconds)
        moved = [axis.response(c) for c in torques]
        if self.beside_Nm[j] > 0 and isinstance(axis.body, HeldBody):
            moved.append(np.where(axis.channel == ATTITUDE_ERROR, self.beside_Nm[j] / axis.body.stiffness_Nm, 0.0))
        return np.column_stack(moved) if moved else axis.columns


def _by_inertia(motion: _Motion, I_B: np.ndarray, share: float) -> np.ndarray:
    """By what the coupling torque (M, 3, 6) is off for one sigma of each element of the inertia.

    Principal moments are off by the share, principal axes by as many radians: a product by the share of the moments' difference.
    What a moment does to its own axis's acceleration is the axis's own (``Body.sensitivities``)."""
    found = []
    for a in range(3):
        for b in range(a, 3):
            E = np.zeros((3, 3))
            E[a, b] = E[b, a] = share * (I_B[a, a] if a == b else np.hypot(I_B[a, a] - I_B[b, b], I_B[a, b]))
            turned = np.cross(motion.rate, motion.rate @ E)
            found.append(turned if a == b else turned + motion.acceleration @ E)
    return np.stack(found, axis=2)


def fused(
    subject: Subject,
    axes: tuple[int, ...] = (0, 1, 2),
    *,
    prior: str | None = None,
    loop: str | None = None,
    considered: dict[str, float] | None = None,
    seed: int = _SEED,
    foreknown: Foreknown | None = None,
) -> Fusion:
    """The torque about some axes.

    ``prior``: one of PRIORS, or None: edges.  ``loop``: one of
    ``gather.LOOPS``, or None: modelled where that is possible and explains the data no worse than measured.
    ``considered``: sigmas in place of some of CONSIDERED.  ``foreknown``: torques known beforehand, an input of the fit: the torque
    found is the rest.

    Raises CannotFuse where body rates, actuators or inertia are missing and what ``gather`` raises."""
    with needed():
        subject.known_inertia()
    sizes = CONSIDERED | {"inertia": subject.inertia_share} | (considered or {})
    try:
        found = _fused(subject, gather(subject, axes, loop, foreknown=foreknown), axes, prior, sizes, seed)
    except CommandNotKnown as why:
        found = _fused(subject, gather(subject, axes, loop, follow=True, foreknown=foreknown), axes, prior, sizes, seed)
        found = replace(found, doubts=Doubts([COMMAND_SMOOTHED(**why.told), *found.doubts]))
    if loop is not None or found.loop == "measured" or not found.unexplained:
        return found
    other = _fused(subject, gather(subject, axes, "measured", foreknown=foreknown), axes, prior, sizes, seed)
    if len(other.unexplained) >= len(found.unexplained):
        return found
    first = found.unexplained[0]
    return replace(other, doubts=Doubts([LOOP_NOT_USED(**first.about, **first.numbers), *other.doubts]))


def _fused(
    subject: Subject, record: Record, axes, prior: str | None, considered: dict[str, float], seed: int
) -> Fusion:
    I_B, grid = subject.known_inertia(), record.grid
    prior = prior or "edges"
    bodies = {j: _body(subject, record, j, wiener=prior == "wiener") for j in record.series}
    whole, still = len(bodies) == 3, record.still
    if still:  # a turn that counts is seen before the levels are fitted, and need not be fitted twice
        _check_turn(record, _motion(bodies, {j: unfitted(bodies[j], record.series[j]) for j in bodies}, record), I_B)
    feed = record.feed
    fits = {j: fit_levels(bodies[j], record.series[j], None if feed is None else feed.known(j)) for j in bodies}
    motion = _motion(bodies, fits, record)
    if still:
        _check_turn(record, motion, I_B)
    coupling = _Coupling.of(motion, I_B, considered["inertia"], record.command, feed, whole=whole)
    if whole and not record.together:
        fits = _carried(subject, axes, record, motion, fits)
    seeds = np.random.default_rng(seed).spawn(3)
    fine = _finer(grid, prior)
    solved = {}
    for j in axes:
        axis = AxisData.of(bodies[j], fits[j].levels, fits[j].series, fine.seconds)
        solved[j] = _solve(axis, coupling, grid, prior, considered, j, seeds[j])
    torque, sigma, momentum, paths = _columns_of(solved, grid, fine, coupling)
    unexplained = Doubts(d for s in solved.values() for d in s.unexplained)
    found = [None if whole else NOT_ALL_AXES()]
    for j, s in solved.items():
        found += [*fit_doubts(AXES[j], fits[j]), *s.doubts]
    start_s = float(grid.from_epoch(subject.telemetry)[0])
    settings = {
        "prior": prior, "loop": record.loop, **_followed(record.command), "seed": seed, "unexplained_channels": len(unexplained),
        **_settings({AXES[j]: (fits[j], s) for j, s in solved.items()}),
    }  # fmt: skip
    return Fusion(
        grid, torque, sigma, momentum, paths,
        {AXES[j]: s.peak_scale for j, s in solved.items()},
        {AXES[j]: replace(s.data, start_s=start_s) for j, s in solved.items()},
        record.loop, unexplained, settings, record.doubts + found,
    )  # fmt: skip


def _check_turn(record: Record, motion: _Motion, I_B: np.ndarray) -> None:
    check_turn(record.series, motion.rate, I_B, motion.stored_Nms, motion.torque_sigma_Nm)


def _followed(command: Command | None) -> dict:
    if command is None or command.still:
        return {}
    fed = {"gyroscopic": command.gyroscopic, "acceleration": command.acceleration_fed}
    return {"command": command.source, "feed_forward": fed}


def _finer(grid: Grid, prior: str) -> Grid:
    """The grid of candidate corners: twice as fine where the record is short enough, since a true one lies between two."""
    if prior != "edges" or not all_candidates(2 * grid.count - 1):
        return grid
    return Grid(grid.start_ns, grid.step_s / 2, 2 * grid.count - 1)


def _body(subject: Subject, record: Record, j: int, *, wiener: bool) -> Body:
    inertia = float(subject.known_inertia()[j, j])
    if record.loop != "modelled":
        return FreeBody(inertia_kgm2=inertia, wiener=wiener)
    law = subject.controller()
    believed = None if law.inertia is None else law.inertia[j]
    return HeldBody.under(law, inertia, believed, wiener=wiener)


def _motion(bodies: dict[int, Body], fits: dict[int, AxisFit], record: Record) -> _Motion:
    """From one smoothing of each axis under its fitted levels."""
    rate, variance, acceleration, stored = np.zeros((4, record.grid.count, 3))
    sigma = np.full(3, np.inf)
    for j, body in bodies.items():
        axis = AxisData.of(body, fits[j].levels, fits[j].series, record.grid.seconds)
        known = None if record.feed is None else record.feed.known(j)
        axis = axis.without_known(known)
        best, wanted = smooth(freed(axis) if is_slow(axis) else axis.model, axis.data), axis.times.wanted
        x = (best.mean if known is None else best.mean + axis.moved(known(axis.times.seconds)))[wanted]
        F, _ = body.dynamics(axis.levels)
        F[body.torque, body.slope] = 1
        rate[:, j], acceleration[:, j] = x[:, body.RATE], x @ F[body.RATE]
        variance[:, j] = best.covariance[wanted, body.RATE, body.RATE]
        sigma[j] = body.inertia_kgm2 * np.sqrt(np.median(best.covariance[wanted, body.torque, body.torque]))
        if not record.pushed:
            stored[:, j] = record.start_Nms[j] + body.inertia_kgm2 * x[:, body.STORED]
    if (c := record.command) is not None:
        rate, acceleration, stored, variance = (
            rate + c.rate, acceleration + c.acceleration, stored - c.fed_Nms, variance + c.variance[0]
        )  # fmt: skip
    if not (np.isfinite(rate).all() and np.isfinite(acceleration).all() and variance.min() >= 0):
        raise _not_fitted()
    return _Motion(rate, variance, acceleration, stored, sigma)


def _not_fitted() -> CannotFuse:
    return CannotFuse(
        "the model cannot be fitted to this record: its covariance is not positive or not finite",
        remedy="Look for values of impossible size (asflown telemetry check), or use --method momentum.",
    )


def _carried(subject: Subject, axes, record: Record, motion: _Motion, fits: dict[int, AxisFit]) -> dict[int, AxisFit]:
    """The fits with the momentum of unsynchronised wheels read anew, each sample carried by the motion."""
    at = record.grid.seconds

    def stored(t):
        return np.column_stack([np.interp(t, at, motion.stored_Nms[:, j]) for j in range(3)])

    again = {
        j: series[-1]
        for j, series in gather(
            subject, axes, record.loop, stored, follow=record.loop == "modelled" and not record.still
        ).series.items()
    }
    return {
        j: replace(f, series=tuple(again[j] if s.row == again[j].row else s for s in f.series)) for j, f in fits.items()
    }


def _solve(
    whole: AxisData, coupling: _Coupling, grid: Grid, prior: str, considered: dict[str, float], j: int,
    rng: np.random.Generator,
) -> _Solved:  # fmt: skip
    """The torque of axis ``j`` at the wanted instants, the coupling to other axes taken off first."""
    name, axis = AXES[j], whole.without_known(coupling.known(grid, j))
    sizes, columns = _sensitivities(whole, axis, considered)
    columns = np.column_stack([columns, coupling.considered(grid, j, whole)])
    learnt = replace(axis, columns=columns if axis.body.NARROWS else columns[:, :0])
    doubts: list[Doubt] = []
    post = draw_torques(learnt, PATHS, rng) if prior == "edges" else None
    if post is not None and not post.explained:
        post = None
        doubts.append(CORNERS_DO_NOT_EXPLAIN(axis=name))
    if post is None:
        post = gaussian_torque(learnt, PATHS, rng)
    if not axis.body.NARROWS:
        post = widened(post, replace(axis, columns=columns), rng)
    if not (np.isfinite(post.paths).all() and np.isfinite(post.mean).all()):
        raise _not_fitted()
    innovations = by_channel(post.whitened, axis.channel)
    off = {
        n: (s * float(c.mean()), s * float(c.std()))
        for (n, s), c in zip(sizes.items(), post.considered.T, strict=False)
    }
    unexplained = innovation_doubts(name, innovations)
    doubts += unexplained + considered_doubts(name, sizes, post.considered) + _apart(name, post.settings)
    wanted = axis.times.wanted
    return _Solved(
        post.mean[wanted], post.paths[:, wanted], post.peak_scale, off, innovations, unexplained, post.settings, doubts, learnt
    )  # fmt: skip


def _apart(name: str, found: dict) -> list[Doubt]:
    """Whether chains, if there were any, lie apart."""
    draws = min(found.get("effective_bulk", np.inf), found.get("effective_tail", np.inf))
    if found.get("r_hat", 1.0) <= _APART and draws >= _FEW:
        return []
    return [CHAINS_APART(axis=name, r_hat=found["r_hat"], draws=draws)]


def _sensitivities(
    whole: AxisData, axis: AxisData, considered: dict[str, float]
) -> tuple[dict[str, float], np.ndarray]:
    """Sigmas by name, and sensitivities (M, P) of one sigma each, of what is taken as known and moves these measurements.

    ``axis``: less the coupling, ``whole``: with it.  The wheels' scale is in w x H as in their momentum: it counts by the torque alone."""
    found = whole.body.sensitivities(whole, smooth(whole.model, whole.data))
    if axis is not whole and considered["spin_inertia"] > 0:
        found["spin_inertia"] = axis.body.sensitivities(axis, smooth(axis.model, axis.data))["spin_inertia"]
    names = [n for n, column in found.items() if considered[n] > 0 and np.any(column)]
    columns = np.column_stack([considered[n] * found[n] for n in names] or [whole.columns])
    return {n: considered[n] for n in names}, columns


def _columns_of(solved: dict[int, _Solved], grid: Grid, fine: Grid, coupling: _Coupling):
    """Torque, sigma, momentum (M, 3) and paths (K, F, 3), the uncertainty of w x H included; NaN for other axes."""
    torque, sigma, momentum = np.full((3, grid.count, 3), np.nan)
    paths = np.full((PATHS, fine.count, 3), np.nan)
    every = (fine.count - 1) // (grid.count - 1)
    for j, s in solved.items():
        own = spread(s.paths[:, ::every])
        torque[:, j], sigma[:, j] = s.mean[::every], np.sqrt(own**2 + coupling.variance[:, j])
        wider = np.interp(fine.seconds, grid.seconds, sigma[:, j] / own)
        paths[:, :, j] = s.mean + (s.paths - s.mean) * wider
        momentum[:, j] = coupling.momentum_Nms[:, j]
    return torque, sigma, momentum, paths


def _settings(solved: dict[str, tuple[AxisFit, _Solved]]) -> dict:
    return {
        "levels": {a: asdict(f.levels) for a, (f, _) in solved.items()},
        "left_out": {a: f.left_out for a, (f, _) in solved.items()},
        "time_offsets": {a: {n: asdict(o) for n, o in f.offsets.items()} for a, (f, _) in solved.items()},
        "considered": {
            a: {n: {"off": m, "sigma": e} for n, (m, e) in s.considered.items()} for a, (_, s) in solved.items()
        },
        "innovations": {a: {n: asdict(i) for n, i in s.innovations.items()} for a, (_, s) in solved.items()},
        "torque": {a: s.settings for a, (_, s) in solved.items() if s.settings},
    }
