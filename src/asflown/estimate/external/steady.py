"""A steady external torque from the momentum that craft and wheels gain (001 sections IV and Appendix A).

``drift``: on a quiet day the wheels take up what acts on the craft.  As printed, T = sum a J (change of rate)/(time) from
two readings and one mean spin inertia, in axes taken not to turn.  An Earth-pointed craft does turn, by some 1e-8 rad/s,
and its wheels' momentum with it: w x H is as large as the torque's smaller parts.  ``corrected`` is the slope on time of

    y = h_w + I w + w x int H dt                               (body axes, w the mean turn)

``momentum``: with slews, H = R (I w + h_w) in space, regressed on int R dt (a torque fixed in the body) or on time (one
fixed in space); rows are turned back into the body, where noise belongs to axes.

Noise of neighbouring samples may be alike.  Regressors vary slowly against it, so only its long-run variance counts: that
of the residuals times how many of them are worth one (``kit.regression.memory``), for each body axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from ...craft.model import Craft
from ...kit.errors import BadInput, some_of
from ...kit.regression import robust_line
from ...kit.rotations import rotation, turned_by
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ...telemetry.telemetry import Telemetry
from ..subject import (
    FEWEST,
    GYRO_BIAS,
    INERTIA_SHARE,
    SPIN_SHARE,
    UNTOLD_TURN,
    Samples,
    Subject,
    samples_of,
    slews,
    subject_of,
    thrusters_firing,
)
from .regress import OUTLYING, Fit, regress
from .result import ExternalTorque

METHODS = ("drift", "momentum")
VARIANTS = ("corrected", "printed")
FRAMES = ("body", "inertial")

#: The craft's alternative that holds the printed method's one spin inertia.
_PRINTED_SPIN = "001-drift"

_FAR = 0.5  # rad from the first attitude: beyond it one mean turn does not do
_FEW_WORTH = 20  # independent samples below which a sigma is doubted
_CHANGED = 4.0  # sigma between the torques of both halves


def external_torque(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str | None = None,
    variant: str = "corrected",
    frame: str = "body",
    turn_rad_s=None,
) -> ExternalTorque:
    """The constant torque on the craft that its momentum shows. [N m]

    ``method``: 'drift' (no slews), 'momentum', or None: drift where the record holds no slew.  ``variant``: 'corrected', or
    'printed', 001 Appendix A with its faults (drift only).  ``frame``: in which the torque is constant.  ``turn_rad_s`` (3,):
    mean body rate for the drift's w x H, in place of that of quaternion or gyros.

    Raises BadInput where thrusters fire, a slew is in a drift, or channels are missing."""
    for value, allowed, what in (
        (variant, VARIANTS, "variant"),
        (frame, FRAMES, "frame"),
        (method, (None, *METHODS), "method"),
    ):
        if value not in allowed:
            raise BadInput(
                f"{what} {value!r} is not known",
                remedy=f"Choose one of: {some_of(a for a in allowed if a is not None)}.",
            )
    firing = thrusters_firing(telemetry)
    if firing:
        raise BadInput(
            f"thrusters fire in this span ({some_of(firing)}), and what they give would be taken for the external torque",
            file=telemetry.source or None,
            remedy="Narrow the span with --start and --stop to one without firings.",
        )
    turning = slews(telemetry) or _turns_far(telemetry)
    method = method or ("momentum" if frame == "inertial" or (turning and variant == "corrected") else "drift")
    if method == "momentum" and (variant == "printed" or turn_rad_s is not None):
        raise BadInput(
            "the momentum method has no printed variant and takes the turn from the attitude",
            remedy="Use --method drift, or leave --variant and --turn-rate out.",
        )
    if method == "drift" and (turning or frame == "inertial"):
        why = (
            "the craft slews or turns far in this span"
            if turning
            else "the drift of the wheels gives a torque in body axes"
        )
        raise BadInput(
            f"{why}: the drift method does not apply",
            file=telemetry.source or None,
            remedy="Use --method momentum"
            + (", or narrow the span to a hold with --start and --stop." if turning else "."),
        )
    alternative = variant == "printed" and _PRINTED_SPIN in craft.alternatives
    subject = subject_of(telemetry, craft.with_alternative(_PRINTED_SPIN) if alternative else craft)
    try:
        if variant == "printed":
            result = _printed(subject, alternative)
        else:
            result = _drift(subject, turn_rad_s) if method == "drift" else _momentum(subject, frame)
    except BadInput as why:
        raise why.within(telemetry.source) from why.__cause__
    doubts = [*subject.doubts, *result.doubts]
    if subject.relative:
        doubts.append("the wheels' spin inertia is not known: the torque is per unit spin inertia (rad/s^2), not N m")
    return replace(result, doubts=tuple(dict.fromkeys(doubts)))


def _turns_far(tlm: Telemetry) -> bool:
    """Whether the attitude leaves the first one by more than a drift allows."""
    quaternion = [f"quaternion_{m}" for m in "wxyz"]
    if all(n in tlm for n in quaternion):
        attitude = rotation(together(tlm, quaternion)[1])
        return bool(len(attitude)) and float((attitude[0].inv() * attitude).magnitude().max()) > _FAR
    if not tlm.has_axes("body_rate"):
        return False
    tai_ns, rates = together(tlm, [f"body_rate_{a}" for a in AXES])
    return len(tai_ns) > 1 and float(np.linalg.norm(np.median(rates, axis=0)) * np.ptp(tai_ns) / NS) > _FAR


def _printed(subject: Subject, alternative: bool) -> ExternalTorque:
    """001 Appendix A: the last reading less the first, whatever lies between."""
    wheels = subject.wheels()
    tai_ns, rates = together(subject.telemetry, [c.name for c, _ in wheels])
    if len(tai_ns) < 2:
        raise BadInput("fewer than two instants with all wheel rates", remedy="Take a longer record.")
    t = (tai_ns - tai_ns[0]) / NS
    per_rate = np.array([np.array(w.axis) * (w.spin_inertia or 1.0) for _, w in wheels])
    gained = (rates - rates[0]) @ per_rate
    torque = gained[-1] / t[-1]
    doubts = ["printed method: two readings, without w x H and without a sigma"]
    if not alternative:
        doubts.append(f"001's mean spin inertia is that of Cassini's wheels: {subject.craft.craft.name}'s own is used")
    used = np.zeros(len(t), bool)
    used[[0, -1]] = True
    return ExternalTorque(
        craft=subject.craft.craft.name,
        epoch=subject.telemetry.epoch_label,
        method="drift",
        variant="printed",
        frame="body",
        torque=torque,
        momentum=(rates @ per_rate).mean(axis=0),
        wheel_drift_rad_s2={w.name: float(d / t[-1]) for (_, w), d in zip(wheels, rates[-1] - rates[0], strict=True)},
        time_s=subject.telemetry.seconds(tai_ns),
        gained=gained,
        fitted=np.outer(t, torque),
        used=used,
        relative=subject.relative,
        doubts=tuple(doubts),
        settings={"spin_inertia_kg_m2": [w.spin_inertia for _, w in wheels]},
    )


@dataclass(frozen=True)
class _Course:
    """Momentum y (N, 3) in the body; how it is turned (N) from the body's axes at the start; momentum gained there per
    torque, G (N, 3, 3); what is not in the noise: ``turn_sigma`` (3,) random and ``unknown`` (3,) systematic [N m]."""

    method: str
    frame: str
    y: np.ndarray
    turned: Rotation
    G: np.ndarray
    unknown: np.ndarray
    turn_from: str
    doubts: list[str]
    turn_sigma: np.ndarray | None = None
    turn: np.ndarray | None = None
    gyroscopic: np.ndarray | None = None

    @property
    def rows(self) -> np.ndarray:
        """Start momentum and torque to momentum in the body: R^T (1, G), (N, 3, 6)."""
        back = self.turned.inv().as_matrix()
        return np.concatenate([back, back @ self.G], axis=2)


def _drift(subject: Subject, turn) -> ExternalTorque:
    s = samples_of(subject)
    t, H = s.seconds, s.momentum
    w, w_sigma, turn_from, w_unknown, doubts = _turn(s, turn)
    mean = H.mean(axis=0)
    course = _Course(
        method="drift",
        frame="body",
        y=H + np.cross(w, cumulative_trapezoid(H, t, axis=0, initial=0)),
        turned=Rotation.identity(len(t)),
        G=t[:, None, None] * np.eye(3),
        unknown=_crossed(mean, np.full(3, w_unknown)),
        turn_from=turn_from,
        doubts=doubts,
        turn_sigma=_crossed(mean, w_sigma),
        turn=w,
        gyroscopic=np.cross(w, mean),
    )
    return _fitted(subject, s, course)


def _turn(s: Samples, given):
    """Mean body rate, its sigma (3,), where it is from, what it may be off by [rad/s], and doubts."""
    t = s.seconds
    if given is not None:
        return np.asarray(given, float), np.zeros(3), "the user", 0.0, []
    if s.attitude is not None:
        turned = (s.attitude[0].inv() * s.attitude).as_rotvec()
        lines = [robust_line(t, turned[:, j]) for j in range(3)]
        w, sigma = np.array([v[1] for v, _, _ in lines]), np.sqrt([c[1, 1] for _, c, _ in lines])
        return w, sigma, "quaternion", 0.0, []
    if s.rates is not None and np.abs(w := np.median(s.rates, axis=0)).max() > 3 * GYRO_BIAS:
        doubt = (
            "the craft's turn is that of its gyros, whose bias counts as turn: a quaternion, or --turn-rate, would tell"
        )
        return w, 1.25 * s.rates.std(axis=0) / np.sqrt(len(t)), "body rates", GYRO_BIAS, [doubt]
    what = "the gyros show no turn beyond their bias" if s.rates is not None else "nothing tells how the craft turns"
    doubt = f"{what}: w x H is left out, a craft pointed at Earth is assumed. Give --turn-rate, or the quaternion"
    return np.zeros(3), np.zeros(3), "nothing", UNTOLD_TURN, [doubt]


def _crossed(H, sigma) -> np.ndarray:
    """One sigma of w x H about each axis, (3,)."""
    a, b = np.roll(np.arange(3), -1), np.roll(np.arange(3), -2)
    return np.hypot(sigma[a] * H[b], sigma[b] * H[a])


def _momentum(subject: Subject, frame: str) -> ExternalTorque:
    subject.known_inertia()
    s = samples_of(subject)
    if s.rates is None:
        raise BadInput(
            "body rates are not in the telemetry, and through a slew the body's momentum is needed",
            channel="body_rate_x",
            remedy="Narrow the span to a hold and use --method drift.",
        )
    t, doubts, unknown = s.seconds, [], np.zeros(3)
    if s.attitude is not None:
        from_start, turn_from = s.attitude[0].inv(), "quaternion"
        turned = from_start * s.attitude
    elif frame == "inertial":
        raise BadInput("no quaternion: the inertial frame is not known", remedy="Use --frame body.")
    else:
        from_start, turn_from = Rotation.identity(), "body rates"
        turned = turned_by(t, s.rates)
        unknown = _crossed(s.momentum.mean(axis=0), np.full(3, GYRO_BIAS))
        doubts.append("there is no quaternion: the attitude is that of the body rates added up, their bias with them")
    if frame == "body":
        G = cumulative_trapezoid(turned.as_matrix(), t, axis=0, initial=0)
    else:
        G = t[:, None, None] * from_start.as_matrix()
    return _fitted(subject, s, _Course("momentum", frame, s.momentum, turned, G, unknown, turn_from, doubts))


def _fitted(subject: Subject, s: Samples, course: _Course) -> ExternalTorque:
    tlm, fit = subject.telemetry, regress(course.rows, course.y)
    if course.turn_sigma is not None:
        fit = replace(fit, covariance=fit.covariance + np.diag(np.r_[np.zeros(3), course.turn_sigma**2]))
    spin = 0.0 if subject.relative else SPIN_SHARE
    systematic = np.sqrt(
        (spin * fit.shift(s.stored)) ** 2 + (INERTIA_SHARE * fit.shift(s.body)) ** 2 + course.unknown**2
    )
    gained_variance = np.einsum("nij,jk,nik->ni", course.G, fit.covariance[3:, 3:], course.G)
    inertia = "inertia_per_spin_inertia" if subject.craft.relative else "inertia_kg_m2"
    return ExternalTorque(
        craft=subject.craft.craft.name,
        epoch=tlm.epoch_label,
        method=course.method,
        variant="corrected",
        frame=course.frame,
        torque=fit.torque,
        sigma=fit.sigma,
        systematic=systematic,
        interval_95=fit.torque[:, None] + fit.reach * np.outer(fit.sigma, [-1, 1]),
        gyroscopic=course.gyroscopic,
        turn_rad_s=course.turn,
        turn_from=course.turn_from,
        momentum=s.momentum.mean(axis=0),
        wheel_drift_rad_s2=_wheel_drift(subject) if course.method == "drift" else {},
        time_s=tlm.seconds(s.tai_ns),
        gained=course.turned.apply(course.y) - fit.values[:3],
        fitted=course.G @ fit.torque,
        fitted_95=fit.reach * np.sqrt(np.maximum(gained_variance, 0.0)),
        used=fit.used,
        worth=fit.worth,
        relative=subject.relative,
        doubts=(*s.doubts, *course.doubts, *_quality(fit, course, systematic)),
        settings={inertia: subject.inertia_kgm2, "wheels": [w.name for w in subject.craft.wheels]},
    )


def _wheel_drift(subject: Subject) -> dict[str, float]:
    """Slope of every wheel's rate. [rad/s^2]"""
    tlm = subject.telemetry
    channels = [tlm.channel(f"wheel_rate_{n}").usable for n in tlm.members("wheel_rate") if subject.craft.wheel(n)]
    return {c.member: float(robust_line(tlm.seconds(c.tai_ns), c.values)[0][1]) for c in channels}


