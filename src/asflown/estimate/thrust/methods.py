"""Thrust as flown, from wheel biasing, run-downs under thruster control and burns (001 section V, Appendix D).

``joint`` (default): one model of all records: momentum, and velocity where an accelerometer counts, with the corrected
formula of the pulse (``thrust_fit``).  ``printed``: 001 eqs 14-23 (``thrust_printed``), divided by R.  ``accelerometer``:
F = M dV / sum of on-times, divided by R (Appendix D).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import VARIANTS
from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS, utc_label
from ...telemetry.telemetry import Telemetry
from ..firing import Priors, priors_for
from .joint import joint
from .papers import accelerometer_result, printed_result

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from .result import ThrustResult

METHODS = ("joint", "printed", "accelerometer")

#: Records this far apart may have different thrusts. [days]
_APART_DAYS = 60.0
#: A prediction older than this is doubted [days]; a newer one is taken to be good to this share, assumed.
_STALE_DAYS, _PREDICTED_SHARE = 200.0, 0.05
#: Two branches' thrusts are not further apart than this share; assumed.
_NO_BRANCH = 0.3


def thrust(
    telemetry: Telemetry | Sequence[Telemetry],
    craft: Craft,
    *,
    method: str = "joint",
    variant: str = "corrected",
    priors: Priors | None = None,
) -> ThrustResult:
    """Steady thrust of every thruster, fall time and centre of mass, of one record or several together.

    ``variant``: which formula's R divides a thrust of the printed and accelerometer methods: ``corrected``, or ``printed``, which
    gives 1.395 for 125 ms in place of 1.359; the joint method has the corrected one only.

    Raises BadInput where no thruster fires, names or counters do not fit the craft, or channels are missing."""
    if method not in METHODS:
        raise BadInput(f"method {method!r} is not known", remedy=f"Choose one of: {some_of(METHODS)}.")
    if variant not in VARIANTS or (method == "joint" and variant != "corrected"):
        raise BadInput(
            f"variant {variant!r} is not one of the {method} method",
            remedy="The joint method is always corrected; printed and accelerometer take --variant corrected or printed.",
        )
    records = [telemetry] if isinstance(telemetry, Telemetry) else list(telemetry)
    known = priors or priors_for(craft)
    done = {"joint": joint, "printed": printed_result, "accelerometer": accelerometer_result}[method](
        records, craft, variant, known
    )
    dated = [t for t in records if t.dated]
    days = [t.epoch_ns / NS / 86_400 for t in dated]
    doubts = list(done.doubts)
    if days and max(days) - min(days) > _APART_DAYS:
        doubts.append(
            f"the records lie {max(days) - min(days):.0f} days apart and are given one thrust: it falls as propellant is used"
        )
    predicted = None
    if dated and craft.thrust_history:
        predicted = craft.thrust_at(dated[0].epoch_ns)
        last = max(h.date for h in craft.thrust_history)
        if dated[0].epoch_ns - last > _STALE_DAYS * 86_400 * NS:
            doubts.append(
                f"the predicted thrust is that of {utc_label(last)[:10]}, the last one known: it has fallen since"
            )
        elif done.mean_sigma_N is not None:
            off, expected = done.mean_thrust_N - predicted, np.hypot(done.mean_sigma_N, _PREDICTED_SHARE * predicted)
            if abs(off) > 2 * expected:
                why = "the other branch, with a thrust of its own and the same places, would look so"
                if abs(off) > _NO_BRANCH * predicted:
                    why = "neither blow-down nor the other branch explains so much"
                doubts.append(
                    f"the mean is {100 * off / predicted:+.0f} % from the {predicted:.3g} N predicted, which are taken to be known to "
                    f"{100 * _PREDICTED_SHARE:.0f} %: {why}"
                )
    return replace(done, predicted_N=predicted, doubts=tuple(dict.fromkeys(doubts)))
