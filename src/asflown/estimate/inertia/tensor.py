"""The inertia tensor and the external torque, from reaction-wheel slews (Feldman and Lee, section IV).

``axis`` and ``all`` are the paper's least squares (eqs 6-8, 9-11); ``gls`` takes the noise as it is; ``consistent`` fits
the whole motion to wheels, rates and attitude at their own times, and is the default.  A craft of which only the
actuators' torque is known gets a momentum balance instead (from_torque).

The scale of the wheels' spin inertia is the scale of the answer: no slew tells one from the other.  It is therefore
never estimated, and its sigma stands apart from the random one, with that of the rates' scale.  Where the centre of
mass lies does not matter: momentum is conserved about it wherever it is, and the tensor is about it too.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of, tensor_of
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...kit.result import recorded
from ...kit.rotations import rates_between, rotation
from ..subject import PER_SPIN_INERTIA, SPIN_SHARE, Subject, subject_of
from .consistent import by_whole_motion
from .contradictions import conserved
from .excitation import Excitation, excitation
from .from_torque import by_torque
from .gather import slew_record
from .levels import first_levels
from .prediction import compare_inertia, predicted_inertia
from .prior import possible, prior_for
from .result import Answer, Evidence, InertiaResult
from .sample_by_sample import Rows, Solved, all_axes, by_axis, generalized, rows_of
from .slews import Slew, find_slews

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from .record import SlewRecord
    from .result import Misread

METHODS = ("consistent", "gls", "all", "axis")
FRAMES = ("body", "inertial")

#: One sigma of the rates' common scale: assumed.
RATE_SCALE = 0.001

SKEW_LEFT_OUT = Kind(
    "inertia.skew-left-out", Severity.NOTE,
    "{skew} of {slews} slews are about no single body axis: method axis leaves them out",
    "Use --method consistent, gls or all.",
)  # fmt: skip
NOT_IDENTIFIED = Kind(
    "inertia.not-identified", Severity.CAUTION, "no slew identifies {elements}: they are null",
    "Add slews about the other body axes, or use --method consistent.",
)  # fmt: skip
SLOW_BY_SAMPLES = Kind(
    "inertia.slow-by-samples", Severity.SUSPECT,
    "slow outside torques act, and method {method} does not know of them: against method gls, which does, they move its elements by up to "
    "{off:.2g} ({element})",
    "Use --method consistent.",
)  # fmt: skip
SOURCES_UNSEEN = Kind(
    "inertia.sources-unseen", Severity.SUSPECT,
    "the craft file says that residual dipole or sunlight act, and there is no {channels}: method gls has no term for their torque, and its "
    "sigma takes what is left over for white noise",
    "Use --method consistent, which fits a slow torque, or add the channels.",
)  # fmt: skip
WHEEL_MISREAD = Kind(
    "inertia.wheel-misread", Severity.SUSPECT,
    "momentum would be conserved better (chi square {square:.0f} of 3) if {words}: {element} would move by {moved:+.3g}, {sigmas:.1f} total "
    "sigma",
    "Check that wheel's axis and spin_inertia in the craft file, and the scale of its rate.",
)  # fmt: skip

#: A misread wheel is doubted where it moves an element by so many total sigmas.
_MOVED = 2.0


@recorded
def inertia(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str = "consistent",
    frame: str = "body",
    wheel_scale: float = SPIN_SHARE,
    rate_scale: float = RATE_SCALE,
    progress: Callable[[str], None] | None = None,
) -> InertiaResult:
    """The inertia tensor as flown, and the constant external torque, from slews by reaction wheels.

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates (or wheel momentum), and body rates or quaternion or both; or, without wheels, control torque with
        quaternion, body rates and orbit position.
    craft : Craft
        Wheels' axes and spin inertia; its tensor is the prior of elements that the slews do not identify.
    method : {'consistent', 'gls', 'all', 'axis'}
        'axis' and 'all' are the least squares of Feldman and Lee (eqs 6-8 and 9-11), 'gls' adds a noise model,
        'consistent' fits the whole motion.
    frame : {'body', 'inertial'}
        Axes in which the external torque is constant.
    wheel_scale, rate_scale : float
        One sigma of the common scale error of the wheels' spin inertia and of the body rates, as fractions; they make the
        systematic sigma.
    progress : callable, optional
        Called with a line of text in each round of the fit.

    Returns
    -------
    InertiaResult
        Tensor (3, 3) [kg m2] about the centre of mass, body axes, wheels counted as if they did not spin; off-diagonal
        elements are those of the tensor, the negated products of inertia.  Torque (3,) [N m], positive about +axis.

    Raises
    ------
    BadInput
        Where channels are missing or contradict each other, and where the record holds no slew.
    """
    check_choice(method, METHODS, "inertia method")
    check_choice(frame, FRAMES, "frame")
    for name, value in (("wheel", wheel_scale), ("rate", rate_scale)):
        if not 0 <= value < 1:
            raise BadInput(
                f"a {name} scale error of {value:g} is not a fraction between 0 and 1",
                remedy='Write it as "0.24 %" or 0.0024.',
            )
    subject = subject_of(telemetry, craft, moving=None)
    if not telemetry.members("wheel_rate") and telemetry.has_axes("control_torque"):
        answer = by_torque(subject)
    elif method == "consistent":
        answer = whole_motion_of(subject, frame, progress)
    else:
        answer = _by_samples(subject, _conserved(subject), method, frame)
    return _result(subject, answer, wheel_scale, rate_scale)


def whole_motion_of(subject: Subject, frame: str = "body", progress: Callable[[str], None] | None = None) -> Answer:
    """The answer of method 'consistent'.  Raises BadInput as ``inertia`` does."""
    record = _conserved(subject)
    return by_whole_motion(subject, record, _excited(record), frame, progress)


def _conserved(subject: Subject) -> SlewRecord:
    record = slew_record(subject)
    return conserved(record, _slews(record), subject.telemetry.source or None)


def _motion_of(record: SlewRecord) -> tuple[np.ndarray, np.ndarray]:
    """Instants and rates (N, 3) as they are, or from the attitude where there are none."""
    if record.has_rates:
        return record.common_rates()
    return record.attitude.time_s[1:], rates_between(record.attitude.time_s, record.attitude.q_NB)[1]


def _slews(record: SlewRecord) -> list[Slew]:
    return find_slews(*_motion_of(record), first_levels(record).rate)


def _excited(record: SlewRecord) -> Excitation:
    """What the body's turning identifies.

    Where the momentum wanders the mean rate does not count: what a steady turn makes of the tensor may as well be a torque's."""
    times, omega = _motion_of(record)
    inside = np.zeros(len(times), bool)
    for a, b in record.arcs:
        inside |= (times >= a) & (times < b)
    used = omega[inside]
    return excitation(used - used.mean(axis=0) if record.wanders else used, first_levels(record).rate)


