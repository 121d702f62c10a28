"""The slew that would tell most of the inertia tensor, after what has been flown.

A rest-to-rest turn about one body direction u adds S^T S = n(u u^T) sum (r - mean r)^2 to what is known, r its rate
at each sample, the hold before and after it counted: the start momentum is common to all samples and is solved for
with them, which takes the mean off.  That the body turns meanwhile is left out: after a turn of
25 degrees sigmas are too large by up to 7 %.

What has been flown counts as `asflown inertia` finds it, with its sigma: gravity, outside torques and noise as they were.  A new turn is
worth as much, for its S^T S, as those flown: a sample's noise is scaled so that their information is what the fit says.

Chosen is the direction with the smallest determinant of the posterior covariance (D-optimal: the same whatever the
axes and units), starting from a prior of Feldman and Lee's requirement, 10 % on moments and 75 kg m2 on products, one
sigma each.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
import scipy

from ...dynamics.rigid_body import ELEMENTS
from ...kit.digits import scaled_unit
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.regression import noise_sigma
from ...kit.result import Estimate, per_spin_inertia, recorded
from ...kit.schema import Annotated, Doc, NotRequired, Number, TypedDict, Vector
from ...kit.table import Table
from ...kit.timeline import NS, cadence_ns, seconds_since, utc_to_tai_ns
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ..subject import subject_of
from .excitation import excitation, named, normal_matrix
from .gather import check_wheels
from .prior import PRODUCT_SHARE, prior_sigma
from .tensor import whole_motion_of

if TYPE_CHECKING:
    from ...craft.model import Craft, CraftAt
    from ...telemetry.telemetry import Channel, Telemetry
    from ..subject import Subject

#: Nominal noise of a sample of body and wheel rate. [rad/s]
RATE_SIGMA, WHEEL_SIGMA = 2e-6, 0.005

_DIRECTIONS = 2000  # over the sphere: neighbours 4 degrees apart
_SLOWER = np.linspace(1.0, 0.05, 20)  # rates tried, as shares of that wanted
_HOLD_S = 60.0
_CADENCE_S = 4.0  # of the samples of a plan from nothing
_SEEN = 1e-4  # of the largest information: what is less has not been flown
_NOISE_WINDOW = 5.0  # half-width of the fits whose residuals are the rates' noise, in samples

NOISE_ONLY = Kind(
    "inertia.plan-noise-only", Severity.CAUTION,
    "the sigmas include noise only: scale errors of the spin inertia and of the gyros add 0.2 to 1 %",
)  # fmt: skip
NOT_FITTED = Kind(
    "inertia.plan-not-fitted", Severity.SUSPECT,
    "the fit of what has been flown did not settle: its sigma here is that of the sensors' noise alone", "Take a shorter window.",
)  # fmt: skip
RATIOS_ONLY = Kind(
    "inertia.plan-ratios-only", Severity.NOTE,
    "the wheels' spin inertia is not known: sigmas are per unit spin inertia, and the prior of products is {product_percent:.1f} % "
    "of the mean moment", "Give the wheels' spin_inertia in the craft file.",
)  # fmt: skip
LIMIT_UNKNOWN = Kind(
    "inertia.plan-limit-unknown", Severity.CAUTION,
    "the {limit} of the wheels is not in the craft file: the turn may exceed what they can give",
    "Add it to the [[wheels]] of the craft file.",
)  # fmt: skip
NO_TURN_ABOUT = Kind(
    "inertia.plan-no-turn", Severity.NOTE, "no turn about {axes} fits the wheels' limits, however slow",
    "Plan a smaller --angle.",
)  # fmt: skip


class TurnRecord(TypedDict):
    axis: Annotated[Vector, Doc("body axes, in the sense of the turn")]
    angle_rad: Number
    rate_rad_s: Annotated[Number, Doc("largest; less than asked where wheels or angle do not allow it")]
    acceleration_rad_s2: Number
    duration_s: Number
    limited_by_wheels: bool
    gain_nats: Annotated[Number, Doc("half the fall of the log determinant of the covariance")]
    rank: int
    inertia_sigma_kgm2: Annotated[dict[str, Number] | None, Doc("what the turn would leave, by element")]
    inertia_sigma_per_spin_inertia: NotRequired[dict[str, Number]]


class SlewPlanRecord(TypedDict):
    """JSON of `asflown inertia plan`.  Where the wheels' spin inertia is unknown the keys in kg m2 and N m s are null and their
    siblings per unit spin inertia hold the values."""

    craft: str
    criterion: str
    unit: Annotated[str, Doc("kg m2, or per spin inertia")]
    rank_before: int
    inertia_sigma_before_kgm2: Annotated[dict[str, Number] | None, Doc("by element")]
    best: TurnRecord
    others: list[TurnRecord]
    momentum_sigma_Nms: Annotated[Vector | None, Doc("noise of a sample")]
    rate_sigma_rad_s: Annotated[Number, Doc("noise of a sample of body rate")]
    cadence_s: Number
    inertia_sigma_before_per_spin_inertia: NotRequired[dict[str, Number]]
    momentum_sigma_per_spin_inertia_rad_s: NotRequired[Vector]


@dataclass(frozen=True)
class PlannedTurn:
    """One turn, and what it would leave: ``inertia_sigma_kgm2`` (6,), one sigma in the order of ELEMENTS.

    ``gain``: half the fall of the covariance's log determinant, nats.  ``rate_rad_s`` and ``acceleration_rad_s2`` are those
    asked for, or less: where the wheels cannot give them (``limited``), or the angle is too small to reach the rate."""

    axis: np.ndarray
    angle_rad: float
    rate_rad_s: float
    acceleration_rad_s2: float
    duration_s: float
    inertia_sigma_kgm2: np.ndarray
    gain: float
    rank: int
    limited: bool

    def record(self, *, relative: bool) -> dict:
        sigma = dict(zip(ELEMENTS, self.inertia_sigma_kgm2, strict=True))
        record = {
            "axis": self.axis,
            "angle_rad": self.angle_rad,
            "rate_rad_s": self.rate_rad_s,
            "acceleration_rad_s2": self.acceleration_rad_s2,
            "duration_s": self.duration_s,
            "limited_by_wheels": self.limited,
            "gain_nats": self.gain,
            "rank": self.rank,
            "inertia_sigma_kgm2": sigma,
        }
        if relative:
            per_spin_inertia(record, ["inertia_sigma_kgm2"])
        return record | {"sigma": sigma}


@dataclass(frozen=True, kw_only=True, repr=False)
class SlewPlanResult(Estimate):
    """The best turn, and those about the body axes beside it.  Sigmas in kg m2, or per unit spin inertia where ``relative``."""

    RECORD: ClassVar[type] = SlewPlanRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {"sigma_before": "inertia_sigma_before_kgm2"}

    inertia_kgm2: np.ndarray  # (3, 3), what the prior is centred on
    rank_before: int
    inertia_sigma_before_kgm2: np.ndarray  # (6,)
    turns: tuple[PlannedTurn, ...]  # the best first
    momentum_sigma_Nms: np.ndarray  # (3,), noise of a sample
    rate_sigma_rad_s: float
    cadence_s: float
    relative: bool

    @property
    def best(self) -> PlannedTurn:
        return self.turns[0]

    def _record(self) -> dict:
        before = dict(zip(ELEMENTS, self.inertia_sigma_before_kgm2, strict=True))
        best, *others = (t.record(relative=self.relative) for t in self.turns)
        record = {
            "craft": self.craft,
            "criterion": self.method,
            "unit": "per spin inertia" if self.relative else "kg m2",
            "rank_before": self.rank_before,
            "inertia_sigma_before_kgm2": before,
            "best": best,
            "others": others,
            "momentum_sigma_Nms": self.momentum_sigma_Nms,
            "rate_sigma_rad_s": self.rate_sigma_rad_s,
            "cadence_s": self.cadence_s,
        }
        if self.relative:
            per_spin_inertia(record, ["inertia_sigma_before_kgm2", "momentum_sigma_Nms"])
        return record | {"sigma_before": before}

    def _tables(self) -> tuple[Table, ...]:
        unit = "per unit spin inertia" if self.relative else "kg m2"
        b = self.best
        title = (
            f"Next slew for the inertia tensor · {self.craft} · rank so far {self.rank_before}\n"
            f"  best: {np.degrees(b.angle_rad):.3g} deg about {named(b.axis)} at {_rate(b.rate_rad_s)}, {b.duration_s:.0f} s: "
            f"rank {b.rank}"
        )
        rows = [("now", "", *_digits(self.inertia_sigma_before_kgm2))]
        for t in self.turns:
            slow = f", {_rate(t.rate_rad_s)}" if t.limited else ""
            rows.append((f"about {named(t.axis)}{slow}", f"{t.gain:.1f}", *_digits(t.inertia_sigma_kgm2)))
        return (Table(title, tuple(rows), (f"one sigma [{unit}]", "gain", *ELEMENTS)),)


def _rate(rate_rad_s: float) -> str:
    factor, unit = scaled_unit(rate_rad_s, "rad/s")
    return f"{factor * rate_rad_s:.3g} {unit}"


def _digits(sigma) -> tuple[str, ...]:
    return tuple(f"{s:.3g}" for s in sigma)


@recorded
def slew_plan(
    craft: Craft,
    telemetry: Telemetry | None = None,
    *,
    angle_rad: float = np.radians(25.0),
    rate_rad_s: float = 2e-3,
    acceleration_rad_s2: float = 2e-5,
    date: str | None = None,
    wheel_rates_rad_s=None,
    wheel_sigma_rad_s: float = WHEEL_SIGMA,
) -> SlewPlanResult:
    """The rest-to-rest turn that would tell most of the inertia tensor, within the wheels' limits.

    Parameters
    ----------
    craft : Craft
        Inertia, wheels and their limits.
    telemetry : Telemetry, optional
        What has been flown: body and wheel rates.  Unless given, nothing: samples every 4 s, nominal noise.
    angle_rad, rate_rad_s, acceleration_rad_s2 : float
        Angle of the turn, and its largest rate and acceleration.
    date : str, optional
        UTC date of the craft where no telemetry is given; the latest unless given.
    wheel_rates_rad_s : array_like of shape (n,), optional
        Rates of the wheels in service at the start of the turn; those at the end of the telemetry unless given, else at rest.
    wheel_sigma_rad_s : float
        Noise of a sample of a wheel's rate.

    Returns
    -------
    SlewPlanResult
        The turn with the smallest determinant of the posterior covariance (D-optimal), and those about the body axes.

    Raises
    ------
    BadInput
        Where the inertia is not known, for a turn that is none, and where the wheels can give no such turn.
    """
    turn = _Turn.asked(angle_rad, rate_rad_s, acceleration_rad_s2)
    now, flown, doubts = _begun(craft, telemetry, date)
    I_B = now.inertia_kgm2
    if I_B is None:
        raise BadInput(
            f"the inertia of {now.craft.name} is not known, and the plan starts from it",
            remedy='Give it: --inertia "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2.',
        )
    noise = momentum_noise(I_B, now.wheels, flown.rate_sigma, wheel_sigma_rad_s)
    known, share = _known(I_B, flown, noise)
    noise = noise * share
    wheels = _Wheels(now, flown.wheel_rates if wheel_rates_rad_s is None else wheel_rates_rad_s)
    tried = [
        _tried(axis, speed, turn, flown.cadence_s, known, noise)
        for axis, speed in zip(*_possible(wheels, I_B, turn), strict=True)
    ]
    if not tried:
        raise BadInput(
            f"no turn by {np.degrees(angle_rad):.3g} deg fits the wheels' limits, however slow",
            remedy="Plan a smaller --angle, or a record at whose end the wheels turn slower.",
        )
    best = max(tried, key=lambda t: t.gain)
    chosen = [best] + [t for t in tried if np.abs(t.axis).max() == 1.0 and t is not best]
    return SlewPlanResult(
        craft=now.craft.name,
        epoch="" if telemetry is None else telemetry.epoch_label,
        method="D-optimal",
        inertia_kgm2=I_B,
        rank_before=excitation(flown.omega_B, flown.rate_sigma).rank,
        inertia_sigma_before_kgm2=np.sqrt(np.diag(np.linalg.inv(known))),
        turns=tuple(t.planned(flown) for t in chosen),
        momentum_sigma_Nms=noise,
        rate_sigma_rad_s=flown.rate_sigma,
        cadence_s=flown.cadence_s,
        relative=now.relative,
        doubts=Doubts([*doubts, *wheels.doubts, *_plan_doubts(now, tried)]),
    )


def _plan_doubts(now: CraftAt, tried: list[_Tried]) -> list[Doubt]:
    missing = [a for j, a in enumerate(AXES) if not any(abs(t.axis[j]) == 1.0 for t in tried)]
    doubts = [NO_TURN_ABOUT(axes=missing)] if missing else []
    doubts.append(NOISE_ONLY())
    if now.relative:
        doubts.append(RATIOS_ONLY(product_percent=100 * PRODUCT_SHARE))
    return doubts


# ---- what has been flown ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _Flown:
    """Body rates (N, 3) of what has been flown, wheel rates at its end (None: at rest), cadence, noise of a rate sample, and what
    method 'consistent' finds in it: information (6, 6) on the elements, that of the craft's own tensor included where slews do not
    identify all of it; None where nothing is found."""

    omega_B: np.ndarray = field(default_factory=lambda: np.zeros((1, 3)))
    wheel_rates: list[float] | None = None
    cadence_s: float = _CADENCE_S
    rate_sigma: float = RATE_SIGMA
    found: np.ndarray | None = None
    leaning: bool = False

    @property
    def square(self) -> np.ndarray:
        """Sum of w w^T about the mean, (3, 3)."""
        mean = self.omega_B.mean(axis=0)
        return (self.omega_B - mean).T @ (self.omega_B - mean)


def _begun(craft: Craft, telemetry: Telemetry | None, date: str | None) -> tuple[CraftAt, _Flown, Doubts]:
    """The craft on the telemetry's date, or on the one given; what has been flown, and doubts of both."""
    if telemetry is None:
        now = craft.at(None if date is None else int(utc_to_tai_ns(date)))
        return now, _Flown(), now.doubts
    subject = subject_of(telemetry, craft)
    check_wheels(subject)
    flown = _flown_in(subject)
    if excitation(flown.omega_B, flown.rate_sigma).rank == 0:
        return subject.craft, flown, subject.doubts
    answer = whole_motion_of(subject)
    doubts = subject.doubts + Doubts([d for d in answer.doubts if d is not None and d.severity >= Severity.SUSPECT])
    if not np.isfinite(answer.covariance).all():
        return subject.craft, flown, doubts + Doubts([NOT_FITTED()])
    found = np.linalg.inv(answer.covariance)
    return subject.craft, replace(flown, found=found, leaning=answer.excitation.rank < 6), doubts


