"""The entry of one arc's sources: residual dipole, levers and constant torque, those that the arc tells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...kit.plain import finite
from ..entry import Entry, Value
from .of_record import record_entry

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...estimate.sources import SourcesResult
    from ...telemetry.telemetry import Telemetry

KIND = "sources"
_FIGURES = {"dipole": "dipole", "sunlight": "sunlight_lever", "drag": "drag_lever", "constant": "constant_torque"}


def sources_entry(result: SourcesResult, telemetry: Telemetry, craft: Craft, event_id: str | None = None) -> Entry:
    """The entry of one record's sources; a component that the arc does not tell is left out.

    Raises BadInput for telemetry without an epoch."""
    values = tuple(
        Value(f"{_FIGURES[name]}_{axis}", "telemetry", finite(v), finite(s), _unit(result, of.unit))
        for name, of in result.found.items()
        for axis, v, s, told in zip(of.names, of.value, of.sigma, of.told, strict=True)
        if told
    )
    return record_entry(KIND, values, result.doubts, telemetry, craft, event_id, result.provenance)


def _unit(result: SourcesResult, unit: str) -> str:
    return "rad/s^2, per unit spin inertia" if result.relative and unit == "N m" else unit
