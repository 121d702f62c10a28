"""JSON Schemas of every verb, made from the types of its record and shipped in asflown/schemas.

python -m asflown.cli.schemas       # writes them anew; a test holds them current
"""

from __future__ import annotations

import json
from importlib import import_module, resources
from pathlib import Path
from typing import Any

from ..kit.schema import json_schema
from ..maneuvers.history import GatesHistoryRecord
from . import records

#: Verb -> module and class of its result, or a record that is no result's.
_RESULTS = {
    "torque": ("estimate.torque", "TorqueResult"),
    "wheels": ("estimate.wheels", "WheelsResult"),
    "inertia": ("estimate.inertia", "InertiaResult"),
    "inertia plan": ("estimate.inertia", "SlewPlanResult"),
    "inertia history": ("estimate.inertia", "InertiaHistoryResult"),
    "external-torque": ("estimate.external", "ExternalTorqueResult"),
    "sources": ("estimate.sources", "SourcesResult"),
    "density": ("estimate.density", "DensityResult"),
    "jets": ("estimate.jets", "JetsResult"),
    "leak": ("estimate.leak", "LeakResult"),
    "thrust": ("estimate.thrust", "ThrustResult"),
    "gates": ("estimate.gates", "GatesResult"),
    "gates watch": ("estimate.gates", "GatesWatchResult"),
    "gates predict": ("estimate.gates", "GatesPredictionResult"),
    "budget": ("campaigns.budget", "ErrorBudget"),
    "tune": ("campaigns.tune", "SpanSearch"),
}
_RECORDS = {
    "telemetry check": records.TelemetryCheckRecord,
    "telemetry names": records.TelemetryNamesRecord,
    "craft list": records.CraftListRecord,
    "craft show": records.CraftRecord,
    "craft check": records.CraftCheckRecord,
    "craft new": records.CraftNewRecord,
    "simulate": records.SimulateRecord,
    "demo": records.DemoRecord,
    "gates history": GatesHistoryRecord,
    "gates simulate": records.GatesSimulateRecord,
    "trend add": records.TrendAddRecord,
    "trend list": records.TrendListRecord,
    "trend show": records.TrendShowRecord,
    "trend compare": records.TrendCompareRecord,
    "trend watch": records.TrendWatchRecord,
    "report": records.ReportRecord,
}


def results() -> dict[str, Any]:
    """Class of the result of every verb that has one."""
    return {v: getattr(import_module(f"asflown.{room}"), name) for v, (room, name) in _RESULTS.items()}


def schemas() -> dict[str, dict[str, Any]]:
    """Every verb's schema, by verb."""
    found = {verb: json_schema(verb, r.RECORD, r.OLD_KEYS) for verb, r in results().items()}
    return found | {verb: json_schema(verb, record) for verb, record in _RECORDS.items()}


def file_of(verb: str) -> str:
    """Name of the file that holds a verb's schema."""
    return f"{verb.replace(' ', '-')}.json"


def shipped(verb: str) -> dict[str, Any]:
    """The schema of a verb as it was shipped."""
    return json.loads((resources.files("asflown") / "schemas" / file_of(verb)).read_text(encoding="utf-8"))


def text_of(schema: dict[str, Any]) -> str:
    return json.dumps(schema, indent=1) + "\n"


if __name__ == "__main__":
    folder = Path(str(resources.files("asflown"))) / "schemas"
    folder.mkdir(exist_ok=True)
    for verb, schema in schemas().items():
        (folder / file_of(verb)).write_text(text_of(schema), encoding="utf-8")
