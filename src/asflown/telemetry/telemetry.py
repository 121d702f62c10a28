"""Telemetry: channels with validity, an epoch, and the findings of the screening.

Nothing is resampled.  A channel holds the instants at which it was sampled, in TAI, each with a flag
whether it may be used; exclusions give the reason why not.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..kit.doubts import Doubts
from ..kit.errors import BadInput, some_of
from ..kit.timeline import NS, cadence_ns, seconds_since, segments, tai_to_datetime64, utc_label, utc_to_tai_ns
from .channels import AXES, ChannelKind, kind_of, member_of
from .findings import Finding, found_in

if TYPE_CHECKING:
    from ..kit.result import Input

#: Runs of at most this many missing samples are bridged; longer ones are gaps.
BRIDGED = 5

LONGEST_S = 4_000_000_000  # seconds from any epoch that int64 nanoseconds hold with a margin


@dataclass(frozen=True)
class Exclusion:
    """A span of one channel ('*': all) that must not be used, and the reason."""

    channel: str
    start_ns: int
    stop_ns: int
    reason: str


@dataclass(frozen=True)
class Channel:
    """One channel, in SI, at its own sample times.

    Attributes
    ----------
    name : str
        As in docs/telemetry.md: 'wheel_rate_RWA1'.
    tai_ns : ndarray of int64, shape (N,)
        Sample times, ns TAI, increasing.
    values : ndarray of float64 or str, shape (N,)
        In the SI unit of the channel's kind; words for a state channel.
    valid : ndarray of bool, shape (N,)
        Which samples may be used.
    """

    name: str
    tai_ns: np.ndarray
    values: np.ndarray  # float64, or str for a state channel
    valid: np.ndarray
    unit_given: str = ""
    count_size: float = 0.0  # SI size of one count, where the dictionary gives it
    modulus: float = 0.0  # SI; values wrap at it and are still to be unwrapped (0: they do not)

    @property
    def kind(self) -> ChannelKind:
        """Its family: unit, meaning, behaviour."""
        return kind_of(self.name)

    @property
    def member(self) -> str:
        """The part of the name after the family's: axis, wheel, thruster or mechanism."""
        return member_of(self.name)

    @property
    def cadence_ns(self) -> int:
        """Median step of its samples. [ns]"""
        return cadence_ns(self.tai_ns)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Smallest and largest value, of all samples."""
        return float(np.min(self.values)), float(np.max(self.values))

    @property
    def usable(self) -> Channel:
        """The channel with its usable samples only."""
        return self if self.valid.all() else self.where(self.valid)

    def where(self, mask) -> Channel:
        """The channel with the samples of ``mask``, (N,) bool or indices."""
        return replace(self, tai_ns=self.tai_ns[mask], values=self.values[mask], valid=self.valid[mask])

    def segments(self) -> list[slice]:
        """Stretches of samples without a gap, as slices; call on ``usable``."""
        return segments(self.tai_ns, BRIDGED, self.cadence_ns)


def common_instants(parts: list[Channel]) -> np.ndarray:
    """Instants at which all the channels were sampled. [ns TAI]"""
    instants = parts[0].tai_ns
    for p in parts[1:]:
        if p.tai_ns is not instants and not np.array_equal(p.tai_ns, instants):
            instants = np.intersect1d(instants, p.tai_ns, assume_unique=True)
    return instants


@dataclass(frozen=True)
class Telemetry:
    """Screened telemetry of one file or flight, as ``load_telemetry`` returns it.

    Attributes
    ----------
    channels : dict of str to Channel
        By name.
    epoch_ns : int
        ns TAI; times of results count from it.
    dated : bool
        False where the file gives no epoch: times then count from zero.
    findings : tuple of Finding
        What the screening found, channel by channel.
    doubts : Doubts
        About units and the direction of the quaternion.
    exclusions : tuple of Exclusion
        Spans excluded by the user.
    inputs : tuple of Input
        The files it was read from, with SHA-256.
    """

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
        """The channel of that name.

        Parameters
        ----------
        name : str
            As in docs/telemetry.md.

        Returns
        -------
        Channel

        Raises
        ------
        BadInput
            Where the telemetry has no such channel.
        """
        if name not in self.channels:
            raise BadInput(
                "this channel is required but is not in the telemetry",
                file=self.source or None,
                channel=name,
                remedy=f"The telemetry contains: {some_of(self.channels)}.",
            )
        if self.used is not None:
            self.used.add(name)
        return self.channels[name]

    def watched(self) -> Telemetry:
        """A copy that records in ``used`` the channels requested from it."""
        return replace(self, used=set())

    def found_in(self, channels) -> Doubts:
        """Findings about some channels, as doubts."""
        return found_in(self.findings, channels)

    def members(self, stem: str) -> list[str]:
        """Wheels, thrusters or mechanisms that have a channel of family ``stem``: members('wheel_rate') -> ['RWA1', …]."""
        return [c.member for c in self.channels.values() if c.kind.stem == stem]

    def has_axes(self, stem: str) -> bool:
        """Whether all three axes of a family are there."""
        return all(f"{stem}_{a}" in self.channels for a in AXES)

    @property
    def date_ns(self) -> int | None:
        """The epoch (ns TAI), or None where the file gives no date; the craft's latest known state is then used."""
        return self.epoch_ns if self.dated else None

    @property
    def epoch_label(self) -> str:
        """The epoch as UTC, or 'not given'."""
        return f"{utc_label(self.epoch_ns)} UTC" if self.dated else "not given"

    def seconds(self, tai_ns) -> np.ndarray:
        """Seconds from the epoch, of times in ns TAI."""
        return seconds_since(tai_ns, self.epoch_ns)

    def moment(self, text: str | float) -> int:
        """A time as ns TAI.

        Parameters
        ----------
        text : str or float
            Seconds from the epoch (120, '120'), or UTC ('2015-09-29T00:00:00').

        Returns
        -------
        int

        Raises
        ------
        BadInput
            For text that is not a time, and for UTC where the telemetry has no epoch.
        """
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
        """A time for a message: seconds from the epoch, and UTC where there is one."""
        s = f"{float(self.seconds(tai_ns)):g} s"
        return f"{s} ({utc_label(tai_ns)} UTC)" if self.dated else s

    def span(self) -> tuple[int, int]:
        """Times of the first and last sample of any channel. [ns TAI]"""
        starts = [c.tai_ns[0] for c in self.channels.values() if len(c.tai_ns)]
        stops = [c.tai_ns[-1] for c in self.channels.values() if len(c.tai_ns)]
        return int(min(starts)), int(max(stops))

    def between(self, start=None, stop=None) -> Telemetry:
        """The telemetry of a window; the epoch stays.

        Parameters
        ----------
        start, stop : str or float, optional
            Seconds from the epoch, or UTC; without one the window is open at that end.

        Returns
        -------
        Telemetry

        Raises
        ------
        BadInput
            For a window without data, or one that ends before it starts.
        """
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

    def to_xarray(self):
        """The channels as a Dataset in SI, each over its own instants.

        Returns
        -------
        xarray.Dataset
            Variables by channel name with ``units`` and ``long_name``, and ``valid_<name>``; coordinates ``time`` (of channels that are
            sampled together: ``time``, ``time_2``, …) in UTC.  NaN nowhere: samples that must not be used have valid = False.
        """
        import xarray

        clocks: list[np.ndarray] = []
        variables: dict[str, tuple] = {}
        coordinates = {}
        for name, c in self.channels.items():
            at = next((k for k, t in enumerate(clocks) if np.array_equal(t, c.tai_ns)), len(clocks))
            if at == len(clocks):
                clocks.append(c.tai_ns)
            dim = "time" if at == 0 else f"time_{at + 1}"
            coordinates[dim] = tai_to_datetime64(c.tai_ns)
            variables[name] = (dim, c.values, {"units": c.kind.unit, "long_name": c.kind.meaning})
            variables[f"valid_{name}"] = (dim, c.valid)
        return xarray.Dataset(
            variables, coordinates, {"source": self.source, "sha256": self.sha256, "epoch": self.epoch_label}
        )

    def to_pandas(self):
        """The channels as a DataFrame in SI: seconds from the epoch as index, a column ``name [unit]`` each, missing where not sampled or not to be used.

        Returns
        -------
        pandas.DataFrame
        """
        import pandas

        columns = {}
        for name, c in self.channels.items():
            used = c.usable
            columns[f"{name} [{c.kind.unit}]"] = pandas.Series(used.values, index=pandas.Index(used.tai_ns))
        frame = pandas.DataFrame(columns)
        frame.index = pandas.Index(self.seconds(frame.index.to_numpy(np.int64)), name="time_s")
        frame.attrs = {"source": self.source, "sha256": self.sha256, "epoch": self.epoch_label}
        return frame

    def plot(self, channels=None):
        """Draw channels over time, a panel for each family; samples that are not used are marked.

        Parameters
        ----------
        channels : collection of str, optional
            Names; all of them unless given.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        BadInput
            For a channel that the telemetry does not have.
        """
        from importlib import import_module

        # plots are above telemetry: the function is imported by name, and only when needed
        return import_module("asflown.plots.telemetry").draw_telemetry(
            self, [self.channel(n).name for n in channels or self.channels]
        )

    def excluding(self, exclusions: list[Exclusion]) -> Telemetry:
        """The telemetry with some spans marked as unusable.

        Parameters
        ----------
        exclusions : list of Exclusion
            Channel ('*' for all), start, stop and reason of each.

        Returns
        -------
        Telemetry

        Raises
        ------
        BadInput
            For a channel that the telemetry does not have.
        """
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
