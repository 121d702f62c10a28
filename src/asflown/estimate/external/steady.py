"""A steady external torque from the momentum that craft and wheels gain (Feldman & Lee section IV and Appendix A).

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

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice, some_of
from ...kit.regression import robust_line
from ...kit.result import recorded
from ...kit.rotations import rotation
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ..environment import known_terms
from ..subject import (
    FEWEST,
    GYRO_BIAS,
    INERTIA_SHARE,
    PER_SPIN_INERTIA,
    SPIN_SHARE,
    UNTOLD_TURN,
    Samples,
    Subject,
    samples_of,
    subject_of,
)
from .regress import OUTLYING, Fit, regress
from .result import ExternalTorqueResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from ..environment import Air

METHODS = ("drift", "momentum")
VARIANTS = ("corrected", "printed")
FRAMES = ("body", "inertial")

#: The craft's alternative that holds the printed method's one spin inertia.
_PRINTED_SPIN = "001-drift"

_FAR = 0.5  # rad from the first attitude: beyond it one mean turn does not do
_FEW_WORTH = 20  # independent samples below which a sigma is doubted
_CHANGED = 4.0  # sigma between the torques of both halves


PRINTED = Kind(
    "external.printed", Severity.CAUTION, "the printed method uses two readings, without w x H, and gives no sigma",
    "Use --variant corrected.",
)  # fmt: skip
OWN_SPIN_INERTIA = Kind(
    "external.own-spin-inertia", Severity.NOTE,
    "the paper's mean spin inertia is that of another craft's wheels: {craft}'s own is used",
)  # fmt: skip
TURN_FROM_GYROS = Kind(
    "external.turn-from-gyros", Severity.CAUTION, "the craft's turn is measured by its gyros, whose bias counts as turn",
    "Add the quaternion, or give --turn-rate.",
)  # fmt: skip
TURN_UNKNOWN = Kind(
    "external.turn-unknown", Severity.CAUTION, "{why}: w x H is left out, and an Earth-pointed craft is assumed",
    "Add the quaternion, or give --turn-rate.",
)  # fmt: skip
ATTITUDE_FROM_RATES = Kind(
    "external.attitude-from-rates", Severity.CAUTION,
    "there is no quaternion: the attitude is integrated from the body rates, including their bias", "Add the quaternion.",
)  # fmt: skip
OUTLIERS = Kind(
    "external.outliers", Severity.SUSPECT,
    "{outliers} of {samples} samples lie more than {limit:.0f} sigma from the fit and are not used: is the inertia right?",
    "Check the inertia (--inertia), and what happened at those times (--plot).",
)  # fmt: skip
FEW_EFFECTIVE_SAMPLES = Kind(
    "external.few-effective-samples", Severity.CAUTION,
    "the residuals are correlated: the effective sample size is {effective:.0f}; the torque is not constant or the inertia "
    "is wrong, and sigma is rough",
    "Take a longer record, or check the inertia.",
)  # fmt: skip
NOT_CONSTANT = Kind(
    "external.not-constant", Severity.SUSPECT,
    "the two halves of the span give torques that differ by {apart:.1f} sigma about {axis}: the torque is not constant in "
    "these axes, or a known quantity is wrong",
    "Try the other --frame, or a shorter span.",
)  # fmt: skip
SYSTEMATIC = Kind(
    "external.systematic", Severity.CAUTION,
    "errors of known quantities (spin inertia {spin_percent:.2f} %, inertia {inertia_percent:.0f} %, gyros, turn) can shift the "
    "torque by more than its sigma, which is noise only: see the systematic column",
)  # fmt: skip


@recorded
def external_torque(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str | None = None,
    variant: str = "corrected",
    frame: str = "body",
    turn_rad_s=None,
    known: Sequence[str] = (),
    air: Air | None = None,
) -> ExternalTorqueResult:
    """The constant external torque on the craft, from the momentum that craft and wheels gain.

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates, with body rates and quaternion where there are any.
    craft : Craft
        Wheels' axes and spin inertia; inertia for the momentum method.
    method : {'drift', 'momentum'}, optional
        'drift' fits a line to the momentum in a hold, 'momentum' a balance that slews may cross.  By default drift where the
        record holds no slew.
    variant : {'corrected', 'printed'}
        'printed' is Appendix A of Feldman & Lee with its errors: two readings, without w x H (drift only).
    frame : {'body', 'inertial'}
        Axes in which the torque is constant; 'inertial' is that of the quaternion.
    turn_rad_s : array_like of shape (3,), optional
        Mean body rate, body axes [rad/s], for the drift's w x H; from quaternion or gyros unless given.
    known : sequence of str
        Torques of the surroundings that are taken off, as the craft file has them: of 'gravity-gradient', 'sunlight', 'dipole',
        'drag', 'rods'.  Their errors stand in the systematic sigma.
    air : Air, optional
        For the density of drag.

    Returns
    -------
    ExternalTorqueResult
        Torque (3,) [N m] about the centre of mass, positive as it turns the body about +axis.

    Raises
    ------
    BadInput
        Where thrusters fire, a drift holds a slew, or channels are missing.
    """
    check_choice(variant, VARIANTS, "variant")
    check_choice(frame, FRAMES, "frame")
    check_choice(method, (None, *METHODS), "method")
    alternative = variant == "printed" and _PRINTED_SPIN in craft.alternatives
    subject = subject_of(telemetry, craft.with_alternative(_PRINTED_SPIN) if alternative else craft)
    if subject.firing:
        raise BadInput(
            f"thrusters fire in this span ({some_of(subject.firing)}), and their torque cannot be separated from the external one",
            file=telemetry.source or None,
            remedy="Narrow the span with --start and --stop to one without firings.",
        )
    turning = subject.slewing or _turns_far(telemetry)
    method = method or ("momentum" if frame == "inertial" or (turning and variant == "corrected") else "drift")
    if known and variant == "printed":
        raise BadInput("the printed variant takes no known torques off", remedy="Use --variant corrected.")
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
    try:
        if variant == "printed":
            result = _printed(subject, alternative=alternative)
        else:
            taken = _Taken(subject, tuple(known), air)
            result = _drift(subject, turn_rad_s, taken) if method == "drift" else _momentum(subject, frame, taken)
    except BadInput as why:
        raise why.within(telemetry.source) from why.__cause__
    found = [*subject.doubts, *result.doubts, PER_SPIN_INERTIA(what="the torque is") if subject.relative else None]
    return replace(result, doubts=Doubts(found))


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


def _printed(subject: Subject, *, alternative: bool) -> ExternalTorqueResult:
    """Feldman & Lee Appendix A: the last reading less the first, whatever lies between."""
    wheels = subject.wheels()
    tai_ns, rates = together(subject.telemetry, [c.name for c, _ in wheels])
    if len(tai_ns) < 2:
        raise BadInput("fewer than two instants with all wheel rates", remedy="Take a longer record.")
    t = (tai_ns - tai_ns[0]) / NS
    per_rate = np.array([np.array(w.axis) * (w.spin_inertia or 1.0) for _, w in wheels])
    gained = (rates - rates[0]) @ per_rate
    torque = gained[-1] / t[-1]
    doubts = Doubts([PRINTED(), None if alternative else OWN_SPIN_INERTIA(craft=subject.craft.craft.name)])
    used = np.zeros(len(t), bool)
    used[[0, -1]] = True
    return ExternalTorqueResult(
        craft=subject.craft.craft.name,
        epoch=subject.telemetry.epoch_label,
        method="drift",
        variant="printed",
        frame="body",
        torque_Nm=torque,
        momentum_Nms=(rates @ per_rate).mean(axis=0),
        wheel_drift_rad_s2={w.name: float(d / t[-1]) for (_, w), d in zip(wheels, rates[-1] - rates[0], strict=True)},
        time_s=subject.telemetry.seconds(tai_ns),
        gained_Nms=gained,
        fitted_Nms=np.outer(t, torque),
        used=used,
        relative=subject.relative,
        doubts=doubts,
        settings={"spin_inertia_kg_m2": [w.spin_inertia for _, w in wheels]},
    )


@dataclass(frozen=True)
class _Course:
    """Momentum y (N, 3) in the body; how it is turned (N) from the body's axes at the start; momentum gained there per
    torque, G (N, 3, 3); what is not in the noise: ``turn_sigma`` (3,) random and ``unknown`` (3,) systematic [N m]."""

    method: str
    frame: str
    y: np.ndarray
    turned: scipy.spatial.transform.Rotation
    G: np.ndarray
    unknown: np.ndarray
    turn_from: str
    doubts: list[Doubt]
    turn_sigma: np.ndarray | None = None
    turn: np.ndarray | None = None
    gyroscopic: np.ndarray | None = None

    @property
    def rows(self) -> np.ndarray:
        """Start momentum and torque to momentum in the body: R^T (1, G), (N, 3, 6)."""
        back = self.turned.inv().as_matrix()
        return np.concatenate([back, back @ self.G], axis=2)


@dataclass
class _Taken:
    """Known torques to take off: what they and one sigma of each of their errors bring to the momentum, body axes."""

    subject: Subject
    names: tuple[str, ...]
    air: Air | None
    where_from: dict[str, str] = field(default_factory=dict)
    errors: np.ndarray | None = None  # (N, 3, q)
    doubts: Doubts = Doubts()

    def brought(self, s: Samples, turned: scipy.spatial.transform.Rotation) -> np.ndarray:
        """Momentum that the known torques brought since the first sample, (N, 3)."""
        if not self.names:
            return np.zeros_like(s.momentum)
        around = known_terms(self.subject, s.tai_ns, self.names, self.air)
        self.doubts = around.doubts
        self.where_from = {t.name: t.source for t in around.terms}
        torque = np.sum([t.torque_Nm for t in around.terms if t.torque_Nm is not None], axis=0)
        errors = [t.errors_Nm for t in around.terms if t.errors_Nm is not None]
        R = turned.as_matrix()
        whole = np.concatenate([torque[:, :, None], *errors], axis=2)
        grown = np.swapaxes(R, 1, 2) @ scipy.integrate.cumulative_trapezoid(R @ whole, s.seconds, axis=0, initial=0)
        self.errors = grown[:, :, 1:]
        return grown[:, :, 0]


def _drift(subject: Subject, turn, taken: _Taken) -> ExternalTorqueResult:
    s = samples_of(subject)
    t, H = s.seconds, s.momentum
    w, w_sigma, turn_from, w_unknown, doubts = _turn(s, turn)
    mean = H.mean(axis=0)
    course = _Course(
        method="drift",
        frame="body",
        y=H
        + np.cross(w, scipy.integrate.cumulative_trapezoid(H, t, axis=0, initial=0))
        - taken.brought(s, scipy.spatial.transform.Rotation.identity(len(t))),
        turned=scipy.spatial.transform.Rotation.identity(len(t)),
        G=t[:, None, None] * np.eye(3),
        unknown=_crossed(mean, np.full(3, w_unknown)),
        turn_from=turn_from,
        doubts=doubts,
        turn_sigma=_crossed(mean, w_sigma),
        turn=w,
        gyroscopic=np.cross(w, mean),
    )
    return _fitted(subject, s, course, taken)


def _turn(s: Samples, given):
    """Mean body rate, its sigma (3,), where it is from, what it may be off by [rad/s], and doubts."""
    t = s.seconds
    if given is not None:
        return np.asarray(given, float), np.zeros(3), "the user", 0.0, []
    if s.attitude is not None:
        turned = s.turned.as_rotvec()
        lines = [robust_line(t, turned[:, j]) for j in range(3)]
        w, sigma = np.array([v[1] for v, _, _ in lines]), np.sqrt([c[1, 1] for _, c, _ in lines])
        return w, sigma, "quaternion", 0.0, []
    if s.rates is not None and np.abs(w := np.median(s.rates, axis=0)).max() > 3 * GYRO_BIAS:
        return w, 1.25 * s.rates.std(axis=0) / np.sqrt(len(t)), "body rates", GYRO_BIAS, [TURN_FROM_GYROS()]
    why = "the gyros show no turn beyond their bias" if s.rates is not None else "no channel measures the craft's turn"
    return np.zeros(3), np.zeros(3), "nothing", UNTOLD_TURN, [TURN_UNKNOWN(why=why)]


def _crossed(H, sigma) -> np.ndarray:
    """One sigma of w x H about each axis, (3,)."""
    a, b = np.roll(np.arange(3), -1), np.roll(np.arange(3), -2)
    return np.hypot(sigma[a] * H[b], sigma[b] * H[a])


def _momentum(subject: Subject, frame: str, taken: _Taken) -> ExternalTorqueResult:
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
    elif frame == "inertial":
        raise BadInput("no quaternion: the inertial frame is not known", remedy="Use --frame body.")
    else:
        from_start, turn_from = scipy.spatial.transform.Rotation.identity(), "body rates"
        unknown = _crossed(s.momentum.mean(axis=0), np.full(3, GYRO_BIAS))
        doubts.append(ATTITUDE_FROM_RATES())
    if frame == "body":
        G = scipy.integrate.cumulative_trapezoid(s.turned.as_matrix(), t, axis=0, initial=0)
    else:
        G = t[:, None, None] * from_start.as_matrix()
    y = s.momentum - taken.brought(s, s.turned)
    return _fitted(subject, s, _Course("momentum", frame, y, s.turned, G, unknown, turn_from, doubts), taken)


def _fitted(subject: Subject, s: Samples, course: _Course, taken: _Taken) -> ExternalTorqueResult:
    tlm, fit = subject.telemetry, regress(course.rows, course.y)
    if course.turn_sigma is not None:
        fit = replace(fit, covariance=fit.covariance + np.diag(np.r_[np.zeros(3), course.turn_sigma**2]))
    spin = 0.0 if subject.relative else SPIN_SHARE
    systematic = np.sqrt(
        (spin * fit.shift(s.stored)) ** 2 + (INERTIA_SHARE * fit.shift(s.body)) ** 2 + course.unknown**2
    )
    if taken.errors is not None:
        shifts = np.array([fit.shift(e) for e in np.moveaxis(taken.errors, 2, 0)])
        systematic = np.sqrt(systematic**2 + np.sum(shifts**2, axis=0))
    gained_variance = np.einsum("nij,jk,nik->ni", course.G, fit.covariance[3:, 3:], course.G)
    inertia = "inertia_per_spin_inertia" if subject.craft.relative else "inertia_kg_m2"
    return ExternalTorqueResult(
        craft=subject.craft.craft.name,
        epoch=tlm.epoch_label,
        method=course.method,
        variant="corrected",
        frame=course.frame,
        torque_Nm=fit.torque,
        torque_sigma_Nm=fit.sigma,
        torque_systematic_Nm=systematic,
        torque_ci95_Nm=fit.torque[:, None] + fit.reach * np.outer(fit.sigma, [-1, 1]),
        gyroscopic_Nm=course.gyroscopic,
        turn_rad_s=course.turn,
        turn_from=course.turn_from,
        momentum_Nms=s.momentum.mean(axis=0),
        wheel_drift_rad_s2=_wheel_drift(subject) if course.method == "drift" else {},
        time_s=tlm.seconds(s.tai_ns),
        gained_Nms=course.turned.apply(course.y) - fit.values[:3],
        fitted_Nms=course.G @ fit.torque,
        fitted_ci95_Nms=fit.reach * np.sqrt(np.maximum(gained_variance, 0.0)),
        used=fit.used,
        effective_samples=fit.worth,
        relative=subject.relative,
        doubts=Doubts([*s.doubts, *course.doubts, *taken.doubts, *_quality(fit, course, systematic)]),
        known=taken.where_from,
        settings={inertia: subject.inertia_kgm2, "wheels": [w.name for w in subject.craft.wheels]},
    )


def _wheel_drift(subject: Subject) -> dict[str, float]:
    """Slope of every wheel's rate. [rad/s^2]"""
    tlm = subject.telemetry
    channels = [tlm.channel(f"wheel_rate_{n}").usable for n in tlm.members("wheel_rate") if subject.craft.wheel(n)]
    return {c.member: float(robust_line(tlm.seconds(c.tai_ns), c.values)[0][1]) for c in channels}


def _quality(fit: Fit, course: _Course, systematic) -> list[Doubt]:
    """Doubts that a fit itself raises."""
    doubts = []
    out = int((~fit.used).sum())
    if out > max(3, 0.01 * len(fit.used)):
        doubts.append(OUTLIERS(outliers=out, samples=len(fit.used), limit=OUTLYING))
    if fit.worth < _FEW_WORTH:
        doubts.append(FEW_EFFECTIVE_SAMPLES(effective=fit.worth))
    elif fit.used.sum() >= 8 * FEWEST:
        rows, y, middle = course.rows, course.y, len(course.y) // 2
        first, second = regress(rows[:middle], y[:middle]), regress(rows[middle:], y[middle:])
        apart = np.abs(first.torque - second.torque) / np.hypot(first.sigma, second.sigma)
        if np.nanmax(apart) > _CHANGED:
            doubts.append(NOT_CONSTANT(apart=float(np.nanmax(apart)), axis=AXES[int(np.nanargmax(apart))]))
    if (systematic > fit.sigma).any():
        doubts.append(SYSTEMATIC(spin_percent=100 * SPIN_SHARE, inertia_percent=100 * INERTIA_SHARE))
    return doubts