def _quality(fit: Fit, course: _Course, systematic) -> list[str]:
    """Doubts that a fit itself raises."""
    doubts = []
    out = int((~fit.used).sum())
    if out > max(3, 0.01 * len(fit.used)):
        doubts.append(
            f"{out} of {len(fit.used)} samples stand {OUTLYING:.0f} sigma off the fit and do not count: is the inertia right?"
        )
    if fit.worth < _FEW_WORTH:
        doubts.append(
            f"residuals follow each other, and all samples are worth {fit.worth:.0f} independent ones: the torque is not constant, or the "
            "inertia not right, and sigma is rough"
        )
    elif fit.used.sum() >= 8 * FEWEST:
        rows, y, middle = course.rows, course.y, len(course.y) // 2
        first, second = regress(rows[:middle], y[:middle]), regress(rows[middle:], y[middle:])
        apart = np.abs(first.torque - second.torque) / np.hypot(first.sigma, second.sigma)
        if np.nanmax(apart) > _CHANGED:
            doubts.append(
                f"both halves of the span give torques {np.nanmax(apart):.1f} sigma apart (about {AXES[int(np.nanargmax(apart))]}): "
                "it is not constant in these axes, or what is taken as known is off"
            )
    if (systematic > fit.sigma).any():
        doubts.append(
            "what is taken as known (spin inertia to 0.24 %, inertia to 1 %, gyros, turn) may shift the torque by more than "
            "its sigma, which holds noise only: see systematic"
        )
    return doubts
