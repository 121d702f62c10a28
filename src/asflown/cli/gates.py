"""The verb `gates`: fit, watch, predict and history."""

from __future__ import annotations

from pathlib import Path

import typer

from .gates_simulate import simulate
from .gates_watch import predict, watch
from .groups import FitUnlessNamed
from .maneuver_options import AGAINST, ENGINE, FILE, WITHOUT, held, maneuvers_from, past_named, removed_bias
from .options import CRAFT, JSON, KEEP_AS, KEEP_IN, PLOT_DIR, craft_from, hashes
from .output import keep, print_doubts, print_json, provenance, say

app = typer.Typer(
    cls=FitUnlessNamed, help="How well an engine executes its maneuvers: `asflown gates FILE` fits a Gates model and judges it.",
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@app.command(short_help="Fit a model and judge it; `fit` may be left out.")
def fit(
    file: Path = FILE,
    engine: str = ENGINE,
    model: str = typer.Option("estimated-bias", "--model", help="estimated-bias, zero-mean or mean-aware."),
    likelihood: str = typer.Option("additive", "--likelihood", help="additive, robust, printed or unweighted."),
    hold: list[str] = typer.Option(
        [],
        "--hold",
        help='A term kept: "pointing_fixed=0 mm/s", "pointing_fixed=2000", "pointing=2000"; may be repeated.',
    ),
    prior: str = typer.Option(
        None,
        "--prior",
        help="An earlier model whose sigmas are taken as a prior: as in 2008-01, or an earlier fit's JSON.",
    ),
    prior_width: float = typer.Option(0.5, "--prior-width", help="Its width, in parts of each sigma."),
    against: str = AGAINST,
    without: str = WITHOUT,
    patch: str = typer.Option(
        None, "--patch", help="First burn flown after a patch: compare the burns before and after it."
    ),
    removed: str = typer.Option(
        None, "--removed", help='Bias it took out, as in "-4 mm/s" or "-4 mm/s, 0.03 %"; taken out of the burns before.'
    ),
    bootstrap: int = typer.Option(0, "--bootstrap", min=0, max=100_000, help="Parametric refits."),
    seed: int = typer.Option(0, "--seed", min=0, help="Of bootstrap and envelopes."),
    craft: str = CRAFT,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    plot_dir: Path = PLOT_DIR,
    report: Path = typer.Option(
        None, "--report", help="One page (HTML) with verdict, tables and figures; its JSON twin beside it."
    ),
    json: bool = JSON,
) -> None:
    """Fixed and proportional sigmas and biases of magnitude and pointing, with intervals, outliers, influence and doubts."""
    from ..estimate.gates import across_patch, fit_gates, judge_gates
    from ..kit.errors import BadInput
    from ..kit.files import check_folder

    if removed is not None and patch is None:
        raise BadInput(
            "--removed without --patch", remedy="Name the first burn after the patch, as in --patch OTM-330."
        )
    if plot_dir is not None:
        check_folder(plot_dir)
    if report is not None:
        from ..report.gates_page import check_report

        check_report(report)
    burns = maneuvers_from(file, engine, without)
    whose = burns.engine[0]
    compared = None
    if patch is not None:
        burns, compared = across_patch(burns, patch, *removed_bias(removed))
    earlier = past_named(prior, whose)
    result = fit_gates(
        burns, model=model, likelihood=likelihood, hold=held(hold, whose), prior=None if earlier is None else earlier.model,
        prior_width=prior_width, bootstrap=bootstrap, seed=seed,
    )  # fmt: skip
    judged = judge_gates(result, against=past_named(against, whose), seed=seed)
    doubts = [*result.doubts, *judged.doubts, *(compared.doubts if compared else ())]
    options = {
        "engine": engine, "model": model, "likelihood": likelihood, "hold": hold, "prior": prior, "prior_width": prior_width,
        "against": against, "without": without, "patch": patch, "removed": removed, "bootstrap": bootstrap, "craft": craft,
    }  # fmt: skip
    record = {
        "command": "gates", **result.record(), **judged.record(), "patch": None if compared is None else compared.record(),
        "doubts": doubts, "provenance": provenance({burns.source: burns.sha256} | hashes(prior, against), options, seed),
    }  # fmt: skip
    if store is not None:
        from ..trends.entries import gates_entry

        keep(store, gates_entry(result, craft_from(craft, None, None), name, record["provenance"]))
    if plot_dir is not None:
        from ..plots.figure import save_figures
        from ..plots.maneuvers import gates_figures

        for path in save_figures(gates_figures(result, judged), plot_dir):
            say(f"wrote {path}")
    if report is not None:
        from ..report.gates_page import write_gates_report

        say(f"wrote {report} and {write_gates_report(result, judged, compared, record, report)}")
    if json:
        print_json(record)
        return
    print(result)
    print(judged)
    if compared is not None:
        print(compared)
    print_doubts(doubts)


app.command(short_help="Each new burn against the model before it: exit 3 on alarm.")(watch)
app.command(short_help="Maneuvers executed by a model, as a table.")(simulate)
app.command(short_help="Errors to be expected of burns yet to be flown.")(predict)


@app.command(short_help="Cassini's models and biases through the years.")
def history(
    engine: str = typer.Option(None, "--engine", help="main-engine or rcs; both unless given."), json: bool = JSON
) -> None:
    """Cassini's execution-error models and biases from launch to 2012, as published."""
    from ..kit.errors import BadInput
    from ..maneuvers.history import MAIN_ENGINE, RCS, engine_called
    from ..maneuvers.history import history as models

    kind = None if engine is None else engine_called(engine)
    if engine is not None and kind is None:
        raise BadInput(f"the history holds no engine {engine!r}", remedy=f"Name {MAIN_ENGINE} or {RCS}.")
    chosen = [m for m in models() if kind in (None, m.engine)]
    doubts = list(dict.fromkeys(f"{m.engine} {', '.join(m.names)}: {d}" for m in chosen for d in m.doubts))
    if json:
        print_json({"command": "gates history", "models": [m.record() for m in chosen], "doubts": doubts,
                    "provenance": provenance({}, {"engine": engine})})  # fmt: skip
        return
    print_history(chosen)
    print_doubts(doubts)


def print_history(models) -> None:
    """Sigmas and biases, a model a line, in the units of the tables."""
    print(
        f"  {'1-sigma, pointing per axis':30s} {'magnitude':>15s}   {'pointing':>15s}  {'bias: magnitude':>16s}  {'X':>14s}  {'Y':>14s}"
    )
    print(
        f"  {'':30s} {'%':>7s} {'mm/s':>7s}   {'mrad':>7s} {'mm/s':>7s}  {'%':>7s} {'mm/s':>8s}  {'mrad':>7s} {'mm/s':>6s}  {'mrad':>7s} {'mm/s':>6s}"
    )
    for m in models:
        g = m.model
        (fx, fy), (px, py) = g.pointing_bias_fixed_mps, g.pointing_bias_proportional_rad
        sigmas = f"{100 * g.magnitude_proportional:7.2f} {1e3 * g.magnitude_fixed_mps:7.1f}   {1e3 * g.pointing_proportional_rad:7.1f} {1e3 * g.pointing_fixed_mps:7.1f}"
        biases = (
            f"  {100 * g.bias_proportional:7.2f} {1e3 * g.bias_fixed_mps:8.1f}  {1e3 * px:7.1f} {1e3 * fx:6.1f}  {1e3 * py:7.1f} {1e3 * fy:6.1f}"
            if m.bias_known else ""
        )  # fmt: skip
        print(f"  {m.engine:11s} {', '.join(m.names):18s} {sigmas}{biases}")
