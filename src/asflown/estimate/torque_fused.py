"""Disturbance torque from all channels at once: one smoothing of the loop with a torque in it.

Wheels, body rates and attitude error each see the torque through the same closed loop.  The model of
``latent_loop`` holds that loop, the slow error of the attitude estimate, and the torque as a random
process; sizes, times and noise levels are those of largest marginal likelihood (weak priors keep
them where the data say nothing).  Nothing is splined or differenced, a missing sample is a missing
update, and a gap only widens the band.

``smooth``: a Matern-3/2 torque, smoothed exactly.  ``edges``: a torque of straight lines whose slope may
jump, jumps of very unequal size (Student-t by its scale mixture), sampled by Gibbs steps: paths
given the jumps' scales, scales given the paths.  The mean over paths does not round a corner more
than the data's doubt about its place demands, and the spread of paths is the band.  Paths also give
what is joint over time: an impulse between two instants, the height of a peak.

Each axis is solved by itself; the gyroscopic torque w x H and the products of inertia, which the
one-axis model takes for torque, are then put back from the smoothed rates and momentum.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy import optimize

from ..kit.errors import BadInput
from ..kit.regression import noise_sigma
from ..kit.smoother import Measurements, Model, draw, log_likelihood, smooth
from ..kit.timeline import NS
from ..telemetry.channels import AXES
from .latent_loop import MOMENTUM, RATE, SLOPE, TORQUE, Body, Levels, Series, Times, arrange
from .subject import Grid, Subject, gaps_on_grid, grid_for, slews
from .torque_momentum import actuators, gap_doubts, splined

PRIORS = ("edges", "smooth")

#: Degrees of freedom of the slope's jumps; small is heavy-tailed (studies/jump_freedom.py).
JUMP_FREEDOM = 0.3
#: Paths kept and paths thrown away first; the mean's own error is then below a tenth of the band.
PATHS, BURN_IN = 240, 60
_ROUNDS = 8
_SEED = 20160913
#: Fewest samples a channel needs, and most instants of one pass.
_LEAST, _LONGEST = 25, 20_000

#: Width of the weak log-normal priors, in the order of Levels.
_SPREAD = np.array([1.5, 0.8, 0.7, 0.7, 0.7, 1.0, 0.7, 1.5])

#: A sample whose innovation is larger than this many sigma is left out. [sigma]
_OUTLYING = 5.0

#: One-sigma uncertainty of what is taken as known, as fractions; it enters the band.
CONSIDERED = {"inertia": 0.01, "spin_inertia": 0.0025}


@dataclass(frozen=True)
class AxisFit:
    """What was fitted on one axis."""

    levels: Levels
    series: tuple[Series, ...]  # without outliers
    left_out: int
    whiteness: dict[str, float]  # lag-one correlation of each channel's innovations


@dataclass(frozen=True)
class Axis:
    """One axis solved: paths (K, M) of the torque the one-axis model sees, and smoothed states (M,)."""

    fit: AxisFit
    paths: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    momentum: np.ndarray
    rate_variance: np.ndarray


def fused(subject: Subject, prior: str = "edges", axes: tuple[int, ...] = (0, 1, 2), seed: int = _SEED):
    """Returns grid, torque (M, 3), sigma, momentum, settings, doubts, paths (K, M, 3); NaN for axes not asked for.

    ``prior``: one of PRIORS (``disturbance_torque`` checks it).

    Raises BadInput where attitude error, body rates, wheels, controller or inertia are missing, and in
    a slew (the loop's commanded motion is not in the telemetry)."""
    grid, series, start_Nms, doubts = _gather(subject, axes)
    I_B, controller = subject.known_inertia(), subject.controller()
    random = np.random.default_rng(seed).spawn(3)
    solved = {}
    for j in axes:
        body = Body(I_B[j, j], controller)
        solved[j] = _solve_axis(body, _fit_axis(body, series[j]), grid, prior, random[j])
    torque, sigma, momentum = np.full((3, grid.count, 3), np.nan)
    paths = np.full((PATHS, grid.count, 3), np.nan)
    rate, acceleration, h, rate_variance = np.zeros((4, grid.count, 3))
    for j, x in solved.items():
        rate[:, j], acceleration[:, j], rate_variance[:, j] = x.rate, x.acceleration, x.rate_variance
        h[:, j] = start_Nms[j] + x.momentum
    products = I_B - np.diag(np.diag(I_B))
    back = acceleration @ products + np.cross(rate, rate @ I_B + h)
    turning = rate_variance @ (np.mean(h**2) * (1 - np.eye(3)))  # of w x H: the size of H is what matters
    for j, x in solved.items():
        torque[:, j] = x.mean + (back[:, j] if len(axes) == 3 else 0.0)
        sigma[:, j] = np.sqrt(x.variance + (turning[:, j] if len(axes) == 3 else 0.0))
        paths[:, :, j] = x.paths + (torque[:, j] - x.mean)
        momentum[:, j] = h[:, j] + rate @ I_B[:, j]
    settings = {
        "prior": prior,
        "seed": seed,
        "considered": CONSIDERED,
        "levels": {AXES[j]: asdict(x.fit.levels) for j, x in solved.items()},
        "left_out": {AXES[j]: x.fit.left_out for j, x in solved.items()},
    }
    doubts += _fit_doubts({j: x.fit for j, x in solved.items()})
    if len(axes) < 3:
        doubts.append(
            "w x H and the products of inertia are not put back, since one axis was asked for: use --axis all where they count"
        )
    return grid, torque, sigma, momentum, settings, doubts, paths


def _solve_axis(body: Body, fit: AxisFit, grid: Grid, prior: str, rng: np.random.Generator) -> Axis:
    """Torque paths and smoothed states of one axis, with the band widened for what was taken as known."""
    times, data = arrange(list(fit.series), grid.seconds)
    edges = prior == "edges"
    model = body.model(fit.levels, times, edges=edges)
    wanted = times.wanted
    if edges:
        paths, scale = _gibbs(model, data, times, rng)
        model = replace(model, scale=scale[:, None])
    else:
        paths = np.array([draw(model, data, rng)[:, TORQUE] for _ in range(PATHS)])
    paths = body.inertia_kgm2 * paths[:, wanted]
    best = smooth(model, data)
    here = body.inertia_kgm2 * best.mean[wanted, TORQUE]
    if edges:
        mean, variance = paths.mean(axis=0), paths.var(axis=0, ddof=1)
    else:
        mean, variance = here, body.inertia_kgm2**2 * best.covariance[wanted, TORQUE, TORQUE]
    for name, share in CONSIDERED.items():
        other = replace(body, inertia_kgm2=body.inertia_kgm2 * (1 + share)) if name == "inertia" else body
        changed = replace(other.model(fit.levels, times, edges=edges), scale=model.scale)
        values = np.where(data.row == 2, data.value * (1 + share), data.value) if name == "spin_inertia" else data.value
        answer = smooth(changed, replace(data, value=values))
        variance = variance + (other.inertia_kgm2 * answer.mean[wanted, TORQUE] - here) ** 2
    rate_variance = best.covariance[wanted, RATE, RATE]
    sound = np.isfinite(best.whitened).all() and np.isfinite(mean).all() and rate_variance.min() >= 0
    if not (sound and np.isfinite(variance).all() and variance.min() > 0):
        raise BadInput(
            "the loop's model cannot be fitted to this record: its covariance lost its meaning",
            remedy="Look for values of impossible size (asflown telemetry check), or use --method momentum.",
        )
    F, _, _ = body.dynamics(fit.levels, edges)
    return Axis(
        fit, paths, mean, variance,
        best.mean[wanted, RATE], best.mean[wanted] @ F[RATE], body.inertia_kgm2 * best.mean[wanted, MOMENTUM],
        rate_variance,
    )  # fmt: skip


def _gibbs(model: Model, data: Measurements, times: Times, rng: np.random.Generator):
    """Torque paths (PATHS, N) [torque per inertia] under unequal jumps, and the jumps' harmonic mean scales (N,).

    Given a path, each jump's scale is inverse-gamma; given the scales, so is their overall size."""
    steps = len(times.which)
    density = model.driven[0][times.which[1:], SLOPE, SLOPE]  # variance of a step's jump at scale 1
    scale, overall = _jump_scales(model, data)
    kept, precision = np.empty((PATHS, steps)), np.zeros(steps)
    nu = JUMP_FREEDOM
    for k in range(PATHS + BURN_IN):
        path = draw(replace(model, scale=scale[:, None]), data, rng)
        jump = np.diff(path[:, SLOPE]) ** 2 / density
        scale[1:] = 0.5 * (nu * overall + jump) / rng.gamma((nu + 1) / 2, size=steps - 1)
        scale = np.clip(scale, 1e-9 * overall, 1e9 * overall)
        overall = rng.gamma(0.5 * nu * (steps - 1)) / (0.5 * nu * np.sum(1 / scale[1:]))
        if k >= BURN_IN:
            kept[k - BURN_IN] = path[:, TORQUE]
            precision += 1 / scale
    return kept, PATHS / precision


def _jump_scales(model: Model, data: Measurements) -> tuple[np.ndarray, float]:
    """A start for the sampler by expectation-maximization: scale = (nu + E[w^2]/q) / (nu + 1), q the overall size."""
    overall, scale = 1.0, np.ones(len(model.which))
    for _ in range(_ROUNDS):
        ratio = smooth(replace(model, scale=overall * scale[:, None]), data).drive[:, 0] / overall
        scale = (JUMP_FREEDOM + ratio) / (JUMP_FREEDOM + 1)
        overall *= float(np.mean(ratio[1:] / scale[1:]))
    return overall * scale, overall


def _gather(subject: Subject, axes):
    """Series of every axis from the grid's start; the wheels' momentum there; what to doubt."""
    tlm = subject.telemetry
    if subject.relative:
        raise BadInput("the fused method needs wheels of known spin inertia", remedy="Use --method momentum.")
    if slews(tlm):
        raise BadInput(
            "the craft slews, and the loop's commanded motion is not in the telemetry",
            remedy="The fused method needs a hold: narrow the window with --start and --stop, or use --method momentum.",
        )
    names = [f"{stem}_{AXES[j]}" for stem in ("attitude_error", "body_rate") for j in axes]
    channels = [tlm.channel(n) for n in names]
    stored, pushed, _ = actuators(subject)
    if pushed:
        raise BadInput("the fused method needs wheel rates or wheel momentum", remedy="Use --method momentum.")
    everything = [*channels, *[c for c, _ in stored]]
    grid = grid_for(everything)
    if grid.count > _LONGEST:
        raise BadInput(
            f"{grid.count} instants are too many for one fused pass",
            remedy=f"Take at most {_LONGEST} s with --start and --stop.",
        )
    for c in everything:
        u = c.usable.values
        if len(u) < _LEAST or np.ptp(u) == 0:
            why = "never changes" if len(u) >= _LEAST else f"has {len(u)} usable samples, fewer than {_LEAST}"
            raise BadInput(
                f"this channel {why}: the fused method cannot fit its noise",
                channel=c.name,
                remedy="Take a longer window, or use --method momentum.",
            )
    doubts: list[str] = []
    t, h = _momentum(stored, grid, doubts)
    first = h[0].copy()
    series: dict[int, list[Series]] = {}
    for k, j in enumerate(axes):
        series[j] = []
        for row, c in enumerate((channels[k], channels[len(axes) + k])):
            u = c.usable
            s = grid.of(u.tai_ns)
            inside = (s >= 0) & (s <= grid.seconds[-1] + 1e-6)
            series[j].append(Series(row, s[inside], u.values[inside]))
        series[j].append(Series(2, t, h[:, j] - first[j]))
    silent = {g: c.name for c in everything for g in gaps_on_grid(c, grid)}
    doubts += [
        d.replace("are left null", "are bridged by the model, the band widened") for d in gap_doubts(tlm, grid, silent)
    ]
    return grid, series, first, doubts


def _momentum(stored, grid: Grid, doubts: list[str]):
    """Stored momentum in body axes at the sample times all actuators share."""
    lead = stored[0][0].usable
    common = lead.tai_ns
    for c, _ in stored[1:]:
        common = np.intersect1d(common, c.usable.tai_ns)
    inside = (common >= grid.start_ns) & (common <= grid.start_ns + round(grid.seconds[-1] * NS))
    common = common[inside]
    if len(common) > 0.5 * len(lead.tai_ns):
        h = np.zeros((len(common), 3))
        for c, direction in stored:
            u = c.usable
            h += np.outer(u.values[np.searchsorted(u.tai_ns, common)], direction)
        return grid.of(common), h
    doubts.append("the wheels are sampled at different instants: their rates are splined to those of the first")
    times = grid.of(lead.tai_ns)
    times = times[(times >= 0) & (times <= grid.seconds[-1])]
    fine = Grid(grid.start_ns, 0.125, int(grid.seconds[-1] * 8) + 1)
    h = np.sum([np.outer(np.interp(times, fine.seconds, splined(c, fine)), d) for c, d in stored], axis=0)
    known = np.isfinite(h).all(axis=1)
    return times[known], h[known]


def _starting_levels(series: list[Series]) -> Levels:
    """From the channels alone: noises from local fits, the torque from the momentum's swing."""

    def noise(s: Series, least: float) -> float:
        sigma = noise_sigma(s.seconds, s.values, degree=3, half_width=4 * float(np.median(np.diff(s.seconds))))
        return max(sigma, least) if np.isfinite(sigma) else least

    error, rate, h = series
    slope = np.gradient(h.values, h.seconds)
    white = noise(error, 1e-9)
    return Levels(
        torque_Nm=max(float(np.std(slope)), 1e-7),
        length_s=15.0,
        error_white_rad=white,
        rate_white_rad_s=noise(rate, 1e-10),
        momentum_white_Nms=noise(h, 1e-6),
        error_slow_rad=1.5 * white,
        error_time_s=15.0,
        reaction_Nm_sqrt_s=max(0.05 * float(np.std(slope)), 1e-6),
    )


def _fit_axis(body: Body, series: list[Series]) -> AxisFit:
    """Levels of largest posterior; samples that no level explains are left out and the fit repeated."""
    centre = _starting_levels(series).logs()
    logs = centre
    left_out = 0
    for _ in range(2):
        times, data = arrange(series)

        def cost(p, times=times, data=data):
            value = log_likelihood(body.model(Levels.from_logs(p), times), data)
            return (-value if np.isfinite(value) else 1e10) + 0.5 * np.sum(((p - centre) / _SPREAD) ** 2)

        bounds = list(zip(centre - 4 * _SPREAD, centre + 4 * _SPREAD, strict=True))
        found = optimize.minimize(cost, logs, method="L-BFGS-B", bounds=bounds, options={"maxiter": 60})
        logs = found.x
        whitened = np.nan_to_num(smooth(body.model(Levels.from_logs(logs), times), data).whitened)
        bad = np.abs(whitened) > _OUTLYING
        if not bad.any() or bad.mean() > 0.1:
            break
        series, left_out = _without(series, times, data, bad), int(bad.sum())
    whiteness = {}
    for row, name in enumerate(("attitude_error", "body_rate", "momentum")):
        v = whitened[(data.row == row) & ~bad]
        whiteness[name] = float(np.corrcoef(v[:-1], v[1:])[0, 1]) if len(v) > 10 else 0.0
    return AxisFit(Levels.from_logs(logs), tuple(series), left_out, whiteness)


def _without(series, times: Times, data: Measurements, bad) -> list[Series]:
    step = np.searchsorted(data.start, np.arange(len(data.row)), side="right") - 1
    kept = []
    for s in series:
        drop = times.seconds[step[bad & (data.row == s.row)]]
        keep = ~np.isin(np.round(s.seconds * 1e3), np.round(drop * 1e3))
        kept.append(replace(s, seconds=s.seconds[keep], values=s.values[keep]))
    return kept


def _fit_doubts(fits: dict[int, AxisFit]) -> list[str]:
    doubts = []
    for j, f in fits.items():
        for name, r in f.whiteness.items():
            if abs(r) > 0.35:
                doubts.append(
                    f"the loop's model does not explain {name} about {AXES[j]} (its innovations follow each other, correlation "
                    f"{r:+.2f}): inertia, gains, a commanded motion or a thruster firing in the span?"
                )
        if f.left_out:
            doubts.append(f"{f.left_out} samples about {AXES[j]} lie beyond {_OUTLYING:g} sigma and are left out")
    return doubts
