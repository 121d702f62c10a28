"""The verb `inertia history`."""

from __future__ import annotations

import typer

from ..job import Job
from ..options import CRAFT, JSON
from ..output import say
from ..verb import verb


@verb
def history(
    context: typer.Context,
    craft: str = CRAFT,
    store: str = typer.Option(None, "--store", help="Put the estimates into a trend store: a path (SQLite) or a URL."),
    json: bool = JSON,
) -> None:
    """Tensors estimated and predicted over the mission, as the craft file has them (Feldman and Lee, Table 1)."""
    from ...estimate.inertia import inertia_history

    job = Job(context)
    result = inertia_history(job.craft)
    if store is not None:
        from ...trends.entries import history_entries
        from ...trends.store import TrendStore

        with TrendStore.open(store) as trends:
            kept = trends.add(history_entries(job.craft))
        say(f"kept {len(kept)} estimates")
    job.finish(result)
