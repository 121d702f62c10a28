"""The verb `gates`, or `gates fit`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..job import Job
from ..options import CRAFT, JSON, KEEP_AS, KEEP_IN, PLOT_DIR
from ..output import say
from ..verb import Asked, verb
from .options import AGAINST, COLUMNS, ENGINE, FILE, WITHOUT, held, maneuvers_from, past_named, removed_bias

if TYPE_CHECKING:
    from ...estimate.gates import GatesPatch, GatesResult
    from ...maneuvers.table import Maneuvers


HOLD = typer.Option(
    [], "--hold", help='A term kept: "pointing_fixed=0 mm/s", "pointing_fixed=2000", "pointing=2000"; may be repeated.'
)
PRIOR = typer.Option(
    None,
    "--prior",
    help="An earlier model whose sigmas are taken as a prior: as in 2008-01, or an earlier fit's JSON.",
)
PATCH = typer.Option(
    None, "--patch", help="First burn flown after a patch: compare the burns before and after it."
)  # fmt: skip
REMOVED = typer.Option(
    None, "--removed", help='Bias it took out, as in "-4 mm/s" or "-4 mm/s, 0.03 %"; taken out of the burns before.'
)
REPORT = typer.Option(
    None, "--report", help="One page (HTML) with verdict, tables and figures; its JSON twin beside it."
)  # fmt: skip


@verb
def fit(
    context: typer.Context,
    file: Path = FILE,
    engine: str = ENGINE,
    model: str = typer.Option("estimated-bias", "--model", help="estimated-bias, zero-mean or mean-aware."),
    likelihood: str = typer.Option("additive", "--likelihood", help="additive, robust, printed or unweighted."),
    hold: list[str] = HOLD,
    prior: str = PRIOR,
    prior_width: float = typer.Option(0.5, "--prior-width", help="Its width, in parts of each sigma."),
    against: str = AGAINST,
    without: str = WITHOUT,
    columns: Path = COLUMNS,
    patch: str = PATCH,
    removed: str = REMOVED,
    bootstrap: int = typer.Option(0, "--bootstrap", min=0, max=100_000, help="Parametric refits."),
    seed: int = typer.Option(0, "--seed", min=0, help="Seed of bootstrap and envelopes."),
    craft: str = CRAFT,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    plot_dir: Path = PLOT_DIR,
    report: Path = REPORT,
    json: bool = JSON,
) -> None:
    """Fixed and proportional sigmas and biases of magnitude and pointing, with intervals, outliers, influence and doubts."""
    from ...estimate.gates import gates, gates_judgement
    from ...kit.result import inputs_of
    from ...plots.gates import gates_figures

    def entry(result, name):
        from ...trends.entries import gates_entry

        return gates_entry(result, job.craft, name)

    job = Job(context)
    _check(job, patch, removed, report)
    if store is not None:
        job.craft_named(craft)  # whose entry it will be: before the work
    compared = None
    burns = maneuvers_from(file, engine, without, columns)
    if patch is not None:
        compared = _patched(burns, patch, removed)
        burns = compared.maneuvers
    whose, earlier = burns.engine_name, past_named(prior, burns.engine_name)
    fitted = gates(
        burns, model=model, likelihood=likelihood, hold=held(hold, whose), prior=earlier and earlier.model,
        prior_width=prior_width, bootstrap=bootstrap, seed=seed,
    )  # fmt: skip
    judgement = gates_judgement(fitted, against=past_named(against, whose), seed=seed)
    result = fitted.with_judgement(judgement, compared)
    inputs = inputs_of(prior, against)
    if report is not None:
        _write_report(job, result, inputs, report)
    job.finish(result, inputs=inputs, entry=entry, figures=gates_figures)


def _check(job: Job, patch: str | None, removed: str | None, report: Path | None) -> None:
    """Before the work: options that need each other, and whether the page can be written."""
    from ...kit.errors import BadInput

    if removed is not None and patch is None:
        raise BadInput(
            "--removed without --patch", remedy="Name the first burn after the patch, as in --patch OTM-330."
        )
    if report is not None:
        from ...report.pictures import check_page

        check_page(report, inputs=job.inputs, force=Asked.force)


def _patched(burns: Maneuvers, patch: str, removed: str | None) -> GatesPatch:
    from ...estimate.gates import gates_patch

    fixed, proportional = removed_bias(removed)
    return gates_patch(burns, patch, removed_fixed_mps=fixed, removed_proportional=proportional)


def _write_report(job: Job, result: GatesResult, inputs, report: Path) -> None:
    """The page, with the provenance that the verb's answer has."""
    from ...report.gates_page import write_gates_report

    told = replace(result, inputs=tuple(dict.fromkeys((*result.inputs, *inputs))), options=job.options)
    say(f"wrote {report} and {write_gates_report(told, report)}")
