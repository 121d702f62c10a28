"""The verb `tune`."""

from __future__ import annotations

import typer

from .job import Job
from .options import CM, CRAFT, INERTIA, JSON, numbers_of
from .verb import verb


@verb
def tune(
    context: typer.Context,
    spans: str = typer.Option(None, "--spans", help='Shares of the record to try, as in "0.04,0.08,0.12".'),
    widths: str = typer.Option("30,15", "--widths", help="Rises of the injected triangles [s]."),
    noise: str = typer.Option("none", "--noise", help="none, half, nominal or double."),
    runs: int = typer.Option(4, "--runs", min=1, help="Flights a profile, where there is noise."),
    craft: str = CRAFT,
    inertia: str = INERTIA,
    cm: str = CM,
    json: bool = JSON,
) -> None:
    """Search the printed method's smoothing span as the paper did, and show what the best one balances."""
    from ..campaigns.tune import SPANS, tune

    job = Job(context)
    rises = numbers_of(widths, "--widths")
    shares = numbers_of(spans, "--spans") if spans else list(SPANS)
    result = tune(job.craft, rises=rises, spans=shares, runs=runs, noise=noise)
    job.finish(result, options={"spans": shares, "widths_s": rises})
