"""The tensor by a fit of the whole motion: method ``consistent``."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, tensor_of
from ...kit.doubts import Doubt, Kind, Severity
from ...kit.rotations import rotation
from .contradictions import MOST_STEPS
from .levels import first_levels
from .linear import WHEEL
from .misread import in_words
from .motion import Layout
from .prior import possible, prior_for
from .result import Answer, Evidence, Misread
from .slews import find_slews
from .steps import SWING_KEPT, momentum_step, other_vectors, swing_found
from .swings import SWING_FOUND, SWINGS, FoundSwing
from .whole_motion import fit_slews

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..subject import Subject
    from .excitation import Excitation
    from .prior import Prior
    from .record import SlewRecord
    from .whole_motion import SlewFit

#: A step of momentum is kept where it is this large, squared, in its own covariance: of 3 degrees of freedom, chance gives it
#: once in 1e8, at each of some hundred instants tried.
_STEP_KEPT = 40.0
#: A wheel's vector fits otherwise where its difference is this large, squared, in its own covariance; healthy flights have up to 12.
_OTHERWISE = 40.0
#: So many undescribed swings are let in.
_MOST_SWINGS = 2
#: Time stamps apart by more than this are spoken of. [s]
_LATE_S = 0.05
#: Wheel readings that miss the fit by so many times their own scatter are not explained by it.
_UNEXPLAINED = 4.0

STAMPED_APART = Kind(
    "inertia.stamped-apart", Severity.CAUTION,
    "the {channels} are stamped {apart_s:.2f} s {how} against {against}: the fit corrects for it",
    "Check the time stamps of these channels.",
)  # fmt: skip
OUTLIERS = Kind(
    "inertia.outliers", Severity.CAUTION, "{outliers} readings are outliers and are left out",
    "Look at the residuals: --plot.",
)  # fmt: skip
NOT_CONVERGED = Kind(
    "inertia.not-converged", Severity.SUSPECT,
    "the fit did not settle in {rounds} rounds: no random sigma is given", "Take a shorter window.",
)  # fmt: skip
SLOW_TORQUE = Kind(
    "inertia.slow-torque", Severity.NOTE,
    "an outside torque that changes slowly is part of the model: {torque_Nm:.2g} N m rms over {lasts_s:.0f} s, fitted, beside the levers of "
    "what the telemetry shows of field, sunlight and air stream",
)  # fmt: skip
WITHOUT_STEPS = Kind(
    "inertia.without-steps", Severity.CAUTION,
    "with a slow torque in place of the {steps} steps of momentum the tensor would be {values}: {element} moves most, by {change:+.3g} "
    "({sigmas:.1f} sigma)",
    "Add the thrusters' on-times, so that the steps need not be found.",
)  # fmt: skip
UNEXPLAINED = Kind(
    "inertia.unexplained", Severity.SUSPECT,
    "wheel readings miss the fit by {ratio:.0f} times their own scatter: momentum is not conserved as modelled. A wheel mistaken "
    "for another, a wrong axis or spin inertia, or a torque that is not modelled would do that",
    "Check the wheels' axes and spin inertia, and look at the residuals: --plot.",
)  # fmt: skip


def by_whole_motion(
    subject: Subject,
    record: SlewRecord,
    excited: Excitation,
    frame: str,
    progress: Callable[[str], None] | None,
) -> Answer:
    """Raises BadInput where the slews do not identify the tensor and nothing else is known of it."""
    prior, leaning = prior_for(subject, excited)
    fit_of = partial(fit_slews, frame=frame, prior=prior, seen=excited.seen, progress=progress)
    fit, unparted = _explained(fit_of(record), fit_of, prior)
    layout = fit.layout
    tensor, torque = layout.TENSOR, layout.torque
    elements, impossible = possible(fit.beta[tensor], np.linalg.inv(fit.covariance[tensor, tensor]))
    evidence = _evidence(fit)
    by = fit.by_scale[tensor]
    settled = 1.0 if fit.converged else np.nan
    return Answer(
        method="consistent",
        elements=elements,
        covariance=settled * fit.covariance[:6, :6],
        by_scale=np.stack([tensor_of(by[:, 0]), tensor_of(by[:, 1])]),
        excitation=excited,
        torque_Nm=fit.beta[torque],
        torque_sigma_Nm=settled * fit.sigma[torque],
        frame=frame,
        slews=tuple(find_slews(evidence.time_s, evidence.omega_rad_s, fit.levels.rate)),
        evidence=evidence,
        settings=_settings(fit) | _without_steps(fit, unparted),
        misread=_misread(fit),
        doubts=[*fit.record.doubts, *leaning, *impossible, *_fit_doubts(fit), _step_doubt(fit, unparted)],
    )


def _explained(
    fit: SlewFit, fit_of: Callable[[SlewRecord], SlewFit], prior: Prior | None
) -> tuple[SlewFit, SlewFit | None]:
    """The fit of the best explanation of momentum that is not conserved, and that of a slow torque alone where steps were found.

    A step is let in where it is plain and where it explains more than a slow torque would, each by what it costs (BIC)."""
    record, slow = fit.record, None
    if record.wanders:
        return fit, None
    for turn in range(MOST_STEPS + 1):
        at, square = momentum_step(fit, prior)
        swing, larger = swing_found(fit) if turn < _MOST_SWINGS else (None, 0.0)
        if swing is not None and larger > max(SWING_KEPT, square):
            fit = fit_of(replace(fit.record, swings=(*fit.record.swings, swing)))
            continue
        plain = square >= _STEP_KEPT and turn < MOST_STEPS
        if slow is None and (plain or fit.record.steps) and not fit.record.slow:
            slow = fit_of(replace(fit.record.whole or record, slow=True))
            parted = fit_of(fit.record.split_at(at)) if plain else fit
            fit = slow if slow.criterion < parted.criterion else parted
        elif plain:
            parted = fit_of(fit.record.split_at(at))
            if fit.record.slow and parted.criterion >= fit.criterion:
                break
            slow = slow or fit
            fit = parted
        else:
            break
    return fit, slow if fit.record.steps else None


def _without_steps(fit: SlewFit, unparted: SlewFit | None) -> dict:
    """The tensor of a slow torque in place of the steps, and the size of that torque where it is in the model."""
    slow = {}
    if fit.record.slow:
        slow = {"slow_torque_Nm": fit.levels.slow, "slow_torque_s": fit.levels.slow_s}
    if unparted is None:
        return slow
    sigma = tensor_of(unparted.sigma[Layout.TENSOR]) if unparted.converged else None
    told = {"inertia_kgm2": tensor_of(unparted.beta[Layout.TENSOR]), "inertia_sigma_random_kgm2": sigma}
    return slow | {"without_steps": told, "bic_without_steps_above": unparted.criterion - fit.criterion}


def _step_doubt(fit: SlewFit, unparted: SlewFit | None) -> Doubt | None:
    if unparted is None:
        return SLOW_TORQUE(torque_Nm=fit.levels.slow, lasts_s=fit.levels.slow_s) if fit.record.slow else None
    moved = unparted.beta[Layout.TENSOR] - fit.beta[Layout.TENSOR]
    k = int(np.argmax(np.abs(moved) / fit.sigma[Layout.TENSOR]))
    values = ", ".join(f"{n} {v:.6g}" for n, v in zip(ELEMENTS, unparted.beta[Layout.TENSOR], strict=True))
    return WITHOUT_STEPS(
        values=values,
        element=ELEMENTS[k],
        change=moved[k],
        sigmas=abs(moved[k]) / fit.sigma[k],
        steps=len(fit.record.steps),
    )


def _misread(fit: SlewFit) -> Misread | None:
    """The wheel whose vector fits otherwise, where one plainly does."""
    told = other_vectors(fit)
    k = max(range(len(told)), key=lambda k: told[k].square, default=None)
    if k is None or told[k].square < _OTHERWISE:
        return None
    vector = fit.record.axes[k]
    return Misread(in_words(fit.record.wheels[k], vector, vector + told[k].value), told[k].square, told[k].moved)


def _settings(fit: SlewFit) -> dict:
    """What was fitted besides: noise levels, time offsets, biases."""
    layout, noise, beta, sigma = fit.layout, fit.levels, fit.beta, fit.sigma
    rates, attitude = fit.record.has_rates, fit.record.has_attitude
    late = layout.skew_rates
    return {
        "wheel_noise": noise.wheel,
        "rate_noise_rad_s": noise.rate if rates else None,
        "attitude_noise_rad": noise.attitude if attitude else None,
        "attitude_coloured_rad": noise.coloured if attitude else None,
        "attitude_coloured_s": noise.coloured_s if attitude else None,
        "wheels_late_s": -beta[layout.skew_wheels],
        "wheels_late_sigma_s": sigma[layout.skew_wheels],
        "rates_late_s": None if late is None else -beta[late],
        "rates_late_sigma_s": None if late is None else sigma[late],
        "wander_Nms_per_root_s": noise.wander or None,
        "rate_bias_rad_s": None if layout.bias is None else beta[layout.bias],
        "swings": {name: list(found) for name, found in _amplitudes(fit).items()},
        "swings_found": _found(fit),
        "arcs": len(fit.record.arcs),
        "left_out": int((~fit.weighted.kept).sum()),
        "rounds": fit.rounds,
        "converged": fit.converged,
    }


def _amplitudes(fit: SlewFit) -> dict[str, tuple[float, float]]:
    """Of what swings, over what the craft file says, with sigma."""
    at = fit.layout.amplitudes
    names = [s.name for s in fit.record.swings if not isinstance(s, FoundSwing)]
    return {n: (float(b), float(s)) for n, b, s in zip(names, fit.beta[at], fit.sigma[at], strict=False)}


def _found(fit: SlewFit) -> list[dict]:
    """What swings and is not described: its frequency, damping, and the elements (6,) of its delta delta^T."""
    swings = [s for s in fit.record.swings if isinstance(s, FoundSwing)]
    parts = fit.beta[fit.layout.size - FoundSwing.FREE * len(swings) : fit.layout.size].reshape(-1, FoundSwing.FREE)
    return [
        {"frequency_Hz": s.frequency / (2 * np.pi), "damping": s.damping, "coupling_kgm2": s.size * part}
        for s, part in zip(swings, parts, strict=True)
    ]


def _evidence(fit: SlewFit) -> Evidence:
    """Residual momentum at the wheels' instants, inertial axes, with the smoothed rates and what the wheels held."""
    m, model = fit.record.momentum, fit.weighted.model
    rows = model.kind == WHEEL
    left = np.empty(len(m.time_s))
    left[model.source[rows]] = fit.residual[rows]
    time_s, total, _ = m.vectors(left)
    at = time_s + fit.beta[fit.layout.skew_wheels]
    residual = rotation(fit.motion.at(at).q_NB).apply(total)
    omega = fit.motion.moved(fit.smoothed.mean).at(at).omega_B
    held = m.vectors(m.value_Nms)[1]
    return Evidence(fit.record.zero_s + time_s, omega, held, residual, np.ones(len(time_s), bool))


