"""One call for the disturbance torque: a method, or the best there is, and a result with its doubts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...kit.result import recorded
from ...telemetry.channels import AXES
from ..redundancy import redundancy
from ..subject import PER_SPIN_INERTIA, Subject, subject_of
from .answer import Answer, Method
from .choice import method_called
from .known import check_known, foreknown, with_known, without_known
from .result import TorqueResult
from .rods import rods_doubt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from ..environment import Air

NOTHING_CHANGES = Kind(
    "torque.nothing-changes", Severity.VOID,
    "not one channel changes in this record: dead sensors or a frozen frame; the torque says nothing, nor does its sigma",
    "Run asflown telemetry check on the file.",
)  # fmt: skip
THRUSTERS_FIRE = Kind(
    "torque.thrusters-fire", Severity.CAUTION,
    "thrusters fire in this record ({thrusters}): their torque is part of the result, and where they rather than the wheels hold "
    "the attitude the transfer method does not apply",
    "Narrow the span to one without firings, or use --method on-times.",
)  # fmt: skip


@recorded
def torque(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str | Method | None = None,
    variant: str = "corrected",
    axis: str = "all",
    model: str | None = None,
    order: int | None = None,
    window_s: float | None = None,
    prior: str | None = None,
    loop: str | None = None,
    considered: dict[str, float] | None = None,
    moving: str | None = "auto",
    known: Sequence[str] = (),
    air: Air | None = None,
) -> TorqueResult:
    """The torque on the body that the actuators did not command, in body axes.

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates, wheel momentum or control torque; body rates; attitude error.
    craft : Craft
        Wheels, inertia and wheel controller.
    method : str or Method, optional
        'fused' (all channels at once), 'momentum' (cover paper eqs 2-9), 'transfer' (cover paper eqs 10-20), 'polynomial' (plume
        paper eqs 7, 17, 18) or 'on-times' (about one axis, where thrusters fire); or an object such as ``Momentum(window_s=20)``,
        which has its own options.  By default fused where it can be, else momentum or transfer; with the printed variant or a
        window momentum.
    variant : {'corrected', 'printed'}
        'printed' is the papers' method with its errors.
    axis : {'all', 'x', 'y', 'z'}
        About which to reconstruct.
    model : {'full', 'low', 'hankel'}, optional
        Loop model of the transfer and polynomial methods.
    order : {6, 12, 15, 18}, optional
        Of the polynomial method; 12 unless given.
    window_s : float, optional
        Full width [s] of the local fits of the momentum and transfer methods, in place of the studied one.
    prior : {'edges', 'matern', 'wiener'}, optional
        What the fused method takes the torque for; edges, or matern in a long record.
    loop : {'modelled', 'measured'}, optional
        Whether the fused method models the controller; where it can unless given.
    considered : dict of str to float, optional
        One sigma of what the fused method takes as known: inertia, spin_inertia, kp, kd, control_torque (shares), delay_s [s].
    moving : str or None
        Mechanism whose inertia is taken off; 'auto': the one whose angle is seen to move; None: no mechanism moves.
    known : sequence of str
        Torques of the surroundings that are taken off: 'gravity-gradient', 'sunlight', 'dipole', 'drag', 'rods', as the craft file has
        them; their uncertainty goes into the band.  The fused method has them as an input of its fit, pulses of torque rods too.
    air : Air, optional
        F10.7 of the day before, its 81-day mean and Ap for the density of the drag; without it the density falls exponentially.

    Returns
    -------
    TorqueResult
        Torque (M, 3) [N m] about the centre of mass, positive as it turns the body about +axis; NaN where not known.

    Raises
    ------
    BadInput
        For options that the method does not take, for a known torque that cannot be computed, and where the telemetry lacks what the method needs, names wheels the craft
        does not have, or is shorter than the window.
    """
    options = {
        "model": model,
        "order": order,
        "window_s": window_s,
        "prior": prior,
        "loop": loop,
        "considered": considered,
    }
    check_choice(axis, (*AXES, "all"), "axis")
    if not isinstance(method, Method):
        method = method_called(
            method, variant=variant, model=model, order=order, window_s=window_s, prior=prior, loop=loop, considered=considered
        )  # fmt: skip
    elif variant != "corrected" or any(v is not None for v in options.values()):
        raise BadInput("a method object has its own options", remedy="Give them to the object: Momentum(window_s=20).")
    names, subject = check_known(known), subject_of(telemetry, craft, moving)
    if not names:
        return torque_of(subject, method, axis)
    if hasattr(method, "foreknown"):
        method = replace(method, foreknown=foreknown(subject, names, air))  # type: ignore[call-arg]
    result = torque_of(subject, method, axis)
    return (with_known if result.method == "fused" else without_known)(result, subject, names, air)


def torque_of(subject: Subject, method: Method, axis: str = "all") -> TorqueResult:
    """As ``torque``, of a subject that is already there."""
    telemetry = subject.telemetry
    axes = (0, 1, 2) if axis == "all" else (AXES.index(axis),)
    try:
        answer = method.estimate(subject, axes)
        for j in axes:
            if not np.isfinite(answer.torque_Nm[:, j]).any():
                telemetry.channel(f"attitude_error_{AXES[j]}")  # the only channels that may lack an axis
    except BadInput as why:
        raise why.within(telemetry.source) from why.__cause__
    relative = subject.relative and answer.by.name != "transfer"
    return TorqueResult(
        craft=subject.craft.craft.name,
        epoch=telemetry.epoch_label,
        method=answer.by.name,
        variant=answer.by.variant,
        axis=axis,
        time_s=answer.grid.from_epoch(telemetry),
        torque_Nm=answer.torque_Nm,
        torque_sigma_Nm=answer.sigma_Nm,
        momentum_Nms=answer.momentum_Nms,
        relative=relative,
        settings=answer.settings | _inertia_used(subject),
        fits=answer.fits,
        paths_Nm=answer.paths_Nm,
        peak_scales=answer.peak_scales,
        evidence=answer.evidence,
        gained=answer.gained,
        doubts=subject.doubts + answer.doubts + _doubts(subject, answer, relative=relative),
    )


def _doubts(subject: Subject, answer: Answer, *, relative: bool) -> Doubts:
    """Those of the record as a whole."""
    found: list[Doubt] = []
    if _nothing_changes(subject.telemetry):
        found.append(NOTHING_CHANGES())
    if subject.firing and answer.gained is None:
        found.append(THRUSTERS_FIRE(thrusters=subject.firing))
    if relative:
        found.append(PER_SPIN_INERTIA(what="torque and momentum are"))
    return Doubts([*found, rods_doubt(subject.telemetry, answer.sigma_Nm), *redundancy(subject)])


def _nothing_changes(telemetry: Telemetry) -> bool:
    stems = ("wheel_rate", "wheel_momentum", "control_torque", "body_rate", "attitude_error")
    said = [c.usable.values for c in telemetry.channels.values() if c.kind.stem in stems]
    return not any(len(v) == 0 or np.ptp(v) > 0 for v in said)


def _inertia_used(subject: Subject) -> dict:
    I_B = subject.inertia_kgm2
    key = "inertia_per_spin_inertia" if subject.craft.relative else "inertia_kg_m2"
    return {
        key: None if I_B is None else I_B.tolist(),
        "mechanism_taken_off": subject.moving,
        "wheels": [w.name for w in subject.craft.wheels],
    }