# ---- sample by sample ----------------------------------------------------------------------------


def _by_samples(subject: Subject, record: SlewRecord, method: str, frame: str) -> Answer:
    """Raises BadInput where there is no slew, or where the slews do not identify the tensor and nothing else is known of it."""
    rows, levels = rows_of(record), first_levels(record)
    slews = find_slews(rows.time_s, rows.motion.omega_B, levels.rate)
    if method != "gls" and not slews:
        raise BadInput(
            "no slew is in this record: the body hardly turns",
            file=subject.telemetry.source or None,
            remedy="Take a window with slews (--start, --stop).",
        )
    if method == "gls":
        solved = generalized(rows, levels, record.momentum.unit_covariance(), frame)
    else:
        solved = by_axis(rows, slews) if method == "axis" else all_axes(rows, slews)
    omega = rows.motion.omega_B[solved.used]
    excited = excitation(omega if len(omega) else rows.motion.omega_B)
    if method == "axis":
        elements, covariance = solved.elements, solved.covariance
        doubts = _axis_doubts(slews, elements)
    else:
        elements, covariance, doubts = _with_prior(subject, solved, excited)
    return Answer(
        method=method,
        elements=elements,
        covariance=covariance,
        # every row's momentum over every row's rate: both scales go into all elements alike
        by_scale=np.stack([tensor_of(elements), -tensor_of(elements)]),
        excitation=excited,
        torque_Nm=solved.torque_Nm,
        torque_sigma_Nm=np.sqrt(np.diag(solved.torque_covariance)),
        frame=frame,
        slews=tuple(replace(s, start_s=record.zero_s + s.start_s, stop_s=record.zero_s + s.stop_s) for s in slews),
        evidence=_evidence(record, rows, solved),
        products=solved.products,
        doubts=[*record.doubts, *doubts, _slow_doubt(record, rows, method, elements, frame)],
    )


