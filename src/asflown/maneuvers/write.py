"""Maneuvers as a table that reads back."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kit.files import mark, write_text
from ..kit.timeline import utc_label

if TYPE_CHECKING:
    from pathlib import Path

    from .table import Maneuvers


#: What such a table calls itself (see ``kit.files.is_ours``).
MANEUVERS = "maneuvers"


def write_maneuvers(m: Maneuvers, path: str | Path) -> None:
    """Write resolved errors as a CSV table that ``load_maneuvers`` reads; nothing half written stays.

    Parameters
    ----------
    m : Maneuvers
    path : str or Path

    Raises
    ------
    BadInput
        Where the place cannot be written.
    """
    write_text(path, f"{maneuver_text(m)}# {mark(MANEUVERS)}\n")


def maneuver_text(m: Maneuvers) -> str:
    """One row a maneuver, SI; ledgers as the column ``adjusted``."""
    columns: dict[str, Any] = {
        "id": list(m.id), "engine": list(m.engine), "dv [m/s]": m.dv_mps, "magnitude_error [m/s]": m.magnitude_error_mps,
        "sigma_magnitude [m/s]": m.sigma_magnitude_mps,
    }  # fmt: skip
    if m.tai_ns is not None:
        columns["time [utc]"] = [utc_label(int(t), 3) for t in m.tai_ns]
    if m.pointing_error_mps is not None:
        error, covariance = m.across
        sigma = np.sqrt(np.einsum("nii->ni", covariance))
        product = sigma[:, 0] * sigma[:, 1]
        correlation = np.divide(covariance[:, 0, 1], product, out=np.zeros(len(m)), where=product > 0)
        for j, axis in enumerate("xy"):
            columns[f"pointing_error_{axis} [m/s]"] = error[:, j]
            columns[f"sigma_pointing_{axis} [m/s]"] = sigma[:, j]
        columns["correlation_xy []"] = np.clip(correlation, -1, 1)
    if any(m.ledger):
        columns["adjusted"] = ["; ".join(a.name for a in book) for book in m.ledger]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(
        zip(
            *(column if isinstance(column, list) else map(repr, column.tolist()) for column in columns.values()),
            strict=True,
        )
    )
    return text.getvalue()
