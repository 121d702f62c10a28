"""Disturbance torque from all channels at once: one smoothing of the loop with a torque in it.

Wheels, body rates and attitude error each see the torque through the same closed loop.  A model of one axis
(``latent_loop`` where the controller is known, ``latent_free`` where it is not) holds that loop, the slow error
of the attitude estimate, and the torque as a random process; sizes, times and noise levels are those of
largest marginal likelihood (``levels``).  Nothing is splined or differenced, a missing sample is a missing
update, and a gap only widens the band.

What the torque may be is a prior: ``edges``, straight lines between corners with a roughness where the data
ask for one (``corners``); ``matern`` or ``wiener``, a Gaussian process (``curves``).  What is taken as known
(inertia, gains, spin inertia) is off by an unknown amount, which the band contains, and which the data narrow where
the controller is known.

Each axis is fitted by itself.  Its motion gives the gyroscopic torque w x H and the products of inertia's
share, which a one-axis model would take for a disturbance; a second pass solves with these taken off.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from ...kit.ensemble import spread
from ...kit.errors import BadInput
from ...kit.smoother import Measurements, smooth
from ...telemetry.channels import AXES
from ..subject import Grid, Subject
from .body import Body, without_known
from .corners import COARSEST_S, draw_torques, spacing_s
from .free_body import FreeBody
from .gather import Record, gather
from .held_body import HeldBody
from .innovations import Innovations, by_channel, considered_doubts, innovation_doubts
from .levels import AxisFit, fit_doubts, fit_levels
from .series import Times, arrange, channel_of
from .smooth_torque import gaussian_torque, widened
from .whitening import AxisData

PRIORS = ("edges", "matern", "wiener")

#: One-sigma uncertainty of what is taken as known: shares, and the loop's delay in seconds.  Tensors estimated in
#: flight differ from the ground's by 0.2 to 1.3 % (001 Table 1, Ixx and Iyy), wheels' by their rounding; gains are
#: software constants, what delivers them is not; a digital loop is late by up to a cycle of 0.125 s.
CONSIDERED = {"inertia": 0.01, "spin_inertia": 0.0025, "kp": 0.005, "kd": 0.005, "delay_s": 0.1, "control_torque": 0.01}

#: Torques drawn from the posterior.
PATHS = 400
_SEED = 20160913


@dataclass(frozen=True)
class Solved:
    """One axis: its fit, the torque's posterior on the grid (paths (K, M)), and what prediction leaves."""

    fit: AxisFit
    mean: np.ndarray
    paths: np.ndarray
    considered: dict[str, tuple[float, float]]  # share off, mean and sigma
    innovations: dict[str, Innovations]
    settings: dict
    doubts: list[str]
    data: AxisData


@dataclass(frozen=True)
class Motion:
    """What the craft does, on the grid, (M, 3), from all axes' smoothed states."""

    rate: np.ndarray
    rate_variance: np.ndarray
    acceleration: np.ndarray
    stored_Nms: np.ndarray


