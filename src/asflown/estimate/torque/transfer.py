"""Disturbance torque from attitude error, through the inverse of the closed loop (cover paper, section IV).

    T = -I (e'' + KD F(e') + KP KD e)                      full: the exact inverse of the cover paper's eq 11
    T = -I (e'' + KD e' + KP KD e)                         low: cover paper eq 16, plume paper eq 6
    T = -(I/g) (e'' + d e' + k e)                          hankel: plume paper eqs 9, 10

F is the rate filter: the sixth-order loop has an inverse that is no harder than the low-order one,
with the rate filtered.  e is commanded minus estimated attitude in a hold, so the body rate is -e'.  Where the controller
believes another inertia J than the body's, J stands before all but e''.  Of a body that turns with its commanded attitude, w x H
is added where the controller does not feed it forward.

``printed`` is the papers' method: e splined to 1 s, smoothed over 8 % of the record, differenced forward
twice (eqs 18, 19), low-order inverse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy

from ...dynamics.loop import SecondOrder, filtered_rate, hankel_order_two, low_order
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...kit.regression import LocalFit, local_polynomial
from ...kit.timeline import NS, runs
from ...telemetry.channels import AXES
from ..subject import (
    Grid,
    Subject,
    changes_as_in_a_slew,
    fit_on_grid,
    gap_doubts,
    gaps_on_grid,
    grid_for,
    splined,
    turns,
)
from .answer import VARIANTS, Answer, Method, check_window
from .momentum import HALF_WIDTH_S, smoothed_as_printed

if TYPE_CHECKING:
    from ...craft.model import WheelController

MODELS = ("low", "hankel", "full")

#: Half-width of the local cubic through attitude error, chosen by studies/error_window.py. [s]
ERROR_HALF_WIDTH_S = 18.0


PRINTED = Kind(
    "torque.printed-transfer", Severity.CAUTION,
    "the printed method smooths over 8 % of the record ({span_s:.0f} s here), which takes 10-15 % off pulses of 30 s, 20-27 % off "
    "pulses of 15 s, and half of those of 7-10 s",
    "Use --variant corrected, or --method fused.",
)  # fmt: skip
NOT_HELD = Kind(
    "torque.not-held", Severity.SUSPECT,
    "the attitude is not held still: the transfer method assumes a hold, and commanded rates and accelerations are not in the "
    "telemetry",
    "Narrow the window to a hold with --start and --stop; of a craft that turns with its orbit, say gyroscopic under "
    "[wheel_controller].",
)  # fmt: skip
WHITE_NOISE_ONLY = Kind(
    "torque.white-noise-only", Severity.CAUTION,
    "the band of the transfer method holds white noise and the inertia's sigma only: slow (correlated) error of the attitude estimate "
    "is not in it",
    "Use --method fused.",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Transfer(Method):
    """Attitude error through the inverse of the loop.

    ``model``: one of MODELS; None: full, or low for the printed variant.  ``window_s``: full width of the local cubics, in
    place of the studied one."""

    name: ClassVar[str] = "transfer"
    model: str | None = None
    window_s: float | None = None
    variant: str = "corrected"

    def __post_init__(self):
        check_choice(self.variant, VARIANTS, "variant")
        check_choice(self.model, (None, *MODELS), "model")
        check_window(self.window_s, self.variant)
        if self.variant == "printed" and self.model == "full":
            raise BadInput(
                "the printed transfer method has no full model", remedy="Use --variant corrected --model full."
            )

    @property
    def taken(self) -> str:
        """The loop's model."""
        return self.model or ("low" if self.variant == "printed" else "full")

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:  # noqa: ARG002 - all axes with a channel
        return self._printed(subject) if self.variant == "printed" else self._corrected(subject)

    def _printed(self, subject: Subject) -> Answer:
        """Torque is NaN for axes without attitude error."""
        I_B = subject.known_inertia()
        inverse = _second_order(subject, self.taken)
        channels = _errors(subject)
        grid = grid_for(list(channels.values()), step_s=1.0)
        torque = np.full((grid.count - 2, 3), np.nan)
        span = 0
        for j, channel in channels.items():
            smooth, span = smoothed_as_printed(splined(channel, grid)[:, None])
            e = smooth[:, 0]
            rate = np.diff(e)
            torque[:, j] = (
                -I_B[j, j]
                / inverse.gain
                * (np.diff(rate) + inverse.damping_per_s * rate[:-1] + inverse.stiffness_per_s2 * e[:-2])
            )
        silent = {g: c.name for c in channels.values() for g in gaps_on_grid(c, grid)}
        return Answer(
            by=self, grid=Grid(grid.start_ns, 1.0, grid.count - 2), torque_Nm=torque,
            settings={"span_samples": span, "model": self.taken},
            doubts=Doubts([PRINTED(span_s=span), *gap_doubts(subject.telemetry, grid, silent)]),
        )  # fmt: skip

    def _corrected(self, subject: Subject) -> Answer:
        """The error smoothed once by local cubics, the chosen inverse applied, w x h added where the wheels are known.

        Smoothed once, because value, slope and curvature of one local fit each have their own bandwidth:
        an inverse put together from them is late by up to 2 s on 10-s excursions.  The rate error is taken
        from telemetry where it is there: controller_rate_error (cover paper eq 17, plume paper eq 8), which has already
        gone through the filter, or rate_error."""
        I_B, law = subject.known_inertia(), subject.controller()
        J, tlm = law.believed_kgm2(I_B), subject.telemetry
        width = ERROR_HALF_WIDTH_S if self.window_s is None else self.window_s / 2
        channels = _errors(subject)
        told = {j: _rate_channel(tlm, AXES[j]) for j in channels}
        grid = grid_for([*channels.values(), *[c for c in told.values() if c is not None]])
        inverse = None if self.taken == "full" else _second_order(subject, self.taken)
        inverted = {j: _inverted(subject, inverse, grid, width, c, told[j]) for j, c in channels.items()}
        acceleration, push, rate = np.full((3, grid.count, 3), np.nan)
        variance = np.full((grid.count, 3), np.nan)
        for j, found in inverted.items():
            acceleration[:, j], push[:, j], rate[:, j] = found.motion
            variance[:, j] = I_B[j, j] ** 2 * found.variance
        gain = 1.0 if inverse is None else inverse.gain
        if len(channels) == 3 and inverse is None:
            torque = -(acceleration @ I_B + push * np.diag(J))
        elif self.taken == "low":
            torque = -(acceleration * np.diag(I_B) + push * np.diag(J))
        else:
            torque = -np.diag(I_B) / gain * (acceleration + push)
        # the whole torque that the loop tells is in proportion to the inertia
        variance = variance / gain**2 + (subject.inertia_share * torque) ** 2
        followed = len(channels) == 3 and tlm.members("wheel_rate") and not subject.relative
        turning = followed and law.gyroscopic is not None and tlm.has_axes("body_rate")
        if followed:
            torque += _turning(subject, grid, -rate, known=bool(turning))
        silent = {g: name for found in inverted.values() for g, name in found.gaps.items()}
        told_by_error = rate[:, list(channels)]
        told_by_error = told_by_error[np.isfinite(told_by_error).all(axis=1)]
        moves = subject.slewing or (turns(tlm) and not turning) or changes_as_in_a_slew(told_by_error)
        return Answer(
            by=self, grid=grid, torque_Nm=torque, sigma_Nm=np.sqrt(variance),
            settings={"half_width_s": width, "degree": 3, "model": self.taken, "inertia_share": subject.inertia_share},
            doubts=Doubts([*gap_doubts(tlm, grid, silent), NOT_HELD() if moves else None, WHITE_NOISE_ONLY()]),
        )  # fmt: skip


