"""Disturbance torque from polynomials fitted to a whole record (plume paper, eqs 7, 8, 17, 18).

Two channels, as in the paper: total momentum by a 12th-order polynomial (15th and 18th tried there),
whose derivative is the torque (eq 18); attitude error by a 6th-order one (eq 7), put through the
low-order inverse of the loop (eq 6).  Kept for comparison: on the papers' own torque the 12th order
is 7 % low and 3 s early, the 6th 27 % low, and both swing at the ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial as Fitted

from ...dynamics.loop import hankel_order_two, low_order
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...kit.timeline import NS
from ...telemetry.channels import AXES
from ..subject import Grid, Subject, actuators, fit_on_grid, gap_doubts, gaps_on_grid, grid_for
from .answer import VARIANTS, Answer, Method
from .momentum import HALF_WIDTH_S

ORDERS = (6, 12, 15, 18)


SWINGS = Kind(
    "torque.polynomial-swings", Severity.CAUTION,
    "polynomials over a whole record swing at its ends and round every peak", "Compare with --method fused or momentum.",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Polynomial(Method):
    """One polynomial an axis over the whole record; there is one way, so that both variants are the same.

    ``order``: 6 fits attitude error, 12, 15 and 18 total momentum; ``model``: of the loop, low or hankel (order 6)."""

    name: ClassVar[str] = "polynomial"
    order: int = 12
    model: str = "low"
    variant: str = "corrected"

    def __post_init__(self):
        check_choice(self.variant, VARIANTS, "variant")
        check_choice(self.order, ORDERS, "order")
        check_choice(self.model, ("low", "hankel"), "model")

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:  # noqa: ARG002 - all axes with a channel
        """``Answer.fits``: for every order and axis the RMS misfit of the samples, absolute and in percent of their mean size."""
        tlm = subject.telemetry
        momentum = _momentum_samples(subject) if self.order != 6 or tlm.members("wheel_rate") else None
        fits = [] if momentum is None else [f for n in ORDERS[1:] for f in _fit_records(momentum, n, "momentum", "Nms")]
        errors = {j: f"attitude_error_{a}" for j, a in enumerate(AXES) if f"attitude_error_{a}" in tlm}
        for j, name in errors.items():
            c = tlm.channel(name).usable
            _, rms, share = _fit((c.tai_ns - c.tai_ns[0]) / NS, c.values, 6)
            fits.append({"order": 6, "channel": name, "axis": AXES[j], "rms_rad": rms, "rms_percent": share})
        if momentum is None or self.order == 6:
            grid, torque, how = _from_error(subject, errors, self.model)
            settings = {"order": 6, "model": self.model, "rate_error": how}
            return Answer(
                by=self, grid=grid, torque_Nm=torque, settings=settings, doubts=Doubts([SWINGS()]), fits=tuple(fits)
            )
        grid, torque, smooth, silent = _from_momentum(subject, momentum, self.order)
        return Answer(
            by=self, grid=grid, torque_Nm=torque, momentum_Nms=smooth, settings={"order": self.order},
            doubts=Doubts([SWINGS(), *gap_doubts(tlm, grid, silent)]), fits=tuple(fits),
        )  # fmt: skip


def _from_momentum(subject: Subject, samples, order: int):
    """Plume paper eq 18: grid, torque and momentum (M, 3), null in gaps, and the gaps with their channel."""
    grid, t, H = samples
    torque, smooth = np.full((2, grid.count, 3), np.nan)
    for j in range(3):
        p, _, _ = _fit(t, H[:, j], order)
        smooth[:, j], torque[:, j] = p(grid.seconds), p.deriv()(grid.seconds)
    silent = {g: c.name for c, _ in actuators(subject)[0] for g in gaps_on_grid(c, grid)}
    for a, b in silent:
        inside = (grid.seconds > a + 1e-9) & (grid.seconds < b - 1e-9)
        smooth[inside], torque[inside] = np.nan, np.nan
    return grid, torque, smooth, silent


def _fit(t, y, order):
    """Least squares on a scaled domain; RMS misfit and its share of the mean magnitude in percent."""
    if len(t) < 2 * (order + 1):
        raise BadInput(
            f"{len(t)} samples are too few for a polynomial of order {order}",
            remedy="Take a longer record, or a lower --order.",
        )
    p, (_, rank, _, _) = Fitted.fit(t, y, order, full=True)  # asked for, so that numpy does not warn
    if rank <= order:
        raise BadInput(
            f"a gap leaves too little of the record to hold a polynomial of order {order}",
            remedy="Narrow the window to a stretch without the gap (--start, --stop), or use a lower --order.",
        )
    rms = float(np.sqrt(np.mean((y - p(t)) ** 2)))
    size = float(np.mean(np.abs(y)))
    return p, rms, 100 * rms / size if size > 0 else None


def _momentum_samples(subject: Subject):
    """Total momentum at the first wheel's sample times; other channels by local cubic at those times."""
    tlm, I_B = subject.telemetry, subject.inertia_kgm2
    stored, _, _ = actuators(subject)
    if not stored:
        raise BadInput("the polynomial method needs wheel rates or wheel momentum", remedy="Use --method momentum.")
    rates = [tlm.channel(f"body_rate_{a}") for a in AXES] if tlm.has_axes("body_rate") and I_B is not None else []
    columns = [] if I_B is None else list(I_B.T)
    terms = [(c, d, HALF_WIDTH_S) for c, d in stored] + [
        (c, d, HALF_WIDTH_S) for c, d in zip(rates, columns, strict=False)
    ]
    grid = grid_for([c for c, _, _ in terms])
    lead = stored[0][0].usable
    t = grid.of(lead.tai_ns)
    inside = (t >= 0) & (t <= grid.seconds[-1] + 1e-9)
    t = t[inside]
    H = np.zeros((len(t), 3))
    for channel, direction, width in terms:
        c = channel.usable
        tc = grid.of(c.tai_ns)
        same = len(tc) >= len(t) and np.isin(np.round(t * 1e6), np.round(tc * 1e6)).all()
        if same:
            values = c.values[np.searchsorted(tc, t - 1e-6)]
        else:
            values = np.interp(t, grid.seconds, fit_on_grid(channel, grid, degree=3, half_width_s=width).fit.value)
        H += np.outer(values, direction)
    keep = np.isfinite(H).all(axis=1)
    return grid, t[keep], H[keep]


