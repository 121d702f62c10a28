"""What is not sure of a leak monitor's verdict: its noise, the thrust it takes, and what else would look like one thruster."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...craft.model import STALE_NS
from ...kit.doubts import Doubt, Kind, Severity
from ...kit.timeline import utc_label
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
#: Degrees of freedom below which the noise is little known; correlated readings that count as one, above which it is doubted.
_FEW_DEGREES, _CORRELATED = 120, 3.0

_GIVE_THRUST = "Give it with --thrust."
_CHECK_GEOMETRY = (
    "Check the centre of mass (--cm) and the inertia (--inertia), and what else could have turned the craft."
)

NOISE_FROM_FEW = Kind(
    "leak.noise-from-few", Severity.CAUTION,
    "the noise is learned from few readings (effective sample size {effective:.0f}): the alarm needs a larger leak",
    "Take a longer record.",
)  # fmt: skip
NOISE_CORRELATED = Kind(
    "leak.noise-correlated", Severity.CAUTION,
    "readings in the holds from which the noise is learned are correlated ({correlated:.0f} count as one): if the craft was "
    "disturbed then, the noise is overstated and small leaks are missed",
    "Start the record in a quiet hold (--start).",
)  # fmt: skip
NOISE_FROM_ALL = Kind(
    "leak.noise-from-all", Severity.CAUTION,
    "the noise is learned from the whole record: a leak that lasts through all of it would count as steady external torque",
    "Take a longer record.",
)  # fmt: skip
THRUST_NOMINAL = Kind("leak.thrust-nominal", Severity.NOTE, "the thrust is the nominal one", _GIVE_THRUST)
THRUST_UNDATED = Kind(
    "leak.thrust-undated", Severity.CAUTION, "the record has no date: the thrust is that of {date}, the latest known", _GIVE_THRUST
)  # fmt: skip
THRUST_CARRIED_OVER = Kind(
    "leak.thrust-carried-over", Severity.CAUTION, "the thrust is carried over from {date}, the nearest date known", _GIVE_THRUST
)  # fmt: skip
SHORT_RECORD = Kind(
    "leak.short-record", Severity.NOTE,
    "up to its end or its alarm the record is shorter than {window_s:g} s: the smallest leak found by then is not given",
    "Take a shorter --window, or a longer record.",
)  # fmt: skip
BRANCH_CHANGES = Kind(
    "leak.branch-changes", Severity.SUSPECT,
    "the thrusters' branch changes {change}: where the on-times are those of one branch only, all that the other fires counts as "
    "uncommanded momentum",
    "Narrow the span to one branch (--start, --stop).",
)  # fmt: skip
OTHER_BRANCH = Kind(
    "leak.other-branch", Severity.CAUTION,
    "{branches}: a weak thruster is one of the branch in use, a leaking one may be of either",
    "Describe the branch in use in the craft file.",
)  # fmt: skip
PAPERS_MONITOR = Kind(
    "leak.papers-monitor", Severity.CAUTION,
    "the papers' monitor gives no probability, and takes all uncommanded momentum for a leak",
    "Use --method likelihood.",
)  # fmt: skip
NO_SINGLE_THRUSTER = Kind(
    "leak.no-single-thruster", Severity.SUSPECT,
    "no single thruster makes a torque in this direction (log likelihood ratio {ratio:.1f})", _CHECK_GEOMETRY,
)  # fmt: skip
SEVERAL_THRUSTERS = Kind(
    "leak.several-thrusters", Severity.SUSPECT,
    "no single thruster makes a torque in this direction (log likelihood ratio {ratio:.1f}); {thrusters} together would",
    _CHECK_GEOMETRY,
)  # fmt: skip
UNCOUNTED_PULSES = Kind(
    "leak.uncounted-pulses", Severity.SUSPECT,
    "no single thruster makes a torque in this direction (log likelihood ratio {ratio:.1f}); {thrusters} together would: if they "
    "fire, their pulses (about {pulses:.0f}) are not counted, as those of the other branch when its on-times are not in the file",
    f"Give the on-times of the branch that fires. {_CHECK_GEOMETRY}",
)  # fmt: skip
LOSS_TOO_LARGE = Kind(
    "leak.loss-too-large", Severity.SUSPECT,
    "a loss of {loss_percent:.0f} % is more than a thruster has to lose: momentum is missing from the readings (a wheel that "
    "saturates), or on-times are under wrong names",
    "Check the wheels' rate limits and the names of the on-time channels.",
)  # fmt: skip
SMALL_TORQUE = Kind(
    "leak.small-torque", Severity.CAUTION,
    "an external torque (sunlight, thin atmosphere) that has changed can mimic a leak this small", "Give its size with --torque-sigma.",
)  # fmt: skip
THRUSTER_OPEN = Kind(
    "leak.thruster-open", Severity.CAUTION,
    "which thruster it is remains open: {thruster} {posterior:.2f}, {second} {posterior_of_second:.2f}",
    "Take a longer record after the alarm.",
)  # fmt: skip
FROM_THE_START = Kind(
    "leak.from-the-start", Severity.CAUTION,
    "the change is there from the record's start: only its size distinguishes it from the steady external torque",
    "Start the record earlier.",
)  # fmt: skip


def noise_doubts(noise: Noise, steps: Steps) -> list[Doubt]:
    doubts = []
    if noise.degrees < _FEW_DEGREES:
        doubts.append(NOISE_FROM_FEW(effective=noise.degrees / AXES_IN_A_LEAK))
    if noise.alike.max() > _CORRELATED:
        doubts.append(NOISE_CORRELATED(correlated=float(noise.alike.max())))
    if not len(steps.tai_ns[noise.until :]):
        doubts.append(NOISE_FROM_ALL())
    return doubts


def thrust_doubt(epoch_ns: int | None, craft: Craft) -> Doubt | None:
    """Of a thrust that the user does not give, on a date; None: in a record without one."""
    if not craft.thrust_history:
        return THRUST_NOMINAL()
    if epoch_ns is None:
        return THRUST_UNDATED(date=utc_label(max(h.date for h in craft.thrust_history))[:10])
    nearest = min((h.date for h in craft.thrust_history), key=lambda d: abs(epoch_ns - d))
    return THRUST_CARRIED_OVER(date=utc_label(nearest)[:10]) if abs(epoch_ns - nearest) > STALE_NS else None


def mixture(better: float, torque_Nm, precision, geometry: Geometry) -> list[str]:
    """Thrusters that would make a torque (3,) [N m] between them, where it is so much ``better`` (log likelihood ratio) with a
    direction of its own than by the best of them alone; none where one will do.  ``precision`` (3, 3): of the torque."""
    if better <= MISFIT:
        return []
    root = np.linalg.cholesky(precision).T
    thrust, _ = scipy.optimize.nnls(root @ geometry.columns, root @ torque_Nm)
    return [n for n, f in zip(geometry.names, thrust, strict=True) if f > _PART * thrust.max()]


def direction_doubt(better: float, mixed: list[str], pulses: float) -> Doubt | None:
    """Where no one thruster makes the torque.  ``pulses``: how many its momentum amounts to."""
    if better <= MISFIT:
        return None
    if len(mixed) < 2:
        return NO_SINGLE_THRUSTER(ratio=better)
    if pulses > PULSES:
        return UNCOUNTED_PULSES(ratio=better, thrusters=mixed, pulses=pulses)
    return SEVERAL_THRUSTERS(ratio=better, thrusters=mixed)


def branch_doubt(telemetry: Telemetry, craft: Craft) -> Doubt | None:
    if (change := branch_change(telemetry)) is not None:
        return BRANCH_CHANGES(change=change)
    if (other := undescribed(telemetry, craft.thrusters)) is not None:
        return OTHER_BRANCH(branches=other)
    return None


def loss_doubt(loss: float, sigma: float) -> Doubt | None:
    """A pulse cannot give less than nothing."""
    return LOSS_TOO_LARGE(loss_percent=100 * loss) if loss - 2 * sigma > 1 else None
