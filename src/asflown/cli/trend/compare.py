"""The verb `trend compare`."""

from __future__ import annotations

import typer

from ..options import JSON
from ..output import print_doubts, print_json, provenance
from ..verb import verb
from .store_options import FIGURE, KIND, STORE, WHOSE, weighed_all, without_password
from .tables import print_cold_warm, print_two


@verb
def compare(
    first: str = typer.Argument(None, help="An event to compare with a second one; cold and warm pairs unless given."),
    second: str = typer.Argument(None),
    store: str = STORE,
    figure: str = FIGURE,
    kind: str | None = KIND,
    craft: str = WHOSE,
    margin: float = typer.Option(
        15.0, "--margin", min=0.1, max=100, help="Difference within which both count as equivalent [%]."
    ),
    json: bool = JSON,
) -> None:
    """Test whether cold actuations and the warm ones after them are equivalent within a margin; or compare two events."""
    from ...kit.errors import BadInput
    from ...trends.board import health_in
    from ...trends.record import cold_warm_record, two_record

    if (first is None) != (second is None):
        raise BadInput(
            "a comparison needs two events", remedy="Name two events, or none to compare cold and warm ones."
        )
    (health,) = weighed_all([health_in(store, craft, kind, [], margin=margin / 100)])
    record = cold_warm_record(health) if first is None else two_record(health, first, second)
    if figure is not None:
        health.figure(figure)
        for key in ("equivalence", "figures"):
            if key in record:
                record[key] = [r for r in record[key] if r["figure"] == figure]
    if json:
        print_json({
            "command": "trend compare", "craft": health.craft, "kind": health.kind, **record, **health.doubts.record(),
            "provenance": provenance({}, {"store": without_password(store), "margin_percent": margin, "figure": figure}),
        })  # fmt: skip
        return
    print_two(record) if first else print_cold_warm(record)
    print_doubts(health.doubts)
