"""Text tables: how one is written is told from its first lines, then its columns are read by DuckDB.

What DuckDB's reader and ours might take differently (quotation marks, comments or blank lines among the rows, cells that are not
numbers) is read by Python's csv module, which knows the line of every fault.  Both give the same numbers, to the last digit.
"""

from __future__ import annotations

import csv
import gzip
import io
import re
import tempfile
import zlib
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.quantities import is_unit
from ..kit.timeline import posix_to_tai_ns
from .channels import split_header
from .tables import Table, check_headings, checked, quiet_database, quoted_pattern, typed
from .times import DECIMALS, UNITS_NS, NotATime, exact_ns

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from .times import Scale

_EPOCH_COMMENT = re.compile(r"#\s{0,9}epoch\s{0,9}[:=](.{0,200})", re.IGNORECASE)
_DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars"}
#: Lines looked at to tell how the table is written, and the most bytes they may take.
_HEAD_LINES, _HEAD_BYTES = 200, 1 << 20
#: Text beyond this is not read cell by cell in Python. [bytes]
SLOW_LIMIT = 200_000_000
#: Text up to this is read cell by cell at once: DuckDB takes longer to load. [bytes]
SMALL = 500_000
#: A packed table is unpacked up to this size. [bytes]
UNPACKED_LIMIT = 8_000_000_000
_NUMBER = re.compile(
    r"[+-]?(?:\d{1,400}(?:[.,]\d{0,400})?|[.,]\d{1,400})(?:[eE][+-]?\d{1,5})?|nan|[+-]?inf(?:inity)?",
    re.IGNORECASE | re.ASCII,
)
_DECIMAL_COMMA = re.compile(r"[+-]?\d{0,400},\d{1,400}(?:[eE][+-]?\d{1,5})?", re.ASCII)


@dataclass(frozen=True)
class Form:
    """How a text table is written: cells, headings with units, the line of its first row, and what was told of it."""

    delimiter: str
    decimal: str
    headings: tuple[str, ...]
    width: int  # cells of a row
    first_line: int  # of the first row, counted from 1
    epoch: str | None
    notes: tuple[str, ...] = ()


def read_text(path: Path) -> TextFile:
    """A delimited text table, plain or gzip, with its form told from its first lines.  Raises BadInput naming the line."""
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    plain = _Unpacked(path) if packed else None
    return TextFile(Path(plain.name) if plain else path, form_of(_head(Path(plain.name) if plain else path)), plain)


def read_csv(data: bytes) -> Table:
    """A small table that is in memory already, with all its cells as text."""
    if data[:2] == b"\x1f\x8b":
        data = b"".join(_unpacked(io.BytesIO(data)))
    text = _decoded(data)
    return _cell_by_cell(text, form_of(text.split("\n")))


class _Unpacked:
    """A temporary file with the content of a gzip file; it is removed when nothing refers to it any more."""

    def __init__(self, path: Path):
        self._file = tempfile.NamedTemporaryFile(prefix="asflown-", suffix=".csv")  # noqa: SIM115  lives as long as the table
        with path.open("rb") as packed:
            for block in _unpacked(packed):
                self._file.write(block)
        self._file.flush()
        self.name = self._file.name


def _unpacked(packed) -> Iterable[bytes]:
    total = 0
    try:
        with gzip.open(packed) as plain:
            while block := plain.read(1 << 20):
                total += len(block)
                if total > UNPACKED_LIMIT:
                    raise BadInput(
                        f"the gzip file unpacks to more than {UNPACKED_LIMIT / 1e9:g} GB",
                        remedy="Unpack it and divide the table, or write Parquet.",
                    )
                if b"\0" in block:
                    raise _not_text("the file contains zero bytes (NUL)")
                yield block
    except (EOFError, OSError, zlib.error) as why:
        raise BadInput(
            f"the gzip file is truncated or damaged ({why})", remedy="Copy the file again from its source."
        ) from None


def _not_text(why: object) -> BadInput:
    return BadInput(
        f"this is not a text table in UTF-8 ({why})",
        remedy="asflown reads CSV (plain or gzip), Parquet, NetCDF/HDF5, FITS, CDF, MATLAB and Excel files. "
        "Save the table in one of these.",
    )


