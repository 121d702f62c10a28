"""Commanded firings of a record, and the momentum of the craft at instants where they are known.

On-times are sampled less often than momentum.  Where they do not change, every sample of the momentum is used.  Where they do,
the sample nearest to the counter's is used; the time of firings between the two is not known, so they are interpolated
linearly, with the variance of as many pulses placed at random.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.timeline import NS
from ..subject import Samples, at_limit, samples_of
from .branches import CHANNEL, branch_change, branches_in_use, undescribed
from .counters import Counters, Known, NothingFires, control_step_s, counters_of, step_of
from .missed_pulses import PULSES, gained_idle, pulse_Nms, uncounted

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from ...craft.model import Thruster
    from ...telemetry.telemetry import Telemetry
    from ..subject import Subject

#: Pulses a second times this is added to the variance of a sample, for what they still have to give. [s]
_TAIL_S = 0.2
#: While thrusters fire, one sample is used in so long: the one at which the firings are known best. [s]
_ENOUGH_S = 8.0
#: Share of the cadence within which a spline between samples smears a pulse.
_SMEARED = 0.25


BRANCH_NOT_DESCRIBED = Kind(
    "firing.branch-not-described", Severity.CAUTION,
    "{why}: the places and directions described are used, and the thrust is that of branch {branch}",
    "Describe the branch in use in the craft file.",
)  # fmt: skip


@dataclass(frozen=True)
class Firings:
    """One record: momentum at N instants, in inertial axes that were the body's at the first, and what had been fired.

    ``each`` (N, n, 3) and ``body`` (N, 3): momentum of wheels and of body, body axes."""

    subject: Subject
    thrusters: tuple[Thruster, ...]
    step_s: float  # control step: pulses are multiples of it
    tai_ns: np.ndarray
    turned: Rotation
    each: np.ndarray
    body: np.ndarray
    rates: np.ndarray | None
    by_quaternion: bool
    known: Known
    broken: np.ndarray  # (N - 1,) bool: what was fired, or what was gained, is not known
    at_limit: np.ndarray  # (N,) bool: a wheel may be at its rate limit
    counters: Counters
    doubts: Doubts

    @property
    def telemetry(self) -> Telemetry:
        return self.subject.telemetry

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(t.name for t in self.thrusters)

    @property
    def seconds(self) -> np.ndarray:
        """From the first instant."""
        return (self.tai_ns - self.tai_ns[0]) / NS

    @property
    def momentum(self) -> np.ndarray:
        """Of wheels and body, body axes, (N, 3). [N m s]"""
        return self.each.sum(axis=1) + self.body

    @property
    def in_space(self) -> np.ndarray:
        """The same in inertial axes, (N, 3)."""
        return self.turned.apply(self.momentum)

    @property
    def total_on_time_s(self) -> np.ndarray:
        """Over the whole record, (j,)."""
        return self.counters.on_time_s[-1]

    @property
    def total_pulses(self) -> np.ndarray:
        return self.counters.pulses[-1]


def firings_of(subject: Subject, enough_s: float = _ENOUGH_S) -> Firings:
    """``enough_s``: while thrusters fire, one sample in so long is used. [s]

    Raises BadInput where no thruster fires, one is not the craft's or has no counter, or the momentum is not known."""
    telemetry, craft = subject.telemetry, subject.craft.craft
    if subject.relative:
        raise BadInput(
            f"the spin inertia of {craft.name}'s wheels is not known, so a thrust in newtons is not either",
            remedy="Give spin_inertia in the craft file.",
        )
    subject.known_inertia()
    try:
        thrusters, counters, doubts = counters_of(subject)
    except NothingFires as why:
        raise _idle(subject, why) from None
    samples = samples_of(subject)
    chosen = _instants(samples, counters, enough_s)
    if len(chosen) < 3:
        raise BadInput(
            f"{len(chosen)} instants at which momentum and on-times are both known are too few",
            file=telemetry.source or None,
            remedy="The record must reach over at least three samples of the on-times; take a longer one.",
        )
    turned = samples.turned[chosen]
    tai_ns = samples.tai_ns[chosen]
    broken = np.zeros(len(tai_ns) - 1, bool)
    for k in np.flatnonzero(counters.broken):
        broken |= (tai_ns[:-1] < counters.tai_ns[k + 1]) & (tai_ns[1:] > counters.tai_ns[k])
    limited, of_wheels = at_limit(subject, tai_ns)
    broken |= limited[1:] | limited[:-1]
    if broken.all():
        raise BadInput(
            "no two neighbouring instants have momentum and on-times that are known: "
            + "; ".join(map(str, [*of_wheels, *doubts])),
            file=telemetry.source or None,
            remedy="Take a record, or a span of it, in which counters and wheels stay within their ranges.",
        )
    return Firings(
        subject=subject,
        thrusters=thrusters,
        step_s=step_of(craft, counters.on_time_s),
        tai_ns=tai_ns,
        turned=turned[0].inv() * turned,
        each=samples.each[chosen],
        body=samples.body[chosen],
        rates=None if samples.rates is None else samples.rates[chosen],
        by_quaternion=samples.attitude is not None,
        known=_smeared(counters.at(tai_ns), samples.splined_s),
        broken=broken,
        at_limit=limited,
        counters=counters,
        doubts=Doubts([*subject.doubts, *samples.doubts, *doubts, *of_wheels, _one_branch(telemetry, thrusters)]),
    )


