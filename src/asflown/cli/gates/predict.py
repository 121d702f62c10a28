"""The verb `gates predict`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..job import Job
from ..options import JSON
from ..output import say
from ..verb import verb
from .options import ENGINE, maneuvers_from, past_named

if TYPE_CHECKING:
    from ...estimate.gates import GatesPredictionResult

#: Heading of the table of samples, by which such a table is known.
_HEADING = "id,sample,error_x [m/s],error_y [m/s],error_z [m/s]"


@verb
def predict(
    context: typer.Context,
    plan: Path = typer.Argument(help="Burns to come: a table with id and dv, or expected_dv and craft_x."),
    by: str = typer.Option(
        None, "--by", help="A model of the history, as in rcs/2012-1, or the JSON of an earlier fit."
    ),
    past: Path = typer.Option(None, "--past", help="Executed maneuvers, to which a model is fitted."),
    engine: str = ENGINE,
    model: str = typer.Option("mean-aware", "--model", help="Of the fit: estimated-bias, zero-mean or mean-aware."),
    samples: int = typer.Option(0, "--samples", min=0, max=1_000_000, help="Errors drawn of every burn, for --out."),
    table: Path = typer.Option(None, "--out", help="Where to write them (CSV, TVC axes)."),
    seed: int = typer.Option(0, "--seed", min=0, help="Seed of the samples."),
    json: bool = JSON,
) -> None:
    """Execution errors to be expected of burns yet to be flown: means, covariances, the 95 % ellipsoid, samples."""
    from ...estimate.gates import gates, gates_prediction
    from ...kit.errors import BadInput
    from ...kit.result import inputs_of
    from ...maneuvers.plan import load_plan

    if (by is None) == (past is None):
        raise BadInput(
            "exactly one source of a model is needed",
            remedy="Name a model (--by rcs/2012-1) or executed maneuvers (--past FILE).",
        )
    if (samples > 0) != (table is not None):
        raise BadInput("--samples and --out go together", remedy="Give --samples N --out FILE.csv.")
    job = Job(context)
    if table is not None:
        job.may_write(table, "samples", ours=_is_samples(table))
    burns = load_plan(plan)
    source = past_named(by, engine) if past is None else gates(maneuvers_from(past, engine), model=model)
    result = replace(gates_prediction(burns, source), seed=seed if samples else None)
    if table is not None:
        _write_samples(result, samples, seed, table)
        say(f"wrote {table}")
    job.finish(result, inputs=inputs_of(by))


def _is_samples(table: Path) -> bool:
    if not table.is_file():
        return False
    with table.open("rb") as file:
        return file.readline(200).decode("utf-8", "replace").rstrip() == _HEADING


def _write_samples(result: GatesPredictionResult, count: int, seed: int, table: Path) -> None:
    import csv
    import io

    import numpy as np

    from ...kit.files import write_text

    rng = np.random.default_rng(seed)
    text = io.StringIO()
    text.write(f"{_HEADING}\n")
    writer = csv.writer(text, lineterminator="\n")
    for b in result.burns:
        writer.writerows([b.id, k + 1, *map(repr, row)] for k, row in enumerate(b.samples(count, rng).tolist()))
    write_text(table, text.getvalue())