def _fit_records(samples, order, channel, unit):
    _, t, H = samples
    records = []
    for j in range(3):
        if len(t) >= 2 * (order + 1):
            _, rms, share = _fit(t, H[:, j], order)
            records.append(
                {"order": order, "channel": channel, "axis": AXES[j], f"rms_{unit}": rms, "rms_percent": share}
            )
    return records


def _from_error(subject: Subject, errors: dict[int, str], model: str):
    """Plume paper eqs 6-8: sixth-order polynomials of attitude error and, where telemetered, of the controller's rate error."""
    tlm, k = subject.telemetry, subject.controller()
    if not errors:
        tlm.channel("attitude_error_y")
    inertia = subject.known_inertia()
    inverse = hankel_order_two(k) if model == "hankel" else low_order(k)
    grid: Grid = grid_for([tlm.channel(n) for n in errors.values()])
    torque = np.full((grid.count, 3), np.nan)
    at, how = grid.seconds, "derivative of the polynomial"
    for j, name in errors.items():
        c = tlm.channel(name).usable
        p, _, _ = _fit(grid.of(c.tai_ns), c.values, 6)
        e, rate, acceleration = p(at), p.deriv()(at), p.deriv(2)(at)
        rate_name = f"controller_rate_error_{AXES[j]}"
        if rate_name in tlm:  # eq 8 accepts only this one: it holds KP e, to be taken off
            r = tlm.channel(rate_name).usable
            q, _, _ = _fit(grid.of(r.tai_ns), r.values, 6)
            rate, how = q(at) - k.kp_per_s * e, "controller_rate_error less KP e"
        torque[:, j] = (
            -inertia[j, j] / inverse.gain
            * (acceleration + inverse.damping_per_s * rate + inverse.stiffness_per_s2 * e)
        )  # fmt: skip
    return grid, torque, how
