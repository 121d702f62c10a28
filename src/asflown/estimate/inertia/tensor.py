"""The inertia tensor and the external torque, from reaction-wheel slews (001 section IV).

``axis`` and ``all`` are the paper's least squares (eqs 6-8, 9-11); ``gls`` takes the noise as it is; ``consistent`` fits
the whole motion to wheels, rates and attitude at their own times, and is the default.  A craft of which only the
actuators' torque is known gets a momentum balance instead (inertia_torque).

The scale of the wheels' spin inertia is the scale of the answer: no slew tells one from the other.  It is therefore
never estimated, and its sigma stands apart from the random one, with that of the rates' scale.  Where the centre of
mass lies does not matter: momentum is conserved about it wherever it is, and the tensor is about it too.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of, momentum_regressor, nearest_possible, tensor_of
from ...kit.errors import BadInput
from ...kit.rotations import rates_between, rotation
from ..subject import Subject, subject_of
from .contradictions import MOST_STEPS, conserved
from .excitation import Excitation, excitation
from .from_torque import balance, told
from .levels import first_levels
from .motion import WHEEL
from .prediction import compare_inertia, predicted_inertia
from .prior import prior_sigma
from .record import MomentumSamples, SlewRecord, slew_record
from .result import Evidence, InertiaResult
from .sample_by_sample import all_axes, by_axis, generalized, rows_of
from .slews import Slew, find_slews
from .whole_motion import SlewFit, fit_slews, momentum_step

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

METHODS = ("consistent", "gls", "all", "axis")

#: One sigma of the common scale of the wheels' spin inertia: what 001's rounding of it comes to (0.161 for 0.16138).
WHEEL_SCALE = 0.0024
#: One sigma of the rates' common scale: assumed.
RATE_SCALE = 0.001

#: A step of momentum is kept where it is this large, squared, in its own covariance.
_STEP_KEPT = 40.0
#: Time stamps apart by more than this are spoken of. [s]
_LATE_S = 0.05
#: Wheel readings that miss the fit by so many times their own scatter are not explained by it.
_UNEXPLAINED = 4.0


_WANDERS = (
    "momentum is not conserved to 2 % of what the wheels' varies by: outside torques vary, and the fit (method consistent) lets "
    "the momentum wander, so that only quick exchanges between wheels and body tell of the tensor"
)


_STEPPED = "the momentum steps near {:.0f} s, and no channel says why (a thruster?): it begins anew there"


def inertia_tensor(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str = "consistent",
    frame: str = "body",
    wheel_scale: float = WHEEL_SCALE,
    rate_scale: float = RATE_SCALE,
    progress=None,
) -> InertiaResult:
    """Tensor (3, 3) about the centre of mass in body axes, with random and systematic sigma, and the external torque.

    ``frame``: axes in which the external torque is constant, 'body' or 'inertial'.  ``wheel_scale``, ``rate_scale``: one
    sigma of the common scale error of the wheels' spin inertia, and of the body rates.
    Raises BadInput for channels that are missing or contradict each other, and for a record without a slew."""
    if method not in METHODS:
        raise BadInput(f"no inertia method {method!r}", remedy=f"Choose one of: {', '.join(METHODS)}.")
    if frame not in ("body", "inertial"):
        raise BadInput(f"no frame {frame!r} for the external torque", remedy="Choose body or inertial.")
    for name, value in (("wheel", wheel_scale), ("rate", rate_scale)):
        if not 0 <= value < 1:
            raise BadInput(f"a {name} scale error of {value:g} is not one", remedy='Write it as "0.24 %" or 0.0024.')
    subject = subject_of(telemetry, craft, moving=None)
    if not telemetry.members("wheel_rate") and telemetry.has_axes("control_torque"):
        return _finished(subject, _by_torque(subject), wheel_scale, rate_scale)
    record = slew_record(subject)
    excited, slews = _turning(record)
    record, steps, steady = conserved(record, slews, telemetry.source or None)
    zero = float(telemetry.seconds(record.start_ns))
    record = replace(record, doubts=(*record.doubts, *[_STEPPED.format(zero + at) for at in steps]))
    if not steady:  # a steady turn then tells nothing: what it makes of the tensor may as well be a torque's
        excited, slews = _turning(record, steady=False)
        record = replace(record, doubts=(*record.doubts, _WANDERS))
    if method == "consistent":
        result = _consistent(subject, record, excited, frame, not steady, progress)
    else:
        result = _sample_by_sample(subject, record, method, frame)
    return _finished(subject, result, wheel_scale, rate_scale)


# ---- the fit of the whole motion -----------------------------------------------------------------


def _consistent(
    subject: Subject, record: SlewRecord, excited: Excitation, frame: str, wander: bool, progress
) -> InertiaResult:
    doubts = list(record.doubts)
    prior = _prior(subject, excited, doubts)
    asked = {"frame": frame, "prior": prior, "seen": excited.seen, "wander": wander, "progress": progress}
    fit = _with_steps(subject, fit_slews(record, **asked), asked, doubts)
    L, sigma = fit.layout, np.sqrt(np.diag(fit.covariance))
    inverse = np.linalg.inv(fit.covariance[L.TENSOR, L.TENSOR])
    elements = _possible(fit.beta[L.TENSOR], inverse, doubts)
    doubts += _fit_doubts(fit)
    zero = float(subject.telemetry.seconds(record.start_ns))
    evidence = _evidence(fit, zero)
    slews = find_slews(evidence.time_s, evidence.omega_rad_s, fit.levels.rate)
    by = fit.by_scale[L.TENSOR]
    noise = fit.levels
    settings = {
        "wheel_noise": noise.wheel, "rate_noise_rad_s": noise.rate if record.has_rates else None,
        "attitude_noise_rad": noise.attitude if record.has_attitude else None,
        "attitude_coloured_rad": noise.coloured if record.has_attitude else None,
        "attitude_coloured_s": noise.coloured_s if record.has_attitude else None,
        "wheels_late_s": -fit.beta[L.skew_wheels], "wheels_late_sigma_s": sigma[L.skew_wheels],
        "rates_late_s": None if L.skew_rates is None else -fit.beta[L.skew_rates],
        "rates_late_sigma_s": None if L.skew_rates is None else sigma[L.skew_rates],
        "wander_Nms_per_root_s": noise.wander or None,
        "rate_bias_rad_s": None if L.bias is None else fit.beta[L.bias],
        "arcs": len(fit.record.arcs), "left_out": int((~fit.kept).sum()), "rounds": fit.rounds, "converged": fit.converged,
    }  # fmt: skip
    return InertiaResult(
        subject.craft.craft.name, "consistent", subject.telemetry.epoch_label, tensor_of(elements), _sigmas(fit.covariance[:6, :6]),
        np.stack([tensor_of(by[:, 0]), tensor_of(by[:, 1])]), excited, fit.beta[L.torque], sigma[L.torque], frame,
        tuple(slews), evidence, None, tuple(doubts), subject.relative, {}, settings,
    )  # fmt: skip


def _with_steps(subject: Subject, fit: SlewFit, asked: dict, doubts: list[str]) -> SlewFit:
    """The same fit with the momentum free to step where it plainly did: a thruster that no channel tells of."""
    for _ in range(0 if asked["wander"] else MOST_STEPS):
        at, square = momentum_step(fit, asked["prior"])
        if square < _STEP_KEPT:
            return fit
        doubts.append(_STEPPED.format(float(subject.telemetry.seconds(fit.record.start_ns)) + at))
        fit = fit_slews(fit.record.split_at(at), **asked)
    return fit


def _momentum_residual(fit: SlewFit):
    """Residual momentum at the wheels' instants: time (N,), inertial axes (N, 3), arc (N,)."""
    m, model = fit.record.momentum, fit.model
    rows = model.kind == WHEEL
    left = np.empty(len(m.time_s))
    left[model.source[rows]] = fit.residual[rows]
    time_s, total, index = m.vectors(left)
    arc = np.zeros(len(time_s), int)
    arc[index] = m.arc
    motion = fit.motion.at(time_s + fit.beta[fit.layout.skew_wheels])
    return time_s, rotation(motion.q_NB).apply(total), arc


