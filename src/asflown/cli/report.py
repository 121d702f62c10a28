"""The verb `report`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import JSON
from .output import print_json, provenance, say, wrapped
from .trend.store_options import LIMIT, WHOSE, weighed_all, without_password
from .verb import Asked, verb


@verb
def report(
    store: str = typer.Argument(help="A trend store: a path (SQLite) or a URL."),
    out: Path = typer.Option(..., "--out", help="The page (HTML); the same as JSON is written to the same folder."),
    craft: str = WHOSE,
    limit: list[str] = LIMIT,
    json: bool = JSON,
) -> None:
    """Write one page for the anomaly board: verdict, trends, overlays, cold and warm, devices, provenance."""
    from ..report.page import write_report
    from ..report.pictures import check_page
    from ..trends.board import healths_in

    check_page(out, inputs=[store], force=Asked.force)
    healths = weighed_all(healths_in(store, craft, limit))
    origin = provenance({}, {"store": without_password(store), "craft": craft, "limit": list(limit)})
    twin, record = write_report(healths, out, origin)
    if json:
        print_json(record)
        return
    for h in healths:
        print(f"{h.verdict.upper()}: {h.craft}, {h.kind}, {len(h.entries)} events, newest {h.entries[-1].event}")
        for r in h.reasons:
            print(wrapped("  ", r))
    say(f"wrote {out} and {twin}")
