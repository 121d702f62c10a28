"""Wheels against attitude error: two estimates of one torque show a wrong sign or unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput
from ...telemetry.channels import AXES
from ..subject import turns
from .momentum import Momentum
from .transfer import NOT_HELD, Transfer

if TYPE_CHECKING:
    from ..subject import Subject
    from .answer import Answer

#: Instants compared, and how far each torque's scatter exceeds its sigma; less says nothing.
_FEWEST, _LOUD = 30, 3.0
#: Correlation below minus the first: opposite signs; above the second: alike but for a scale, to e^_NEAR.
_OPPOSITE, _ALIKE, _NEAR = 0.3, 0.5, 0.3

_SLIPS = {
    60 / (2 * np.pi): "wheel rates in rpm labelled rad/s",
    2 * np.pi / 60: "wheel rates in rad/s labelled rpm",
    1e-3: "attitude error in mrad labelled rad",
    1e3: "attitude error in rad labelled mrad, or wheel rates a thousand times too large",
    np.pi / 180: "attitude error in degrees labelled rad",
    180 / np.pi: "attitude error in rad labelled degrees",
}


OPPOSITE = Kind(
    "torque.opposite-signs", Severity.SUSPECT,
    "torque {axis} from wheels and from attitude error have opposite signs (correlation {correlation:.2f}): a sign is wrong, most "
    "often that of the attitude error (commanded minus estimated) or of a wheel axis",
    "Check the channel dictionary and the wheels' axes in the craft file.",
)  # fmt: skip
OTHER_SCALE = Kind(
    "torque.other-scale", Severity.SUSPECT, "torque {axis} from wheels is {ratio:.3g} times that from attitude error: {guess}?",
    "Check the unit in the heading or in the channel dictionary.",
)  # fmt: skip


def consistency(subject: Subject, answer: Answer) -> list[Doubt]:
    """What wheels and attitude error say of each other's sign and unit, axis by axis; nothing where one is not there.

    ``answer``: taken for one of the two where it is that."""
    tlm = subject.telemetry
    if subject.slewing or subject.firing:
        return []  # the attitude error then answers to more than the disturbance
    wheels = bool(tlm.members("wheel_rate")) and not subject.relative
    errors = any(f"attitude_error_{a}" in tlm for a in AXES)
    if not (wheels and errors) or subject.inertia_kgm2 is None or subject.craft.craft.wheel_controller is None:
        return []
    ready = {answer.by.name: answer} if answer.by.variant == "corrected" else {}
    try:
        a = ready.get("momentum") or Momentum().estimate(subject, ())
        b = ready.get("transfer") or Transfer().estimate(subject, ())
    except BadInput:
        return []  # too short for one of the two: nothing to compare
    turned = subject.slewing or turns(subject.telemetry)
    if b.doubts.has(NOT_HELD) and (turned or not subject.telemetry.has_axes("body_rate")):
        return []  # the attitude error then answers to the command too; where the gyros see a hold, its unit may be wrong
    return [d for j in range(3) for d in _compared(a, b, j)]


def _compared(wheels: Answer, error: Answer, j: int) -> list[Doubt]:
    if wheels.sigma_Nm is None or error.sigma_Nm is None:
        return []
    ta, tb = (a.grid.start_ns * 1e-9 + a.grid.seconds for a in (wheels, error))
    x, y = wheels.torque_Nm[:, j], np.interp(ta, tb, error.torque_Nm[:, j], left=np.nan, right=np.nan)
    good = np.isfinite(x) & np.isfinite(y)
    if good.sum() < _FEWEST:
        return []
    x, y = x[good], y[good]
    loud_x = np.std(x) > _LOUD * np.nanmedian(wheels.sigma_Nm[:, j])
    loud_y = np.std(y) > _LOUD * np.nanmedian(error.sigma_Nm[:, j])
    if not (loud_x and loud_y):
        return []  # noise against noise says nothing
    r, ratio = float(np.corrcoef(x, y)[0, 1]), float(np.std(x) / np.std(y))
    doubts = [OPPOSITE(axis=AXES[j], correlation=r)] if r < -_OPPOSITE else []
    for factor, slip in _SLIPS.items():
        if abs(r) > _ALIKE and abs(np.log(ratio / factor)) < _NEAR:
            doubts.append(OTHER_SCALE(axis=AXES[j], ratio=ratio, guess=slip))
    return doubts
