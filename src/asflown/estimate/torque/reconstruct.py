"""One call for the disturbance torque: choose a method, get a result that knows its doubts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput, some_of
from ...telemetry.channels import AXES
from ..fused import CONSIDERED, LOOPS, PRIORS, fused
from ..subject import Subject, subject_of, thrusters_firing
from . import momentum, polynomial, transfer
from .consistency import consistency
from .result import TorqueResult, find_peaks

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

METHODS = ("fused", "momentum", "transfer", "polynomial")
VARIANTS = ("corrected", "printed")


def disturbance_torque(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str | None = None,
    variant: str = "corrected",
    axis: str = "all",
    model: str | None = None,
    order: int = 12,
    window_s: float | None = None,
    prior: str | None = None,
    loop: str | None = None,
    considered: dict[str, float] | None = None,
    moving: str | None = "auto",
) -> TorqueResult:
    """The torque on the body that the actuators did not command, in body axes. [N m]

    ``method``: 'fused' (all channels at once), 'momentum' (000 eqs 2-9), 'transfer' (000 eqs 10-20; ``model``
    low, hankel or full) or 'polynomial' (004 eqs 7, 17, 18; ``order`` 6, 12, 15 or 18); None: fused where it can
    be, else (and for the printed variant, or with a window) momentum.  ``variant``: 'corrected', or 'printed', the paper's way with its faults.
    ``prior``, ``loop``, ``considered``: of the fused method, see ``fused.fused``.  ``window_s``: full width of
    the corrected methods' local fits, in place of the studied one.  ``moving``: see ``subject_of``.

    Positive torque turns the body about +axis.  Raises BadInput where the telemetry lacks what the
    method needs, names wheels the craft does not have, or is shorter than the window."""
    _check(variant, VARIANTS, "variant")
    free = method is None and variant == "corrected" and window_s is None
    method = method or ("fused" if free else "momentum")
    _check(method, METHODS, "method")
    for name, value, allowed in (("prior", prior, PRIORS), ("loop", loop, LOOPS)):
        if value is not None:
            _check(value, allowed, name)
    _check_considered(considered)
    chosen = prior is not None or loop is not None or considered is not None
    if method != "fused" and chosen:
        raise BadInput(
            f"the {method} method has no prior, loop or considered quantities to choose", remedy="Use --method fused."
        )
    _check(axis, (*AXES, "all"), "axis")
    if model is not None:
        _check(model, transfer.MODELS, "model")
    if window_s is not None and not 0 < window_s < 1e9:
        raise BadInput(f"a window of {window_s} s is not possible", remedy="Give a positive number of seconds.")
    if method == "fused" and variant == "printed":
        raise BadInput("the fused method is in no paper", remedy="Leave --variant out, or name the paper's --method.")
    _check(order, polynomial.ORDERS, "order")
    if model is not None and method in ("momentum", "fused"):
        raise BadInput(
            f"the {method} method has no loop model to choose", remedy="Leave --model out, or use --method transfer."
        )
    if window_s is not None and (variant == "printed" or method in ("polynomial", "fused")):
        raise BadInput(f"the {method} method, {variant}, has no window to choose", remedy="Leave --window out.")
    subject = subject_of(telemetry, craft, moving)
    beforehand: list[str] = []
    try:
        try:
            answer = _run(subject, method, variant, axis, model, order, window_s, (prior, loop, considered))
        except BadInput as why:
            if not free or chosen:
                raise
            # what asks for less; where it too is asked too much, its complaint is the plainer one
            method = "transfer" if _attitude_alone(telemetry) else "momentum"
            answer = _run(subject, method, variant, axis, model, order, window_s, (prior, loop, considered))
            where = f"{why.channel}: " if why.channel else ""
            beforehand.append(f"the fused method cannot be used ({where}{why.what}): this is the {method} method")
    except BadInput as why:
        raise why.within(telemetry.source) from why.__cause__
    grid, torque, sigma, momentum, settings, doubts, fits, *drawn = answer
    time_s = grid.from_epoch(telemetry)
    columns = list(range(3)) if axis == "all" else [AXES.index(axis)]
    for j in columns:
        if not np.isfinite(torque[:, j]).any():
            telemetry.channel(f"attitude_error_{AXES[j]}")  # the only channels that may lack an axis
    result = TorqueResult(
        craft=craft.name,
        method=method,
        variant=variant,
        axis=axis,
        epoch=telemetry.epoch_label,
        time_s=time_s,
        torque_Nm=torque,
        sigma_Nm=sigma,
        momentum_Nms=momentum,
        relative=subject.relative and method != "transfer",
        settings=settings | _inertia_used(subject),
        fits=tuple(fits),
        paths_Nm=drawn[0] if drawn else None,
        evidence=drawn[1] if drawn else {},
    )
    doubts = [
        *beforehand,
        *subject.doubts,
        *doubts,
        *_still_doubts(telemetry),
        *_thruster_doubts(subject),
        *_relative_doubts(subject, result),
    ]
    if method == "momentum" and variant == "corrected":
        doubts += _smoothing_doubts(result, settings["half_width_s"])
    ready = {method: answer} if variant == "corrected" and sigma is not None else {}
    doubts += consistency(subject, ready)
    return _with_doubts(result, doubts)


def _still_doubts(telemetry: Telemetry) -> list[str]:
    stems = ("wheel_rate", "wheel_momentum", "control_torque", "body_rate", "attitude_error")
    said = [c.usable.values for c in telemetry.channels.values() if c.kind.stem in stems]
    if any(len(v) == 0 or np.ptp(v) > 0 for v in said):
        return []
    return [
        "not one channel changes in this record: dead sensors or a frozen frame; the torque says nothing, nor does its sigma"
    ]


def _attitude_alone(telemetry: Telemetry) -> bool:
    """Whether nothing is told of what the actuators did, and the attitude's error is."""
    stems = {c.kind.stem for c in telemetry.channels.values()}
    return "attitude_error" in stems and not stems & {"wheel_rate", "wheel_momentum", "control_torque"}


