"""The entry of one inertia estimate: the tensor's elements with their total sigma, and the external torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...craft.model import Craft, tensor
from ...dynamics.rigid_body import ELEMENTS, elements_of
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.plain import finite
from ...kit.timeline import utc_label
from ...telemetry.channels import AXES
from ..entry import Entry, Value
from .of_record import record_entry

if TYPE_CHECKING:
    from ...estimate.inertia import InertiaResult
    from ...telemetry.telemetry import Telemetry

KIND = "inertia"


FROM_CRAFT_FILE = Kind(
    "trends.from-craft-file", Severity.CAUTION, "the tensor comes from the craft file ({source}), without a sigma"
)


def inertia_entry(result: InertiaResult, telemetry: Telemetry, craft: Craft, event_id: str | None = None) -> Entry:
    """The entry of one record's tensor.  Raises BadInput for telemetry without an epoch."""
    unit, torque_unit = "kg m2", "N m"
    if result.relative:
        unit, torque_unit = "per spin inertia", "rad/s^2, per unit spin inertia"
    values = [
        Value(name, "telemetry", finite(v), finite(s), unit)
        for name, v, s in zip(
            ELEMENTS, elements_of(result.inertia_kgm2), elements_of(result.inertia_sigma_kgm2), strict=True
        )
    ]
    values += [
        Value(f"external_torque_{a}", "telemetry", finite(t), finite(s), torque_unit)
        for a, t, s in zip(AXES, result.external_torque_Nm, result.external_torque_sigma_Nm, strict=True)
    ]
    return record_entry(KIND, tuple(values), result.doubts, telemetry, craft, event_id, result.provenance)


def history_entries(craft: Craft) -> list[Entry]:
    """The craft file's own estimates of its tensor, one entry a date; no sigma, since none was published."""
    known = [m for m in craft.mass_properties if m.basis == "estimated" and m.inertia is not None]
    return [
        Entry(
            craft.name, f"{KIND}-{utc_label(m.date)[:10]}", KIND, utc_label(m.date), note=m.source,
            values=tuple(
                Value(n, "telemetry", float(v), None, "kg m2") for n, v in zip(ELEMENTS, elements_of(tensor(m.inertia)), strict=True)
            ),
            doubts=Doubts([FROM_CRAFT_FILE(source=m.source)]),
        )
        for m in sorted(known, key=lambda m: m.date)
    ]  # fmt: skip
