"""The verb `gates simulate`."""

from __future__ import annotations

from pathlib import Path

import typer

from ...kit.doubts import Doubts, Kind, Severity
from ..job import Job
from ..options import JSON
from ..output import say
from ..verb import verb

#: From burn to burn, where a start is given.
_TEN_DAYS_NS = 864_000_000_000_000

ASSUMED = Kind(
    "cli.assumed-burns", Severity.NOTE,
    "sizes are drawn log-uniformly and the orbit determination's sigmas are assumed: the paper gives neither",
)  # fmt: skip


@verb
def simulate(
    context: typer.Context,
    by: str = typer.Option("rcs/2012-1", "--by", help="A model of the history, biases as found."),
    count: int = typer.Option(
        None, "--count", min=1, max=100_000, help="How many; as many as the 2012-1 model was made of unless given."
    ),
    weaker: str = typer.Option(None, "--weaker", help='Share by which the last burns fall short, as in "3 %".'),
    last: int = typer.Option(3, "--last", min=1, help="How many do."),
    start: str = typer.Option(
        None, "--start", help="UTC of the first burn; the others follow every ten days. Without it there are no times."
    ),
    seed: int = typer.Option(0, "--seed", min=0),
    table: Path = typer.Option(..., "--out", help="The table (CSV)."),
    json: bool = JSON,
) -> None:
    """Maneuvers of log-uniform sizes, executed by a model and reconstructed by an assumed orbit determination."""
    from dataclasses import replace

    import numpy as np

    from ...kit.errors import BadInput
    from ...kit.quantities import quantity
    from ...kit.timeline import utc_to_tai_ns
    from ...maneuvers.history import RCS, past_model
    from ...maneuvers.write import MANEUVERS, write_maneuvers
    from ...sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute

    job = Job(context)
    job.may_write(table, MANEUVERS)
    past = past_model(by)
    burns = RCS_SET if past.engine == RCS else MAIN_ENGINE_SET
    burns = replace(burns, count=count or burns.count)
    share = 0.0 if weaker is None else quantity(weaker, "")
    if not 0 <= share < 1:
        raise BadInput(f"--weaker {weaker!r} is not a share", remedy='Write it as in "3 %", between 0 and 100 %.')
    short = np.zeros(burns.count)
    if weaker is not None:
        short[-last:] = share
    made = execute(past.model, burns, seed, weaker=short)
    if start is not None:
        made = replace(made, tai_ns=utc_to_tai_ns(start) + _TEN_DAYS_NS * np.arange(burns.count))
    write_maneuvers(made, table)
    record = {
        "out": str(table), "count": burns.count, "engine": burns.engine, "truth": past.model.record(), "weaker": share,
        "last": last if weaker else 0,
    }  # fmt: skip
    doubts = Doubts([ASSUMED()]) + past.doubts.passed_on_by("model")
    job.tell(record, doubts, lambda: say(f"wrote {table}"), seed=seed)
