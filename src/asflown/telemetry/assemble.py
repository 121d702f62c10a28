"""Columns of tables become channels; used for self-describing files and for channel dictionaries."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.timeline import utc_to_tai_ns
from .channels import kind_of, split_header, to_si
from .findings import Finding
from .tables import Table, numbers_of, times_of, whole_second, words_of
from .telemetry import Channel
from .times import Scale, joined_ns, scale_called, spread

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .text import TextFile


@dataclass
class Read:
    """Channels read from the tables, before screening."""

    channels: dict[str, Channel]
    epoch_ns: int
    dated: bool
    time_labels: dict[str, np.ndarray]
    label_tai_ns: np.ndarray
    findings: list[Finding]
    row_times_ns: list[np.ndarray] = field(default_factory=list)  # of each table
    readings: dict[str, tuple[np.ndarray, np.ndarray]] | None = None  # the quaternion under other conventions


@dataclass(frozen=True)
class Use:
    """How one column becomes a channel: value = (cell x scale + offset) [unit]."""

    column: int
    name: str
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    count_size: float = 0.0  # SI
    modulus: float = 0.0  # SI; 0 where values do not wrap
    fills: tuple[float, ...] = ()  # cells that mean 'no value'
    valid: tuple[float, float] | None = None  # SI; values outside are not measurements


@dataclass(frozen=True)
class Clock:
    """How the times of a table are written.

    columns: one; several are added (``units``: of each) or joined with a blank; none where rows come at ``rate_Hz``.
    factor: what numbers are multiplied by.  cadence_ns: of the samples, where stamps are coarser (0: as stamped)."""

    columns: tuple[int, ...]
    scale: Scale
    units: tuple[str, ...] = ()
    factor: Decimal = Decimal(1)
    cadence_ns: int = 0
    rate_Hz: float = 0.0

    def tai_ns(self, table: Table, origin_ns: int) -> np.ndarray:
        """The instant of each row, ns TAI; ``origin_ns`` is the zero of elapsed times."""
        if self.rate_Hz:
            return origin_ns + np.rint(np.arange(len(table)) * (1e9 / self.rate_Hz)).astype(np.int64)
        if len(self.columns) == 1 and self.factor == 1:
            ns = times_of(table, self.columns[0], self.scale, origin_ns)
        else:
            ns = joined_ns(table, self.columns, self.units, self.factor, self.scale, origin_ns)
        return spread(ns, self.cadence_ns) if self.cadence_ns else ns


@dataclass(frozen=True)
class Part:
    """One table, and what is made of its columns."""

    table: Table | TextFile
    clock: Clock
    uses: list[Use]
    clocks: list[int]  # further time columns, kept as written

    def parsed(self, extra: Sequence[int] = ()) -> Part:
        """With the columns read that are used; ``extra``: further columns of numbers."""
        state = [u for u in self.uses if kind_of(u.name).behaves == "state"]
        numbers = dict.fromkeys([*(u.column for u in self.uses if u not in state), *extra])
        words = dict.fromkeys([*(u.column for u in state), *self.clocks])
        return replace(self, table=self.table.parsed(self.clock.columns, self.clock.scale, numbers, words))


def channel_from(table: Table, use: Use, tai_ns: np.ndarray, findings: list[Finding]) -> Channel:
    """A column as a channel in SI, in file order.  Raises BadInput for a bad cell or no sample at all."""
    factor, shift = to_si(use.name, use.unit)
    if kind_of(use.name).behaves == "state":
        rows, values = words_of(table, use.column)
    else:
        rows, values, said_nan = numbers_of(table, use.column, use.name)
        declared = table.blanked.get(use.column, np.empty(0, np.int64))
        if use.fills:
            fill = np.isin(values, use.fills)
            declared, rows, values = np.union1d(declared, rows[fill]), rows[~fill], values[~fill]
        if len(values) and max(float(np.max(values)), -float(np.min(values))) > _LARGEST:
            row = int(rows[np.argmax(np.abs(values))])
            raise BadInput(
                "the value is too large for a measurement",
                line=table.line(row),
                channel=use.name,
                remedy="Correct it, or declare it as a fill value.",
            )
        if use.scale != 1 or use.offset != 0:
            values = values * use.scale + use.offset
        if factor != 1 or shift != 0:
            values = values * factor + shift
        if use.valid is not None:
            out = (values < use.valid[0]) | (values > use.valid[1])
            declared, rows, values = np.union1d(declared, rows[out]), rows[~out], values[~out]
        if len(declared):
            detail = "values that are declared as fill or lie outside the declared range; not used"
            findings.append(Finding(use.name, "declared", len(declared), int(tai_ns[declared[0]]), detail))
        if len(said_nan):
            findings.append(
                Finding(use.name, "nan", len(said_nan), int(tai_ns[said_nan[0]]), "cells contain 'nan' and count as blank")
            )  # fmt: skip
    if len(rows) == 0:
        raise BadInput("the column has no values", channel=use.name, remedy="Remove the column, or add its data.")
    at = tai_ns if len(rows) == len(tai_ns) else tai_ns[rows]
    return Channel(use.name, at, values, np.ones(len(rows), bool), use.unit, use.count_size, modulus=use.modulus)


def time_scale(table: Table | TextFile) -> Scale:
    """The scale of the first column of a table that describes itself.  Raises BadInput where it is not a time."""
    first = split_header(table.headings[0]) or (table.headings[0].strip(), None)
    if first[0].lower() != "time" or first[1] is None:
        raise BadInput(
            f"there is no time column: the first heading is {table.headings[0][:60]!r}",
            remedy="The first column is 'time [s]', 'time [utc]', 'time [gps s]' or 'time [et s]'; "
            "for any other table give a channel dictionary (--channels).",
        )
    scale = scale_called(first[1])
    if scale is None:
        raise BadInput(
            f"the time scale [{first[1]}] is not known",
            remedy="Write 'time [s]' (also ms, us, min, h, d), 'time [utc]', 'time [gps s]', 'time [et s]', 'time [unix s]', "
            "'time [mjd]' or 'time [jd]'.",
        )
    return scale


def assembled(parts: Sequence[Part], epoch: str | None, *, alone: bool = True) -> Read:
    """Channels of all tables on one TAI axis, from parts whose columns have been read.

    ``epoch`` (UTC) is the zero of elapsed times, or else what the tables say of themselves (the earliest).
    ``alone``: the parts must hold a channel."""
    said = [ns for part in parts if (ns := origin_of(part.table.epoch)) is not None]
    origin = origin_of(epoch) if epoch is not None else min(said, default=None)
    dated = origin is not None or any(part.clock.scale.dated for part in parts)
    channels: dict[str, Channel] = {}
    labels: dict[str, np.ndarray] = {}
    label_ns, times = np.empty(0, np.int64), []
    findings: list[Finding] = []
    for part in parts:
        table = part.table.whole()
        zero = origin_of(table.epoch) if epoch is None and table.epoch is not None else origin
        tai_ns = part.clock.tai_ns(table, zero or 0)
        times.append(tai_ns)
        for use in part.uses:
            if use.name in channels:
                raise BadInput(
                    "two columns contain this channel", channel=use.name, remedy="Keep one of them, or rename one."
                )
            channels[use.name] = channel_from(table, use, tai_ns, findings)
        if part.clocks and not labels:
            label_ns = tai_ns
            labels = {table.headings[j]: np.array([str(c) for c in table.columns[j]], dtype=str) for j in part.clocks}
        findings += [Finding("", "form", 1, int(tai_ns[0]), note) for note in table.notes]
    if len(rows := np.concatenate(times)) > 1 and (rows == rows[0]).all():
        raise BadInput(
            f"all {len(rows)} rows have the same time",
            remedy="Check that the first column is the time, and that it was written with enough digits.",
        )
    if not channels and alone:
        raise BadInput("the table has no channel other than time", remedy="Add columns such as 'body_rate_x [rad/s]'.")
    epoch_ns = origin if origin is not None else (whole_second(times[0][0]) if dated else 0)
    return Read(channels, epoch_ns, dated, labels, label_ns, findings, times)


def origin_of(epoch: str | None) -> int | None:
    if epoch is None:
        return None
    try:
        return int(utc_to_tai_ns(epoch))
    except BadInput:
        raise BadInput(
            f"the epoch {epoch[:60]!r} is not a time", remedy="Write '# epoch: 2015-09-29T00:00:00 UTC'."
        ) from None


_LARGEST = 1e60  # larger values overflow when squared or converted; no measurement reaches them
