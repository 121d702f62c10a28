"""The verb `trend watch`."""

from __future__ import annotations

import typer

from ..options import JSON
from ..output import print_doubts, print_json, provenance, wrapped
from ..verb import verb
from .store_options import FIGURE, KIND, LIMIT, STORE, WHOSE, weighed_all, without_password
from .tables import print_newest


@verb
def watch(
    store: str = STORE,
    figure: str = FIGURE,
    event: str = typer.Option(None, "--event", help="Judge this event, without later ones; the newest unless given."),
    kind: str | None = KIND,
    craft: str = WHOSE,
    limit: list[str] = LIMIT,
    json: bool = JSON,
) -> None:
    """Judge the newest actuation against the earlier ones: pass, watch or alarm, and why.  Exit code 3 on alarm."""
    from ...trends.board import health_in
    from ...trends.entry import BEST
    from ...trends.record import cycles_record, figure_record, shape_record
    from ...trends.verdicts import ORDER

    (health,) = weighed_all([health_in(store, craft, kind, limit, until=event)])
    verdict, reasons = health.verdict, list(health.reasons)
    figures = [f for f in health.figures if f.newest is not None and f.basis in BEST]
    if figure is not None:
        figures = [health.figure(figure)]
        verdict, reasons = figures[0].verdict, list(figures[0].reasons)
    if json:
        print_json({
            "command": "trend watch", "craft": health.craft, "kind": health.kind, "event": health.entries[-1].event,
            "verdict": verdict, "reasons": reasons, "figures": [figure_record(f) for f in figures],
            "shape": shape_record(health), "cycles": cycles_record(health), **health.doubts.record(),
            "provenance": provenance({}, {"store": without_password(store), "figure": figure, "event": event, "limit": limit}),
        })  # fmt: skip
    else:
        print(f"{verdict.upper()}: {health.craft}, {health.kind}, {health.entries[-1].event}")
        for r in reasons:
            print(wrapped("  ", r))
        print_newest(health, figures)
        print_doubts(health.doubts)
    if verdict == ORDER[-1]:
        raise typer.Exit(3)