@dataclass(frozen=True)
class _Inverted:
    """One axis: e'', the rest of the bracket and e' (3, M); variance (M,) of the bracket; gaps with their channel."""

    motion: np.ndarray
    variance: np.ndarray
    gaps: dict[tuple[float, float], str]


def _inverted(subject: Subject, inverse: SecondOrder | None, grid: Grid, width: float, channel, rate) -> _Inverted:
    """``channel``: attitude error; ``rate``: the rate error told, or None."""
    k = subject.controller()
    f = fit_on_grid(channel, grid, degree=3, half_width_s=width)
    gaps = dict.fromkeys(f.gaps, channel.name)
    told, extra = None, 0.0
    if rate is not None:
        r = fit_on_grid(rate, grid, degree=3, half_width_s=width)
        gaps |= dict.fromkeys(r.gaps, rate.name)
        told, extra = r.fit.value, k.kd_per_s**2 * r.variance([1, 0, 0])
    stride = max(1, round(channel.cadence_ns / NS / grid.step_s))
    loop = _Inverse(k, inverse, grid.step_s, stride, None if rate is None else rate.kind.stem)
    widened = f.widened @ np.square([k.kp_per_s * k.kd_per_s, k.kd_per_s, 1.0])
    variance = _noise_gain(loop, channel, grid, width, f) * f.sigma**2 + widened + extra
    return _Inverted(loop.apply(f.fit.value, told), variance, gaps)