def _evidence(fit: SlewFit, zero: float) -> Evidence:
    time_s, residual, _ = _momentum_residual(fit)
    moved = fit.motion.moved(fit.smoothed.mean).at(time_s + fit.beta[fit.layout.skew_wheels])
    _, held, _ = fit.record.momentum.vectors(fit.record.momentum.value_Nms)
    return Evidence(zero + time_s, moved.omega_B, held, residual, np.ones(len(time_s), bool))


def _fit_doubts(fit: SlewFit) -> list[str]:
    L, sigma = fit.layout, np.sqrt(np.diag(fit.covariance))
    against = "the attitude" if fit.record.has_attitude else "the body rates"
    doubts = []
    for name, k in (("wheel rates", L.skew_wheels), ("body rates", L.skew_rates)):
        if k is not None and abs(fit.beta[k]) > max(_LATE_S, 4 * sigma[k]):
            how = "late" if fit.beta[k] < 0 else "early"
            doubts.append(
                f"the {name} are stamped {abs(fit.beta[k]):.2f} s {how} against {against}: taken into account"
            )
    left = int((~fit.kept).sum())
    if left:
        doubts.append(f"{left} readings lie far from what all others say of them, and are left out")
    if not fit.converged:
        doubts.append("the fit had not settled after its last round: its sigmas may be too small")
    scatter = first_levels(fit.record).wheel
    if fit.levels.wheel > _UNEXPLAINED * scatter:
        doubts.append(
            f"wheel readings miss the fit by {fit.levels.wheel / scatter:.0f} times their own scatter: momentum is not conserved as "
            "modelled. A wheel mistaken for another, a wrong axis or spin inertia, or a torque not thought of would do that"
        )
    return doubts


