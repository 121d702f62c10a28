"""What thrusters were ordered to do in a record, and the momentum of the craft at instants where that is known.

On-times come every so often.  Where they do not change, any sample of the momentum will do; where they do, the sample nearest the
counter's is taken, and firings between the two happened at a time that is not known: they count in proportion to time, with
the variance of so many pulses placed at random.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ...kit.errors import BadInput
from ...kit.rotations import turned_by
from ...kit.timeline import NS
from ..subject import Samples, Subject, at_limit, samples_of, subject_of
from .branches import CHANNEL, branch_change, branches_in_use, undescribed
from .counters import Counters, Known, NothingFires, counters_of, step_of
from .missed_pulses import PULSES, gained_idle, pulse_Nms, uncounted

if TYPE_CHECKING:
    from ...craft.model import Craft, Thruster
    from ...telemetry.telemetry import Telemetry

#: Pulses a second times this is what a sample soon after some of them counts as not known. [s]
_TAIL_S = 0.2
#: While something fires, samples further apart than this are enough: the quietest of each such span is taken. [s]
_ENOUGH_S = 8.0
#: Share of the cadence within which a spline between samples smears a pulse.
_SMEARED = 0.25


@dataclass(frozen=True)
class Firings:
    """One record: momentum at N instants, in axes that do not turn and were the body's at the first, and what had been fired.

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
    doubts: tuple[str, ...]

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
        """The same in axes that do not turn, (N, 3)."""
        return self.turned.apply(self.momentum)

    @property
    def total_on_time_s(self) -> np.ndarray:
        """Over the whole record, (j,)."""
        return self.counters.on_time_s[-1]

    @property
    def total_pulses(self) -> np.ndarray:
        return self.counters.pulses[-1]


def firings_of(telemetry: Telemetry, craft: Craft, enough_s: float = _ENOUGH_S) -> Firings:
    """``enough_s``: while something fires, one sample in so long is taken.

    Raises BadInput where no thruster fires, one is not the craft's or has no counter, or the momentum is not known."""
    subject = subject_of(telemetry, craft)
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
    turned = _turned(samples)[chosen]
    tai_ns = samples.tai_ns[chosen]
    broken = np.zeros(len(tai_ns) - 1, bool)
    for k in np.flatnonzero(counters.broken):
        broken |= (tai_ns[:-1] < counters.tai_ns[k + 1]) & (tai_ns[1:] > counters.tai_ns[k])
    limited, of_wheels = at_limit(subject, tai_ns)
    broken |= limited[1:] | limited[:-1]
    if broken.all():
        raise BadInput(
            "no two neighbouring instants have momentum and on-times that are known: "
            + "; ".join([*of_wheels, *doubts]),
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
        doubts=(*subject.doubts, *samples.doubts, *doubts, *of_wheels, *_one_branch(telemetry, thrusters)),
    )


def _instants(s: Samples, counters: Counters, enough_s: float) -> np.ndarray:
    """Which samples to use: all where nothing fires, in every other interval of the counters the one best known."""
    inside = np.flatnonzero((s.tai_ns >= counters.tai_ns[0]) & (s.tai_ns <= counters.tai_ns[-1]))
    if not len(inside):
        return inside
    tai_ns = s.tai_ns[inside]
    known = counters.at(tai_ns)
    unsure = (known.early + _TAIL_S * known.rate).sum(axis=1)
    # every sample belongs to the counters' sample nearest to it, or to a span of several
    at = (counters.tai_ns - counters.tai_ns[0]) / NS
    nearest = np.searchsorted(0.5 * (at[1:] + at[:-1]), (tai_ns - counters.tai_ns[0]) / NS)
    nearest = np.floor(at / enough_s)[nearest]
    order = np.lexsort((unsure, nearest))
    best = order[np.unique(nearest[order], return_index=True)[1]]
    keep = unsure == 0
    keep[best] = True
    return inside[keep]


def _smeared(known: Known, cadence_s: float) -> Known:
    """With the pulses that a spline over so long a cadence moves to either side."""
    return known._replace(early=known.early + _SMEARED * cadence_s * known.rate)


def _turned(s: Samples) -> Rotation:
    """From the body's axes to ones that do not turn."""
    if s.attitude is not None:
        return s.attitude
    return Rotation.identity(len(s.tai_ns)) if s.rates is None else turned_by(s.seconds, s.rates)


def _idle(subject: Subject, why: NothingFires) -> BadInput:
    """No on-time rises: whether the momentum says otherwise."""
    samples = samples_of(subject)
    if samples.rates is None:
        return why
    craft, turned = subject.craft.craft, _turned(samples)
    step_s = craft.wheel_controller.period if craft.wheel_controller else 0.125
    gained = gained_idle(turned.apply(samples.momentum), turned.apply(samples.body))
    pulses = gained / pulse_Nms(craft, craft.thrusters, step_s, subject.telemetry.date_ns)
    return uncounted(gained, pulses, "in this record", subject.telemetry.source) if pulses > PULSES else why


def _one_branch(tlm: Telemetry, thrusters) -> list[str]:
    """Doubts about the branch in use; raises BadInput where it changes."""
    if (change := branch_change(tlm)) is not None:
        raise BadInput(
            f"the thrusters' branch changes in this record ({change}), and each branch has a thrust of its own",
            file=tlm.source or None,
            channel=CHANNEL,
            remedy="Give one record a branch: cut it with --start and --stop.",
        )
    other = undescribed(tlm, thrusters)
    if other is None:
        return []
    return [f"{other}: its places and directions are taken, and the thrust is that of branch {branches_in_use(tlm)[0]}"]
