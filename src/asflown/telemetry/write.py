"""Telemetry written as a self-describing table: CSV, plain or gzip, or Parquet."""

from __future__ import annotations

import csv
import gzip
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.files import write_whole
from ..kit.timeline import NS, utc_label

if TYPE_CHECKING:
    from .telemetry import Telemetry


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
    for source in telemetry.inputs:
        if path.exists() and os.path.exists(source.file) and os.path.samefile(path, source.file):
            raise BadInput("the table would replace the file it was read from", file=path, remedy="Name another file.")
    columns, epoch = _cells(telemetry), _epoch_text(telemetry)
    states = [f"{n} [{c.kind.unit}]" for n, c in telemetry.channels.items() if c.kind.behaves == "state"]
    words = {*telemetry.time_labels, *states}

    def write(place: Path) -> None:
        if path.suffix == ".parquet":
            _write_parquet(columns, words, epoch, place)
        else:
            data = _csv_text(columns, epoch).encode()
            # no date inside: same bytes each time
            place.write_bytes(gzip.compress(data, 6, mtime=0) if path.suffix == ".gz" else data)

    if not path.parent.is_dir():
        raise BadInput(
            "the table cannot be written (the folder does not exist)", file=path, remedy="Choose another folder."
        )
    write_whole(path, write)


def table_text(telemetry: Telemetry) -> str:
    """The CSV that ``write_table`` writes."""
    return _csv_text(_cells(telemetry), _epoch_text(telemetry))


def _cells(telemetry: Telemetry) -> dict[str, list]:
    """Columns of text by heading, a row per instant."""
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
    return columns


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


def _csv_text(columns: dict[str, list], epoch: str | None) -> str:
    text = io.StringIO()
    if epoch:
        text.write(f"# epoch: {epoch}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def _write_parquet(columns: dict[str, list], words: set[str], epoch: str | None, path: Path) -> None:
    """The CSV cells, typed and packed by DuckDB (a decimal and its float64 read back as each other)."""
    import tempfile

    import duckdb

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
