"""Which channels tell what the actuators hold or give."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Kind, Severity
from ...kit.errors import BadInput
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from .subject import Subject


COMMANDED_ONLY = Kind(
    "subject.commanded-only", Severity.CAUTION,
    "only the commanded control torque is telemetered: it is assumed to be delivered, and momentum_Nms is that of the body "
    "alone, without what the actuators hold", "Add wheel_rate_<WHEEL> or wheel_momentum_x|y|z.",
)  # fmt: skip


NO_ACTUATORS = Kind(
    "subject.no-actuators", Severity.CAUTION,
    "{craft} has no wheels, and no control torque is telemetered: the torque is all that acts on the body, torque rods and thrusters "
    "included", "Add control_torque_x, _y and _z where something commands one.",
)  # fmt: skip


def actuators(subject: Subject):
    """What holds momentum: [(channel, momentum per unit)], or the control torque channels, and doubts.

    Neither for a craft without wheels, whose body alone holds momentum."""
    tlm = subject.telemetry
    if tlm.members("wheel_rate"):
        pairs = subject.wheels()
        axes, spin = axes_and_inertias(pairs)
        return [(c, J * a) for (c, _), a, J in zip(pairs, axes, spin, strict=True)], [], []
    if tlm.has_axes("wheel_momentum"):
        return [(tlm.channel(f"wheel_momentum_{a}"), np.eye(3)[j]) for j, a in enumerate(AXES)], [], []
    if tlm.has_axes("control_torque"):
        return [], [tlm.channel(f"control_torque_{a}") for a in AXES], [COMMANDED_ONLY()]
    subject.wheels()  # names what is missing
    if not subject.craft.wheels and tlm.has_axes("body_rate") and subject.inertia_kgm2 is not None:
        return [], [], [NO_ACTUATORS(craft=subject.craft.craft.name)]
    raise BadInput(
        "neither wheel rates, wheel momentum nor control torque are in the telemetry",
        file=tlm.source or None,
        remedy="The momentum method needs wheel_rate_<WHEEL>, wheel_momentum_x|y|z or control_torque_x|y|z; of a craft without wheels, "
        "body rates and its inertia.",
    )


def axes_and_inertias(pairs):
    axes = np.array([w.axis for _, w in pairs])
    spin = np.array([1.0 if w.spin_inertia is None else w.spin_inertia for _, w in pairs])
    return axes, spin
