"""Tables that a scenario names: a CSV of times and a vector's components."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.quantities import si_factor
from ..kit.reading import csv_rows, plain_number, read_text, reading
from ..telemetry.channels import AXES, split_header

if TYPE_CHECKING:
    from pathlib import Path


def read_table(path: Path, what: str, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Times (k,) [s] and values (k, 3) in ``unit``; components that have no column are zero.

    Raises BadInput for a file that cannot be read, whose header is not ``time [s],x [unit],…``, or whose times do not increase."""
    remedy = (
        f"Write a CSV with the header time [s],x [{unit}],y [{unit}],z [{unit}] (any of the axes) and increasing times."
    )
    with reading(path, remedy, f"this {what} table"):
        rows = [row for _, row in csv_rows(read_text(path, f"{what} table", remedy), path, remedy)]
        split = [split_header(cell) for cell in rows[0]] if rows else []
        heads = [head for head in split if head is not None]
        if (
            len(heads) < 2
            or len(heads) < len(split)
            or heads[0][0] != "time"
            or any(name not in AXES for name, _ in heads[1:])
        ):
            raise BadInput(f"the header of this {what} table is not understood", file=path, remedy=remedy)
        try:
            values = np.array([[plain_number(cell) for cell in row] for row in rows[1:]])
        except ValueError as why:
            raise BadInput(f"a row of this {what} table is not all numbers ({why})", file=path, remedy=remedy) from why
        if values.ndim != 2 or len(values) < 2 or values.shape[1] != len(heads) or not (np.abs(values) < 1e60).all():
            raise BadInput(f"the rows of this {what} table do not match its header", file=path, remedy=remedy)
        times = values[:, 0] * si_factor(heads[0][1], "s")
        if np.any(np.diff(times) <= 0):
            raise BadInput(f"the times of this {what} table do not increase", file=path, remedy=remedy)
        along = np.zeros((len(times), 3))
        for column, (name, given) in enumerate(heads[1:], start=1):
            along[:, AXES.index(name)] = values[:, column] * si_factor(given, unit)
        return times, along
