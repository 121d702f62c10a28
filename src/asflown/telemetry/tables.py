"""Tables: headed columns of one time axis, and their cells as numbers, words and times.

A table does not interpret.  It gives headings, cells and line numbers; the meaning of a column
comes from its heading (``load``) or from a channel dictionary (``dictionary``).
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kit.errors import BadInput, some_of
from ..kit.reading import plain_number
from ..kit.timeline import NS, posix_to_tai_ns
from .channels import split_header
from .times import NotATime, Scale, dated_ns, exact_ns, is_stamp

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path


@dataclass(frozen=True)
class Table:
    """Headed columns of one time axis: text cells as written, or numbers where the format has types (masked or NaN = blank)."""

    headings: tuple[str, ...]
    columns: tuple[Sequence[str] | np.ndarray, ...]
    lines: Sequence[int] = ()  # line in the file of each row, where the format has lines
    epoch: str | None = None  # UTC, as written
    notes: tuple[str, ...] = ()  # how the file was read, where there was a choice
    instants: dict[int, np.ndarray] = field(default_factory=dict)  # columns read as times already: ns of their scale
    blanked: dict[int, np.ndarray] = field(
        default_factory=dict
    )  # rows of a column that the file declares as fill or out of range

    def __len__(self) -> int:
        return max((len(c) for c in (*self.columns, *self.instants.values())), default=0)

    @cached_property
    def every_row(self) -> np.ndarray:
        """The numbers of all rows, one array for all columns."""
        return np.arange(len(self))

    def line(self, row: int) -> int | None:
        return int(self.lines[row]) if len(self.lines) else None

    def begins_dated(self, column: int) -> bool:
        """Whether the first cell of a column is a date."""
        cells = self.columns[column]
        return (isinstance(cells, np.ndarray) and cells.dtype.kind == "M") or (len(cells) > 0 and is_stamp(cells[0]))

    def take(self, rows, columns, headings=None) -> Table:
        """Some rows of some columns, under other headings where given."""
        cut = tuple(
            c[rows] if isinstance(c, np.ndarray) else [c[i] for i in rows] for c in (self.columns[j] for j in columns)
        )
        lines = [self.lines[i] for i in rows] if len(self.lines) else ()
        return Table(tuple(headings or (self.headings[j] for j in columns)), cut, lines, self.epoch, self.notes)

    def parsed(self, time: Iterable[int], scale: Scale, numbers: Iterable[int], words: Iterable[int]) -> Table:  # noqa: ARG002
        """The table with the columns that are used; here all are there already (see ``text``)."""
        return self

    def whole(self) -> Table:
        """The table with every column."""
        return self


#: What programs write where there is no value, in small letters.
NO_VALUE = frozenset((
    "nan", "-nan", "+nan", "na", "n/a", "n.a.", "#n/a", "#na", "<na>", "null", "none", "nil", "nat", "-", "--", "---", "#div/0!", "#num!",
    "#value!", "#null!", "#ref!", "#name?", "1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind",
))  # fmt: skip


# ---- cells ------------------------------------------------------------------------------------


def numbers_of(table: Table, column: int, channel: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The numbers of one column: rows sampled (int), their values (float64), rows that contain 'nan'.

    A blank is 'not sampled then'.  Raises BadInput for a cell that is not a finite number, with its line.
    """
    cells = table.columns[column]
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
        masked = isinstance(cells, np.ma.MaskedArray)
        rows = np.flatnonzero(~np.ma.getmaskarray(cells)) if masked else table.every_row
        values = np.asarray(cells.data[rows] if masked else cells, float)
        said_nan = rows[:0]
        if len(values) and np.isnan(np.min(values)):
            nan = np.isnan(values)
            said_nan = rows[nan] if masked else rows[:0]
            rows, values = rows[~nan], values[~nan]
    else:
        rows, texts = _sampled(cells)
        values = np.array([_number(c) for c in texts], float)
        nan = np.isnan(values)
        bad = next((i for i in np.flatnonzero(nan).tolist() if texts[i].strip().lower() not in NO_VALUE), None)
        if bad is not None:
            raise BadInput(
                f"{_shown(texts[bad])} is not a number",
                line=table.line(rows[bad]),
                channel=channel,
                remedy="Write a number, or leave the cell blank where the channel was not sampled.",
            )
        rows, values, said_nan = rows[~nan], values[~nan], rows[nan]
    if len(values) and not (np.isfinite(np.min(values)) and np.isfinite(np.max(values))):
        bad = int(np.flatnonzero(~np.isfinite(values))[0])
        raise BadInput(
            f"{_shown(cells[rows[bad]])} is not finite",
            line=table.line(rows[bad]),
            channel=channel,
            remedy="Leave the cell blank where there is no value.",
        )
    return rows, values, said_nan


def _number(cell: str) -> float:
    """A cell as a number; NaN for one that is none."""
    if not cell.isascii():
        cell = cell.replace("\N{MINUS SIGN}", "-").strip()  # also without a hard blank
    try:
        return plain_number(cell)
    except ValueError:
        return float(cell.upper().replace("D", "E")) if _FORTRAN.fullmatch(cell) else np.nan