# ---- where only the actuators' torque is known ---------------------------------------------------


def _by_torque(subject: Subject) -> InertiaResult:
    I_B = subject.known_inertia()
    found, sigma = balance(subject.telemetry), prior_sigma(I_B)
    known, unknown = told(found, sigma)
    doubts = [
        *subject.doubts,
        "only the commanded torque of the actuators is known: the momentum balance over blocks, with the gravity gradient, is used",
    ]
    size = np.sqrt(np.diag(found.covariance))
    prior = np.append(size[:6] / sigma, np.zeros(3)) ** 2  # information, in units of the data's own sigmas
    information = np.linalg.inv(found.covariance / np.outer(size, size))
    covariance = np.linalg.inv(information + np.diag(prior))
    centre = np.append(elements_of(I_B), np.zeros(3)) / size
    beta = size * (covariance @ (information @ (found.solution / size) + prior * centre))
    covariance = covariance * np.outer(size, size)
    if unknown:
        each = "; ".join(
            f"{n} {', '.join(f'{v[k]:.3g}' for v in found.by_block.values())}"
            for k, n in enumerate(ELEMENTS)
            if n in unknown
        )
        blocks = ", ".join(f"{b:g}" for b in found.by_block)
        doubts.append(
            f"the data alone do not tell {', '.join(unknown)} to 10 % (products 1.3 % of the mean moment): blocks of {blocks} s give {each} "
            "kg m2. What is given for them leans on the craft's own tensor"
        )
    rms = np.sqrt(np.mean(found.omega_B**2, axis=0))
    excited = Excitation(len(known), np.full(6, np.nan), known, unknown, np.eye(3), rms)
    evidence = Evidence(
        found.time_s,
        found.omega_B,
        np.cumsum(found.pushed_Nms, axis=0),
        found.residual_Nms,
        np.ones(len(found.time_s), bool),
    )
    scales = np.stack([tensor_of(beta[:6]), -tensor_of(beta[:6])])  # of the torque, and of the rates
    settings = {"by_block_kgm2": {f"{b:g}": v for b, v in found.by_block.items()}}
    return InertiaResult(
        subject.craft.craft.name, "momentum balance", subject.telemetry.epoch_label, tensor_of(_possible(beta[:6], np.linalg.inv(covariance[:6, :6]), doubts)),
        _sigmas(covariance[:6, :6]), scales, excited, beta[6:], np.sqrt(np.diag(covariance)[6:]), "body", (), evidence, None,
        tuple(doubts), False, {}, settings,
    )  # fmt: skip


