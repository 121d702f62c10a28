"""The verb `gates watch`."""

from __future__ import annotations

from pathlib import Path

import typer

from ..job import Job
from ..options import JSON, PLOT_DIR
from ..verb import verb
from .options import AGAINST, COLUMNS, ENGINE, FILE, WITHOUT, maneuvers_from, past_named


@verb
def watch(
    context: typer.Context,
    file: Path = FILE,
    engine: str = ENGINE,
    first: str = typer.Option(None, "--from", help="First burn to be watched; after the fifteenth unless given."),
    against: str = AGAINST,
    false_alarm: float = typer.Option(0.05, "--false-alarm", help="Share of watches as long that raise a false alarm."),
    without: str = WITHOUT,
    columns: Path = COLUMNS,
    plot_dir: Path = PLOT_DIR,
    json: bool = JSON,
) -> None:
    """Each new burn against the model before it: outliers, cumulated sums, the change point, and what could have been seen.  Exit 3 on alarm."""
    from ...estimate.gates import gates_watch
    from ...kit.result import inputs_of
    from ...plots.gates_watch import watch_figures

    job = Job(context)
    burns = maneuvers_from(file, engine, without, columns)
    past = past_named(against, burns.engine_name)
    result = gates_watch(burns, first=first, against=past, false_alarm=false_alarm)
    job.finish(result, inputs=inputs_of(against), figures=watch_figures, failed=result.verdict == "alarm")