#: Double precision as Fortran writes it.
_FORTRAN = re.compile(r"\s{0,99}[+-]?\d{0,40}\.?\d{1,40}[dD][+-]?\d{1,3}\s{0,99}", re.ASCII)


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
        values = np.ma.filled(cells.astype(float), np.nan).tolist()
        texts = ["" if v != v else str(int(v)) if v == int(v) else repr(float(v)) for v in values]
    else:
        texts = [str(c).strip() for c in cells]
    rows = np.array([i for i, c in enumerate(texts) if c], np.int64)
    return rows, np.array([texts[i] for i in rows], dtype=str)


def times_of(table: Table, column: int, scale: Scale, origin_ns: int = 0) -> np.ndarray:
    """One column as int64 ns TAI, every row; ``origin_ns`` is the zero of elapsed times.

    Numbers are read as decimals, so that nothing is lost far from their origin.
    Raises BadInput for a blank, a cell that is not a time, or one beyond the calendar."""
    cells = table.columns[column]
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        return _of_dates(table, column, cells)
    try:
        if not scale.numeric:
            return table.instants[column] if column in table.instants else dated_ns(cells, scale)
        ns = table.instants[column] if column in table.instants else exact_ns(cells, scale)
    except NotATime as why:
        raise _no_time(table, column, why, scale) from None
    try:
        return scale.tai_ns(ns, origin_ns)
    except BadInput:
        raise
    except ValueError:
        raise BadInput("the times are outside the calendar", remedy="Check the scale of the time column.") from None


def _of_dates(table: Table, column: int, cells: np.ndarray) -> np.ndarray:
    """A typed column of dates, which count no leap seconds, as ns TAI."""
    blank = np.isnat(np.ma.filled(cells, np.datetime64("NaT")))
    if blank.any():
        raise _no_time(table, column, NotATime(int(np.flatnonzero(blank)[0])), Scale("utc"))
    return posix_to_tai_ns(cells.astype("datetime64[ns]").astype(np.int64))


def whole_second(tai_ns: int) -> int:
    """The whole second at or before an instant: an epoch that a label represents exactly."""
    return (int(tai_ns) + 1000) // NS * NS  # a microsecond short of a second is that second


def _no_time(table: Table, column: int, why: NotATime, scale: Scale) -> BadInput:
    cell = table.columns[column][why.row]
    remedy = {
        "utc": "Write UTC as 2015-09-29T00:00:00 or 2015-272T00:00:00; declare any other form in a channel dictionary.",
        "pattern": f"Every row needs a time of the declared form {scale.pattern!r}.",
    }.get(scale.kind, "Every row needs a time, a number.")
    reason = f" ({why.why.rpartition('(')[2]}" if why.why.endswith(")") else ""
    return BadInput(
        f"{_shown(cell)} in column {table.headings[column]!r} is not a time{reason}",
        line=table.line(why.row),
        remedy=remedy,
    )


def _shown(cell: object) -> str:
    text = repr(cell if isinstance(cell, str) else str(cell))
    return text if len(text) <= 60 else text[:57] + "…'"


def quiet_database():
    """DuckDB in memory, its progress counted and not written among results."""
    import duckdb

    db = duckdb.connect()
    db.execute("SET enable_progress_bar = true; SET enable_progress_bar_print = false")
    return db


def share_done(db) -> float:
    """How much of its query a database has done."""
    return db.query_progress() / 100


def quoted_pattern(path: Path) -> str:
    """A path for DuckDB, which reads names as patterns: each special character stands for itself."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in str(path.absolute()))


def said(value) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def typed(column) -> np.ndarray | list[str]:
    """A typed column as numbers (masked or NaN = blank), as dates, or as text cells."""
    values: Any = column if isinstance(column, np.ma.MaskedArray) else np.asarray(column)
    if values.dtype.kind in "iubf":
        if not values.dtype.isnative:
            values = values.astype(values.dtype.newbyteorder("="))
        return values if np.ma.is_masked(values) else np.asarray(values)
    if values.dtype.kind == "M":
        return np.ma.filled(values, np.datetime64("NaT"))
    if values.dtype.kind == "m":
        return np.ma.filled(values, np.timedelta64("NaT"))
    missing = np.ma.getmaskarray(values)
    plain = np.ma.getdata(values).tolist()
    return ["" if m or v is None else said(v) for v, m in zip(plain, missing.tolist(), strict=True)]


def checked(table: Table) -> Table:
    """The table, with at least one row and no heading twice; else raises BadInput."""
    check_headings(table.headings)
    if len(table) == 0:
        raise BadInput("the table has a header but no rows", remedy="Give at least one row.")
    return table


def check_headings(headings: Iterable[str]) -> None:
    twice = sorted(h for h, times in Counter(headings).items() if h and times > 1)
    if twice:
        raise BadInput(f"the header names a column twice: {some_of(twice)}", remedy="Keep one of them, or rename one.")


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