def fused(
    subject: Subject,
    prior: str | None = None,
    axes: tuple[int, ...] = (0, 1, 2),
    loop: str | None = None,
    considered: dict[str, float] | None = None,
    seed: int = _SEED,
):
    """Returns grid, torque (M, 3), sigma, momentum, settings, doubts, paths (K, M, 3), axis -> AxisData; NaN for axes not asked for.

    ``prior``: one of PRIORS, or None: edges, but matern in a record too long for it.  ``loop``: one of
    records.LOOPS, or None: modelled where it can be.  ``considered``: in place of some of CONSIDERED.

    Raises BadInput where body rates, actuators or inertia are missing, for edges in a record of more than 100
    minutes (at 1 s), and what ``records.gather`` raises."""
    known = CONSIDERED | (considered or {})
    I_B = subject.known_inertia()
    record = gather(subject, axes, loop)
    doubts = list(record.doubts)
    too_long = _too_long_for_corners(record.grid)
    if prior == "edges" and too_long:
        raise BadInput(too_long, remedy="Narrow it with --start and --stop, or use --prior matern.")
    if prior is None:
        prior = "matern" if too_long else "edges"
        doubts += [f"{too_long}: a smooth torque is taken, which rounds sharp ones"] if too_long else []
    bodies = {j: _body(subject, record, I_B[j, j], prior == "wiener") for j in record.series}
    fits = {j: fit_levels(bodies[j], record.series[j]) for j in bodies}
    motion = _motion(bodies, fits, record)
    H = motion.rate @ I_B + motion.stored_Nms
    coupling = np.zeros_like(H)
    if len(bodies) == 3:
        products = I_B - np.diag(np.diag(I_B))
        coupling = motion.acceleration @ products + np.cross(motion.rate, H)
        fits = _carried(subject, axes, record, motion, fits)
    else:
        doubts.append(
            "w x H and the products of inertia are not taken off, since not all axes have body rates: they are in the torque"
        )
    # of w x H: the size of H is what matters
    turning = motion.rate_variance @ (np.mean(H**2, axis=0) * (1 - np.eye(3)))
    seeds = np.random.default_rng(seed).spawn(3)
    torque, sigma, momentum = np.full((3, record.grid.count, 3), np.nan)
    fine = _finer(record.grid, prior)
    paths = np.full((PATHS, fine.count, 3), np.nan)
    solved = {}
    for j in axes:
        s = _solve(bodies[j], fits[j], fine, record.grid, coupling[:, j], prior, known, AXES[j], seeds[j])
        solved[AXES[j]] = s
        every = (fine.count - 1) // (record.grid.count - 1)
        own = spread(s.paths[:, ::every])
        torque[:, j], sigma[:, j] = s.mean[::every], np.sqrt(own**2 + turning[:, j])
        wider = np.interp(fine.seconds, record.grid.seconds, sigma[:, j] / own)
        paths[:, :, j] = s.mean + (s.paths - s.mean) * wider
        momentum[:, j] = H[:, j]
        doubts += s.doubts
    unexplained = [d for a, s in solved.items() for d in innovation_doubts(a, s.innovations)]
    if unexplained and loop is None and record.loop == "modelled":
        *answer, other_settings, others, drawn, data = fused(subject, prior, axes, "measured", considered, seed)
        if other_settings["unexplained_channels"] < len(unexplained):
            instead = f"the loop as the craft file describes it is not used, the actuators' action is taken as measured: {unexplained[0]}"
            return (*answer, other_settings, [instead, *others], drawn, data)
    settings = {
        "prior": prior, "loop": record.loop, "seed": seed, "unexplained_channels": len(unexplained), **_settings(solved)
    }  # fmt: skip
    start_s = float(record.grid.from_epoch(subject.telemetry)[0])
    data = {a: replace(s.data, start_s=start_s) for a, s in solved.items()}
    return record.grid, torque, sigma, momentum, settings, doubts, paths, data


def _too_long_for_corners(grid: Grid) -> str:
    """What there is against looking for corners; '' where there is nothing."""
    duration = float(grid.seconds[-1])
    if spacing_s(duration, grid.step_s) <= max(COARSEST_S, grid.step_s):
        return ""
    return f"the record of {duration:.0f} s is too long to look for corners in"


def _finer(grid: Grid, prior: str) -> Grid:
    """The grid of candidate corners: twice as fine where the record is short enough, since a true one lies between two."""
    if prior != "edges" or spacing_s(float(grid.seconds[-1]), grid.step_s / 2) > grid.step_s / 2 * (1 + 1e-9):
        return grid
    return Grid(grid.start_ns, grid.step_s / 2, 2 * grid.count - 1)


def _body(subject: Subject, record: Record, inertia_kgm2: float, wiener: bool) -> Body:
    if record.loop == "modelled":
        return HeldBody.under(subject.controller(), inertia_kgm2, wiener=wiener)
    return FreeBody(inertia_kgm2=inertia_kgm2, wiener=wiener)


def _motion(bodies: dict[int, Body], fits: dict[int, AxisFit], record: Record) -> Motion:
    """From one smoothing of each axis under its fitted levels."""
    rate, variance, acceleration, stored = np.zeros((4, record.grid.count, 3))
    for j, body in bodies.items():
        times, data = arrange(fits[j].series, record.grid.seconds)
        best = smooth(body.smooth_model(fits[j].levels, times), data)
        x = best.mean[times.wanted]
        F, _ = body.dynamics(fits[j].levels)
        F[body.torque, body.slope] = 1
        rate[:, j], acceleration[:, j] = x[:, body.RATE], x @ F[body.RATE]
        variance[:, j] = best.covariance[times.wanted, body.RATE, body.RATE]
        if not record.pushed:
            stored[:, j] = record.start_Nms[j] + body.inertia_kgm2 * x[:, body.STORED]
    sound = np.isfinite(rate).all() and np.isfinite(acceleration).all() and variance.min() >= 0
    if not sound:
        raise _lost()
    return Motion(rate, variance, acceleration, stored)