def _fit_doubts(fit: SlewFit) -> list[Doubt]:
    layout, beta, sigma = fit.layout, fit.beta, fit.sigma
    against = "the attitude" if fit.record.has_attitude else "the body rates"
    doubts = [
        STAMPED_APART(channels=name, apart_s=abs(beta[k]), how="late" if beta[k] < 0 else "early", against=against)
        for name, k in (("wheel rates", layout.skew_wheels), ("body rates", layout.skew_rates))
        if k is not None and abs(beta[k]) > max(_LATE_S, 4 * sigma[k])
    ]
    if fit.converged:
        doubts += [SWINGS(name=name, share=share, sigma=s) for name, (share, s) in _amplitudes(fit).items()]
    mean = float(np.trace(tensor_of(beta[layout.TENSOR]))) / 3
    for found in _found(fit):
        share = np.abs(np.linalg.eigvalsh(tensor_of(found["coupling_kgm2"]))).max() / mean
        doubts.append(SWING_FOUND(frequency_Hz=found["frequency_Hz"], percent=100 * share))
    out = int((~fit.weighted.kept).sum())
    if out:
        doubts.append(OUTLIERS(outliers=out))
    if not fit.converged:
        doubts.append(NOT_CONVERGED(rounds=fit.rounds))
    scatter = first_levels(fit.record).wheel
    if fit.levels.wheel > _UNEXPLAINED * scatter:
        doubts.append(UNEXPLAINED(ratio=fit.levels.wheel / scatter))
    return doubts