def _known(I_B: np.ndarray, flown: _Flown, noise: np.ndarray) -> tuple[np.ndarray, float]:
    """Information (6, 6) on the elements so far, and the share of a sample's ``noise`` (3,) that it shows."""
    prior, by_samples = np.diag(1 / prior_sigma(I_B) ** 2), _information(flown.square, noise)
    if flown.found is None:
        return prior + by_samples, 1.0
    told = flown.found - prior if flown.leaning else flown.found
    values, vectors = np.linalg.eigh(by_samples)
    seen = vectors[:, values > _SEEN * values[-1]]
    both = [np.linalg.slogdet(seen.T @ m @ seen) for m in (told, by_samples)]
    share = float(np.exp((both[1][1] - both[0][1]) / (2 * seen.shape[1]))) if both[0][0] > 0 else 1.0
    return flown.found, share


def _flown_in(subject: Subject) -> _Flown:
    """Raises BadInput where body or wheel rates are missing."""
    telemetry = subject.telemetry
    rates = [telemetry.channel(f"body_rate_{a}").usable for a in AXES]
    tai_ns, omega = together(telemetry, [c.name for c in rates])
    wheels = [c.usable for c, _ in subject.wheels()]
    if min(len(tai_ns), *(len(c.values) for c in [*rates, *wheels])) < 2:
        raise BadInput(
            "the body rates are hardly ever known together",
            file=telemetry.source or None,
            remedy="Take a longer record, or leave the file out to plan from nothing.",
        )
    sigma = max(_noise_of(c) for c in rates)
    at_end = [float(np.median(c.values[-5:])) for c in wheels]
    omega = omega[np.isfinite(omega).all(axis=1)]
    return _Flown(omega, at_end, cadence_ns(tai_ns) / NS, sigma if sigma > 0 else RATE_SIGMA)


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


