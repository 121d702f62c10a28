"""The verb `report`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import JSON
from .output import print_json, provenance, say, wrapped
from .trend.store_options import LIMIT, WHOSE, without_password


def report(
    store: str = typer.Argument(help="A trend store: a path (SQLite) or a URL."),
    out: Path = typer.Option(..., "--out", help="The page (HTML); the same as JSON is written to the same folder."),
    craft: str = WHOSE,
    limit: list[str] = LIMIT,
    json: bool = JSON,
) -> None:
    """Write one page for the anomaly board: verdict, trends, overlays, cold and warm, devices, provenance."""
    from ..kit.errors import BadInput
    from ..kit.files import check_place

    if out.suffix.lower() not in (".html", ".htm"):
        raise BadInput("a report is an HTML page", file=out, remedy="Name it .html.")
    check_place(out)
    check_place(out.with_suffix(".json"))
    from ..report.page import write_report
    from ..trends.board import healths_in

    healths = healths_in(store, craft, limit)
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
