"""A reconstructed torque as a table on disk."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.files import write_text
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from .result import TorqueResult


def save_csv(result: TorqueResult, path, provenance: dict) -> None:
    """The torque as a self-describing table: time, torque, sigma, momentum and bands per axis; blank where unknown.

    Doubts and provenance stand in comment lines.  Nothing half-written stays."""
    unit, momentum_unit = ("rad/s2", "rad/s") if result.relative else ("N m", "N m s")
    suffix = "_per_spin_inertia" if result.relative else ""
    columns = [("time [s]", result.time_s)]
    for name, values, u in (
        ("disturbance_torque", result.torque_Nm, unit),
        ("sigma_torque", result.sigma_Nm, unit),
        ("momentum", result.momentum_Nms, momentum_unit),
    ):
        if values is not None:
            columns += [(f"{name}{suffix}_{AXES[j]} [{u}]", values[:, j]) for j in result.axes]
    for n in (68, 95):
        for end, values in zip(("low", "high"), result.band(n / 100) or (), strict=False):
            columns += [(f"band_{n}_{end}{suffix}_{AXES[j]} [{unit}]", values[:, j]) for j in result.axes]
    lines = [
        f"# epoch: {result.epoch}",
        f"# disturbance torque on the body, body axes; craft {result.craft}; {result.method}, {result.variant}",
        *(f"# DOUBT {d}" for d in result.doubts),
        *(f"# input {i['file']} sha256 {i['sha256']}" for i in provenance["inputs"]),
        f"# asflown {provenance['versions']['asflown']}, options {provenance['options']}",
        ",".join(name for name, _ in columns),
    ]
    for row in zip(*(v for _, v in columns), strict=True):
        lines.append(",".join(repr(float(v)) if np.isfinite(v) else "" for v in row))
    write_text(path, "\n".join(lines) + "\n")
