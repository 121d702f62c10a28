"""Tables on disk: CSV, Parquet and NetCDF/HDF5 read as headed columns, and telemetry written the same way.

A reader does not interpret.  It gives headings, cells and line numbers; the meaning of a column
comes from its heading (``load``) or from a channel dictionary (``dictionary``).
"""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections import Counter
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kit.errors import BadInput, some_of
from ..kit.files import write_whole
from ..kit.quantities import si_factor
from ..kit.timeline import NS, et_to_tai_ns, gps_to_tai_ns, utc_label, utc_to_tai_ns
from .channels import split_header
from .telemetry import LONGEST_S, Telemetry

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Time scales a column may be written in.
SCALES = ("s", "utc", "gps s", "et s", "unix s")

_EPOCH_COMMENT = re.compile(r"^#\s*epoch\s*[:=]\s*(.*?)\s*$", re.IGNORECASE)
_YEARS = range(1960, 2250)  # UTC begins in 1960; int64 nanoseconds end in 2292


@dataclass(frozen=True)
class Table:
    """Headed columns of one time axis: text cells as written, or numbers where the format has types (NaN = blank)."""

    headings: tuple[str, ...]
    columns: tuple[Sequence[str] | np.ndarray, ...]
    lines: Sequence[int] = ()  # line in the file of each row, where the format has lines
    epoch: str | None = None  # UTC, as written

    def __len__(self) -> int:
        return len(self.columns[0]) if self.columns else 0

    def line(self, row: int) -> int | None:
        return int(self.lines[row]) if len(self.lines) else None

    def take(self, rows, columns, headings=None) -> Table:
        """Some rows of some columns, under other headings where given."""
        cut = tuple(
            c[rows] if isinstance(c, np.ndarray) else [c[i] for i in rows] for c in (self.columns[j] for j in columns)
        )
        lines = [self.lines[i] for i in rows] if len(self.lines) else ()
        return Table(tuple(headings or (self.headings[j] for j in columns)), cut, lines, self.epoch)


# ---- cells ------------------------------------------------------------------------------------


