"""Thrust as flown, from wheel biasing, run-downs under thruster control and burns (Feldman & Lee, section V and Appendix D).

``joint`` (default): one model of all records: momentum, and velocity where an accelerometer counts, with the corrected
formula of the pulse (``fit``).  ``printed``: eqs 14-23 (``printed``), divided by R.  ``accelerometer``:
F = M dV / sum of on-times, divided by R (Appendix D).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import VARIANTS
from ...kit.doubts import Doubts
from ...kit.errors import BadInput, check_choice
from ...kit.result import recorded
from ...telemetry.telemetry import Telemetry
from ..firing import thrust_priors
from ..subject import subject_of
from .doubts import prediction_doubts
from .joint import joint
from .papers import accelerometer_result, printed_result

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from ..firing import Priors
    from .result import ThrustResult

METHODS = ("joint", "printed", "accelerometer")


@recorded
def thrust(
    telemetry: Telemetry | Sequence[Telemetry],
    craft: Craft,
    *,
    method: str = "joint",
    variant: str = "corrected",
    priors: Priors | None = None,
) -> ThrustResult:
    """Steady thrust of every thruster, fall time of the valves and centre of mass, from one record or several together.

    The joint method fits momentum about the centre of mass, and velocity where an accelerometer counts, step by step between
    samples:

        d(R (I w + h_w)) = R sum_k (r_k - c) x d_k F_k T_k + noise,   T_k = on-time + pulses (fall - rise) + ...

    with places r_k, directions d_k and effective times T_k of the pulses (``dynamics.pulses``).

    Parameters
    ----------
    telemetry : Telemetry or sequence of Telemetry
        On-times of every thruster, pulse counts where there are any, wheel rates and body rates; accelerometer counts for a
        burn.  All records are given one thrust.
    craft : Craft
        Places and directions of the thrusters, wheels with spin inertia, inertia.
    method : {'joint', 'printed', 'accelerometer'}
        'printed' is the least squares of Feldman & Lee, eqs 14-23; 'accelerometer' F = M dV / on-time of one burn (their
        Appendix D).  Both divide by the ratio R of these pulses.
    variant : {'corrected', 'printed'}
        Formula of R for the printed and accelerometer methods: 'printed' gives 1.395 for a pulse of 125 ms, 'corrected' 1.359.
        The joint method has the corrected one only.
    priors : Priors, optional
        What is known beforehand, as ``thrust_priors`` gives it with what the user says instead: fall time [s], centre of mass [m],
        scatter, mass [kg].  By default those of the craft.

    Returns
    -------
    ThrustResult
        Thrusts [N], along each thruster's direction of force on the craft; fall time [s]; centre of mass (3,) [m] in the axes of
        the thrusters' positions.

    Raises
    ------
    BadInput
        Where no thruster fires, names or counters do not fit the craft, or channels are missing, and where the thrust comes
        out negative.
    """
    check_choice(method, METHODS, "method")
    check_choice(variant, VARIANTS, "variant")
    if method == "joint" and variant != "corrected":
        raise BadInput(
            f"the joint method has no variant {variant!r}",
            remedy="The joint method is always corrected; printed and accelerometer take --variant corrected or printed.",
        )
    records = [telemetry] if isinstance(telemetry, Telemetry) else list(telemetry)
    known = priors or thrust_priors(craft)
    subjects = [subject_of(t, craft) for t in records]
    if method == "joint":
        done = joint(subjects, known)
    else:
        done = (printed_result if method == "printed" else accelerometer_result)(subjects, variant, known)
    _check_thrust(done)
    dated = [t for t in records if t.dated]
    predicted = craft.thrust_at(dated[0].epoch_ns) if dated and craft.thrust_history else None
    found = prediction_doubts(records, craft, done.mean_thrust_N, done.mean_thrust_sigma_N)
    return replace(done, predicted_thrust_N=predicted, doubts=done.doubts + Doubts(found))


def _check_thrust(done: ThrustResult) -> None:
    """Raises BadInput for a thrust that cannot be: negative beyond its sigma, or no number."""
    mean, sigma = done.mean_thrust_N, done.mean_thrust_sigma_N or 0.0
    if np.isfinite(mean) and np.isfinite(sigma) and mean > -2 * sigma:
        return
    came = (
        f"comes out negative ({mean:.3g} N)" if np.isfinite(mean) and mean < 0 else "is not determined by this record"
    )
    raise BadInput(
        f"the mean thrust {came}: momentum and firings contradict each other",
        remedy="Check the sense of the wheels' rates and axes, the thrusters' directions, and names and units of the on-times.",
    )
