"""The verb `inertia history`."""

from __future__ import annotations

import typer

from .options import CRAFT, JSON, craft_from, hashes
from .output import print_doubts, print_json, provenance, say


def history(
    craft: str = CRAFT,
    store: str = typer.Option(None, "--store", help="Put the estimates into a trend store: a path (SQLite) or a URL."),
    json: bool = JSON,
) -> None:
    """Tensors estimated and predicted over the mission, as the craft file has them (001 Table 1)."""
    from ..estimate.inertia import compared_history
    from ..trends.entries import history_entries

    ship = craft_from(craft, None, None)
    windows = compared_history(ship)
    if store is not None:
        from ..trends.store import TrendStore

        with TrendStore.open(store) as trends:
            kept = trends.add(history_entries(ship))
        say(f"kept {len(kept)} estimates")
    if json:
        print_json(
            {
                "command": "inertia history",
                "craft": ship.name,
                "windows": [{"date": d, "configuration": piece} | c.record() for d, piece, c in windows],
                "doubts": [] if windows else [_NONE],
                "provenance": provenance(hashes(craft), {"craft": craft}),
            }
        )
        return
    for date, piece, comparison in windows:
        print(f"{date}  {piece}")
        print(comparison)
        print_doubts(comparison.doubts)
    if not windows:
        print_doubts([_NONE])


_NONE = "the craft file holds no estimate with a prediction of the same date beside it"