# ---- sample by sample ----------------------------------------------------------------------------


def _sample_by_sample(subject: Subject, record: SlewRecord, method: str, frame: str) -> InertiaResult:
    doubts = list(record.doubts)
    rows = rows_of(record)
    levels = first_levels(record)
    slews = find_slews(rows.time_s, rows.motion.omega_B, levels.rate)
    if method != "gls" and not slews:
        raise BadInput(
            "no slew is in this record: the body hardly turns",
            file=subject.telemetry.source or None,
            remedy="Take a window with slews (--start, --stop).",
        )
    if method == "axis":
        solved = by_axis(rows, slews)
        skew = sum(s.about == "skew" for s in slews)
        if skew:
            doubts.append(f"{skew} of {len(slews)} slews are about no single body axis: this method leaves them out")
    elif method == "all":
        solved = all_axes(rows, slews)
    else:
        solved = generalized(rows, levels, _unit(record.momentum), frame, _plain_elements(rows))
    fast = excitation(rows.motion.omega_B[solved.used]) if solved.used.any() else excitation(rows.motion.omega_B)
    elements, covariance = solved.elements, solved.covariance
    if method != "axis":
        prior = _prior(subject, fast, doubts)
        if prior is not None:
            information = solved.information + prior[1]
            covariance = np.linalg.inv(information)
            elements = covariance @ (solved.pull + prior[1] @ prior[0])
        elements = _possible(elements, np.linalg.pinv(covariance, hermitian=True), doubts)
    elif not np.isfinite(elements).all():
        missing = [n for n, v in zip(ELEMENTS, elements, strict=True) if not np.isfinite(v)]
        doubts.append(f"no slew tells {', '.join(missing)}: null")
    zero = float(subject.telemetry.seconds(record.start_ns))
    turn = rotation(rows.motion.q_NB)
    evidence = Evidence(
        zero + rows.time_s, rows.motion.omega_B, rows.h_B, turn.apply(np.nan_to_num(solved.residual_Nms)), solved.used
    )
    # every row's momentum over every row's rate: both scales go into all elements alike
    scales = np.stack([tensor_of(elements), -tensor_of(elements)])
    moved = tuple(replace(s, start_s=zero + s.start_s, stop_s=zero + s.stop_s) for s in slews)
    return InertiaResult(
        subject.craft.craft.name, method, subject.telemetry.epoch_label, tensor_of(elements), _sigmas(covariance), scales, fast,
        solved.torque_Nm, np.sqrt(np.diag(solved.torque_covariance)), frame, moved, evidence, None, tuple(doubts),
        subject.relative, solved.products, {},
    )  # fmt: skip


def _unit(momentum: MomentumSamples) -> np.ndarray:
    """Covariance of the wheels' momentum for unit variance of one reading. (3, 3)"""
    first = momentum.time_s == momentum.time_s[0]
    d, u = momentum.direction[first], momentum.unit[first]
    return (d * u[:, None] ** 2).T @ d


