"""Columns of tables become channels; used for self-describing files and for channel dictionaries."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.timeline import utc_to_tai_ns
from .channels import kind_of, split_header, to_si
from .findings import Finding
from .tables import Table, numbers_of, times_of, whole_second, words_of
from .telemetry import Channel

if TYPE_CHECKING:
    from collections.abc import Sequence


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


def channel_from(table: Table, use: Use, tai_ns: np.ndarray, findings: list[Finding]) -> Channel:
    """A column as a channel in SI, in file order.  Raises BadInput for a bad cell or no sample at all."""
    factor, shift = to_si(use.name, use.unit)
    if kind_of(use.name).behaves == "state":
        rows, values = words_of(table, use.column)
    else:
        rows, values, said_nan = numbers_of(table, use.column, use.name)
        if len(values) and np.max(np.abs(values)) > _LARGEST:
            row = int(rows[np.argmax(np.abs(values))])
            raise BadInput(
                "the value is too large for a measurement", line=table.line(row), channel=use.name, remedy="Correct it."
            )
        if use.scale != 1 or use.offset != 0:
            values = values * use.scale + use.offset
        if factor != 1 or shift != 0:
            values = values * factor + shift
        if len(said_nan):
            findings.append(
                Finding(use.name, "nan", len(said_nan), int(tai_ns[said_nan[0]]), "cells contain 'nan' and count as blank")
            )  # fmt: skip
    if len(rows) == 0:
        raise BadInput("the column has no values", channel=use.name, remedy="Remove the column, or add its data.")
    return Channel(
        use.name, tai_ns[rows], values, np.ones(len(rows), bool), use.unit, use.count_size, modulus=use.modulus
    )


def time_scale(table: Table) -> str:
    first = split_header(table.headings[0])
    if first is None or first[0].lower() != "time":
        raise BadInput(
            f"there is no time column: the first heading is {table.headings[0][:60]!r}",
            remedy="The first column is 'time [s]', 'time [utc]', 'time [gps s]' or 'time [et s]'; "
            "for any other table give a channel dictionary (--channels).",
        )
    scale = " ".join(first[1].lower().split())
    if scale not in ("s", *_TIME_UNITS):
        raise BadInput(
            f"the time scale [{first[1]}] is not known",
            remedy="Write 'time [s]', 'time [utc]', 'time [gps s]' or 'time [et s]'.",
        )
    return scale


def assembled(parts: Sequence[tuple[Table, int, str, list[Use], list[int]]], epoch: str | None) -> Read:
    """Channels of all tables on one TAI axis.  A part is (table, time column, scale, uses, further clocks).

    ``epoch`` (UTC) is the zero of scale 's', or else what the tables say of themselves (the earliest)."""
    said = [ns for table, *_ in parts if (ns := origin_of(table.epoch)) is not None]
    origin = origin_of(epoch) if epoch is not None else min(said, default=None)
    dated = origin is not None or any(scale != "s" for _, _, scale, _, _ in parts)
    channels: dict[str, Channel] = {}
    labels: dict[str, np.ndarray] = {}
    label_ns, times = np.empty(0, np.int64), []
    findings: list[Finding] = []
    for table, time, scale, uses, clocks in parts:
        zero = origin_of(table.epoch) if epoch is None and table.epoch is not None else origin
        tai_ns = times_of(table, time, scale, zero or 0)
        times.append(tai_ns)
        for use in uses:
            if use.name in channels:
                raise BadInput(
                    "two columns contain this channel", channel=use.name, remedy="Keep one of them, or rename one."
                )
            channels[use.name] = channel_from(table, use, tai_ns, findings)
        if clocks and not labels:
            label_ns = tai_ns
            labels = {table.headings[j]: np.array([str(c) for c in table.columns[j]], dtype=str) for j in clocks}
    if len(rows := np.concatenate(times)) > 1 and (rows == rows[0]).all():
        raise BadInput(
            f"all {len(rows)} rows have the same time",
            remedy="Check that the first column is the time, and that it was written with enough digits.",
        )
    if not channels:
        raise BadInput("the table has no channel other than time", remedy="Add columns such as 'body_rate_x [rad/s]'.")
    epoch_ns = origin if origin is not None else (whole_second(times[0][0]) if dated else 0)
    return Read(channels, epoch_ns, dated, labels, label_ns, findings, times)


def origin_of(epoch: str | None) -> int | None:
    if epoch is None:
        return None
    year = epoch.strip()[:4]
    if not (year.isascii() and year.isdigit() and 1960 <= int(year) < 2250):
        raise BadInput(f"the epoch {epoch[:60]!r} is not a time", remedy="Write '# epoch: 2015-09-29T00:00:00 UTC'.")
    return int(utc_to_tai_ns(epoch))


_TIME_UNITS = ("utc", "gps s", "et s")


_LARGEST = 1e60  # larger values overflow when squared or converted; no measurement reaches them
