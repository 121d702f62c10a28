"""What channels that see the same motion say of each other's sign, size, axes and time stamps: doubts of every result that uses them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubts, Kind, Severity
from .balance import FIRMLY, STANDS, law_balance, momentum_balance
from .loop import rates_too_large, rates_unit
from .motion import ERROR, GYRO, HALF_WIDTHS_S, NAMES, QUATERNION, motion_of
from .rates import apart, compared, exchanged, frozen, noisy_axis, unlike
from .units import of_factor

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...kit.doubts import Doubt
    from ..subject import Subject
    from .balance import Balance, Reading
    from .motion import Motion

WHEELS = Kind(
    "redundancy.wheels", Severity.SUSPECT,
    "the wheels contradict the {source} by {by}, which would fit {times:.1f} times better (rms) if {what}{or_else}",
    "Check the wheels' axes, senses and spin inertia in the craft file, and signs, units and time stamps of these channels.",
)  # fmt: skip


def redundancy(subject: Subject) -> Doubts:
    """Of the telemetry of one record against itself, before anything is estimated.

    Compared are body rates by gyro, attitude error and quaternion, about each axis; and what the wheels gain, against what the
    controller makes of that motion, or against what the body loses.  Nothing is said where the motion is too small to tell."""
    # thrusters shake the axes that they turn, which is no noise
    doubts = [*(() if subject.firing else noisy_axis(subject)), *frozen(subject)]
    motion = motion_of(subject)
    if motion is None:
        return Doubts(doubts)
    odd, wrong = _sources(subject, motion)
    doubts += odd
    if not subject.firing:
        doubts += _wheels(subject, motion, wrong)
    return Doubts(doubts)


def _sources(subject: Subject, motion: Motion) -> tuple[list[Doubt], set[str]]:
    """Doubts about the sources of motion, and those that are not to be set against the wheels."""
    sources = [s for s in motion.rates if s != ERROR or not _follows(subject, motion)]
    swapped, wrong = exchanged(motion, sources)
    if swapped:
        return swapped, wrong
    late, stamped = apart(motion, sources)
    pairs = compared(motion, sources)
    trusted = {
        s for s in motion.rates if any(p.off and s in (p.first, p.second) for p in pairs) and _fits(subject, motion, s)
    }
    odd, wrong = unlike([p for p in pairs if not stamped & {p.first, p.second}], trusted)
    return [*late, *odd], wrong | stamped


def _follows(subject: Subject, motion: Motion) -> bool:
    """Whether the body follows a command, as in a slew: its attitude error is then little of its motion."""
    balances = (momentum_balance(subject, motion, s) for s in (GYRO, QUATERNION) if s in motion.rates)
    return any(b is not None and b.exchanges for b in balances)


def _fits(subject: Subject, motion: Motion, source: str) -> bool:
    """Whether the wheels confirm a source."""
    for of in (law_balance, momentum_balance):
        balance = of(subject, motion, source)
        if balance is not None and balance.by != "loop" and balance.own.share < STANDS:
            return True
    return False


def _wheels(subject: Subject, motion: Motion, wrong: set[str]) -> list[Doubt]:
    """Doubts about the wheels against sources that nothing contradicts."""
    for source in (GYRO, QUATERNION):
        balance = momentum_balance(subject, motion, source) if source in motion.rates and source not in wrong else None
        if balance is None or not balance.moves:
            continue
        better = balance.better()
        if better is not None:
            return [_doubt(balance, better)]
        if balance.exchanges:
            return []  # the body takes up what its wheels lose, as it should: it follows a command, which the law does not know
    tried: list[Balance] = []
    for width in HALF_WIDTHS_S:
        seen = motion if width == HALF_WIDTHS_S[0] else motion_of(subject, width)
        tried += [] if seen is None else _laws(subject, seen, wrong)
        tried.sort(key=lambda b: b.told)
        if set(seen.rates if seen else ()) <= {GYRO} or (tried and tried[0].own.share < FIRMLY):
            break  # wider smoothing is for sensors of attitude; or the wheels do what the law asks
    for k, balance in enumerate(tried):
        better = balance.better()
        # a size is told where the law holds best: noise that the controller answers to makes it another elsewhere
        if better is not None and (k == 0 or abs(better.factor) == 1.0):
            return [_doubt(balance, better)]
        if k == 0 and balance.by == "law" and balance.own.share < FIRMLY:
            return []
    return [*rates_unit(motion, wrong), *rates_too_large(subject, motion)][:1]


def _laws(subject: Subject, motion: Motion, wrong: set[str]) -> Iterator[Balance]:
    """What the controller makes of each source."""
    for source in (s for s in (ERROR, QUATERNION, GYRO) if s in motion.rates and s not in wrong):
        # the controller knows the error as it is told; biases of the others make their slow part another than it knows
        balance = law_balance(subject, motion, source, np.inf if source == ERROR else None)
        if balance is not None:
            yield balance


def _doubt(balance: Balance, better: Reading) -> Doubt:
    how = {"law": "the controller's law", "loop": "any loop that holds", "momentum": "momentum"}[balance.by]
    times = float(np.sqrt(balance.own.share / max(better.share, 1e-12)))
    or_else = of_factor(better.factor, balance.source, all_wheels=better.what.startswith("all"))
    return WHEELS(source=NAMES[balance.source], by=how, times=times, what=better.what, or_else=or_else)
