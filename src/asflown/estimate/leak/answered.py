"""Whether the controller answered the leak: a steady torque shifts the attitude error until the wheels balance it.

    D KD KP (e_after - e_before) = -torque                               (the law of [wheel_controller], in a hold)

The torque comes from the wheels' momentum, the shift from the attitude error: senses, spin inertia, units and time stamps of the
one are set against the other.  Steady torques and drag cancel in the difference.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.regression import memory
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ..subject import Subject
    from .diagnosis import Diagnosis

#: Time constants of the loop that the error takes to settle, and samples on either side that tell.
_SETTLED, _FEWEST = 10.0, 30
#: Sigmas, and share, by which the answer must miss the torque: gains and inertia are believed to be known better.
_SIGMAS, _MISSED = 4.0, 0.2

ATTITUDE_CONTRADICTS = Kind(
    "leak.attitude-contradicts", Severity.SUSPECT,
    "by the control law the attitude error's shift at the onset answers {ratio:+.2f} ± {ratio_sigma:.2f} times the torque that the wheels "
    "show: {guess}",
    "Check the wheels' senses, spin inertia and units, time stamps, the sign of the attitude error, and [wheel_controller].",
)  # fmt: skip


def answer_doubt(subject: Subject, found: Diagnosis) -> Doubt | None:
    """Of a leak seen in a hold on wheels.  None where the attitude error does not tell, or agrees."""
    law = subject.craft.craft.wheel_controller
    tlm = subject.telemetry
    if law is None or found.torque_Nm is None or found.onset_ci95_s is None or subject.firing or subject.slewing:
        return None
    if any(f"attitude_error_{a}" not in tlm for a in AXES):
        return None
    stiffness = np.diag(law.believed_kgm2(subject.known_inertia())) * law.kp_per_s * law.kd_per_s
    expected = -np.asarray(found.torque_Nm) / stiffness
    first, last = found.onset_ci95_s
    shift, variance = np.zeros(3), np.zeros(3)
    for j, axis in enumerate(AXES):
        c = tlm.channel(f"attitude_error_{axis}").usable
        t = tlm.seconds(c.tai_ns)
        settled = last + min(_SETTLED / law.kp_per_s, 0.5 * (t[-1] - last))
        parts = [c.values[t < first], c.values[t > settled]]
        if min(map(len, parts)) < _FEWEST:
            return None
        before, after = (p.mean() for p in parts)
        shift[j] = after - before
        variance[j] = sum(np.var(p) * memory(p - p.mean()) / len(p) for p in parts)
    weight = 1 / np.maximum(variance, 1e-30)
    precision = float(weight @ expected**2)
    ratio, sigma = float(weight @ (shift * expected) / precision), float(1 / np.sqrt(precision))
    if abs(ratio - 1) < max(_MISSED, _SIGMAS * sigma):
        return None
    return ATTITUDE_CONTRADICTS(ratio=ratio, ratio_sigma=sigma, guess=_guess(ratio, sigma))


def _guess(ratio: float, sigma: float) -> str:
    if abs(ratio + 1) < max(_MISSED, 2 * sigma):
        return "the senses of all wheels, or the sign of the attitude error, are reversed"
    if ratio < max(_MISSED, 2 * sigma):
        return "time stamps, a unit, or some wheels' senses are wrong, or the controller has an integral that its description lacks"
    return "wheel rates, their spin inertia, the attitude error or time are in another unit, or off by that factor"