# ---- the turn --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Turn:
    """A turn that speeds up, coasts and slows down."""

    angle: float
    rate: float
    acceleration: float

    @classmethod
    def asked(cls, angle: float, rate: float, acceleration: float) -> _Turn:
        """Raises BadInput for a turn that is none."""
        for value, what in ((angle, "angle"), (rate, "rate"), (acceleration, "acceleration")):
            if not 0 < value < 1e6:
                raise BadInput(
                    f"the {what} of a turn must be positive, not {value:g}", remedy=f"Give a positive {what}."
                )
        return cls(angle, rate, acceleration)

    @property
    def top(self) -> float:
        """The largest rate, which is less than wanted where the angle is too small to reach it."""
        return float(min(self.rate, np.sqrt(self.angle * self.acceleration)))

    @property
    def duration(self) -> float:
        return self.angle / self.top + self.top / self.acceleration

    def rate_at(self, t) -> np.ndarray:
        return np.clip(self.acceleration * np.minimum(t, self.duration - t), 0.0, self.top)

    def sampled(self, cadence_s: float) -> np.ndarray:
        """Rate at every sample of the turn and of the holds around it, (N,)."""
        return self.rate_at(np.arange(-_HOLD_S, self.duration + _HOLD_S, cadence_s))

    def slower(self, share: float) -> _Turn:
        """The same turn at a share of its rate, slower in time alone."""
        return _Turn(self.angle, share * self.rate, share**2 * self.acceleration)


