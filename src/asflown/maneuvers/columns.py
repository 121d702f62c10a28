"""The columns a table of maneuvers may have, and how they come from CSV, Parquet and TOML."""

from __future__ import annotations

import difflib
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from ..kit.config import toml_table
from ..kit.errors import BadInput, some_of
from ..kit.quantities import numbers, quantity, si_factor
from ..kit.timeline import utc_to_tai_ns
from ..telemetry.channels import split_header
from ..telemetry.formats import read_excel, read_parquet
from ..telemetry.tables import Table, numbers_of, times_of, words_of
from ..telemetry.text import read_csv
from ..telemetry.times import Scale, scale_called

if TYPE_CHECKING:
    from pathlib import Path

WORDS = ("id", "engine", "excluded", "adjusted", "note")
#: Numbers of one maneuver -> SI unit.
SCALARS = {
    "dv": "m/s", "magnitude_error": "m/s", "pointing_error_x": "m/s", "pointing_error_y": "m/s",
    "sigma_magnitude": "m/s", "sigma_pointing_x": "m/s", "sigma_pointing_y": "m/s", "correlation_xy": "",
    "correction_ratio": "",
}  # fmt: skip
_XYZ = ("x", "y", "z")
#: Vectors (inertial axes) and the covariance -> their components and SI unit.
VECTORS = {
    "expected_dv": (_XYZ, "m/s"), "burn_dv": (_XYZ, "m/s"), "turn_dv": (_XYZ, "m/s"), "deadband_dv": (_XYZ, "m/s"),
    "reconstructed_dv": (_XYZ, "m/s"), "craft_x": (_XYZ, ""),
    "covariance": (("xx", "yy", "zz", "xy", "xz", "yz"), "m2/s2"),
}  # fmt: skip
NUMBERS = SCALARS | {f"{stem}_{c}": unit for stem, (parts, unit) in VECTORS.items() for c in parts}
_LARGEST = 1e6  # m/s, and every other number here: nothing flown comes near


class Columns:
    """Headed columns of one table, asked for by name; every complaint names column and row."""

    def __init__(self, table: Table):
        self.table = table
        self.at: dict[str, tuple[int, str]] = {}
        for j, heading in enumerate(table.headings):
            name, unit = split_header(heading) or (heading.strip(), None)
            self._check(name, unit, heading)
            if name in self.at:
                raise BadInput(f"two columns hold {name}", channel=name, remedy="Keep one of them, or rename one.")
            self.at[name] = (j, unit or "")

    def __len__(self) -> int:
        return len(self.table)

    def __contains__(self, name: str) -> bool:
        return name in self.at

    def _check(self, name: str, unit: str | None, heading: str) -> None:
        if name == "time":
            if scale_called(unit or "utc") is None:
                raise BadInput(
                    f"the time scale [{unit}] is not known",
                    channel=name,
                    remedy="Write one of: utc, s, gps s, et s, unix s, mjd, jd.",
                )
        elif name in NUMBERS:
            if unit is None:
                raise BadInput(
                    f"the heading {heading[:60]!r} has no unit", channel=name,
                    remedy=f"Write '{name} [{'mm/s' if NUMBERS[name] == 'm/s' else NUMBERS[name]}]'; [] is dimensionless.",
                )  # fmt: skip
            _factor(name, unit)
        elif name not in WORDS:
            near = difflib.get_close_matches(name, [*NUMBERS, *WORDS, "time"], 3, 0.5)
            raise BadInput(
                f"{heading[:60]!r} is not a column of a maneuver table", channel=name[:60] or None,
                remedy=(f"Did you mean {some_of(near)}? " if near else "") + "docs/maneuvers.md lists the columns; 'note' is free text.",
            )  # fmt: skip

    def some(self, rows: list[int]) -> Columns:
        """The same columns with some of the rows."""
        return (
            self
            if len(rows) == len(self)
            else Columns(self.table.take(np.array(rows, np.int64), range(len(self.table.headings))))
        )

    def need(self, *names: str) -> None:
        missing = [n for n in names if n not in self.at]
        if missing:
            raise BadInput(
                f"the table has no column {some_of(missing)}",
                remedy=f"A table of this kind needs {some_of(names)}. It has: {some_of(self.at)}. docs/maneuvers.md lists all.",
            )

    def line(self, row: int) -> int | None:
        return self.table.line(row)

    def wrong(self, row: int, name: str, what: str, remedy: str) -> BadInput:
        where = "" if self.line(row) is not None else f" (row {row + 1})"
        return BadInput(what + where, line=self.line(row), channel=name, remedy=remedy)

    def words(self, name: str) -> tuple[str, ...]:
        """One text a row, '' where blank or where there is no such column."""
        found = [""] * len(self)
        if name in self:
            for row, word in zip(*words_of(self.table, self.at[name][0]), strict=True):
                found[row] = str(word)
        return tuple(found)

    def numbers(self, name: str, blank: float | None = None) -> np.ndarray:
        """The column in SI, (N,).  ``blank``: what an empty cell means; without it an empty cell is refused."""
        j, unit = self.at[name]
        rows, values, _ = numbers_of(self.table, j, name)
        found = np.full(len(self), np.nan if blank is None else blank)
        found[rows] = values * _factor(name, unit)
        missing = np.flatnonzero(np.isnan(found))
        if len(missing):
            raise self.wrong(int(missing[0]), name, "there is no value", "Give it, or leave this maneuver out.")
        big = np.flatnonzero(np.abs(found) > _LARGEST)
        if len(big):
            raise self.wrong(int(big[0]), name, "the value is too large for a maneuver", "Check its unit and exponent.")
        return found

    def vectors(self, stem: str, blank: float | None = None) -> np.ndarray:
        """The components of a vector (N, 3), or of the covariance (N, 6), in SI."""
        parts, _ = VECTORS[stem]
        names = [f"{stem}_{p}" for p in parts]
        self.need(*names)
        return np.stack([self.numbers(n, blank) for n in names], axis=1)

    def has(self, stem: str) -> bool:
        """Whether any component of a vector is there."""
        return any(f"{stem}_{p}" in self for p in VECTORS[stem][0])

    def times(self) -> np.ndarray | None:
        if "time" not in self:
            return None
        j, unit = self.at["time"]
        origin = 0 if self.table.epoch is None else int(utc_to_tai_ns(self.table.epoch))
        return times_of(self.table, j, scale_called(unit or "utc") or Scale("utc"), origin)


