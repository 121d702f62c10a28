"""Dictionaries of maneuver tables: columns of any table renamed, scaled and converted to those of docs/maneuvers.md.

A dictionary is TOML; unknown keys are refused, and columns it does not mention are ignored.

    [[column]]    column, name, unit; scale: value = cell * scale [unit]; unit_column: where each row names its unit;
                  variance = true: cells are squares of sigmas, in the unit squared
    [status]      column, used = ["executed"]: other rows are left out, with what the column says as the reason
    [notes]       free text

Errors and sigmas along the dV may be in % of it, pointing errors and sigmas in angles (mrad, arcsec), which are multiplied by it.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..kit.config import document
from ..kit.errors import BadInput, some_of
from ..kit.quantities import si_factor
from ..kit.reading import reading
from ..telemetry.channels import split_header
from ..telemetry.tables import Table, numbers_of, words_of
from .columns import NUMBERS, WORDS

if TYPE_CHECKING:
    from collections.abc import Sequence

_ALONG = ("magnitude_error", "sigma_magnitude")
_ACROSS = ("pointing_error_x", "pointing_error_y", "sigma_pointing_x", "sigma_pointing_y")


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ColumnEntry(_Part):
    column: str
    name: str
    unit: str = ""
    unit_column: str = ""
    scale: float = Field(1.0, allow_inf_nan=False)
    variance: bool = False


class StatusEntry(_Part):
    column: str
    used: tuple[str, ...] = Field(min_length=1)


class ManeuverDictionary(_Part):
    column: tuple[ColumnEntry, ...] = Field(min_length=1)
    status: StatusEntry | None = None
    notes: dict[str, str] = Field(default_factory=dict)


def load_maneuver_dictionary(path) -> ManeuverDictionary:
    """Read and check a dictionary, from a file or a dict of its keys.  Raises BadInput for a missing file, an unknown key, name or unit."""
    remedy = "docs/maneuvers.md lists the keys of a dictionary of maneuver tables."
    hint = "Give a TOML file; docs/maneuvers.md shows one."
    entry, name = document(ManeuverDictionary, path, "columns", "dictionary of maneuver tables", hint, remedy)
    with reading(name, remedy):
        _check(entry)
    return entry


def _check(entry: ManeuverDictionary) -> None:
    twice = [n for n, times in Counter(c.name for c in entry.column).items() if times > 1]
    if twice:
        raise BadInput(f"a name is mapped twice: {some_of(twice)}", remedy="Map it once.")
    for c in entry.column:
        if c.name not in NUMBERS and c.name not in WORDS and c.name != "time":
            raise BadInput(
                f"{c.name!r} is not a column of a maneuver table",
                channel=c.name,
                remedy="docs/maneuvers.md lists the columns.",
            )
        if c.variance and not c.name.startswith("sigma_"):
            raise BadInput("variance = true is for sigmas", channel=c.name, remedy="Map a sigma, or leave it out.")
        if c.name in NUMBERS and not c.unit_column:
            _factor(c.name, c.unit)
    if entry.status and any(c.name == "excluded" for c in entry.column):
        raise BadInput("rows are left out by [status] and by a column 'excluded'", remedy="Give one of them.")


def translated(table: Table, entry: ManeuverDictionary) -> Table:
    """The table with the columns of the dictionary in SI under house names.

    Raises BadInput for a column that is not there, a unit that does not fit, and a cell that is not a number, with its line."""
    at = {(split_header(h) or (h.strip(),))[0]: j for j, h in enumerate(table.headings)}
    at |= {h.strip(): j for j, h in enumerate(table.headings)}
    wanted = {c.column for c in entry.column} | {c.unit_column for c in entry.column if c.unit_column}
    missing = sorted((wanted | ({entry.status.column} if entry.status else set())) - set(at))
    if missing:
        raise BadInput(
            f"columns of the dictionary are not in the table: {some_of(missing)}",
            remedy=f"The table's columns: {some_of(table.headings)}.",
        )
    reasons = _reasons(table, entry, at)
    headings, columns = [], []
    dv: np.ndarray | None = None
    for c in sorted(entry.column, key=lambda c: c.name != "dv"):  # the dV first: shares and angles are of it
        if c.name not in NUMBERS:
            headings.append(f"time [{c.unit or 'utc'}]" if c.name == "time" else c.name)
            columns.append(table.columns[at[c.column]])
            continue
        values = _numbers(table, c, at, dv, reasons)
        dv = values if c.name == "dv" else dv
        headings.append(f"{c.name} [{NUMBERS[c.name]}]")
        columns.append(values)
    if entry.status:
        headings.append("excluded")
        columns.append(reasons)
    return Table(tuple(headings), tuple(columns), table.lines, table.epoch, table.notes)


def _reasons(table: Table, entry: ManeuverDictionary, at: dict[str, int]) -> list[str]:
    """Why each row is left out; '' where it is used."""
    if entry.status is None:
        place = next((at[c.column] for c in entry.column if c.name == "excluded"), None)
        return [""] * len(table) if place is None else _words(table, place)
    used = {u.casefold() for u in entry.status.used}
    said = _words(table, at[entry.status.column])
    return ["" if s.casefold() in used else s or f"{entry.status.column} is blank" for s in said]


def _words(table: Table, column: int) -> list[str]:
    found = [""] * len(table)
    for row, word in zip(*words_of(table, column), strict=True):
        found[row] = str(word)
    return found


def _numbers(
    table: Table, c: ColumnEntry, at: dict[str, int], dv: np.ndarray | None, reasons: Sequence[str]
) -> np.ndarray:
    """A column in SI, NaN where blank, (N,)."""
    rows, values, _ = numbers_of(table, at[c.column], c.name)
    units = _words(table, at[c.unit_column]) if c.unit_column else [c.unit] * len(table)
    found = np.full(len(table), np.nan)
    if c.variance:
        if len(values) and values.min() < 0:
            raise BadInput("a variance is negative", line=table.line(int(rows[np.argmin(values)])), channel=c.name, remedy="Correct it.")  # fmt: skip
        values = np.sqrt(values)
    factors: dict[str, tuple[float, bool]] = {}
    for row, value in zip(rows.tolist(), (values * c.scale).tolist(), strict=True):
        unit = units[row]
        if unit not in factors:
            try:
                factors[unit] = _factor(c.name, unit)
            except BadInput as why:
                if reasons[row]:
                    continue  # a row that is left out may say anything
                raise BadInput(why.what, line=table.line(row), channel=c.name, remedy=why.remedy) from None
        factor, of_dv = factors[unit]
        if of_dv and dv is None:
            raise BadInput(f"[{unit}] is a share of the dV, which is not mapped", channel=c.name, remedy="Map a column to dv.")  # fmt: skip
        found[row] = value * factor * (dv[row] if of_dv and dv is not None else 1.0)
    return found


def _factor(name: str, unit: str) -> tuple[float, bool]:
    """Factor to SI of a unit, and whether it is of the dV: % or an angle."""
    try:
        return si_factor(unit, NUMBERS[name]), False
    except BadInput:
        kind = "" if name in _ALONG else "rad" if name in _ACROSS else None
        if kind is None or unit == "":
            raise
    try:
        return si_factor(unit, kind), True
    except BadInput:
        wanted = "a velocity or %" if kind == "" else "a velocity or an angle"
        raise BadInput(
            f"the unit [{unit}] of {name} is neither {wanted}", channel=name, remedy="Correct unit."
        ) from None
