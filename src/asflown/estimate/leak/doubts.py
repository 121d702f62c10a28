"""What is not sure of a leak monitor's verdict: its noise, the thrust it believes, and what else than one thruster would look so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import nnls

from ...kit.errors import some_of
from ...kit.timeline import NS, utc_label
from ..firing import PULSES, branch_change, undescribed
from .residual import AXES_IN_A_LEAK, Steps

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from .firing import Geometry
    from .noise import Noise

#: Log likelihood ratio of any direction over the best column; noise exceeds it once in 1100.
MISFIT = 7.0
#: A thruster is part of a mixture from this share of its largest on.
_PART = 0.05
#: Independent readings times axes below which the noise is said to be little known; and how many worth one are too many.
_FEW_DEGREES, _FOLLOWING = 120, 3.0
_FAR_FROM_KNOWN = 200 * 86_400 * NS  # a thrust from longer ago is doubted


def noise_doubts(noise: Noise, steps: Steps) -> list[str]:
    doubts = []
    if noise.degrees < _FEW_DEGREES:
        doubts.append(
            f"the noise is learned from readings worth {noise.degrees / AXES_IN_A_LEAK:.0f} independent ones: a larger leak is needed for an alarm"
        )
    if noise.alike.max() > _FOLLOWING:
        doubts.append(
            f"readings in the holds the noise is learned from follow each other ({noise.alike.max():.0f} are worth one): if something "
            "moved then, the noise is overstated and small leaks stay hidden"
        )
    if not len(steps.tai_ns[noise.until :]):
        doubts.append(
            "the noise is learned from all of the record: a leak through all of it would count as steady torque"
        )
    return doubts


def thrust_doubts(epoch_ns: int | None, craft: Craft) -> list[str]:
    """Of a thrust that nobody said, on a date; None: in a record without one."""
    if not craft.thrust_history:
        return ["the thrust is the nominal one: --thrust says it better"]
    if epoch_ns is None:
        latest = utc_label(max(h.date for h in craft.thrust_history))[:10]
        return [f"the record has no date: the thrust is that of {latest}, the latest known; --thrust says it better"]
    nearest = min((h.date for h in craft.thrust_history), key=lambda d: abs(epoch_ns - d))
    if abs(epoch_ns - nearest) <= _FAR_FROM_KNOWN:
        return []
    return [
        f"the thrust is carried over from {utc_label(nearest)[:10]}, the nearest date known: --thrust says it better"
    ]


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
