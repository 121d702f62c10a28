"""The slew that would tell most of the inertia tensor, after what has been flown.

A rest-to-rest turn about one body direction u adds S^T S = n(u u^T) sum (r - mean r)^2 to what is known, r its rate
at each sample, the hold before and after it counted: the start momentum is common to all samples and is solved for
with them, which takes the mean off.  That the body turns meanwhile is left out: after a turn of
25 degrees sigmas are too large by up to 7 %.

Chosen is the direction with the smallest determinant of the posterior covariance (D-optimal: the same whatever the
axes and units), starting from a prior of 001's requirement, 10 % on moments and 75 kg m2 on products, one sigma each.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ...dynamics.rigid_body import ELEMENTS
from ...kit.errors import BadInput
from ...kit.regression import noise_sigma
from ...kit.timeline import NS, cadence_ns, seconds_since
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ..subject import subject_of
from .excitation import excitation, named, normal_matrix
from .prior import prior_sigma

if TYPE_CHECKING:
    from ...craft.model import Craft, CraftAt
    from ...telemetry.telemetry import Channel, Telemetry

#: Nominal noise of a sample of body and wheel rate. [rad/s]
RATE_SIGMA, WHEEL_SIGMA = 2e-6, 0.005

_DIRECTIONS = 2000  # over the sphere: neighbours 4 degrees apart
_SLOWER = np.linspace(1.0, 0.05, 20)  # rates tried, as shares of that wanted
_HOLD_S = 60.0
_NOISE_WINDOW = 5.0  # half-width of the fits whose residuals are the rates' noise, in samples


@dataclass(frozen=True)
class SlewOption:
    """One turn, and what it would leave: ``sigma`` (6,), one sigma in the order of ELEMENTS.

    ``gain``: half the fall of the covariance's log determinant, nats.  ``rate`` and ``acceleration`` are those wanted,
    or less: where the wheels cannot give them (``limited``), or the angle is too small to reach the rate."""

    axis: np.ndarray
    angle: float
    rate: float
    acceleration: float
    duration_s: float
    sigma: np.ndarray
    gain: float
    rank: int
    limited: bool

    def record(self) -> dict:
        return {
            "axis": self.axis,
            "angle_rad": self.angle,
            "rate_rad_s": self.rate,
            "acceleration_rad_s2": self.acceleration,
            "duration_s": self.duration_s,
            "limited_by_wheels": self.limited,
            "gain_nats": self.gain,
            "rank": self.rank,
            "sigma": dict(zip(ELEMENTS, self.sigma, strict=True)),
        }


@dataclass(frozen=True)
class SlewPlan:
    """The best turn, and the body axes beside it.  Sigmas in kg m2, or per unit spin inertia where ``relative``."""

    craft: str
    inertia: np.ndarray  # (3, 3), what the prior is centred on
    rank_before: int
    sigma_before: np.ndarray
    options: tuple[SlewOption, ...]  # the best first
    momentum_sigma: np.ndarray  # (3,), noise of a sample [N m s]
    cadence_s: float
    relative: bool
    doubts: tuple[str, ...]

    @property
    def best(self) -> SlewOption:
        return self.options[0]

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        return {
            "craft": self.craft,
            "criterion": "D-optimal",
            "unit": "per spin inertia" if self.relative else "kg m2",
            "rank_before": self.rank_before,
            "sigma_before": dict(zip(ELEMENTS, self.sigma_before, strict=True)),
            "best": self.best.record(),
            "others": [o.record() for o in self.options[1:]],
            "momentum_sigma_Nms": None if self.relative else self.momentum_sigma,
            "cadence_s": self.cadence_s,
            "doubts": list(self.doubts),
        }

    def __str__(self) -> str:
        """The table a person scans."""
        unit = "per unit spin inertia" if self.relative else "kg m2"
        b = self.best
        lines = [
            f"Next slew for the inertia tensor · {self.craft} · rank so far {self.rank_before}",
            f"  best: {np.degrees(b.angle):.3g} deg about {named(b.axis)} at {1e3 * b.rate:.3g} mrad/s, {b.duration_s:.0f} s: "
            f"rank {b.rank}",
            f"  one sigma [{unit}]" + " " * (19 - len(unit)) + "gain" + "".join(f"{c:>9}" for c in ELEMENTS),
            _row("now", None, self.sigma_before),
        ]
        for o in self.options:
            slow = f", {1e3 * o.rate:.2g} mrad/s" if o.limited else ""
            lines.append(_row(f"about {named(o.axis)}{slow}", o.gain, o.sigma))
        return "\n".join(lines)


def _row(what: str, gain, sigma) -> str:
    return f"    {what:<30}{'' if gain is None else f'{gain:.1f}':>6}" + "".join(f"{s:>9.3g}" for s in sigma)


def plan_slew(
    now: CraftAt,
    *,
    flown_B=None,
    angle: float = np.radians(25.0),
    rate: float = 2e-3,
    acceleration: float = 2e-5,
    wheel_rates=None,
    rate_sigma: float = RATE_SIGMA,
    wheel_sigma: float = WHEEL_SIGMA,
    cadence_s: float = 4.0,
) -> SlewPlan:
    """The best turn by ``angle`` [rad], at most at ``rate`` [rad/s] and ``acceleration`` [rad/s^2].

    ``flown_B``: body rates (N, 3) of what has been flown [rad/s], every ``cadence_s``; None: nothing.  ``wheel_rates``
    at its start [rad/s], one a wheel in service (None: all at rest).  ``rate_sigma``, ``wheel_sigma``: noise of a sample [rad/s].
    Raises BadInput for an inertia not known, a turn that is none, and where the wheels can give no such turn."""
    I_B = now.inertia_kgm2
    if I_B is None:
        raise BadInput(
            f"the inertia of {now.craft.name} is not known, and the plan starts from it",
            remedy='Give it: --inertia "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2.',
        )
    for value, what in ((angle, "angle"), (rate, "rate"), (acceleration, "acceleration"), (cadence_s, "cadence")):
        if not 0 < value < 1e6:
            raise BadInput(f"a turn of {what} {value:g} is none", remedy=f"Give a positive {what}.")
    noise = momentum_noise(I_B, now.wheels, rate_sigma, wheel_sigma)
    prior = np.diag(1 / prior_sigma(I_B) ** 2)
    flown = np.zeros((1, 3)) if flown_B is None else np.asarray(flown_B, float).reshape(-1, 3)
    flown = flown[np.isfinite(flown).all(axis=1)]
    known = prior + _information((flown - flown.mean(axis=0)).T @ (flown - flown.mean(axis=0)), noise)
    wheels = _Wheels(now, wheel_rates)
    options = []
    for axis, speed in zip(*_possible(wheels, I_B, angle, rate, acceleration), strict=True):
        course = _rates(angle, speed * rate, speed**2 * acceleration, cadence_s)
        after = known + _information(np.outer(axis, axis) * np.sum((course - course.mean()) ** 2), noise)
        options.append((_log_det(after) - _log_det(known), axis, speed, course, after))
    if not options:
        raise BadInput(
            f"no turn by {np.degrees(angle):.3g} deg fits the wheels' limits, however slow",
            remedy="Plan a smaller --angle, or a record at whose end the wheels turn slower.",
        )
    best = max(options, key=lambda o: o[0])
    missing = [a for j, a in enumerate("xyz") if not any(abs(o[1][j]) == 1.0 for o in options)]
    if missing:
        wheels.doubts.append(f"no turn about {', '.join(missing)} fits the wheels' limits, however slow")
    chosen = [best] + [o for o in options if np.abs(o[1]).max() == 1.0 and o is not best]
    rows = tuple(
        SlewOption(
            axis, angle, _top(angle, speed * rate, speed**2 * acceleration), speed**2 * acceleration,
            _duration(angle, speed * rate, speed**2 * acceleration),
            np.sqrt(np.diag(np.linalg.inv(after))), gain / 2,
            excitation(np.vstack([flown, np.outer(course, axis)]), rate_sigma).rank, bool(speed < 1),
        )
        for gain, axis, speed, course, after in chosen
    )  # fmt: skip
    return SlewPlan(
        now.craft.name, I_B, excitation(flown, rate_sigma).rank, np.sqrt(np.diag(np.linalg.inv(known))), rows, noise, cadence_s,
        now.relative, tuple(dict.fromkeys([*now.doubts, *wheels.doubts, *_doubts(now)])),
    )  # fmt: skip


def what_was_flown(telemetry: Telemetry, craft: Craft) -> tuple[CraftAt, dict]:
    """The craft on the record's date, and what ``plan_slew`` takes of the record: rates and their noise, wheel rates at its end.

    Raises BadInput where body or wheel rates are missing."""
    subject = subject_of(telemetry, craft)
    rates = [telemetry.channel(f"body_rate_{a}").usable for a in AXES]
    tai_ns, flown = together(telemetry, [c.name for c in rates])
    wheels = [c.usable for c, _ in subject.wheels()]
    if min(len(tai_ns), *(len(c.values) for c in [*rates, *wheels])) < 2:
        raise BadInput(
            "the body rates are hardly ever known together",
            file=telemetry.source or None,
            remedy="Take a longer record, or leave the file out to plan from nothing.",
        )
    sigma = max(_noise_of(c) for c in rates)
    at_end = [float(np.median(c.values[-5:])) for c in wheels]
    found = {
        "flown_B": flown, "wheel_rates": at_end, "cadence_s": cadence_ns(tai_ns) / NS,
        "rate_sigma": sigma if sigma > 0 else RATE_SIGMA,
    }  # fmt: skip
    return replace(subject.craft, doubts=subject.doubts), found


def _noise_of(channel: Channel) -> float:
    """Of one sample; 0 where the record is too short to tell."""
    t = seconds_since(channel.tai_ns, channel.tai_ns[0])
    if len(t) < 20:
        return 0.0
    return float(
        np.nan_to_num(noise_sigma(t, channel.values, degree=3, half_width=_NOISE_WINDOW * channel.cadence_ns / NS))
    )


def momentum_noise(I_B, wheels, rate_sigma: float, wheel_sigma: float) -> np.ndarray:
    """One sigma of a sample of I w + h_w about each body axis, (3,) [N m s]."""
    axes = np.array([w.axis for w in wheels]).reshape(-1, 3)
    spin = np.array([1.0 if w.spin_inertia is None else w.spin_inertia for w in wheels])
    return np.sqrt(rate_sigma**2 * np.sum(I_B**2, axis=1) + wheel_sigma**2 * (spin**2 @ axes**2))


def _information(square, noise) -> np.ndarray:
    return normal_matrix(square, 1 / noise**2)


def _log_det(matrix) -> float:
    return float(np.linalg.slogdet(matrix)[1])


def _doubts(now: CraftAt) -> list[str]:
    doubts = [
        "the sigmas are those of noise alone: errors of the spin inertia and of the gyros' scale add their share, 0.2 to 1 %"
    ]
    if now.relative:
        doubts.append("only ratios to the spin inertia are known: products start from 1 % of the mean moment")
    return doubts


# ---- the turn ----------------------------------------------------------------------------------------------


def _top(angle: float, rate: float, acceleration: float) -> float:
    """The largest rate of a turn, which is less than wanted where the angle is too small to reach it."""
    return float(min(rate, np.sqrt(angle * acceleration)))


def _duration(angle: float, rate: float, acceleration: float) -> float:
    """Of a turn that speeds up, coasts and slows down."""
    top = _top(angle, rate, acceleration)
    return angle / top + top / acceleration


def _rates(angle: float, rate: float, acceleration: float, cadence_s: float) -> np.ndarray:
    """Rate at every sample of a turn and of the holds around it, (N,)."""
    whole = _duration(angle, rate, acceleration)
    t = np.arange(-_HOLD_S, whole + _HOLD_S, cadence_s)
    return _trapezoid(t, whole, angle, rate, acceleration)


def _trapezoid(t, whole: float, angle: float, rate: float, acceleration: float) -> np.ndarray:
    return np.clip(acceleration * np.minimum(t, whole - t), 0.0, _top(angle, rate, acceleration))


def _directions() -> np.ndarray:
    """Body axes both ways, and a spiral of even spacing over the sphere."""
    k = np.arange(_DIRECTIONS)
    z = 1 - (2 * k + 1) / _DIRECTIONS
    turn = k * np.pi * (3 - np.sqrt(5))
    spiral = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    return np.vstack([np.eye(3), -np.eye(3), spiral])


def _possible(wheels: _Wheels, I_B, angle, rate, acceleration) -> tuple[np.ndarray, np.ndarray]:
    """Directions (C, 3) that the wheels can turn the body about, and the share of the rate they can give, (C,).

    Of the two ways round a body axis the faster one is kept, the positive one where both are alike."""
    axes = _directions()
    speed = np.zeros(len(axes))
    for share in _SLOWER:
        left = np.flatnonzero(speed == 0)
        if len(left):
            speed[left[wheels.can(axes[left], I_B, angle, share * rate, share**2 * acceleration)]] = share
    speed[:3] = np.where(speed[3:6] > speed[:3], 0.0, speed[:3])
    speed[3:6] = np.where(speed[:3] > 0, 0.0, speed[3:6])
    return axes[speed > 0], speed[speed > 0]


class _Wheels:
    """What the wheels can give: momentum follows the body's, H constant in space."""

    def __init__(self, now: CraftAt, rates):
        self.axes = np.array([w.axis for w in now.wheels]).reshape(-1, 3)
        self.spin = np.array([1.0 if w.spin_inertia is None else w.spin_inertia for w in now.wheels])
        self.start = np.zeros(len(self.spin)) if rates is None else np.asarray(rates, float)
        self.rate_limit = np.array([np.inf if w.rate_limit is None else w.rate_limit for w in now.wheels])
        self.torque_limit = np.array([np.inf if w.torque_limit is None else w.torque_limit for w in now.wheels])
        self.doubts = [
            f"the {what} of the wheels is not in the craft file, and the turn may be more than they can give"
            for what, limit in (("rate limit", self.rate_limit), ("torque limit", self.torque_limit))
            if not len(limit) or np.isinf(limit).any()
        ]
        if len(self.start) != len(self.spin):
            raise BadInput(
                f"{len(self.start)} wheel rates for {len(self.spin)} wheels",
                remedy=f"Give one for each of {', '.join(w.name for w in now.wheels)}.",
            )

    def can(self, axes, I_B, angle: float, rate: float, acceleration: float) -> np.ndarray:
        """Which of the directions (C, 3) can be turned about within all limits, (C,) bool."""
        if not len(self.spin):
            return np.ones(len(axes), bool)
        whole = _duration(angle, rate, acceleration)
        t = np.linspace(0.0, whole, 81)
        r = _trapezoid(t, whole, angle, rate, acceleration)
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(t))])
        h0 = (self.spin * self.start) @ self.axes
        back = Rotation.from_rotvec((-turned[None, :, None] * axes[:, None, :]).reshape(-1, 3))
        h = back.apply(h0).reshape(len(axes), len(t), 3) - r[None, :, None] * (axes @ I_B)[:, None, :]
        share = np.linalg.pinv((self.spin[:, None] * self.axes).T)  # rate of each wheel per momentum
        rates = self.start + (h - h0) @ share.T
        torques = self.spin * np.gradient(rates, t, axis=1)
        within = (np.abs(rates) <= self.rate_limit).all(axis=(1, 2))
        return within & (np.abs(torques) <= self.torque_limit).all(axis=(1, 2))
