"""The verb `demo`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from .job import Job
from .options import JSON
from .output import provenance, say, wrapped
from .verb import Asked, verb

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..campaigns.deployment import ActuationSummary
    from ..craft.model import Craft
    from ..kit.doubts import Doubts
    from ..kit.table import Table


@verb
def demo(
    context: typer.Context,
    folder: Path = typer.Option(Path("demo-out"), "--out", help="Folder for flights and figures."),
    json: bool = JSON,
) -> None:
    """Fly the papers' test torques and a cover deployment, reconstruct them, and say how wrong each method is."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from ..campaigns.papers import PROFILES, SEED, profile_table
    from ..craft.load import load_craft

    job = Job(context)
    craft = load_craft("cassini")
    # on standard error, so that --json keeps standard output to itself
    with Progress(
        TextColumn("{task.description:44s}"), BarColumn(), TimeElapsedColumn(), console=Console(stderr=True)
    ) as bar:
        task = bar.add_task("warming up", total=9)

        def step(words: str) -> None:
            bar.update(task, description=words, advance=1)

        tables = [_profile(name, folder, craft, step) for name in PROFILES]
        cover, doubts = _cover(folder, craft, step)
        bar.update(task, description="done", completed=9)
    mission = _mission(folder / "mission", craft)

    def text() -> None:
        print("\n\n".join(map(str, [*map(profile_table, tables), cover.table("cover-deploy")])))

    def verdict() -> None:
        say(f"figures and telemetry: {folder}/")
        print(f"\n{_mission_table(mission)}")
        for reason in mission["reasons"]:
            print(wrapped("  ", reason))
        print(f"report: {mission['report']}\nverdict: {mission['verdict']}")

    record = {"tables": tables, "cover": cover.record() | doubts.record(), "mission": mission, "out": str(folder)}
    job.tell(record, doubts, text, last=verdict, options={"out": str(folder)}, seed=SEED)


def _profile(name: str, folder: Path, craft: Craft, step: Callable[[str], None]) -> dict:
    """Errors of every method for a test profile, without noise and with it; figures of the latter."""
    from ..campaigns.papers import AXIS, PROFILES, case, profile_record
    from ..plots.actuation import profile_figures

    rows = []
    for noise in ("none", "nominal"):
        step(f"{name}: flying and reconstructing, noise {noise}")
        flown = case(name, folder, craft, noise)
        rows += flown.errors()
    step(f"{name}: drawing")
    _save(profile_figures(name, PROFILES[name][1], flown.results, flown.truth, AXIS), folder)
    return profile_record(name, rows)


def _cover(folder: Path, craft: Craft, step: Callable[[str], None]) -> tuple[ActuationSummary, Doubts]:
    """A deployment in numbers, with the doubts of its fused torque; figures of it and of a stow."""
    from ..campaigns.deployment import actuation_summary, smoothed_attitude_error, smoothed_momentum, stall_time
    from ..campaigns.papers import AXIS, case
    from ..estimate.subject import subject_of
    from ..estimate.torque import torque_comparison
    from ..plots import actuation

    step("cover-deploy: flying")
    flown = case("cover-deploy", folder, craft)
    step("cover-deploy: reconstructing")
    by_momentum, by_transfer, *_, fused = flown.results
    stall_s = stall_time(flown.flight.truth.time_s, flown.flight.truth.cover_angle_rad)
    step("cover-deploy: drawing")
    figures = actuation.deployment_figures(flown.results, flown.truth, AXIS, stall_s) | {
        "fig05-wheel-rates": actuation.wheel_rates_figure(flown.telemetry),
        "fig06-body-rates": actuation.body_rates_figure(flown.telemetry),
        "fig10-attitude-error": actuation.attitude_error_figure(smoothed_attitude_error(flown.telemetry, AXIS), AXIS),
    }
    step("cover-stow: flying and drawing")
    stow = case("cover-stow", folder, craft)
    for name, title, of in (("fig07", "Deploy: wheel momentum (cover paper, Fig 7)", flown),
                            ("figB1-stow", "Stow: wheel momentum (cover paper, Fig B1)", stow)):  # fmt: skip
        momentum = smoothed_momentum(subject_of(of.telemetry, craft))
        figures[f"{name}-momentum"] = actuation.momentum_figure(momentum, title)
    _save(figures, folder)
    both = torque_comparison(by_momentum, by_transfer, AXIS)
    return actuation_summary(flown.telemetry, by_momentum, both, stall_s), fused.doubts


def _save(figures: dict, folder: Path) -> None:
    from ..kit.files import check_output
    from ..plots.figure import PICTURE, save

    for name, figure in figures.items():
        check_output(folder / f"{name}.svg", PICTURE, force=Asked.force)
        save(figure, folder / f"{name}.svg")


def _mission(folder: Path, craft: Craft) -> dict:
    """Eleven years of a cover flown, analysed, kept and judged, as `simulate`, `trend add` and `report` do; beside the truth."""
    from ..campaigns.papers import SEED
    from ..report.page import write_report
    from ..report.pictures import check_page
    from ..sim.mission import fly_mission
    from ..trends.board import healths_in
    from ..trends.entries import load_events
    from ..trends.record import figure_record
    from ..trends.store import TrendStore
    from .trend.add import analysed

    say("a mission of 20 actuations: flying")
    page = folder / "report.html"
    check_page(page, force=Asked.force)
    truth = fly_mission("cassini-mission", folder, seed=SEED, force=Asked.force)
    store = folder / "trends.db"
    entries = analysed(load_events(folder / "events.toml"), craft)
    with TrendStore.open(store) as trends:
        trends.add(entries)
    say("judging and drawing")
    healths = healths_in(str(store), None, [])
    write_report(healths, page, provenance({}, {"store": str(store)}, SEED))
    deploys = healths[0]
    wanted = {name.rpartition("_N")[0]: v for name, v in truth["law"]["change_percent"].items()}
    found = {f["figure"]: f for f in map(figure_record, deploys.figures) if f["basis"] == "fused"}
    keys = ("figure", "change_percent", "change_percent_ci95")
    changes = [{"flown_percent": v} | {k: found[name][k] for k in keys} for name, v in wanted.items()]
    return {
        "changes": changes, "verdict": deploys.verdict, "reasons": list(deploys.reasons), "report": str(page),
        "events": len(entries),
    }  # fmt: skip


def _mission_table(m: dict) -> Table:
    from ..kit.table import Table

    rows = []
    for c in m["changes"]:
        low, high = c["change_percent_ci95"]
        rows.append(
            (f"change of {c['figure']}", f"{c['flown_percent']:+.0f} %", f"{c['change_percent']:+.0f} %",
             f"{low:+.0f} to {high:+.0f} %")
        )  # fmt: skip
    title = f"mission: {m['events']} actuations in eleven years"
    return Table(title, tuple(rows), ("", "flown here", "found", "95 % interval"))