class _Tried(NamedTuple):
    """A turn about an axis: the rise of the information's log determinant, its rates, and the information after it."""

    gain: float
    axis: np.ndarray
    share: float
    turn: _Turn
    course: np.ndarray
    after: np.ndarray

    def planned(self, flown: _Flown) -> PlannedTurn:
        rank = excitation(np.vstack([flown.omega_B, np.outer(self.course, self.axis)]), flown.rate_sigma).rank
        sigma = np.sqrt(np.diag(np.linalg.inv(self.after)))
        turn = self.turn
        return PlannedTurn(
            self.axis, turn.angle, turn.top, turn.acceleration, turn.duration, sigma, self.gain / 2, rank, bool(self.share < 1)
        )  # fmt: skip


def _tried(axis, share: float, asked: _Turn, cadence_s: float, known: np.ndarray, noise: np.ndarray) -> _Tried:
    turn = asked.slower(share)
    course = turn.sampled(cadence_s)
    after = known + _information(np.outer(axis, axis) * np.sum((course - course.mean()) ** 2), noise)
    return _Tried(_log_det(after) - _log_det(known), axis, share, turn, course, after)


def _log_det(matrix) -> float:
    return float(np.linalg.slogdet(matrix)[1])


def _directions() -> np.ndarray:
    """Body axes both ways, and a spiral of even spacing over the sphere."""
    k = np.arange(_DIRECTIONS)
    z = 1 - (2 * k + 1) / _DIRECTIONS
    turn = k * np.pi * (3 - np.sqrt(5))
    spiral = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    return np.vstack([np.eye(3), -np.eye(3), spiral])