def _plain_elements(rows) -> np.ndarray:
    """A rough tensor to start from: momentum free, ordinary least squares."""
    S = momentum_regressor(rows.motion.omega_B)
    R = rotation(rows.motion.q_NB).as_matrix()
    X = np.concatenate([-S, np.swapaxes(R, 1, 2)], axis=2).reshape(-1, 9)
    return np.linalg.lstsq(X, rows.h_B.ravel(), rcond=1e-8)[0][:6]


# ---- what both have in common --------------------------------------------------------------------


def _turning(record: SlewRecord, steady: bool = True) -> tuple[Excitation, list[Slew]]:
    """What the body's turning can tell, and its slews, from the rates as they are, or the attitude where there are none.

    ``steady``: whether the mean rate counts."""
    if record.has_rates:
        times, omega = record.common_rates()
    else:
        times = record.attitude.time_s[1:]
        omega = rates_between(record.attitude.time_s, record.attitude.q_NB)[1]
    inside = np.zeros(len(times), bool)
    for a, b in record.arcs:
        inside |= (times >= a) & (times < b)
    noise = first_levels(record).rate
    used = omega[inside] if steady else omega[inside] - omega[inside].mean(axis=0)
    return excitation(used, noise), find_slews(times, omega, noise)


def _prior(subject: Subject, excited: Excitation, doubts: list[str]):
    """Mean (6,) and information (6, 6) for the tensor where the slews do not tell all of it; None where they do.

    Raises BadInput where the body does not turn at all."""
    if excited.rank == 6:
        return None
    doubts += excited.sentences()
    if excited.rank == 0:
        raise BadInput(
            "no slew is in this record: the body hardly turns, and nothing is told of its inertia",
            file=subject.telemetry.source or None,
            remedy="Take a window with slews (--start, --stop); asflown inertia plan says which slew would help.",
        )
    I_B = subject.inertia_kgm2
    if I_B is None:
        raise BadInput(
            f"the slews do not tell {', '.join(excited.untold)}, and the inertia of {subject.craft.craft.name} is not known",
            file=subject.telemetry.source or None,
            remedy='Give one to lean on: --inertia "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2, or take more slews.',
        )
    sigma = prior_sigma(I_B)
    doubts += subject.craft.doubts
    doubts.append(
        "what the slews do not tell is taken from the craft's own tensor, with 10 % on moments and 1.3 % of the mean moment on products"
    )
    return elements_of(I_B), np.diag(1 / sigma**2)


def _possible(elements: np.ndarray, information: np.ndarray, doubts: list[str]) -> np.ndarray:
    found, moved = nearest_possible(elements, information)
    if moved:
        doubts.append(
            "the likeliest tensor is one no rigid body can have: the nearest possible one is given, at the edge of what is possible"
        )
    return found


def _sigmas(covariance: np.ndarray) -> np.ndarray:
    return tensor_of(np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def _finished(subject: Subject, result: InertiaResult, wheel_scale: float, rate_scale: float) -> InertiaResult:
    """Scales put in, compared with what was predicted, doubts each once."""
    by_wheel, by_rate = result.sigma_systematic
    wheel = 0.0 if subject.relative else wheel_scale
    systematic = np.hypot(wheel * by_wheel, rate_scale * by_rate)
    result = replace(result, sigma_systematic=systematic)
    comparison, doubts = None, list(result.doubts)
    if subject.craft.craft.mass_properties and np.isfinite(result.inertia).all():
        prediction = predicted_inertia(subject.craft.craft, subject.craft.tai_ns)
        comparison = compare_inertia(result.inertia, prediction, result.sigma_total, subject.relative)
        doubts += comparison.doubts
    settings = result.settings | {"wheel_scale_sigma": wheel, "rate_scale_sigma": rate_scale}
    return replace(result, comparison=comparison, doubts=tuple(dict.fromkeys(doubts)), settings=settings)