def numbers_of(table: Table, column: int, channel: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The numbers of one column: rows sampled (int), their values (float64), rows that contain 'nan'.

    A blank is 'not sampled then'.  Raises BadInput for a cell that is not a finite number, with its line.
    """
    cells = table.columns[column]
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
        values = cells.astype(float)
        rows = np.flatnonzero(~np.isnan(values))
        values, said_nan = values[rows], rows[:0]
    else:
        rows, texts = _sampled(cells)
        try:
            if "_" in "".join(texts):  # Python reads 1_000 as a number; telemetry is never written so
                raise ValueError
            values = np.fromiter(map(float, texts), float, len(texts))
        except ValueError:
            bad = next(i for i, c in enumerate(texts) if "_" in c or not _is_number(c))
            raise BadInput(
                f"{_shown(texts[bad])} is not a number",
                line=table.line(rows[bad]),
                channel=channel,
                remedy="Write a number, or leave the cell blank where the channel was not sampled.",
            ) from None
        nan = np.isnan(values)
        rows, values, said_nan = rows[~nan], values[~nan], rows[nan]
    if not np.isfinite(values).all():
        bad = int(np.flatnonzero(~np.isfinite(values))[0])
        raise BadInput(
            f"{_shown(cells[rows[bad]])} is not finite",
            line=table.line(rows[bad]),
            channel=channel,
            remedy="Leave the cell blank where there is no value.",
        )
    return rows, values, said_nan


def _sampled(cells: Any) -> tuple[np.ndarray, Sequence[str]]:
    """Rows of the cells that are not blank, and those cells."""
    if all(cells) and not any(map(str.isspace, cells)):
        return np.arange(len(cells)), cells
    rows = [i for i, c in enumerate(cells) if c and not c.isspace()]
    return np.array(rows, np.int64), [cells[i] for i in rows]


def words_of(table: Table, column: int) -> tuple[np.ndarray, np.ndarray]:
    """The words of one column: rows sampled and their text.  Whole numbers lose a '.0'."""
    cells = table.columns[column]
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
        texts = ["" if v != v else str(int(v)) if v == int(v) else repr(float(v)) for v in cells.tolist()]
    else:
        texts = [str(c).strip() for c in cells]
    rows = np.array([i for i, c in enumerate(texts) if c], np.int64)
    return rows, np.array([texts[i] for i in rows], dtype=str)


def times_of(table: Table, column: int, scale: str, origin_ns: int = 0) -> np.ndarray:
    """One column as int64 ns TAI, every row; ``origin_ns`` is the zero of scale 's'.

    Seconds are read as decimals, so that nothing is lost far from their origin.
    Raises BadInput for a blank, a cell that is not a time, or one beyond the calendar."""
    cells = table.columns[column]
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        cells = ["" if np.isnat(c) else str(c) for c in cells.astype("datetime64[ns]")]
    if scale == "utc":
        return _utc_times(table, column, cells)
    ns = _decimal_seconds(table, column, cells)
    if scale == "gps s":
        return ns + int(gps_to_tai_ns(0.0))
    if scale == "et s":
        return et_to_tai_ns(ns / NS)
    if scale == "unix s":
        day, rest = np.divmod(ns, 86_400 * NS)
        days, which = np.unique(day, return_inverse=True)
        starts = np.asarray(utc_to_tai_ns([str(np.datetime64(int(d), "D")) for d in days]), np.int64)
        return starts[which] + rest
    return ns + origin_ns


def _utc_times(table: Table, column: int, cells) -> np.ndarray:
    for row, cell in enumerate(cells):
        year = str(cell).strip()[:4]
        if not (year.isascii() and year.isdigit() and int(year) in _YEARS):
            raise _no_time(table, column, row, "Write UTC as 2015-09-29T00:00:00 or 2015-272T00:00:00.")
    try:
        return np.asarray(utc_to_tai_ns(list(cells)), np.int64)
    except BadInput as why:
        row = next((i for i, c in enumerate(cells) if not _is_utc(c)), 0)
        raise _no_time(table, column, row, why.remedy) from None


def _is_utc(cell) -> bool:
    try:
        utc_to_tai_ns(str(cell))
    except BadInput:
        return False
    return True


def _decimal_seconds(table: Table, column: int, cells) -> np.ndarray:
    """Seconds as int64 ns, exact to the last digit written."""
    ns = np.empty(len(cells), np.int64)
    for row, cell in enumerate(cells.tolist() if isinstance(cells, np.ndarray) else cells):
        try:
            seconds = Decimal(cell if isinstance(cell, str) else repr(cell))
            if not abs(seconds) < LONGEST_S:  # also NaN
                raise InvalidOperation
            ns[row] = int((seconds * NS).to_integral_value())
        except (InvalidOperation, ValueError):
            raise _no_time(table, column, row, "Every row needs a time, a number of seconds.") from None
    return ns


def whole_second(tai_ns: int) -> int:
    """The whole second at or before an instant: an epoch that a label represents exactly."""
    return (int(tai_ns) + 1000) // NS * NS  # a microsecond short of a second is that second


def _no_time(table: Table, column: int, row: int, remedy: str) -> BadInput:
    cell = table.columns[column][row]
    what = f"{_shown(cell)} in column {table.headings[column]!r} is not a time"
    return BadInput(what, line=table.line(row), remedy=remedy)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _shown(cell: object) -> str:
    text = repr(cell if isinstance(cell, str) else str(cell))
    return text if len(text) <= 60 else text[:57] + "…'"


# ---- readers ----------------------------------------------------------------------------------


def _csv_rows(numbered: list[tuple[int, str]]) -> list[list[str]]:
    """Cells of lines given with their numbers in the file."""
    rows: list[list[str]] = []
    reader = csv.reader((line for _, line in numbered), strict=True, skipinitialspace=True)
    try:
        for row in reader:
            if reader.line_num != len(rows) + 1:
                raise csv.Error("a quotation mark is never closed")
            rows.append(row)
    except csv.Error as why:
        raise BadInput(
            f"this line cannot be read ({why})",
            line=numbered[min(len(rows), len(numbered) - 1)][0],
            remedy="Write comma-separated cells; quotation marks come in pairs, within one line.",
        ) from None
    return rows


def read_csv(data: bytes) -> Table:
    """A comma-separated table, plain or gzip, with '#' comments; raises BadInput naming the line."""
    text = _text(data).replace("\r\n", "\n").replace("\r", "\n")
    epoch, numbered = None, []
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("#"):
            said = _EPOCH_COMMENT.match(line)
            epoch = said.group(1) if said else epoch
        elif line and not line.isspace():
            numbered.append((number, line))
    if not numbered:
        raise BadInput("there is no header line", remedy="The first line names the columns, as in 'time [s],body_rate_x [rad/s]'.")  # fmt: skip
    lines = [n for n, _ in numbered]
    rows = _csv_rows(numbered)
    headings = [h.strip() for h in rows[0]]
    other = next((w for s, w in ((";", "semicolons"), ("\t", "tabs"), ("|", "bars")) if s in headings[0]), None)
    if len(headings) == 1 and other:
        raise BadInput(
            f"the cells are separated by {other}",
            line=lines[0],
            remedy="Separate cells by commas, and use a point as the decimal sign.",
        )
    while len(headings) > 1 and headings[-1] == "" and all(len(r) == len(rows[0]) and not r[-1].strip() for r in rows):
        headings.pop()  # a comma at the end of every line
        rows = [r[:-1] for r in rows]
    for number, row in zip(lines, rows, strict=True):
        if len(row) != len(headings):
            raise BadInput(
                f"the row has {len(row)} cells, the header {len(headings)}",
                line=number,
                remedy="Every row has one cell per column; leave a cell blank where a channel was not sampled.",
            )
    columns = tuple(zip(*rows[1:], strict=True)) if len(rows) > 1 else ((),) * len(headings)
    return _checked(Table(tuple(headings), columns, lines[1:], epoch))


def _text(data: bytes) -> str:
    if data[:2] == b"\x1f\x8b":
        try:
            data = gzip.decompress(data)
        except (EOFError, OSError, zlib.error) as why:
            raise BadInput(
                f"the gzip file is truncated or damaged ({why})", remedy="Copy the file again from its source."
            ) from None
    if not data.strip():
        raise BadInput("the file is empty", remedy="Give a table with a header line and at least one row.")
    try:
        if b"\0" in data:
            raise ValueError("the file contains zero bytes (NUL)")
        return data.decode("utf-8-sig")
    except (UnicodeDecodeError, ValueError) as why:
        raise BadInput(
            f"this is not a text table in UTF-8 ({why})",
            remedy="asflown reads CSV (plain or gzip), Parquet and NetCDF/HDF5. Save the table in one of these.",
        ) from None


def _checked(table: Table) -> Table:
    twice = sorted(h for h, times in Counter(table.headings).items() if h and times > 1)
    if twice:
        raise BadInput(f"the header names a column twice: {some_of(twice)}", remedy="Keep one of them, or rename one.")
    if len(table) == 0:
        raise BadInput("the table has a header but no rows", remedy="Give at least one row.")
    return table


def read_parquet(path: Path) -> Table:
    """A Parquet file whose column names are header cells; ``epoch`` among its key-value metadata."""
    import duckdb

    try:
        with duckdb.connect() as db:
            found = db.execute("SELECT * FROM read_parquet(?)", [str(path)]).fetchnumpy()
            notes = db.execute("SELECT key, value FROM parquet_kv_metadata(?)", [str(path)]).fetchall()
    except duckdb.Error as why:
        raise BadInput(
            f"the Parquet file cannot be read ({str(why).splitlines()[0][:200]})",
            remedy="Copy the file again, or write it anew.",
        ) from None
    epoch = next((v for k, v in notes if _said(k).strip().lower() == "epoch"), None)
    return _checked(
        Table(tuple(found), tuple(_typed(c) for c in found.values()), (), None if epoch is None else _said(epoch))
    )


def _said(value) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _typed(column) -> np.ndarray | list[str]:
    """A typed column as numbers (NaN = blank), as dates, or as text cells."""
    masked: Any = np.ma.asarray(column)
    if masked.dtype.kind in "iub" and not np.ma.getmaskarray(masked).any():
        return masked.data  # integers stay exact
    if masked.dtype.kind in "fiub":
        return masked.astype(float).filled(np.nan)
    if masked.dtype.kind == "M":
        return masked.filled(np.datetime64("NaT"))
    missing = np.ma.getmaskarray(masked)
    return ["" if m or v is None else _said(v) for v, m in zip(masked.data.tolist(), missing.tolist(), strict=True)]


def read_netcdf(path: Path) -> list[Table]:
    """A NetCDF or HDF5 file: one table per time coordinate, units from the CF ``units`` attributes.

    'seconds since …' counts SI seconds from that UTC instant.  Raises BadInput for no usable variable."""
    import warnings

    import xarray

    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    how: dict[str, Any] = {"engine": "scipy"} if classic else {"engine": "h5netcdf", "phony_dims": "sort"}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with xarray.open_dataset(path, decode_times=False, **how) as opened:
                data = opened.load()
    except ImportError as why:
        raise BadInput(
            f"HDF5 cannot be read here ({str(why)[:100]})",
            remedy="Install the package it names, or save the table as CSV or Parquet.",
        ) from None
    except Exception as why:  # h5py, h5netcdf and xarray share no base exception
        raise BadInput(
            f"the NetCDF/HDF5 file cannot be read ({str(why).splitlines()[0][:200] if str(why) else type(why).__name__})",
            remedy="Copy the file again, or write it anew.",
        ) from None
    tables = []
    for dim in data.sizes:
        clock = _clock(data, dim)
        if clock is None:
            continue
        others = [n for n, v in data.variables.items() if v.dims == (dim,) and n != clock]
        if not others:
            continue
        seconds, heading, epoch = _cf_time(data[clock], data.attrs.get("epoch"))
        names = [f"{n} [{data[n].attrs['units']}]" if "units" in data[n].attrs else str(n) for n in others]
        columns = tuple(_typed(data[n].values) for n in others)
        tables.append(_checked(Table((heading, *names), (seconds, *columns), (), epoch)))
    if not tables:
        raise BadInput(
            f"no variable has a time coordinate (variables: {some_of(data.variables)})",
            remedy="Each channel is a one-dimensional variable with its time as a coordinate, in units 'seconds since …'.",
        )
    return tables


def _clock(data, dim) -> str | None:
    """The variable with the times of a dimension."""
    if dim in data.variables:
        return dim
    named = [
        n for n, v in data.variables.items()
        if v.dims == (dim,) and (v.attrs.get("standard_name") == "time" or str(n) == "time" or str(n).startswith("time_"))
    ]  # fmt: skip
    return named[0] if named else None


def _cf_time(clock, epoch) -> tuple[np.ndarray, str, str | None]:
    """Times, their heading and their epoch, from 'seconds since 2015-09-29T00:00:00', 's', 'gps s' or 'et s'."""
    units = str(clock.attrs.get("units", "s")).strip()
    unit, since, start = units.partition(" since ")
    values = np.asarray(clock.values)
    if units in ("gps s", "et s", "unix s", "utc"):
        return values, f"time [{units}]", None
    factor = 86_400.0 if unit.lower() in ("day", "days", "d") else si_factor(_CF_UNITS.get(unit.lower(), unit), "s")
    if values.dtype.kind not in "fiu":
        raise BadInput(f"the time coordinate {clock.name!r} is not numeric", remedy="Store times as numbers with CF units.")  # fmt: skip
    if since:
        epoch = re.sub(r"(\.0+)?\s*(Z|UTC|[+-]00:?00)?$", "", start.strip()).replace(" ", "T")
    return values if factor == 1 else values * factor, "time [s]", None if epoch is None else str(epoch)


_CF_UNITS = {
    "second": "s", "seconds": "s", "sec": "s", "secs": "s", "millisecond": "ms", "milliseconds": "ms", "msec": "ms",
    "microsecond": "us", "microseconds": "us", "nanosecond": "ns", "nanoseconds": "ns", "minute": "min",
    "minutes": "min", "hour": "h", "hours": "h", "hr": "h",
}  # fmt: skip


# ---- long tables --------------------------------------------------------------------------------


def long_columns(headings: Sequence[str]) -> tuple[int, int, int | None] | None:
    """Where (channel, value, unit) stand in a long table with the plain headings; None for any other table."""
    plain = [(split_header(h) or (h.strip(), ""))[0].lower() for h in headings]
    if "channel" in plain and "value" in plain:
        return plain.index("channel"), plain.index("value"), plain.index("unit") if "unit" in plain else None
    return None


def divided(table: Table, time: int, channel: int, value: int, unit: int | None) -> list[Table]:
    """A long table as one two-column table per channel, in order of appearance."""
    rows: dict[str, list[int]] = {}
    names = [str(c).strip() for c in table.columns[channel]]
    units = [str(c).strip() for c in table.columns[unit]] if unit is not None else None
    for i, name in enumerate(names):
        if not name:
            raise BadInput("this row names no channel", line=table.line(i), remedy="Name the channel in every row.")
        rows.setdefault(name if units is None else f"{name} [{units[i]}]", []).append(i)
    return [table.take(np.array(r), (time, value), (table.headings[time], name)) for name, r in rows.items()]


# ---- writing ------------------------------------------------------------------------------------


def write_table(telemetry: Telemetry, path: str | Path) -> None:
    """Write telemetry as a self-describing table.

    One row per instant, SI units in the headings, blanks where a channel was not sampled.  Every value reads back bit
    for bit.  Samples marked as unusable are written too.  No partial file remains.

    Parameters
    ----------
    telemetry : Telemetry
        The channels to write, with their epoch and further time columns.
    path : str or Path
        The suffix gives the format: .parquet, .gz (gzip CSV), else CSV.

    Raises
    ------
    BadInput
        Where the file cannot be written.
    """
    path = Path(path)
    rows_ns = [c.tai_ns for c in telemetry.channels.values()]
    if telemetry.time_labels:
        rows_ns.append(telemetry.label_tai_ns)
    instants = np.unique(np.concatenate(rows_ns)) if rows_ns else np.empty(0, np.int64)
    columns: dict[str, list] = {"time [s]": [_seconds(t - telemetry.epoch_ns) for t in instants.tolist()]}
    for heading, labels in telemetry.time_labels.items():
        columns[heading] = _spread(instants, telemetry.label_tai_ns, [str(v) for v in labels])
    for name, c in telemetry.channels.items():
        state = c.kind.behaves == "state"
        cells = [str(v) for v in c.values.tolist()] if state else [repr(float(v)) for v in c.values.tolist()]
        columns[f"{name} [{c.kind.unit}]"] = _spread(instants, c.tai_ns, cells)
    epoch = _epoch_text(telemetry)

    def write(place: Path) -> None:
        if path.suffix == ".parquet":
            _write_parquet(columns, epoch, place)
        else:
            _write_csv(columns, epoch, place, packed=path.suffix == ".gz")

    if not path.parent.is_dir():
        raise BadInput(
            "the table cannot be written (the folder does not exist)", file=path, remedy="Choose another folder."
        )
    write_whole(path, write)


def _epoch_text(telemetry: Telemetry) -> str | None:
    if not telemetry.dated:
        return None
    digits = 0 if telemetry.epoch_ns % NS == 0 else 9
    return f"{utc_label(telemetry.epoch_ns, digits)} UTC"


def _seconds(ns: int) -> str:
    """Nanoseconds as exact decimal seconds: 2500000000 -> '2.5'."""
    whole, rest = divmod(abs(ns), NS)
    return f"{'-' if ns < 0 else ''}{whole}.{f'{rest:09d}'.rstrip('0') or '0'}"


def _spread(instants: np.ndarray, at_ns: np.ndarray, cells: list[str]) -> list[str]:
    column = [""] * len(instants)
    for row, cell in zip(np.searchsorted(instants, at_ns).tolist(), cells, strict=True):
        column[row] = cell
    return column


def _write_csv(columns: dict[str, list], epoch: str | None, path: Path, *, packed: bool) -> None:
    import io

    text = io.StringIO()
    if epoch:
        text.write(f"# epoch: {epoch}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    data = text.getvalue().encode()
    path.write_bytes(gzip.compress(data, 6, mtime=0) if packed else data)  # no date inside: same bytes each time


def _write_parquet(columns: dict[str, list], epoch: str | None, path: Path) -> None:
    """The CSV cells, typed and packed by DuckDB (a decimal and its float64 read back as each other)."""
    import tempfile

    import duckdb

    words = [h for h, c in columns.items() if not all(_is_number(v) for v in c if v)]
    types = {h: "VARCHAR" if h in words else "DOUBLE" for h in columns}
    notes = f", KV_METADATA {{epoch: '{epoch}'}}" if epoch else ""
    quoted = str(path).replace("'", "''")
    with tempfile.NamedTemporaryFile("w", suffix=".csv", encoding="utf-8") as plain, duckdb.connect() as db:
        writer = csv.writer(plain, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
        plain.flush()
        try:
            cells = db.read_csv(plain.name, header=True, dtype=types, delimiter=",", quotechar='"')
            cells.create_view("cells")
            db.execute(f"COPY cells TO '{quoted}' (FORMAT parquet{notes})")
        except duckdb.Error as why:
            raise OSError(str(why).splitlines()[0]) from None
