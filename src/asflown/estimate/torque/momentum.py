"""Disturbance torque from the momentum of wheels and body (000 section III, eqs 1-9; 004 eqs 12-16).

``printed`` is the paper's way: wheel momentum alone, splined to 1 s, smoothed by local regression
over 8 % of the record, differenced forward.  Its two faults hide each other: leaving out I w (eq 6)
enlarges pulses by 6-14 %, the smoothing takes about as much off.  The answer is late by 2 s, and
pulses of 5-10 s come out wrong by tens of percent.

``corrected`` keeps the body's momentum (eqs 2, 3) and the transport term w x H, and takes slopes
from local cubics of each channel at its own sample times: no spline, no differencing.
"""

from __future__ import annotations

import numpy as np

from ...dynamics.momentum import wheel_momentum
from ...kit.errors import BadInput
from ...kit.regression import local_polynomial, loess
from ...kit.timeline import NS, runs
from ...telemetry.channels import AXES
from ..subject import (
    Grid,
    Subject,
    actuators,
    axes_and_inertias,
    fit_on_grid,
    gap_doubts,
    gaps_on_grid,
    grid_for,
    splined,
)

#: Half-width of the local cubics, chosen by studies/momentum_window.py; one for all channels, so that what
#: wheels and body pass between them cancels. [s]
HALF_WIDTH_S = 18.0

#: The paper's smoothing span, as a fraction of the 1-s samples (000 section III-A).
PRINTED_SPAN = 0.08


def printed_span(samples: int, share: float = PRINTED_SPAN) -> int:
    """Samples in the smoothing window: 8 %, rounded up, made odd (481 -> 39)."""
    return 2 * (int(np.ceil(share * samples)) // 2) + 1


def printed(subject: Subject):
    """The paper's way. Returns grid, torque (M, 3), None (no sigma), momentum (M, 3), settings, doubts."""
    grid, momentum = splined_momentum(subject)
    smooth, span = smoothed_as_printed(momentum)
    torque = np.diff(smooth, axis=0)  # forward difference over 1 s, given at the earlier instant
    grid = Grid(grid.start_ns, 1.0, grid.count - 1)
    doubts = [
        f"printed method: I w is left out and the window is 8 % of the record ({span} s here): pulses of 15-30 s come out "
        "2-10 % high and 2 s late, narrower ones wrong by tens of percent"
    ]
    doubts += gap_doubts(
        subject.telemetry, grid, {g: c.name for c, _ in subject.wheels() for g in gaps_on_grid(c, grid)}
    )
    coarsest = max(c.cadence_ns for c, _ in subject.wheels()) / NS
    if span < 5 * coarsest:
        doubts.append(
            f"a window of {span} s holds fewer than five samples of {coarsest:g} s: almost nothing is smoothed"
        )
    return grid, torque, None, smooth[:-1], {"span_samples": span}, doubts


def splined_momentum(subject: Subject) -> tuple[Grid, np.ndarray]:
    """Wheel momentum in body axes, every rate splined to 1 s (000 eq 7 and section III-A)."""
    wheels = subject.wheels()
    grid = grid_for([c for c, _ in wheels], step_s=1.0)
    rates = np.stack([splined(c, grid) for c, _ in wheels], axis=1)
    axes, spin = axes_and_inertias(wheels)
    return grid, wheel_momentum(axes, spin, rates)


def smoothed_as_printed(values: np.ndarray, share: float = PRINTED_SPAN) -> tuple[np.ndarray, int]:
    """Local regression of every column over a share of the samples, each stretch without NaN by itself."""
    span = printed_span(len(values), share)
    out = np.full_like(values, np.nan)
    known = np.isfinite(values).all(axis=1)
    stretches = runs(known)
    longest = max((s.stop - s.start for s in stretches), default=0)
    if span < 5 or longest < span:
        raise BadInput(
            f"{len(values)} s of record (longest stretch without a gap {longest} s) are too few for the printed method",
            remedy="It needs at least a minute without a gap: take a longer record.",
        )
    for s in stretches:
        if s.stop - s.start >= span:
            for k in range(values.shape[1]):
                out[s, k] = loess(values[s, k], span)
    return out, span


def corrected(subject: Subject, window_s: float | None = None):
    """Local cubic slopes of every channel, body momentum and transport term included.

    The actuators' momentum comes from wheel rates, from wheel_momentum, or, where only their torque
    is telemetered, from control_torque.  Returns as ``printed``, with sigma (M, 3)."""
    tlm, I_B = subject.telemetry, subject.inertia_kgm2
    doubts: list[str] = []
    has_rates = tlm.has_axes("body_rate")
    stored, pushed, spin_doubt = actuators(subject)
    doubts += spin_doubt
    rates = [tlm.channel(f"body_rate_{a}") for a in AXES] if has_rates else []
    if not has_rates:
        doubts.append(
            "no body rates: the body's own momentum and w x H are left out, so pulses of 15-30 s come out 6-14 % high"
        )
    elif I_B is None:
        doubts.append("the craft's inertia is not known: the body's own momentum is left out, only w x h is kept")
    grid = grid_for([c for c, _ in stored] + rates + pushed)
    # the coarsest channel decides how narrow the common window can be: five samples
    coarsest = max(c.usable.cadence_ns for c in [c for c, _ in stored] + rates + pushed) / NS
    width = max(HALF_WIDTH_S if window_s is None else window_s / 2, 2.5 * coarsest)
    wheels = [(fit_on_grid(c, grid, degree=3, half_width_s=width), c, direction) for c, direction in stored]
    body = [(fit_on_grid(c, grid, degree=3, half_width_s=width), c, None if I_B is None else I_B[:, j])
            for j, c in enumerate(rates)]  # fmt: skip
    momentum, torque, variance = np.zeros((3, grid.count, 3))
    silent: dict[tuple[float, float], str] = {}
    for f, channel, direction in wheels + body:
        silent |= {g: channel.name for g in f.gaps}
        if direction is not None:
            momentum += np.outer(f.fit.value, direction)
            torque += np.outer(f.fit.slope, direction)
            variance += np.outer(f.variance([0, 1, 0]), direction**2)
    if body:
        torque += np.cross(np.stack([f.fit.value for f, _, _ in body], axis=1), momentum)
    for j, channel in enumerate(pushed):
        f = fit_on_grid(channel, grid, degree=3, half_width_s=width)
        torque[:, j] -= f.fit.value
        variance[:, j] += f.variance([1, 0, 0])
        silent |= {g: channel.name for g in f.gaps}
    doubts += gap_doubts(tlm, grid, silent)
    settings = {"half_width_s": width, "degree": 3}
    return grid, torque, np.sqrt(variance), momentum, settings, doubts


def smoothing_loss(grid_step_s: float, torque: np.ndarray, half_width_s: float) -> np.ndarray:
    """How much a second pass of the same smoothing would change a torque: a measure of the first's bias."""
    known = np.isfinite(torque)
    if known.sum() < 8:
        return np.zeros_like(torque)
    t = grid_step_s * np.arange(len(torque))
    total = np.cumsum(np.where(known, torque, 0.0)) * grid_step_s
    # total[k] is the impulse up to half a step after t[k]
    again = local_polynomial(t, total, t - grid_step_s / 2, degree=3, half_width=half_width_s).slope
    return np.where(known, torque - again, 0.0)
