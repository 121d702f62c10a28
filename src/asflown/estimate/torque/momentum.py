"""Disturbance torque from the momentum of wheels and body (cover paper, section III, eqs 1-9; plume paper, eqs 12-16).

``printed`` is the papers' method: wheel momentum alone, splined to 1 s, smoothed by local regression
over 8 % of the record, differenced forward.  Its two errors offset each other: leaving out I w (eq 6)
enlarges pulses by 6-14 %, the smoothing takes about as much off.  The answer is late by 2 s, and
pulses of 5-10 s come out wrong by tens of percent.

``corrected`` keeps the body's momentum (eqs 2, 3) and the transport term w x H, and takes slopes
from local cubics of each channel at its own sample times: no spline, no differencing.  Its band holds the samples' noise and
what the inertia may be off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...dynamics.momentum import wheel_momentum
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...kit.peaks import excursions
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
from .answer import VARIANTS, Answer, Method, check_window

#: Half-width of the local cubics, chosen by studies/momentum_window.py; one for all channels, so that what
#: wheels and body pass between them cancels. [s]
HALF_WIDTH_S = 18.0

#: The paper's smoothing span, as a fraction of the 1-s samples (cover paper, section III-A).
PRINTED_SPAN = 0.08

PRINTED = Kind(
    "torque.printed-momentum", Severity.CAUTION,
    "the printed method leaves out I w and smooths over 8 % of the record ({span_s:.0f} s here): pulses of 15-30 s come out "
    "2-10 % high and 2 s late, narrower ones wrong by tens of percent",
    "Use --variant corrected, or --method fused.",
)  # fmt: skip
FEW_IN_WINDOW = Kind(
    "torque.few-samples-in-window", Severity.CAUTION,
    "a window of {span_s:.0f} s holds fewer than five samples of {cadence_s:g} s: almost nothing is smoothed",
    "Take a longer record.",
)  # fmt: skip
NO_BODY_RATES = Kind(
    "torque.no-body-rates", Severity.CAUTION,
    "there are no body rates: the body's own momentum and w x H are left out, so pulses of 15-30 s come out 6-14 % high",
    "Add body_rate_x, _y and _z.",
)  # fmt: skip
INERTIA_UNKNOWN = Kind(
    "torque.inertia-unknown", Severity.CAUTION,
    "the craft's inertia is not known: the body's own momentum is left out, and only w x h is kept", "Give --inertia.",
)  # fmt: skip
PEAKS_ROUNDED = Kind(
    "torque.peaks-rounded", Severity.CAUTION,
    "smoothing over ±{half_width_s:.0f} s rounds sharp peaks: they may be up to {low_percent:.0f} % low, with ±{noise_percent:.0f} % "
    "of noise (2 sigma); the band holds the noise only, and single peaks can be further off than the printed method's, whose two "
    "errors offset each other",
    "Use --method fused, or a shorter --window at the price of noise.",
)  # fmt: skip
PEAKS_NOT_RESOLVED = Kind(
    "torque.peaks-not-resolved", Severity.CAUTION,
    "some excursions are no wider than the smoothing window of ±{half_width_s:.0f} s: their height and shape are not resolved, "
    "only their impulse is",
    "Use --method fused, or a shorter --window at the price of noise.",
)  # fmt: skip


def printed_span(samples: int, share: float = PRINTED_SPAN) -> int:
    """Samples in the smoothing window: 8 %, rounded up, made odd (481 -> 39)."""
    return 2 * (int(np.ceil(share * samples)) // 2) + 1


@dataclass(frozen=True, kw_only=True)
class Momentum(Method):
    """Slopes of the total momentum; ``window_s``: full width of the local cubics, in place of the studied one."""

    name: ClassVar[str] = "momentum"
    window_s: float | None = None
    variant: str = "corrected"

    def __post_init__(self):
        check_choice(self.variant, VARIANTS, "variant")
        check_window(self.window_s, self.variant)

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:
        return self._printed(subject) if self.variant == "printed" else self._corrected(subject, axes)

    def _printed(self, subject: Subject) -> Answer:
        grid, momentum = splined_momentum(subject)
        smooth, span = smoothed_as_printed(momentum)
        torque = np.diff(smooth, axis=0)  # forward difference over 1 s, given at the earlier instant
        grid = Grid(grid.start_ns, 1.0, grid.count - 1)
        silent = {g: c.name for c, _ in subject.wheels() for g in gaps_on_grid(c, grid)}
        coarsest = max(c.cadence_ns for c, _ in subject.wheels()) / NS
        few = FEW_IN_WINDOW(span_s=span, cadence_s=coarsest) if span < 5 * coarsest else None
        doubts = Doubts([PRINTED(span_s=span), *gap_doubts(subject.telemetry, grid, silent), few])
        return Answer(
            by=self,
            grid=grid,
            torque_Nm=torque,
            momentum_Nms=smooth[:-1],
            settings={"span_samples": span},
            doubts=doubts,
        )

    def _corrected(self, subject: Subject, axes: tuple[int, ...]) -> Answer:
        """The actuators' momentum comes from wheel rates, from wheel_momentum, or, where only their torque is telemetered,
        from control_torque."""
        tlm, I_B = subject.telemetry, subject.inertia_kgm2
        stored, pushed, doubts = actuators(subject)
        rates = [tlm.channel(f"body_rate_{a}") for a in AXES] if tlm.has_axes("body_rate") else []
        if not rates:
            doubts = [*doubts, NO_BODY_RATES()]
        elif I_B is None:
            doubts = [*doubts, INERTIA_UNKNOWN()]
        everything = [*(c for c, _ in stored), *rates, *pushed]
        grid = grid_for(everything)
        # the coarsest channel decides how narrow the common window can be: five samples
        coarsest = max(c.usable.cadence_ns for c in everything) / NS
        width = max(HALF_WIDTH_S if self.window_s is None else self.window_s / 2, 2.5 * coarsest)
        directions = [d for _, d in stored] + [None if I_B is None else I_B[:, j] for j in range(len(rates))]
        fits = [fit_on_grid(c, grid, degree=3, half_width_s=width) for c in everything]
        momentum, torque, variance = np.zeros((3, grid.count, 3))
        for f, direction in zip(fits, directions, strict=False):  # those of pushed channels come last
            if direction is not None:
                momentum += np.outer(f.fit.value, direction)
                torque += np.outer(f.fit.slope, direction)
                variance += np.outer(f.variance([0, 1, 0]), direction**2)
        if rates:
            rate, acceleration = (
                np.stack([getattr(f.fit, part) for f in fits[len(stored) : len(stored) + 3]], axis=1)
                for part in ("value", "slope")
            )
            torque += np.cross(rate, momentum)
            if I_B is not None:
                variance += inertia_variance(I_B, subject.inertia_share, rate, acceleration)
        for j, f in enumerate(fits[len(directions) :]):
            torque[:, j] -= f.fit.value
            variance[:, j] += f.variance([1, 0, 0])
        silent = {g: c.name for f, c in zip(fits, everything, strict=True) for g in f.gaps}
        sigma = np.sqrt(variance)
        doubts = Doubts([*doubts, *gap_doubts(tlm, grid, silent), _rounding(grid.step_s, torque, sigma, width, axes)])
        return Answer(
            by=self, grid=grid, torque_Nm=torque, sigma_Nm=sigma, momentum_Nms=momentum,
            settings={"half_width_s": width, "degree": 3, "inertia_share": None if I_B is None else subject.inertia_share},
            doubts=doubts,
        )  # fmt: skip


def inertia_variance(I_B: np.ndarray, share: float, rate: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Variance of I alpha + w x (I w) that an inertia off by a share leaves. (M, 3) [N^2 m^2]

    ``share``: one sigma of the moment about any axis, not of body axes alone.  The tensor is then off by L E L', with L L' the
    tensor, moments of E of that sigma and its products of 1/sqrt(2) of it, all independent."""
    moments, axes = np.linalg.eigh(I_B)
    L = axes * np.sqrt(np.maximum(moments, 0.0))
    variance = np.zeros_like(rate)
    for j in range(3):
        for k in range(j + 1):
            off = np.outer(L[:, j], L[:, k])
            off = share * (off if j == k else (off + off.T) / np.sqrt(2))
            variance += (acceleration @ off + np.cross(rate, rate @ off)) ** 2
    return variance


def splined_momentum(subject: Subject) -> tuple[Grid, np.ndarray]:
    """Wheel momentum in body axes, every rate splined to 1 s (cover paper, eq 7 and section III-A)."""
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


#: A corner rounded twice is rounded over sqrt(2) times the width: the first pass took this many times
#: what the second takes.
_FIRST_PASS = 1 / (np.sqrt(2) - 1)


def _rounding(step_s: float, torque, sigma, half_width_s: float, axes: tuple[int, ...]) -> Doubt | None:
    """How much of each peak the window took."""
    worst, noise = 0.0, 0.0
    for j in axes:
        loss = smoothing_loss(step_s, torque[:, j], half_width_s)
        for k in excursions(torque[:, j], sigma[:, j]):
            worst = max(worst, _FIRST_PASS * float(loss[k] / torque[k, j]))
            noise = max(noise, 2 * float(sigma[k, j] / abs(torque[k, j])))
    if worst < 0.02:
        return None
    if worst > 0.5:
        return PEAKS_NOT_RESOLVED(half_width_s=half_width_s)
    return PEAKS_ROUNDED(half_width_s=half_width_s, low_percent=100 * worst, noise_percent=100 * noise)


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
