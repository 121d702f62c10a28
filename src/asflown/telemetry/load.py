"""Telemetry from a file: checked channels in SI on a TAI axis."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..kit.errors import BadInput, some_of
from ..kit.files import sha256_of_file
from ..kit.reading import read_bytes, reading
from ..kit.result import Input, inputs_of
from .assemble import Clock, Part, Read, Use, assembled, time_column
from .channels import kind_of, split_header, to_si
from .findings import Finding
from .formats import BY_SIGNATURE
from .tables import Table, divided, long_columns
from .telemetry import Exclusion, Telemetry
from .text import TextFile, read_csv, read_text
from .times import scale_called

#: Headings of further time columns, kept as written; so is any column in a time scale.
CLOCKS = ("sclk", "ert", "ground_receipt", "scet", "utc", "time")


def load_telemetry(path, *, channels=None, exclude=None, craft=None) -> Telemetry:
    """Read one telemetry file or table in memory, screen it, and return its channels in SI.

    Nothing is resampled.  Samples that must not be used are marked, not removed.

    Parameters
    ----------
    path : str or Path, or table
        A text table (plain or gzip), Parquet, NetCDF, HDF5, FITS, CDF, MATLAB or Excel; or a
        pandas or polars DataFrame, an xarray Dataset, or a dict of arrays (name -> values, or name -> (values, unit)).
    channels : str, Path or dict, optional
        Channel dictionary (TOML, or a dict of the same keys), where the table does not describe itself; docs/telemetry.md lists its keys.
    exclude : str or Path, optional
        CSV of spans not to be used, with columns start, stop, channel, reason; start and stop in seconds from the
        epoch or in UTC, '*' for all channels.
    craft : Craft, optional
        Its wheel rate limits improve the test for rpm labelled rad/s.

    Returns
    -------
    Telemetry
        Channels by name, each at its own times (TAI), with ``findings`` and ``doubts`` of the screening.

    Raises
    ------
    BadInput
        Names file, line, channel or time of what cannot be read: a missing file, an unknown channel or unit, a cell
        that is not a number, time running backwards, a quaternion against the body rates.
    """
    from .attitude import check_attitude
    from .screening import screen

    of_file = isinstance(path, (str, Path))
    path = Path(path) if of_file else path
    name = str(path) if of_file else type(path).__name__
    with reading(name, "Check the file, or its channel dictionary (docs/telemetry.md)."):
        if of_file:
            tables, digest = _tables(path), sha256_of_file(path)
        else:
            from .in_memory import digest_of, tables_of

            tables = tables_of(path)
            digest = digest_of(tables)
        if channels is None:
            read = _self_described(tables)
        else:
            from .dictionary import load_dictionary, translated

            read = translated(tables, load_dictionary(channels))
        telemetry = Telemetry(
            channels=read.channels,
            epoch_ns=read.epoch_ns,
            dated=read.dated,
            source=name,
            sha256=digest,
            inputs=(Input(name, digest), *inputs_of(channels)),
            time_labels=read.time_labels,
            label_tai_ns=read.label_tai_ns,
            findings=tuple(read.findings),
        )
        telemetry = check_attitude(screen(telemetry, craft), read.readings)
    if exclude is None:
        return telemetry
    spans = read_exclusions(exclude, telemetry)
    try:
        return replace(telemetry.excluding(spans), inputs=(*telemetry.inputs, *inputs_of(exclude)))
    except BadInput as why:
        raise why.within(exclude) from None


def _check_plain(path: Path) -> None:
    """Raise BadInput where there is no plain file with content."""
    try:
        if path.is_dir():
            raise BadInput("this is a directory, not a file", remedy="Give one file.")
        if not path.exists():
            raise BadInput("there is no such file", remedy="Check the path.")
        if not path.is_file():
            raise BadInput("this is not a plain file", remedy="Write the table to a file first.")
        if path.stat().st_size == 0:
            raise BadInput("the file is empty", remedy="Give a table with a header line and at least one row.")
        with path.open("rb"):
            pass
    except (OSError, ValueError) as why:
        raise BadInput(f"the file cannot be opened ({getattr(why, 'strerror', None) or why})", remedy="Check the path and its permissions.") from None  # fmt: skip


def _tables(path: Path) -> list[Table] | list[TextFile]:
    """The tables of a file, whose format its first bytes give; the suffix is only checked against it."""
    _check_plain(path)
    with path.open("rb") as file:
        first = file.read(32)
    for signature, read in BY_SIGNATURE:
        if first.startswith(signature):
            return read(path)
    if path.suffix.lower() in (".parquet", ".nc", ".h5", ".hdf5", ".hdf", ".fits", ".fit", ".cdf", ".mat", ".xlsx"):
        raise BadInput(
            f"the content is not {path.suffix}, as the file name says",
            remedy="Copy the file again, or correct its suffix.",
        )
    return [read_text(path)]


def _self_described(tables: list[Table] | list[TextFile]) -> Read:
    """Channels from headings 'name [unit]' under a first column 'time [..]'."""
    whole: list[Table | TextFile] = []
    for table in tables:
        where = long_columns(table.headings)
        whole += divided(table.whole(), time_column(table)[0], *where) if where else [table]
    parts = []
    for table in whole:
        at, scale = time_column(table)
        parts.append(Part(table, Clock((at,), scale), *_headed(table, at)).parsed())
    read = assembled(parts, None)
    told = [f"the column {t.headings[0]!r} was taken for row numbers" for t in whole if time_column(t)[0]]
    told += [
        f"the times under {h!r} were read as UTC"
        for t in tables
        if "[" not in (h := t.headings[time_column(t)[0]]) and "(" not in h
    ]
    read.findings += [Finding("", "form", 1, read.epoch_ns, note) for note in dict.fromkeys(told)]
    return read


def _headed(table: Table | TextFile, time: int) -> tuple[list[Use], list[int]]:
    """What each heading after that of the time names: a channel, or a further clock to keep."""
    uses, clocks = [], []
    for j, heading in enumerate(table.headings[time + 1 :], time + 1):
        name, unit = split_header(heading) or (heading.strip(), None)
        if name.lower() in CLOCKS or (unit is not None and _is_clock(unit)):
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
        to_si(name, unit or "")  # report an unknown name or unit before any cell
    return uses, clocks


def _is_clock(unit: str) -> bool:
    scale = scale_called(unit)
    return scale is not None and scale.dated


def _is_state(name: str) -> bool:
    try:
        return kind_of(name).behaves == "state"
    except BadInput:
        return False


def read_exclusions(path, telemetry: Telemetry) -> list[Exclusion]:
    """Spans to exclude: CSV with start, stop (seconds from the epoch, or UTC), channel ('*': all), reason.

    Raises BadInput for a missing column, a span that ends before it starts, or one without a reason."""
    path = Path(path)
    with reading(path, "Write a CSV of start,stop,channel,reason."):
        _check_plain(path)
        table = read_csv(read_bytes(path, "exclusion file", "Check the path."))
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
                raise BadInput(
                    what, line=table.line(row), remedy="Every exclusion needs a start, a later stop and a reason."
                )
            found.append(Exclusion(entry["channel"] or "*", start, stop, entry["reason"]))
    return found