def _slow_doubt(record: SlewRecord, rows: Rows, method: str, elements: np.ndarray, frame: str) -> Doubt | None:
    """What slow outside torques do to the elements (6,) of a method without them."""
    if not record.slow:
        return None
    if method == "gls":
        unseen = () if record.surroundings is None else record.surroundings.unseen
        return SOURCES_UNSEEN(channels=unseen) if unseen else None
    known = generalized(rows, first_levels(record), record.momentum.unit_covariance(), frame).elements
    off = np.nan_to_num(np.abs(elements - known))
    return SLOW_BY_SAMPLES(method=method, off=float(off.max()), element=ELEMENTS[int(np.argmax(off))])


def _axis_doubts(slews: list[Slew], elements: np.ndarray) -> list[Doubt]:
    doubts = []
    skew = sum(s.about == "skew" for s in slews)
    if skew:
        doubts.append(SKEW_LEFT_OUT(skew=skew, slews=len(slews)))
    missing = [n for n, v in zip(ELEMENTS, elements, strict=True) if not np.isfinite(v)]
    if missing:
        doubts.append(NOT_IDENTIFIED(elements=missing))
    return doubts


def _with_prior(subject: Subject, solved: Solved, excited: Excitation) -> tuple[np.ndarray, np.ndarray, list[Doubt]]:
    """Elements and covariance with the craft's own tensor where the slews do not identify all of it, and doubts."""
    elements, covariance = solved.elements, solved.covariance
    prior, leaning = prior_for(subject, excited)
    if prior is not None:
        information = solved.information + prior.information
        covariance = np.linalg.inv(information)
        elements = covariance @ (solved.pull + prior.information @ prior.mean)
    elements, impossible = possible(elements, np.linalg.pinv(covariance, hermitian=True))
    return elements, covariance, [*leaning, *impossible]


def _evidence(record: SlewRecord, rows: Rows, solved: Solved) -> Evidence:
    residual_N = rotation(rows.motion.q_NB).apply(np.nan_to_num(solved.residual_Nms))
    return Evidence(record.zero_s + rows.time_s, rows.motion.omega_B, rows.h_B, residual_N, solved.used)


# ---- what all methods have in common -------------------------------------------------------------


def _result(subject: Subject, answer: Answer, wheel_scale: float, rate_scale: float) -> InertiaResult:
    """The answer with errors of scale put in, compared with what was predicted."""
    craft = subject.craft.craft
    wheel = 0.0 if subject.relative else wheel_scale
    by_wheel, by_rate = answer.by_scale
    result = InertiaResult(
        craft=craft.name,
        epoch=subject.telemetry.epoch_label,
        method=answer.method,
        inertia_kgm2=tensor_of(answer.elements),
        inertia_sigma_random_kgm2=tensor_of(np.sqrt(np.maximum(np.diag(answer.covariance), 0.0))),
        inertia_sigma_systematic_kgm2=np.hypot(wheel * by_wheel, rate_scale * by_rate),
        excitation=answer.excitation,
        external_torque_Nm=answer.torque_Nm,
        external_torque_sigma_Nm=answer.torque_sigma_Nm,
        frame=answer.frame,
        slews=answer.slews,
        evidence=answer.evidence,
        relative=subject.relative,
        products=answer.products,
        settings=answer.settings | {"wheel_scale_sigma": wheel, "rate_scale_sigma": rate_scale},
        doubts=Doubts([*answer.doubts, PER_SPIN_INERTIA(what="tensor and torque are") if subject.relative else None]),
    )
    result = replace(result, doubts=result.doubts + Doubts([_misread_doubt(result, answer.misread)]))
    if not craft.mass_properties or not np.isfinite(result.inertia_kgm2).all():
        return result
    comparison = compare_inertia(
        result.inertia_kgm2, predicted_inertia(craft, subject.craft.tai_ns),
        sigma=result.inertia_sigma_kgm2 if result.settled else None, relative=subject.relative,
    )  # fmt: skip
    return replace(result, comparison=comparison, doubts=result.doubts + comparison.doubts)


def _misread_doubt(result: InertiaResult, found: Misread | None) -> Doubt | None:
    """Of a wheel that fits otherwise, where that matters."""
    if found is None or not result.settled:
        return None
    share = np.abs(found.moved) / elements_of(result.inertia_sigma_kgm2)
    k = int(np.argmax(share))
    if share[k] < _MOVED:
        return None
    return WHEEL_MISREAD(
        square=found.square, words=found.words, element=ELEMENTS[k], moved=found.moved[k], sigmas=share[k]
    )
