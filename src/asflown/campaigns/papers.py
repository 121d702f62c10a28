"""The cover paper's own cases, flown with known truth and reconstructed by its methods and by ours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from ..estimate.torque import TorqueResult, torque
from ..kit.table import Table
from ..sim.flight import Flight, fly, write_flight
from ..telemetry.channels import AXES
from ..telemetry.load import load_telemetry
from .truth import PUBLISHED_PEAK_ERRORS, against_truth

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np

    from ..craft.model import Craft
    from ..telemetry.telemetry import Telemetry

#: Seed of every flight of the demonstration.
SEED = 2016
#: The cover turns about this axis, and the profiles are injected about it.
AXIS = "y"
#: Test profile -> the paper's table of its errors and the figure that shows it.
PROFILES = {"profile-1": ("Table 3", "21"), "profile-2": ("Table 4", "22")}
#: (method, variant): the paper's two as printed, the same corrected, and the fused torque.
WAYS = (
    ("momentum", "printed"),
    ("transfer", "printed"),
    ("momentum", "corrected"),
    ("transfer", "corrected"),
    ("fused", "corrected"),
)


@dataclass(frozen=True)
class Case:
    """A scenario flown, written, and read back through the door that real telemetry comes through."""

    flight: Flight
    telemetry: Telemetry
    craft: Craft

    @cached_property
    def results(self) -> tuple[TorqueResult, ...]:
        """Torque about the case's axis by each of WAYS."""
        return tuple(torque(self.telemetry, self.craft, method=m, variant=v, axis=AXIS) for m, v in WAYS)

    @property
    def truth(self) -> tuple[np.ndarray, np.ndarray]:
        """Time [s] and true torque about the case's axis [N m]."""
        return self.flight.truth.time_s, self.flight.truth.torque_Nm[:, AXES.index(AXIS)]

    def errors(self) -> list[dict]:
        """Each result set against the truth, as ``PeakErrors.record`` has it, with the flight's noise."""
        peaks = [(t, v) for t, v, _ in self.flight.truth.peaks]
        return [
            {"noise": self.flight.scenario.noise} | against_truth(r, *self.truth, peaks, AXIS).record()
            for r in self.results
        ]


def case(name: str, folder: Path, craft: Craft, noise: str = "nominal") -> Case:
    """Fly a shipped scenario and write it into a folder of its own within ``folder``."""
    flight = fly(name, noise=noise, seed=SEED)
    place = folder / (name if noise == "nominal" else f"{name}-{noise}-noise")
    write_flight(flight, place)
    return Case(flight, load_telemetry(place / "telemetry.csv"), craft)


def profile_record(name: str, rows: list[dict]) -> dict:
    """The errors of a test profile's cases beside the published ones."""
    return {
        "profile": name, "table": PROFILES[name][0], "published_unsigned_percent": PUBLISHED_PEAK_ERRORS[name],
        "rows": rows,
    }  # fmt: skip


def profile_table(record: dict) -> Table:
    """The same as a person reads it."""
    published = ("paper", "momentum (unsigned)", *(f"{v:.2f}" for v in record["published_unsigned_percent"]))
    rows = [
        (r["noise"], f"{r['method']}, {r['variant']}", *(f"{v:+.2f}" for v in r["peak_error_percent"]),
         f"{r['lag_s']:+.1f}", f"{r['peak_lag_s']:+.1f}")
        for r in record["rows"]
    ]  # fmt: skip
    return Table(
        f"{record['profile']}: percent error at the six peaks (cover paper, {record['table']}); + is too large, late is positive",
        (published, *rows),
        ("noise", "method", *(f"peak {k}" for k in range(1, 7)), "lag [s]", "lag of peaks [s]"),
    )
