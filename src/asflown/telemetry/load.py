"""Telemetry from a file: any table in, checked channels in SI on a TAI axis out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..kit.errors import BadInput, some_of
from ..kit.files import sha256_of
from ..kit.timeline import utc_to_tai_ns
from .channels import kind_of, split_header, to_si
from .tables import (
    Table,
    divided,
    long_columns,
    numbers_of,
    read_csv,
    read_netcdf,
    read_parquet,
    times_of,
    whole_second,
    words_of,
)
from .telemetry import Channel, Exclusion, Finding, Telemetry

#: Headings of further time columns, kept as written; so is any column in a time scale.
CLOCKS = ("sclk", "ert", "ground_receipt", "scet", "utc", "time")
_TIME_UNITS = ("utc", "gps s", "et s")
_LARGEST = 1e60  # beyond it squares and units overflow, and nothing is measured so


def load_telemetry(path, *, channels=None, exclude=None, craft=None) -> Telemetry:
    """Read one telemetry file, screen it, and return its channels in SI.

    path: CSV (plain or gzip), Parquet, NetCDF or HDF5.
    channels: a channel dictionary (TOML) where the table does not describe itself.
    exclude: a CSV of spans not to be used, with columns start, stop, channel, reason; start and stop
        in seconds from the epoch or in UTC, '*' for all channels.
    craft: a Craft, whose wheel rate limits sharpen the guard against rpm labelled rad/s.

    Nothing is resampled.  What was noticed is in ``findings`` and ``doubts``, and samples that must not
    be used are marked.  Raises BadInput, naming file, line, channel or time, for anything it cannot read.
    """
    from .attitude import check_attitude
    from .screening import screen

    path = Path(path)
    try:
        data = _bytes(path)
        tables = _tables(path, data)
        if channels is None:
            read = _self_described(tables)
        else:
            from .dictionary import load_dictionary, translated

            read = translated(tables, load_dictionary(channels))
        telemetry = Telemetry(
            channels=read.channels,
            epoch_ns=read.epoch_ns,
            dated=read.dated,
            source=str(path),
            sha256=sha256_of(data),
            time_labels=read.time_labels,
            label_tai_ns=read.label_tai_ns,
            findings=tuple(read.findings),
        )
        telemetry = check_attitude(screen(telemetry, craft), read.readings)
    except BadInput as why:
        raise why.within(path) from why.__cause__
    if exclude is None:
        return telemetry
    spans = read_exclusions(exclude, telemetry)
    try:
        return telemetry.excluding(spans)
    except BadInput as why:
        raise why.within(exclude) from None


def _bytes(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except IsADirectoryError:
        raise BadInput("this is a directory", remedy="Give one file.") from None
    except FileNotFoundError:
        raise BadInput("there is no such file", remedy="Check the path.") from None
    except (OSError, ValueError) as why:
        raise BadInput(f"the file cannot be opened ({getattr(why, 'strerror', None) or why})", remedy="Check the path and its permissions.") from None  # fmt: skip
    if not data:
        raise BadInput("the file is empty", remedy="Give a table with a header line and at least one row.")
    return data


def _tables(path: Path, data: bytes) -> list[Table]:
    """What the file holds, by its first bytes; the suffix only says what was hoped for."""
    if data[:4] == b"PAR1":
        return [read_parquet(path)]
    if data[:8] == b"\x89HDF\r\n\x1a\n" or data[:3] == b"CDF":
        return read_netcdf(path)
    if path.suffix in (".parquet", ".nc", ".h5", ".hdf5", ".hdf"):
        raise BadInput(
            f"its name says {path.suffix}, its content does not", remedy="Copy the file again, or correct its suffix."
        )
    return [read_csv(data)]


@dataclass
class Read:
    """What a way of reading found in the tables, before screening."""

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
    """One column put to use: channel value = (cell x scale + offset) [unit]."""

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
                Finding(use.name, "nan", len(said_nan), int(tai_ns[said_nan[0]]), "cells that say 'nan', taken as blank")
            )  # fmt: skip
    if len(rows) == 0:
        raise BadInput(
            "the column holds no value at all", channel=use.name, remedy="Remove the column, or give the data."
        )
    return Channel(
        use.name, tai_ns[rows], values, np.ones(len(rows), bool), use.unit, use.count_size, modulus=use.modulus
    )


def _self_described(tables: list[Table]) -> Read:
    """Channels from headings 'name [unit]' under a first column 'time [..]'."""
    parts: list[Table] = []
    for table in tables:
        time_scale(table)
        where = long_columns(table.headings)
        parts += divided(table, 0, *where) if where else [table]
    return assembled([(part, 0, time_scale(part), *_headed(part)) for part in parts], None)


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


def _headed(table: Table) -> tuple[list[Use], list[int]]:
    """What each heading after the first asks for: channels, and further clocks to keep."""
    uses, clocks = [], []
    for j, heading in enumerate(table.headings[1:], 1):
        name, unit = split_header(heading) or (heading.strip(), None)
        if name.lower() in CLOCKS or (unit is not None and unit.lower() in _TIME_UNITS):
            clocks.append(j)
            continue
        if not name:
            raise BadInput(f"column {j + 1} has no heading", remedy="Name it 'name [unit]', or remove it.")
        if unit is None and not _is_state(name):
            raise BadInput(
                f"the heading {heading[:60]!r} has no unit",
                channel=name[:60] or None,
                remedy="Write 'name [unit]', as in 'body_rate_x [rad/s]'; [] is dimensionless.",
            )
        uses.append(Use(j, name, unit or ""))
        to_si(name, unit or "")  # an unknown name or unit is told before any cell
    return uses, clocks


def _is_state(name: str) -> bool:
    try:
        return kind_of(name).behaves == "state"
    except BadInput:
        return False


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
                    "two columns hold this channel", channel=use.name, remedy="Keep one of them, or rename one."
                )
            channels[use.name] = channel_from(table, use, tai_ns, findings)
        if clocks and not labels:
            label_ns = tai_ns
            labels = {table.headings[j]: np.array([str(c) for c in table.columns[j]], dtype=str) for j in clocks}
    if len(rows := np.concatenate(times)) > 1 and (rows == rows[0]).all():
        raise BadInput(
            f"time stands still: all {len(rows)} rows have the same time",
            remedy="Check that the first column is the time, and that it was written with enough digits.",
        )
    if not channels:
        raise BadInput("the table holds no channel besides time", remedy="Add columns such as 'body_rate_x [rad/s]'.")
    epoch_ns = origin if origin is not None else (whole_second(times[0][0]) if dated else 0)
    return Read(channels, epoch_ns, dated, labels, label_ns, findings, times)


def origin_of(epoch: str | None) -> int | None:
    if epoch is None:
        return None
    year = epoch.strip()[:4]
    if not (year.isascii() and year.isdigit() and 1960 <= int(year) < 2250):
        raise BadInput(f"the epoch {epoch[:60]!r} is not a time", remedy="Write '# epoch: 2015-09-29T00:00:00 UTC'.")
    return int(utc_to_tai_ns(epoch))


def read_exclusions(path, telemetry: Telemetry) -> list[Exclusion]:
    """Spans not to be used: CSV with start, stop (seconds from the epoch, or UTC), channel ('*': all), reason.

    Raises BadInput for a missing column, a span that ends before it starts, or one without a reason."""
    path = Path(path)
    try:
        table = read_csv(_bytes(path))
        names = [h.strip().lower() for h in table.headings]
        missing = [n for n in ("start", "stop", "channel", "reason") if n not in names]
        if missing:
            raise BadInput(
                f"an exclusion file needs the columns start, stop, channel, reason; missing: {some_of(missing)}",
                remedy="Write a first line 'start,stop,channel,reason'; '*' stands for all channels.",
            )
        found = []
        for row, cells in enumerate(zip(*table.columns, strict=True)):
            entry = {n: c.strip() for n, c in zip(names, cells, strict=True)}
            try:
                start, stop = telemetry.moment(entry["start"]), telemetry.moment(entry["stop"])
            except BadInput as why:
                raise BadInput(why.what, line=table.line(row), remedy=why.remedy) from None
            if not entry["reason"] or stop < start:
                what = "the span ends before it starts" if entry["reason"] else "no reason is given"
                raise BadInput(what, line=table.line(row), remedy="Every exclusion says from when, to when and why.")
            found.append(Exclusion(entry["channel"] or "*", start, stop, entry["reason"]))
    except BadInput as why:
        raise why.within(path) from None
    return found