def _instants(s: Samples, counters: Counters, enough_s: float) -> np.ndarray:
    """Samples to use: all where nothing fires, and elsewhere the best known one of each interval of the counters."""
    inside = np.flatnonzero((s.tai_ns >= counters.tai_ns[0]) & (s.tai_ns <= counters.tai_ns[-1]))
    if not len(inside):
        return inside
    tai_ns = s.tai_ns[inside]
    known = counters.at(tai_ns)
    unsure = (known.early + _TAIL_S * known.rate).sum(axis=1)
    # each sample belongs to the counters' sample nearest to it, and those to spans of ``enough_s``
    at = (counters.tai_ns - counters.tai_ns[0]) / NS
    nearest = np.searchsorted(0.5 * (at[1:] + at[:-1]), (tai_ns - counters.tai_ns[0]) / NS)
    nearest = np.floor(at / enough_s)[nearest]
    order = np.lexsort((unsure, nearest))
    best = order[np.unique(nearest[order], return_index=True)[1]]
    keep = unsure == 0
    keep[best] = True
    return inside[keep]


def _smeared(known: Known, cadence_s: float) -> Known:
    """With the variance of pulses that a spline over this cadence moves to an earlier or a later sample."""
    return known._replace(early=known.early + _SMEARED * cadence_s * known.rate)


def _idle(subject: Subject, why: NothingFires) -> BadInput:
    """The error to raise where no on-time rises: that of thrusters that fire uncounted, if the momentum shows it."""
    samples = samples_of(subject)
    if samples.rates is None:
        return why
    craft, turned = subject.craft.craft, samples.turned
    gained = gained_idle(turned.apply(samples.momentum), turned.apply(samples.body))
    pulses = gained / pulse_Nms(craft, craft.thrusters, control_step_s(craft), subject.telemetry.date_ns)
    return uncounted(gained, pulses, "in this record", subject.telemetry.source) if pulses > PULSES else why


def _one_branch(tlm: Telemetry, thrusters) -> Doubt | None:
    """A doubt about the branch in use; raises BadInput where it changes."""
    if (change := branch_change(tlm)) is not None:
        raise BadInput(
            f"the thrusters' branch changes in this record ({change}), and each branch has a thrust of its own",
            file=tlm.source or None,
            channel=CHANNEL,
            remedy="Give one record a branch: cut it with --start and --stop.",
        )
    other = undescribed(tlm, thrusters)
    return None if other is None else BRANCH_NOT_DESCRIBED(why=other, branch=branches_in_use(tlm)[0])