def _run(subject: Subject, method, variant, axis, model, order, window_s, of_fused):
    if method == "polynomial":
        return polynomial.polynomial(subject, order, model or "low")
    if method == "fused":
        prior, loop, considered = of_fused
        axes = (0, 1, 2) if axis == "all" else (AXES.index(axis),)
        *answer, paths, data = fused(subject, prior, axes, loop, considered)
        return (*answer, (), paths, data)
    module = {"momentum": momentum, "transfer": transfer}[method]
    options: dict = {}
    if method == "transfer":
        options["model"] = model or ("low" if variant == "printed" else "full")
        if variant == "printed" and options["model"] == "full":
            raise BadInput(
                "the printed transfer method has no full model", remedy="Use --variant corrected --model full."
            )
    if variant == "corrected":
        options["window_s"] = window_s
    return (*getattr(module, variant)(subject, **options), ())


def _check(value, allowed, what):
    if value not in allowed:
        raise BadInput(f"{what} {value!r} is not known", remedy=f"Choose one of: {some_of(allowed)}.")


def _check_considered(considered: dict[str, float] | None) -> None:
    for name, sigma in (considered or {}).items():
        _check(name, CONSIDERED, "considered quantity")
        if not 0 <= sigma < 1:
            raise BadInput(
                f"a sigma of {sigma} for {name} is not possible",
                remedy="Give a share such as 0.02 (delay_s: seconds); 0 takes the quantity as exact.",
            )


def _inertia_used(subject: Subject) -> dict:
    I_B = subject.inertia_kgm2
    key = "inertia_per_spin_inertia" if subject.craft.relative else "inertia_kg_m2"
    return {
        key: None if I_B is None else I_B.tolist(),
        "mechanism_taken_off": subject.moving,
        "wheels": [w.name for w in subject.craft.wheels],
    }


def _relative_doubts(subject: Subject, result: TorqueResult) -> list[str]:
    if not result.relative:
        return []
    return [
        "the wheels' spin inertia is not known: torque and momentum are per unit spin inertia (rad/s^2, rad/s), not N m"
    ]


def _thruster_doubts(subject: Subject) -> list[str]:
    firing = thrusters_firing(subject.telemetry)
    if not firing:
        return []
    return [
        f"thrusters fire in this record ({some_of(firing)}): their torque is part of the result, and where they rather than the "
        "wheels hold the attitude the transfer method does not apply"
    ]


#: A corner rounded twice is rounded over sqrt(2) times the width: the first pass took this many times
#: what the second takes.
_FIRST_PASS = 1 / (np.sqrt(2) - 1)


def _smoothing_doubts(result: TorqueResult, half_width_s: float) -> list[str]:
    """Say how much of each peak the window took."""
    step = float(result.time_s[1] - result.time_s[0]) if len(result.time_s) > 1 else 1.0
    worst, noise = 0.0, 0.0
    for j in result.axes:
        loss = momentum.smoothing_loss(step, result.torque_Nm[:, j], half_width_s)
        for p in find_peaks(result, j):
            k = int(np.argmin(np.abs(result.time_s - p.time_s)))
            worst = max(worst, _FIRST_PASS * float(loss[k] / p.torque_Nm))
            if result.sigma_Nm is not None:
                noise = max(noise, 2 * float(result.sigma_Nm[k, j] / abs(p.torque_Nm)))
    if worst < 0.02:
        return []
    if worst > 0.5:
        return [
            f"some excursions are no wider than the smoothing window of +-{half_width_s:.0f} s: their height and shape are not "
            "resolved, only their impulse is; --window can be made shorter at the price of noise"
        ]
    return [
        f"smoothing over +-{half_width_s:.0f} s rounds sharp peaks: they may be low by up to {100 * worst:.0f} %, besides "
        f"+-{100 * noise:.0f} % of noise (2 sigma); the band holds only the noise, and single peaks can be further off than the "
        "printed method's, whose two faults offset each other"
    ]


def _with_doubts(result: TorqueResult, doubts) -> TorqueResult:
    return replace(result, doubts=tuple(dict.fromkeys(doubts)))