def _decoded(data: bytes) -> str:
    if not data.strip():
        raise BadInput("the file is empty", remedy="Give a table with a header line and at least one row.")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encoding = "utf-16"  # as spreadsheets write "Unicode text"
    else:
        encoding = "utf-8-sig"
        if b"\0" in data:
            raise _not_text("the file contains zero bytes (NUL)")
    try:
        return data.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as why:
        raise _not_text(why) from None


def _head(path: Path) -> list[str]:
    """The first lines of a file, whole ones."""
    with path.open("rb") as file:
        data = file.read(_HEAD_BYTES)
        more = file.read(1)
    if more:
        end = max(data.rfind(b"\n"), data.rfind(b"\r"))
        if end < 0:
            raise BadInput(
                f"the first line is longer than {_HEAD_BYTES} characters",
                line=1,
                remedy="Give a table with a header line and one row a line.",
            )
        data = data[: end + 1]
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            data = data[: len(data) & ~1]
    return _decoded(data).split("\n")


# ---- the form ---------------------------------------------------------------------------------------


def form_of(lines: Sequence[str]) -> Form:
    """How a text table is written, from its first lines.

    The delimiter is the one that divides the rows alike; see ``form_of_rows`` for the rest."""
    epoch, said_delimiter, comment = None, None, None
    rows: list[tuple[int, str]] = []
    for number, line in enumerate(lines, 1):
        if line.startswith("#"):
            said = _EPOCH_COMMENT.match(line)
            epoch = said.group(1).strip() if said else epoch
            comment = (number, line[1:].strip()) if not rows else comment
        elif not rows and re.fullmatch(r"sep=.", line.rstrip(), re.IGNORECASE):
            said_delimiter = line.rstrip()[4]
        elif line and not line.isspace():
            rows.append((number, line))
            if len(rows) >= _HEAD_LINES:
                break
    delimiter = said_delimiter or _delimiter_of([line for _, line in rows])
    named = None if comment is None else (comment[0], _cells(comment[1], delimiter))
    return form_of_rows([(n, _cells(line, delimiter)) for n, line in rows], delimiter, epoch, named)