def _lost() -> BadInput:
    return BadInput(
        "the model cannot be fitted to this record: its covariance lost its meaning",
        remedy="Look for values of impossible size (asflown telemetry check), or use --method momentum.",
    )


def _carried(subject: Subject, axes, record: Record, motion: Motion, fits):
    """The fits with the momentum of unsynchronised wheels read anew, each sample carried by the motion."""
    if record.together:
        return fits
    at = record.grid.seconds

    def stored(t):
        return np.column_stack([np.interp(t, at, motion.stored_Nms[:, j]) for j in range(3)])

    again = {j: series[-1] for j, series in gather(subject, axes, record.loop, stored).series.items()}
    return {
        j: replace(f, series=tuple(again[j] if s.row == again[j].row else s for s in f.series)) for j, f in fits.items()
    }


def _solve(
    body: Body,
    fit: AxisFit,
    fine: Grid,
    grid: Grid,
    coupling: np.ndarray,
    prior: str,
    considered: dict[str, float],
    axis: str,
    rng,
) -> Solved:
    """The torque of one axis at the ``fine`` instants; ``coupling`` (M,), at those of ``grid``, is taken off first."""
    times, whole = arrange(fit.series, fine.seconds)

    def known(t):
        return -np.interp(t, grid.seconds, coupling)

    data = without_known(body, fit.levels, times, whole, known if np.any(coupling) else None)
    names, columns = _columns(body, fit, times, whole, considered)
    learnt = columns if body.NARROWS else columns[:, :0]
    doubts = fit_doubts(axis, fit)
    post = None
    if prior == "edges":
        post = draw_torques(body, fit.levels, times, data, learnt, PATHS, rng)
        if not post.settings["explained"]:
            post = None
            doubts.append(
                f"straight lines between corners do not explain the torque about {axis}: a smooth torque is taken in their place"
            )
    if post is None:
        post = gaussian_torque(body, fit.levels, times, data, learnt, PATHS, rng)
    if not body.NARROWS:
        post = widened(post, body, fit.levels, times, data, columns, rng)
    if not (np.isfinite(post.paths).all() and np.isfinite(post.mean).all()):
        raise _lost()
    innovations = by_channel(post.whitened, channel_of(times, data))
    shares = {n: considered[n] for n in names}
    off = {
        n: (s * float(c.mean()), s * float(c.std()))
        for (n, s), c in zip(shares.items(), post.considered.T, strict=True)
    }
    doubts += innovation_doubts(axis, innovations) + considered_doubts(axis, shares, post.considered)
    wanted = times.wanted
    kept = AxisData(body, fit.levels, times, data, learnt, 0.0)
    return Solved(fit, post.mean[wanted], post.paths[:, wanted], off, innovations, post.settings, doubts, kept)


def _columns(body: Body, fit: AxisFit, times: Times, data: Measurements, considered: dict[str, float]):
    """Names and sensitivities (M, P), each of one sigma, of what is taken as known and moves these measurements."""
    best = smooth(body.smooth_model(fit.levels, times), data)
    found = body.sensitivities(fit.levels, times, data, best)
    names = [n for n, column in found.items() if considered[n] > 0 and np.any(column)]
    return names, np.column_stack([considered[n] * found[n] for n in names] or [np.empty((len(data.row), 0))])


def _settings(solved: dict[str, Solved]) -> dict:
    return {
        "levels": {a: asdict(s.fit.levels) for a, s in solved.items()},
        "left_out": {a: s.fit.left_out for a, s in solved.items()},
        "time_offsets": {a: {n: asdict(o) for n, o in s.fit.offsets.items()} for a, s in solved.items()},
        "considered": {a: {n: {"off": m, "sigma": e} for n, (m, e) in s.considered.items()} for a, s in solved.items()},
        "innovations": {a: {n: asdict(i) for n, i in s.innovations.items()} for a, s in solved.items()},
        "torque": {a: s.settings for a, s in solved.items() if s.settings},
    }