@dataclass(frozen=True)
class _Inverse:
    """The inverse of the loop as a linear operator on smoothed attitude error, stretch by stretch.

    ``stride``: instants between samples.  The curve to differentiate goes through instants of one phase
    to the samples only: a local fit's noise depends on that phase, and a curve through all of them
    would ripple.  ``rate_channel``: None (differentiate e), 'rate_error' or 'controller_rate_error'."""

    controller: WheelController
    second_order: SecondOrder | None
    step_s: float
    stride: int = 1
    rate_channel: str | None = None

    def apply(self, e: np.ndarray, told: np.ndarray | None = None):
        """e'', the rest of the bracket, and e'; NaN where e is."""
        out = np.full((3, len(e)), np.nan)
        known = np.isfinite(e) & (True if told is None else np.isfinite(told))
        for s in runs(known):
            if s.stop - s.start >= 8 * self.stride:
                out[:, s] = self._stretch(e[s], None if told is None else told[s])
        return out

    def _stretch(self, e, told):
        k = self.controller
        at = self.step_s * np.arange(len(e))
        nodes = np.arange(0, len(e), self.stride)
        if nodes[-1] != len(e) - 1:
            nodes = np.append(nodes, len(e) - 1)
        curve = scipy.interpolate.make_interp_spline(at[nodes], e[nodes], 5)
        e, rate, acceleration = curve(at), curve(at, 1), curve(at, 2)
        if self.rate_channel == "controller_rate_error":  # F(e') + KP e
            filtered, rate = told - k.kp_per_s * e, told - k.kp_per_s * e
        else:
            rate = rate if told is None else told
            filtered = filtered_rate(k, rate, self.step_s) if self.second_order is None else rate
        s = self.second_order or low_order(k)
        return acceleration, s.damping_per_s * filtered + s.stiffness_per_s2 * e, rate


def _noise_gain(loop: _Inverse, channel, grid: Grid, half_width_s: float, f) -> np.ndarray:
    """Variance of the inverse's bracket per unit noise variance of one attitude-error sample. (M,)

    From the answer to single samples of unit size in mid-record; towards the ends it grows as the
    curvature's variance does, which rules the bracket."""
    c = channel.usable
    cadence = c.cadence_ns / NS
    reach = 3 * half_width_s + 10 * grid.step_s
    n = int(2 * reach / cadence) + 1
    at = np.arange(0, (n - 1) * cadence, grid.step_s)
    squares = []
    for k in range(n // 2, n // 2 + 2):
        impulse = np.zeros(n)
        impulse[k] = 1.0
        smooth = local_polynomial(cadence * np.arange(n), impulse, at, degree=3, half_width=half_width_s).value
        acceleration, push, _ = loop.apply(smooth, None if loop.rate_channel is None else np.zeros_like(smooth))
        squares.append(np.sum((acceleration + push) ** 2))
    curvature = f.fit.gain[:, 2, 2]
    return np.mean(squares) * grid.step_s / cadence * np.maximum(1.0, curvature / np.nanmedian(curvature))


def _errors(subject: Subject) -> dict:
    """Axis index -> attitude error channel."""
    tlm = subject.telemetry
    channels = {j: tlm.channel(f"attitude_error_{a}") for j, a in enumerate(AXES) if f"attitude_error_{a}" in tlm}
    if not channels:
        tlm.channel("attitude_error_y")  # names what is missing
    return channels


def _second_order(subject: Subject, model: str) -> SecondOrder:
    k = subject.controller()
    return low_order(k) if model == "low" else hankel_order_two(k)


def _rate_channel(tlm, axis: str):
    for stem in ("controller_rate_error", "rate_error"):
        if f"{stem}_{axis}" in tlm:
            return tlm.channel(f"{stem}_{axis}")
    return None


def _turning(subject: Subject, grid: Grid, deviation: np.ndarray, *, known: bool) -> np.ndarray:
    """What the body's turn adds to the torque (M, 3): w x H less what the controller feeds forward of it, and its damping of the
    commanded rate where it does not track that.

    ``deviation``: rates about the commanded attitude (M, 3), which in a hold are the body's own; ``known``: the file says what is
    fed forward and the body's own rates are there."""
    h = _wheel_momentum(subject, grid)
    if not known:
        return np.cross(deviation, h)
    I_B, law = subject.known_inertia(), subject.controller()
    J = law.believed_kgm2(I_B)
    channels = [subject.telemetry.channel(f"body_rate_{a}") for a in AXES]
    rate = np.column_stack([fit_on_grid(c, grid, degree=3, half_width_s=HALF_WIDTH_S).fit.value for c in channels])
    turn = np.cross(rate, rate @ I_B + h) - law.gyroscopic * np.cross(rate, rate @ J + h)
    return turn if law.tracking else turn + law.kd_per_s * (rate - deviation) * np.diag(J)


def _wheel_momentum(subject: Subject, grid: Grid) -> np.ndarray:
    h = np.zeros((grid.count, 3))
    for channel, wheel in subject.wheels():
        f: LocalFit = fit_on_grid(channel, grid, degree=3, half_width_s=HALF_WIDTH_S).fit
        known = np.isfinite(f.value)  # beyond its ends and in its gaps: it changes slowly, and w is small
        value = np.interp(grid.seconds, grid.seconds[known], f.value[known])
        h += np.outer(value, wheel.spin_inertia * np.asarray(wheel.axis))
    return h