def _factor(name: str, unit: str) -> float:
    try:
        return si_factor(unit, NUMBERS[name])
    except BadInput as why:
        hint = "An angle times the dV is a pointing error. " if name.startswith(("pointing", "sigma_pointing")) else ""
        raise BadInput(why.what, channel=name, remedy=hint + why.remedy) from None


def read_table(path: Path, data: bytes, entries: str = "maneuver") -> Table:
    """A table of maneuvers from CSV (plain or gzip), Parquet, Excel, or TOML with one ``[[maneuver]]`` each."""
    if data[:4] == b"PAR1":
        return read_parquet(path)
    if data[:4] == b"PK\x03\x04":
        return read_excel(path)[0]
    if path.suffix.lower() == ".toml":
        return _from_toml(toml_table(data, None), entries)
    return read_csv(data)


def _from_toml(content: dict, entries: str) -> Table:
    """Entries as a headed table in SI; vectors become columns a component, an absent key a blank."""
    rows = content.get(entries)
    if not (isinstance(rows, list) and rows and all(isinstance(r, dict) for r in rows)) or set(content) != {entries}:
        raise BadInput(
            f"it does not hold [[{entries}]] entries and nothing else", remedy=f"Write one [[{entries}]] each."
        )
    cells: dict[str, list] = {}
    for k, row in enumerate(rows):
        for name, value in row.items():
            for heading, cell in _cells(name, value, k).items():
                blank = float("nan") if isinstance(cell, float) else ""
                cells.setdefault(heading, [blank] * len(rows))[k] = cell
    columns = tuple(np.array(c) if isinstance(c[0], float) else c for c in cells.values())
    return Table(tuple(cells), columns)


def _cells(name: str, value, k: int) -> dict[str, float | str]:
    try:
        if name in SCALARS:
            return {f"{name} [{SCALARS[name]}]": quantity(value, SCALARS[name])}
        if name in VECTORS:
            parts, unit = VECTORS[name]
            values = numbers(value, unit, len(parts))
            return {f"{name}_{p} [{unit}]": v for p, v in zip(parts, values, strict=True)}
    except BadInput as why:
        raise BadInput(f"entry {k + 1}: {why.what}", channel=name, remedy=why.remedy) from None
    if isinstance(value, datetime) and value.tzinfo is not None:
        value = value.astimezone(UTC).replace(tzinfo=None)
    return {name: value.isoformat() if isinstance(value, datetime) else str(value)}