def form_of_rows(
    cells: list[tuple[int, list[str]]], delimiter: str = ",", epoch: str | None = None, comment=None
) -> Form:
    """How a table of cells is written, from its first lines, each with its number.

    The header is the last line of names above the first row of numbers, or the last ``comment`` where there is none; a row of units
    below it is joined to it; lines above it are left aside and told.  Raises BadInput where there is no header."""
    if not cells:
        raise BadInput("there is no header line", remedy="The first line names the columns, as in 'time [s],body_rate_x [rad/s]'.")  # fmt: skip
    width = Counter(len(c) for _, c in cells[len(cells) // 2 :]).most_common(1)[0][0]
    if len(cells) == 2 and len(cells[1][1]) < len(cells[0][1]):
        width = len(cells[0][1])  # of two lines, the second is the one cut short
    at = _first_row(cells, width)
    top, units = _header(cells[:at], width, comment)
    notes = [] if delimiter == "," else [f"cells are separated by {_DELIMITERS.get(delimiter, repr(delimiter))}"]
    if above := [n for n, _ in cells[:at] if n < top[0]]:
        notes.append(f"{len(above)} lines above the header (line {top[0]}) were not read")
    headings = [h.strip() for h in top[1]]
    if units is not None:
        headings = [_joined(h, u.strip()) for h, u in zip(headings, units[1], strict=False)]
        notes.append(f"line {units[0]} was read as units")
    body = [c for _, c in cells[at:]]
    headings = _without_spare(headings, body, width, top[0])
    decimal = _decimal_of(body) if delimiter != "," else "."
    if decimal == ",":
        notes.append("the decimal sign is a comma")
    check_headings(headings)
    first = cells[at][0] if at < len(cells) else cells[-1][0] + 1
    return Form(delimiter, decimal, tuple(headings), width, first, epoch, tuple(notes))


def _cells(line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    except (csv.Error, StopIteration):
        return line.split(delimiter)


def _delimiter_of(lines: list[str]) -> str:
    """The delimiter under which most cells hold no other delimiter, most rows have the same number of cells, and that is largest."""

    def whole(cell: str) -> bool:
        return bool(_NUMBER.fullmatch(cell)) or not any(d in cell for d in _DELIMITERS)

    def score(delimiter: str) -> tuple[float, float, int]:
        rows = [_cells(line, delimiter) for line in lines[len(lines) // 2 :][:50]]
        width, alike = Counter(len(r) for r in rows).most_common(1)[0]
        if width < 2 and len(_cells(lines[0], delimiter)) < 2:
            return 0.0, 0.0, 0
        cells = [c.strip() for r in rows for c in r]
        return sum(map(whole, cells)) / max(len(cells), 1), alike / len(rows), width

    if not lines:
        return ","
    best = max(_DELIMITERS, key=score)
    return best if score(best)[2] else ","


def _is_number(cell: str) -> bool:
    return bool(_NUMBER.fullmatch(cell.strip()))


def _first_row(cells, width: int) -> int:
    """Index of the first line that is a row: as wide as the rows, with a number; the second line where none has one."""
    for i, (_, row) in enumerate(cells):
        if len(row) == width and any(map(_is_number, row)):
            return i
    return min(1, len(cells))


def _header(above, width: int, comment):
    """The line of headings among the lines above the first row, and the line of units below it or None."""
    wide = [(n, row) for n, row in above if len(row) >= min(width, 2)]
    if not wide and comment is not None and len(comment[1]) == width:
        wide = [comment]  # headings behind a '#', as numpy writes them
    if not wide:
        raise BadInput(
            "there is no header line above the first row",
            line=above[0][0] if above else None,
            remedy="The first line names the columns, as in 'time [s],body_rate_x [rad/s]'.",
        )
    if len(wide) > 1 and _is_units(wide[-1][1]) and not _is_units(wide[-2][1]):
        return wide[-2], wide[-1]
    return wide[-1], None


def _is_units(row: list[str]) -> bool:
    """Whether every cell that is not blank is a unit, one of them with more than a letter or in brackets."""
    said = [c.strip() for c in row if c.strip()]
    bare = [c.strip("[]()") for c in said]
    return bool(said) and all(is_unit(b) or b.lower() in ("utc", "-", "") for b in bare)


def _joined(heading: str, unit: str) -> str:
    unit = unit.strip("[]()")
    return heading if split_header(heading) or not heading else f"{heading} [{'' if unit == '-' else unit}]"


def _without_spare(headings: list[str], body: list[list[str]], width: int, line: int) -> list[str]:
    """Headings without the blank cell that a delimiter at the end of lines makes.  Raises BadInput where widths disagree."""
    while len(headings) > width and headings[-1] == "":
        headings = headings[:-1]
    if body and len(headings) != width:
        decimal = " Is the decimal sign a comma? Write a point." if len(headings) < width else ""
        raise BadInput(
            f"the header has {len(headings)} cells, the rows have {width}",
            line=line,
            remedy=f"Every row has one cell per column; leave a cell blank where a channel was not sampled.{decimal}",
        )
    while len(headings) > 1 and headings[-1] == "" and all(not r[-1].strip() for r in body if len(r) == width):
        headings = headings[:-1]  # the rows keep their blank cell; no heading asks for it
    return headings


def _decimal_of(body: list[list[str]]) -> str:
    cells = [c.strip() for row in body for c in row]
    comma = sum(bool(_DECIMAL_COMMA.fullmatch(c)) for c in cells)
    return (
        ","
        if comma and not any(re.fullmatch(r"[+-]?\d{0,400}\.\d{1,400}(?:[eE][+-]?\d{1,5})?", c) for c in cells)
        else "."
    )


# ---- the columns ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TextFile:
    """A text table whose columns are read when it is known which are used; ``unpacked`` holds a temporary file in being."""

    path: Path
    form: Form
    unpacked: object = None

    @property
    def headings(self) -> tuple[str, ...]:
        return self.form.headings

    @property
    def epoch(self) -> str | None:
        return self.form.epoch

    @property
    def notes(self) -> tuple[str, ...]:
        return self.form.notes

    def parsed(self, time: Iterable[int], scale: Scale, numbers: Iterable[int], words: Iterable[int]) -> Table:
        """The table with the columns that are used, by DuckDB where it can tell them, else cell by cell."""
        time = tuple(time)
        large = self.path.stat().st_size > SMALL
        fast = _by_duckdb(self, time[0], scale, tuple(numbers), tuple(words)) if large and len(time) == 1 else None
        return self.whole() if fast is None else fast

    def whole(self) -> Table:
        """Every cell as text, with the line of each row."""
        return self._whole

    @cached_property
    def _whole(self) -> Table:
        size = self.path.stat().st_size
        if size > SLOW_LIMIT:
            raise BadInput(
                f"the table ({size / 1e6:.0f} MB) is too large to be read cell by cell, as its form requires "
                "(quotation marks, comments or blank lines among the rows, or a cell that is not a number)",
                remedy="Write it without them, or as Parquet.",
            )
        return _cell_by_cell(_decoded(self.path.read_bytes()), self.form)


_ISO = r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(\.\d{1,9})?(Z|\+00:00| UTC)?"


#: A decimal of so many digits and its double are one to one.
_ONE_TO_ONE = 15


def _by_duckdb(
    file: TextFile, time: int, scale: Scale, numbers: tuple[int, ...], words: tuple[int, ...]
) -> Table | None:
    """The used columns by DuckDB; None where the text needs the csv module, or a cell is not what it should be."""
    import duckdb

    if scale.kind == "pattern" or (seen := _look(file)) is None:
        return None
    direct = set() if seen.underscores else set(numbers) - {time, *words}
    chosen = [f"{f'c{j}' if j in direct else _number(f'c{j}', file.form.decimal)} AS n{j}" for j in numbers]
    chosen += [f"c{j} AS w{j}" for j in words]
    types = dict.fromkeys(range(file.form.width), "VARCHAR") | dict.fromkeys(direct, "DOUBLE")
    try:
        for clock in _clocks(file.form, time, scale, seen):
            found = _selected(file, [*clock, *chosen], types)
            if "long" not in found or not found.pop("long").any():
                break
    except duckdb.Error:
        return None
    return _table(file, found, time, scale, numbers, words) if len(found["t"]) == seen.rows else None


def _number(cell: str, decimal: str, kind: str = "DOUBLE") -> str:
    """A cell of text as a number; DuckDB reads 1_000 as one, telemetry is never written so."""
    plain = cell if decimal == "." else f"replace({cell}, ',', '.')"
    return f"CAST(CASE WHEN contains({cell}, '_') THEN error('no') ELSE {plain} END AS {kind})"


def _clocks(form: Form, time: int, scale: Scale, seen: _Seen) -> list[list[str]]:
    """Ways to select the times: as doubles where their digits allow, of which ``long`` tells, else as decimals in ns."""
    cell = f"c{time}"
    if scale.kind == "utc":
        stamp = f"regexp_replace({cell}, '(Z|\\+00:00| UTC)$', '')"
        return [[f"CASE WHEN regexp_full_match({cell}, '{_ISO}') THEN epoch_ns(CAST({stamp} AS TIMESTAMP_NS)) ELSE error('no') END AS t"]]  # fmt: skip
    exact = _number(cell, form.decimal, f"DECIMAL(28,{DECIMALS[scale.unit]})")
    decimals = [f"CAST(({exact} - {scale.origin}) * {UNITS_NS[scale.unit]} AS BIGINT) AS t"]
    doubles = [f"{_number(cell, form.decimal)} AS t", f"strlen({cell}) > {_ONE_TO_ONE} AS long"]
    return [decimals] if len(seen.first.split(form.delimiter)[time]) > _ONE_TO_ONE else [doubles, decimals]


def _selected(file: TextFile, chosen: list[str], types: dict[int, str]) -> dict[str, np.ndarray]:
    how = (
        "auto_detect=false, header=false, strict_mode=true, null_padding=false, nullstr='', quote='', escape='', "
        f"compression='none', skip={file.form.first_line - 1}, delim=$delimiter, decimal_separator=$decimal, columns=$columns"
    )
    with quiet_database() as db:
        return db.execute(
            f"SELECT {', '.join(chosen)} FROM read_csv($path, {how})",
            {
                "path": quoted_pattern(file.path),
                "delimiter": file.form.delimiter,
                "decimal": file.form.decimal,
                "columns": {f"c{j}": types[j] for j in range(file.form.width)},
            },
        ).fetchnumpy()


def _table(file: TextFile, found, time: int, scale: Scale, numbers, words) -> Table | None:
    clock = found.pop("t")
    if np.ma.is_masked(clock) or len(clock) == 0:
        return None
    try:
        ns = exact_ns(clock, scale) if clock.dtype.kind == "f" else np.asarray(clock, np.int64)
    except NotATime:
        return None
    columns: list = [()] * len(file.headings)
    for j in numbers:
        columns[j] = found.pop(f"n{j}")
        if np.isinf(columns[j]).any():
            return None
    for j in words:
        columns[j] = typed(found.pop(f"w{j}"))
    first = file.form.first_line
    lines = range(first, first + len(ns))
    return Table(
        file.headings,
        tuple(columns),
        lines,
        file.epoch,
        file.notes,
        {time: posix_to_tai_ns(ns) if scale.kind == "utc" else ns},
    )


@dataclass(frozen=True)
class _Seen:
    """What stands among the rows of a text: how many there are, the first of them, and whether an underscore is among them."""

    rows: int
    first: str
    underscores: bool


_BLOCK = 1 << 22


def _look(file: TextFile) -> _Seen | None:
    """One look at the bytes of the rows; None where a quotation mark, comment or odd line end stands among them.

    Blank lines show as rows that are missing in the end."""
    ends = returns = 0
    underscores, last, first = False, b"\n", b""
    with file.path.open("rb") as text:
        if text.read(2) in (b"\xff\xfe", b"\xfe\xff"):
            return None
        text.seek(0)
        for _ in range(file.form.first_line - 1):
            text.readline()
        while block := text.read(_BLOCK):
            if b'"' in block or b"\0" in block or (b"#" in block and b"\n#" in last[-1:] + block):
                return None
            first = first or block[:10_000]
            underscores |= b"_" in block
            ends += block.count(b"\n")
            returns += block.count(b"\r")
            last = block if len(block) > 1000 else last + block
    blank = last[len(last.rstrip(b"\n\r ")) :]
    if returns not in (0, ends):
        return None
    line = first.partition(b"\n")[0].decode("utf-8", "replace")
    return _Seen(ends - blank.count(b"\n") + 1, line, underscores)


def _cell_by_cell(text: str, form: Form) -> Table:
    """Every cell of a text by the csv module; raises BadInput naming the line."""
    numbered = [
        (number, line)
        for number, line in enumerate(text.split("\n"), 1)
        if number >= form.first_line and line and not line.isspace() and not line.startswith("#")
    ]
    rows = _csv_rows(numbered, form.delimiter)
    lines = [n for n, _ in numbered]
    for number, row in zip(lines, rows, strict=True):
        if len(row) != form.width:
            raise BadInput(
                f"the row has {len(row)} cells, the header {form.width}",
                line=number,
                remedy="Every row has one cell per column; leave a cell blank where a channel was not sampled.",
            )
    columns = tuple(zip(*rows, strict=True))[: len(form.headings)] if rows else ((),) * len(form.headings)
    if form.decimal == ",":
        columns = tuple(
            tuple(c.replace(",", ".") if _DECIMAL_COMMA.fullmatch(c.strip()) else c for c in col) for col in columns
        )
    return checked(Table(form.headings, columns, lines, form.epoch, form.notes))


def _csv_rows(numbered: list[tuple[int, str]], delimiter: str) -> list[list[str]]:
    """Cells of lines given with their numbers in the file."""
    rows: list[list[str]] = []
    reader = csv.reader((line for _, line in numbered), strict=True, skipinitialspace=True, delimiter=delimiter)
    try:
        for row in reader:
            if reader.line_num != len(rows) + 1:
                raise csv.Error("a quotation mark is never closed")
            rows.append(row)
    except csv.Error as why:
        raise BadInput(
            f"this line cannot be read ({why})",
            line=numbered[min(len(rows), len(numbered) - 1)][0],
            remedy="Close every quotation mark within its line.",
        ) from None
    return rows
