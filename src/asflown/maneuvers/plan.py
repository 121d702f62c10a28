"""Burns yet to be flown."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..kit.errors import BadInput, some_of
from ..kit.files import sha256_of
from ..kit.reading import read_bytes, reading
from ..kit.result import Input
from .columns import Columns, read_table
from .frame import SMALLEST, tvc_axes


@dataclass(frozen=True)
class Plan:
    """N planned burns; ``axes`` (N, 3, 3): TVC axes in inertial components, rows X, Y, Z, where the directions are known."""

    id: tuple[str, ...]
    dv_mps: np.ndarray  # (N,)
    axes: np.ndarray | None = None
    inputs: tuple[Input, ...] = ()


def load_plan(path) -> Plan:
    """Read planned burns: CSV, Parquet or TOML ([[maneuver]]) with ``id`` and either ``dv`` or ``expected_dv_x, _y, _z`` and
    ``craft_x_x, _y, _z``.  Raises BadInput, naming file, line and column, for anything it cannot read."""
    path = Path(path)
    with reading(path, "docs/maneuvers.md lists the columns."):
        data = read_bytes(path, "table of burns", "Give a CSV, Parquet or TOML file.")
        columns = Columns(read_table(path, data))
        columns.need("id")
        ids = columns.words("id")
        twice = [n for n, times in Counter(ids).items() if times > 1 or not n]
        if twice:
            raise BadInput(
                f"burns without a name of their own: {some_of(n or 'blank' for n in twice)}",
                remedy="Every burn has an id of its own.",
            )
        axes = None
        if columns.has("expected_dv"):
            expected = columns.vectors("expected_dv")
            dv = np.linalg.norm(expected, axis=1)
            axes = tvc_axes(expected, columns.vectors("craft_x"), ids)
        else:
            columns.need("dv")
            dv = columns.numbers("dv")
        for row in np.flatnonzero(dv < SMALLEST)[:1]:
            raise columns.wrong(int(row), "dv", f"{dv[row]:g} m/s is not the size of a burn", "A dV is positive.")
    return Plan(ids, dv, axes, (Input(str(path), sha256_of(data)),))
