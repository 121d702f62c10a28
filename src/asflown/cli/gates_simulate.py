"""The verb `gates simulate`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import JSON
from .output import print_json, provenance, say


def simulate(
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
    out: Path = typer.Option(..., "--out", help="The table (CSV)."),
    json: bool = JSON,
) -> None:
    """Maneuvers of log-uniform sizes, executed by a model and reconstructed by an assumed orbit determination."""
    from dataclasses import replace

    import numpy as np

    from ..kit.errors import BadInput
    from ..kit.files import check_place
    from ..kit.quantities import quantity
    from ..kit.timeline import utc_to_tai_ns
    from ..maneuvers.history import RCS, past_model
    from ..maneuvers.write import write_maneuvers
    from ..sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute

    check_place(out)
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
        made = replace(made, tai_ns=utc_to_tai_ns(start) + 864_000_000_000_000 * np.arange(burns.count))
    write_maneuvers(made, out)
    doubts = ["sizes are log-uniform and the orbit determination is assumed: no paper gives either"]
    if json:
        print_json({
            "command": "gates simulate", "out": str(out), "count": burns.count, "engine": burns.engine, "truth": past.model.record(),
            "weaker": share, "last": last if weaker else 0, "doubts": doubts,
            "provenance": provenance({}, {"by": by, "count": count, "weaker": weaker, "last": last, "start": start}, seed),
        })  # fmt: skip
        return
    say(f"wrote {out}")