def _possible(wheels: _Wheels, I_B, turn: _Turn) -> tuple[np.ndarray, np.ndarray]:
    """Directions (C, 3) that the wheels can turn the body about, and the share of the rate they can give, (C,).

    Of the two ways round a body axis the faster one is kept, the positive one where both are alike."""
    axes = _directions()
    speed = np.zeros(len(axes))
    for share in _SLOWER:
        left = np.flatnonzero(speed == 0)
        if len(left):
            speed[left[wheels.can(axes[left], I_B, turn.slower(share))]] = share
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
        if len(self.start) != len(self.spin):
            raise BadInput(
                f"{len(self.start)} wheel rates for {len(self.spin)} wheels",
                remedy=f"Give one for each of {', '.join(w.name for w in now.wheels)}.",
            )

    @property
    def doubts(self) -> list[Doubt]:
        limits = (("rate limit", self.rate_limit), ("torque limit", self.torque_limit))
        return [LIMIT_UNKNOWN(limit=what) for what, limit in limits if not len(limit) or np.isinf(limit).any()]

    def can(self, axes, I_B, turn: _Turn) -> np.ndarray:
        """Which of the directions (C, 3) can be turned about within all limits, (C,) bool."""
        if not len(self.spin):
            return np.ones(len(axes), bool)
        t = np.linspace(0.0, turn.duration, 81)
        r = turn.rate_at(t)
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(t))])
        h0 = (self.spin * self.start) @ self.axes
        back = scipy.spatial.transform.Rotation.from_rotvec((-turned[None, :, None] * axes[:, None, :]).reshape(-1, 3))
        h = back.apply(h0).reshape(len(axes), len(t), 3) - r[None, :, None] * (axes @ I_B)[:, None, :]
        share = np.linalg.pinv((self.spin[:, None] * self.axes).T)  # rate of each wheel per momentum
        rates = self.start + (h - h0) @ share.T
        torques = self.spin * np.gradient(rates, t, axis=1)
        within = (np.abs(rates) <= self.rate_limit).all(axis=(1, 2))
        return within & (np.abs(torques) <= self.torque_limit).all(axis=(1, 2))
