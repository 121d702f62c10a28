"""Telemetry inside the house: channels with validity, an epoch, and what was found wrong.

Nothing here is resampled.  A channel holds only the instants at which it was sampled, in TAI, with
a flag for each that says whether it may be used; exclusions say why it may not.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..kit.doubts import Doubts
from ..kit.errors import BadInput, some_of
from ..kit.timeline import NS, cadence_ns, seconds_since, segments, utc_label, utc_to_tai_ns
from .channels import AXES, ChannelKind, kind_of, member_of
from .findings import Finding, found_in

if TYPE_CHECKING:
    from ..kit.result import Input

#: Runs of at most this many missing samples are bridged; longer ones are gaps.
BRIDGED = 5

LONGEST_S = 4_000_000_000  # seconds from any epoch that int64 nanoseconds hold with room to spare


@dataclass(frozen=True)
class Exclusion:
    """A span of one channel ('*': all) that is not to be used, and why."""

    channel: str
    start_ns: int
    stop_ns: int
    reason: str


@dataclass(frozen=True)
class Channel:
    """One channel, in SI, at its own sample times (int64 ns TAI, increasing)."""

    name: str
    tai_ns: np.ndarray
    values: np.ndarray  # float64, or str for a state channel
    valid: np.ndarray
    unit_given: str = ""
    count_size: float = 0.0  # SI size of one count, where the dictionary tells it
    modulus: float = 0.0  # SI; values wrap at it and are still to be unwrapped (0: they do not)

    @property
    def kind(self) -> ChannelKind:
        return kind_of(self.name)

    @property
    def member(self) -> str:
        return member_of(self.name)

    @property
    def cadence_ns(self) -> int:
        return cadence_ns(self.tai_ns)

    @property
    def usable(self) -> Channel:
        return self if self.valid.all() else self.where(self.valid)

    def where(self, mask) -> Channel:
        return replace(self, tai_ns=self.tai_ns[mask], values=self.values[mask], valid=self.valid[mask])

    def segments(self) -> list[slice]:
        """Stretches of usable samples without a gap; call on ``usable``.  Cadence is that of all samples."""
        return segments(self.tai_ns, BRIDGED, self.cadence_ns)


@dataclass(frozen=True)
class Telemetry:
    """What one file (or flight) says, ready for an estimator."""

    channels: dict[str, Channel]
    epoch_ns: int
    dated: bool = True  # False: the file gives no epoch and times only count seconds
    source: str = ""
    sha256: str = ""
    time_labels: dict[str, np.ndarray] = field(default_factory=dict)  # further time columns, as written
    label_tai_ns: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))  # the instants they belong to
    findings: tuple[Finding, ...] = ()
    exclusions: tuple[Exclusion, ...] = ()
    doubts: Doubts = Doubts()
    inputs: tuple[Input, ...] = ()  # the file itself, its channel dictionary, its exclusions
    used: set[str] | None = field(default=None, compare=False, repr=False)  # channels asked for, of a watched copy

    def __contains__(self, name: str) -> bool:
        return name in self.channels

    def channel(self, name: str) -> Channel:
        if name not in self.channels:
            raise BadInput(
                "this channel is needed and is not in the telemetry",
                file=self.source or None,
                channel=name,
                remedy=f"The telemetry holds: {some_of(self.channels)}.",
            )
        if self.used is not None:
            self.used.add(name)
        return self.channels[name]

    def watched(self) -> Telemetry:
        """The same telemetry, which notes in ``used`` the channels that are asked for."""
        return replace(self, used=set())

    def found_in(self, channels) -> Doubts:
        """What the door found in some channels, as doubts."""
        return found_in(self.findings, channels)

    def members(self, stem: str) -> list[str]:
        """Which wheels, thrusters or mechanisms have a ``stem`` channel."""
        return [c.member for c in self.channels.values() if c.kind.stem == stem]

    def has_axes(self, stem: str) -> bool:
        return all(f"{stem}_{a}" in self.channels for a in AXES)

    @property
    def date_ns(self) -> int | None:
        """The epoch (ns TAI), or None where the file gives no date: the craft's latest known state then holds."""
        return self.epoch_ns if self.dated else None

    @property
    def epoch_label(self) -> str:
        return f"{utc_label(self.epoch_ns)} UTC" if self.dated else "not given"

    def seconds(self, tai_ns) -> np.ndarray:
        """Seconds from the epoch."""
        return seconds_since(tai_ns, self.epoch_ns)

    def moment(self, text: str | float) -> int:
        """'120' (seconds from the epoch) or a UTC stamp -> ns TAI."""
        try:
            seconds = float(text)
        except ValueError:
            seconds = None
        if seconds is not None:
            if not abs(seconds) < LONGEST_S:  # also NaN
                raise BadInput(f"{text!r} is not a time", remedy="Give seconds from the epoch, or UTC.")
            return self.epoch_ns + round(seconds * NS)
        ns = utc_to_tai_ns(str(text))
        if not self.dated:
            raise BadInput(
                f"{text!r} is a date, and the telemetry has no epoch",
                file=self.source or None,
                remedy="Give seconds instead, or put '# epoch: 2015-09-29T00:00:00 UTC' at the head of the file.",
            )
        return ns

    def describe_time(self, tai_ns: int) -> str:
        s = f"{float(self.seconds(tai_ns)):g} s"
        return f"{s} ({utc_label(tai_ns)} UTC)" if self.dated else s

    def span(self) -> tuple[int, int]:
        """First and last sample of any channel."""
        starts = [c.tai_ns[0] for c in self.channels.values() if len(c.tai_ns)]
        stops = [c.tai_ns[-1] for c in self.channels.values() if len(c.tai_ns)]
        return int(min(starts)), int(max(stops))

    def between(self, start=None, stop=None) -> Telemetry:
        """Only the samples from ``start`` to ``stop`` (seconds from the epoch, or UTC).

        The epoch stays.  Raises BadInput for a window without data or one that runs backwards."""
        if start is None and stop is None:
            return self
        first, last = self.span()
        a = self.moment(start) if start is not None else first
        b = self.moment(stop) if stop is not None else last
        both = start is not None and stop is not None
        if b <= a or a > last or b < first:
            if both and b <= a:
                what = f"the window ends ({self.describe_time(b)}) before it starts ({self.describe_time(a)})"
            elif both:
                what = f"no data from {self.describe_time(a)} to {self.describe_time(b)}"
            else:
                what = (
                    f"no data {f'after {self.describe_time(a)}' if stop is None else f'before {self.describe_time(b)}'}"
                )
            raise BadInput(
                what,
                file=self.source or None,
                remedy=f"The telemetry runs from {self.describe_time(first)} to {self.describe_time(last)}.",
            )
        kept = {}
        for name, c in self.channels.items():
            part = c.where((c.tai_ns >= a) & (c.tai_ns <= b))
            if len(part.tai_ns):
                kept[name] = part
        if not kept:
            raise BadInput(
                f"no sample falls between {self.describe_time(a)} and {self.describe_time(b)}",
                file=self.source or None,
                remedy="Widen the window.",
            )
        return replace(self, channels=kept)

    def excluding(self, exclusions: list[Exclusion]) -> Telemetry:
        """The same telemetry with the named spans marked as not to be used.

        Raises BadInput for a channel that is not there (an exclusion that excludes nothing is a slip)."""
        channels, findings = dict(self.channels), list(self.findings)
        for x in exclusions:
            if x.channel != "*" and x.channel not in channels:
                raise BadInput(
                    f"an exclusion names {x.channel!r}, which is not in the telemetry",
                    channel=x.channel,
                    remedy=f"Use '*' for all channels, or one of: {some_of(channels)}.",
                )
            for name in list(channels) if x.channel == "*" else [x.channel]:
                c = channels[name]
                hit = (c.tai_ns >= x.start_ns) & (c.tai_ns <= x.stop_ns) & c.valid
                if hit.any():
                    channels[name] = replace(c, valid=c.valid & ~hit)
                    findings.append(
                        Finding(name, "excluded", int(hit.sum()), int(c.tai_ns[hit][0]), f"excluded: {x.reason}")
                    )
        return replace(
            self,
            channels=channels,
            findings=tuple(findings),
            exclusions=(*self.exclusions, *exclusions),
        )


def file_name(path: str | Path) -> str:
    return Path(path).name
