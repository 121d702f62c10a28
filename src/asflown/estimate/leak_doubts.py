"""What else than one leaking or weak thruster would look so: several that fire uncounted, the other branch, a wheel that is full."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from ..craft.model import Craft
from ..kit.errors import some_of
from ..telemetry.telemetry import Telemetry
from .leak_firing import Geometry
from .thruster_branch import branch_change, undescribed
from .uncounted import PULSES

#: Log likelihood ratio of any direction over the best column; noise exceeds it once in 1100.
MISFIT = 7.0
#: A thruster is part of a mixture from this share of its largest on.
_PART = 0.05


def together(better: float, torque_Nm, precision, geometry: Geometry) -> list[str]:
    """Thrusters that would make a torque (3,) [N m] between them, where it is so much ``better`` (log likelihood ratio) with a
    direction of its own than by the best of them alone; none where one will do.  ``precision`` (3, 3): of the torque."""
    if better <= MISFIT:
        return []
    root = np.linalg.cholesky(precision).T
    thrust, _ = nnls(root @ geometry.columns, root @ torque_Nm)
    return [n for n, f in zip(geometry.names, thrust, strict=True) if f > _PART * thrust.max()]


def pointing_doubt(better: float, mixed: list[str], pulses: float) -> str | None:
    """Where no one thruster makes the torque.  ``pulses``: how many its momentum is worth."""
    if better <= MISFIT:
        return None
    text = f"the torque does not point as any thruster's would (log likelihood ratio {better:.1f}): "
    if len(mixed) > 1:
        text += f"{some_of(mixed)} together would. "
        if pulses > PULSES:
            text += (
                f"If they fire, as for {pulses:.0f} pulses, they are not counted: those of the other branch, with on-times that are not in the "
                "file. "
            )
    return text + "Or something else turns the craft, or centre of mass or inertia are not right"


def branch_doubts(telemetry: Telemetry, craft: Craft) -> list[str]:
    doubts = []
    if (change := branch_change(telemetry)) is not None:
        doubts.append(
            f"the thrusters' branch changes {change}: where the on-times are those of one branch alone, all that the other fires is "
            "momentum nobody ordered"
        )
    elif (other := undescribed(telemetry, craft.thrusters)) is not None:
        doubts.append(f"{other}: a weak thruster is one of the branch in use, a leaking one may be of either")
    return doubts


def loss_doubt(loss: float, sigma: float) -> str | None:
    """Pulses that give less than nothing are none."""
    if loss - 2 * sigma <= 1:
        return None
    return (
        f"a loss of {100 * loss:.0f} % is more than a thruster has to lose: momentum is missing from the readings (a wheel that saturates), or "
        "on-times are under wrong names"
    )
