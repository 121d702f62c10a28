"""The verbs `gates watch` and `gates predict`."""

from __future__ import annotations

from pathlib import Path

import typer

from .maneuver_options import AGAINST, ENGINE, FILE, WITHOUT, maneuvers_from, past_named
from .options import JSON, PLOT_DIR, hashes
from .output import print_doubts, print_json, provenance, say


def watch(
    file: Path = FILE,
    engine: str = ENGINE,
    first: str = typer.Option(None, "--from", help="First burn to be watched; after the fifteenth unless given."),
    against: str = AGAINST,
    false_alarm: float = typer.Option(0.05, "--false-alarm", help="Share of watches as long that raise a false alarm."),
    without: str = WITHOUT,
    plot_dir: Path = PLOT_DIR,
    json: bool = JSON,
) -> None:
    """Each new burn against the model before it: outliers, cumulated sums, the change point, and what could have been seen.  Exit 3 on alarm."""
    from ..estimate.gates import watch_maneuvers
    from ..kit.files import check_folder

    if plot_dir is not None:
        check_folder(plot_dir)
    burns = maneuvers_from(file, engine, without)
    result = watch_maneuvers(burns, first=first, against=past_named(against, burns.engine[0]), false_alarm=false_alarm)
    options = {"engine": engine, "from": first, "against": against, "false_alarm": false_alarm, "without": without}
    if plot_dir is not None:
        from ..plots.figure import save_figures
        from ..plots.maneuvers import degradation_figure, watch_figure

        for path in save_figures(
            {"watch": watch_figure(result), "degradation": degradation_figure(result, burns)}, plot_dir
        ):
            say(f"wrote {path}")
    if json:
        print_json(
            {"command": "gates watch"}
            | result.record()
            | {"provenance": provenance({burns.source: burns.sha256} | hashes(against), options)}
        )
    else:
        print(result)
        print_doubts(result.doubts)
    if result.verdict == "alarm":
        raise typer.Exit(3)


def predict(
    plan: Path = typer.Argument(help="Burns to come: a table with id and dv, or expected_dv and craft_x."),
    by: str = typer.Option(
        None, "--by", help="A model of the history, as in rcs/2012-1, or the JSON of an earlier fit."
    ),
    past: Path = typer.Option(None, "--past", help="Executed maneuvers, to which a model is fitted."),
    engine: str = ENGINE,
    model: str = typer.Option("mean-aware", "--model", help="Of the fit: estimated-bias, zero-mean or mean-aware."),
    samples: int = typer.Option(0, "--samples", min=0, max=1_000_000, help="Errors drawn of every burn, for --out."),
    out: Path = typer.Option(None, "--out", help="Where to write them (CSV, TVC axes)."),
    seed: int = typer.Option(0, "--seed", min=0, help="Of the samples."),
    json: bool = JSON,
) -> None:
    """Execution errors to be expected of burns yet to be flown: means, covariances, the 95 % ellipsoid, samples."""
    from ..estimate.gates import fit_gates
    from ..estimate.gates import predict as predicted
    from ..kit.errors import BadInput
    from ..kit.files import check_place
    from ..maneuvers.plan import load_plan

    if (by is None) == (past is None):
        raise BadInput(
            "it takes one source of a model",
            remedy="Name a model (--by rcs/2012-1) or executed maneuvers (--past FILE).",
        )
    if (samples > 0) != (out is not None):
        raise BadInput("samples and their file go together", remedy="Give --samples N --out FILE.csv.")
    if out is not None:
        check_place(out)
    burns = load_plan(plan)
    if past is not None:
        executed = maneuvers_from(past, engine, None)
        source = fit_gates(executed, model=model)
        if not source.known:
            raise BadInput(
                f"{len(executed)} burns cannot carry a model",
                file=past,
                remedy="Name a model of the history with --by.",
            )
    else:
        source = past_named(by, engine or "")
    result = predicted(burns, source)
    if out is not None:
        _write_samples(result, samples, seed, out)
        say(f"wrote {out}")
    options = {"by": by, "past": past, "engine": engine, "model": model, "samples": samples}
    if json:
        origin = provenance({burns.source: burns.sha256} | hashes(past, by), options, seed if samples else None)
        print_json({"command": "gates predict"} | result.record() | {"provenance": origin})
        return
    print(result)
    print_doubts(result.doubts)


def _write_samples(result, count: int, seed: int, out: Path) -> None:
    import csv
    import io

    import numpy as np

    from ..kit.files import write_text

    rng = np.random.default_rng(seed)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["id", "sample", "error_x [m/s]", "error_y [m/s]", "error_z [m/s]"])
    for b in result.burns:
        writer.writerows([b.id, k + 1, *map(repr, row)] for k, row in enumerate(b.samples(count, rng).tolist()))
    write_text(out, text.getvalue())
