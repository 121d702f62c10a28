"""The entry of one record, for any estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...kit.errors import BadInput
from ...kit.timeline import utc_label
from ..entry import Entry, Value

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...kit.doubts import Doubts
    from ...telemetry.telemetry import Telemetry


def record_entry(
    kind: str, values: tuple[Value, ...], doubts: Doubts, telemetry: Telemetry, craft: Craft,
    event_id: str | None, provenance: dict,
) -> Entry:  # fmt: skip
    """The entry of one record; its date is that of the first sample, and its name too unless ``event_id`` gives one.

    Raises BadInput for telemetry without an epoch: a trend needs dates."""
    if not telemetry.dated:
        raise BadInput(
            f"the telemetry has no epoch, so its {kind} cannot enter a trend",
            file=telemetry.source or None,
            remedy="Put '# epoch: 2015-09-29T00:00:00 UTC' at the head of the file.",
        )
    date = utc_label(telemetry.span()[0])
    name = event_id or f"{kind}-{date[:10]}"
    return Entry(craft.name, name, kind, date, values=values, doubts=doubts, provenance=provenance)
