"""A trajectory from a table: position and velocity of a craft from a body's centre, in axes fixed to the body.

    # epoch: 2008-03-12T19:06:12
    time [s],position_x [km],position_y [km],position_z [km],velocity_x [km/s],velocity_y [km/s],velocity_z [km/s]

z along the body's spin axis to its north pole, x through its prime meridian.  Time may be UTC or ET too, as in telemetry.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..kit.errors import BadInput
from ..kit.files import sha256_of
from ..kit.quantities import si_factor
from ..kit.reading import read_bytes, reading
from .assemble import origin_of, time_column
from .channels import AXES, split_header
from .tables import Table, numbers_of, times_of
from .text import read_csv

_FEWEST = 4
#: No position or velocity in any unit is beyond it, and its square does not overflow.
_LARGEST = 1e60
_UNITS = {"position": "m", "velocity": "m/s"}
#: Largest relative difference of the velocities from the slope of the positions; beyond it frame or unit is wrong.
_UNLIKE = 0.05
#: The same between two rows; beyond it one of them is wrong.
_GLITCH = 0.2


@dataclass(frozen=True)
class TrajectoryTable:
    """At instants (N,) int64 ns TAI, or ns from closest approach where ``dated`` is false: (N, 3) [m], (N, 3) [m/s]."""

    tai_ns: np.ndarray
    dated: bool
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    sha256: str


def load_trajectory(path: str | Path) -> TrajectoryTable:
    """Raises BadInput, naming file, line or column, for a table of another form or one that contradicts itself."""
    with reading(path, "Write it as docs/cli.md says under density."):
        return _read(Path(path))


def _read(path: Path) -> TrajectoryTable:
    data = read_bytes(path, "trajectory", "Check the path.")
    table = read_csv(data)
    at, scale = time_column(table)
    origin = origin_of(table.epoch)
    tai_ns = times_of(table, at, scale, origin or 0)
    columns = {
        stem: np.stack([_column(table, f"{stem}_{a}", unit) for a in AXES], axis=1) for stem, unit in _UNITS.items()
    }
    if len(tai_ns) < _FEWEST:
        raise BadInput(f"{len(tai_ns)} rows are too few for a trajectory", remedy=f"Give at least {_FEWEST}.")
    if np.any(np.diff(tai_ns) <= 0):
        k = int(np.flatnonzero(np.diff(tai_ns) <= 0)[0])
        raise BadInput(
            "the times do not increase", line=table.line(k + 1), remedy="Sort the rows by time, with each instant once."
        )
    r, v = columns["position"], columns["velocity"]
    chord = np.diff(r, axis=0) / (np.diff(tai_ns) / 1e9)[:, None]
    off = np.linalg.norm(chord - 0.5 * (v[1:] + v[:-1]), axis=1) / np.maximum(np.linalg.norm(chord, axis=1), 1e-12)
    if np.median(off) > _UNLIKE:
        raise BadInput(
            f"the velocities do not match the change of the positions (they differ by {100 * np.median(off):.0f} %)",
            remedy="Give both in axes fixed to the body, with their units, and rows at most a few seconds apart.",
        )
    if off.max() > _GLITCH:
        k = int(np.argmax(off))
        raise BadInput(
            f"the positions of this row and the next imply another velocity than the two rows give ({100 * off[k]:.0f} % off)",
            line=table.line(k),
            remedy="Correct the row, or leave it out.",
        )
    return TrajectoryTable(tai_ns, origin is not None or scale.dated, r, v, sha256_of(data))


def _column(table: Table, name: str, unit: str) -> np.ndarray:
    for j, heading in enumerate(table.headings):
        split = split_header(heading)
        if split is not None and split[0] == name:
            rows, values, nan = numbers_of(table, j, name)
            if len(rows) < len(table) or len(nan):
                raise BadInput("a cell is blank", channel=name, remedy="Every row gives position and velocity.")
            big = np.flatnonzero(np.abs(values) > _LARGEST)
            if len(big):
                raise BadInput(
                    "the value is too large for a trajectory",
                    line=table.line(int(rows[big[0]])),
                    channel=name,
                    remedy="Check its unit and exponent.",
                )
            return values * si_factor(split[1], unit)
    raise BadInput(
        "the trajectory has no such column",
        channel=name,
        remedy="Its header is time [s],position_x [km],position_y [km],position_z [km],velocity_x [km/s],velocity_y [km/s],velocity_z [km/s].",
    )
