"""The verb `gates history`."""

from __future__ import annotations

import typer

from ..job import Job
from ..options import JSON
from ..verb import verb


@verb
def history(
    context: typer.Context,
    engine: str = typer.Option(None, "--engine", help="main-engine or rcs; both unless given."),
    json: bool = JSON,
) -> None:
    """Cassini's execution-error models and biases from launch to 2012, as published."""
    from ...maneuvers.history import gates_history

    Job(context).finish(gates_history(engine=engine))
