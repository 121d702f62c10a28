"""The verbs `trend add`, `list`, `show`, `compare` and `watch`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import CHANNELS, CM, CRAFT, INERTIA, JSON, craft_from, hashes
from .output import print_doubts, print_json, provenance, say, wrapped
from .trend_tables import doubts_by_event, print_cold_warm, print_figure, print_newest, print_two, value_of

app = typer.Typer(
    help="Figures of merit of an actuator over years: keep, show, compare, watch.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

STORE = typer.Option(..., "--store", help="A path (SQLite) or a URL (sqlite:///…, postgresql://…).")
KIND = typer.Option("deploy", "--kind", help="deploy, stow, wheels, inertia, thrust or gates.")
WHOSE = typer.Option(None, "--craft", help="Which craft's, where the store holds several.")
FIGURES = typer.Option(None, "--figures", help="A Python file that declares further figures of merit.")
LIMIT = typer.Option([], "--limit", help='A figure\'s limit, as in "angular_impulse=-0.5 N m s"; may be repeated.')
FIGURE = typer.Option(None, "--figure", help="One figure of merit; all unless given.")
BASIS = typer.Option(None, "--basis", help="fused (default), 'momentum, printed', 'transfer, printed' or telemetry.")


@app.command(short_help="Analyse a list of actuations and keep the results.")
def add(
    events: Path = typer.Argument(
        help="Event list (TOML or CSV), or telemetry in which the motor's current shows them."
    ),
    store: str = STORE,
    craft: str = CRAFT,
    inertia: str = INERTIA,
    cm: str = CM,
    channels: Path = CHANNELS,
    figures: Path = FIGURES,
    only: str = typer.Option(None, "--only", help="Ids of some events of the list, divided by commas."),
    jobs: int = typer.Option(0, "--jobs", min=0, help="Events analysed at once; 0: as many as there are cores."),
    json: bool = JSON,
) -> None:
    """Analyse actuations and keep their figures of merit; an event kept before gets a further revision."""
    from dataclasses import replace

    from ..trends.store import TrendStore

    ship = craft_from(craft, inertia, cm)
    chosen, inputs = _events(events, ship, channels, only)
    TrendStore.open(store).close()  # a store that cannot be written should say so before the work
    entries = analysed(chosen, ship, channels, figures, jobs)
    options = {"craft": craft, "inertia": inertia, "cm": cm, "channels": channels, "figures": figures, "only": only}
    origin = provenance(inputs | hashes(craft, channels, figures), options)
    kept_with = {
        "versions": origin["versions"],
        "options": {k: None if v is None else str(v) for k, v in options.items()},
    }
    kept_with["list"] = origin["inputs"]
    entries = [replace(e, provenance=kept_with | e.provenance) for e in entries]
    with TrendStore.open(store) as trends:
        added = trends.add(entries)
    if json:
        print_json({
            "command": "trend add", "store": without_password(store), "craft": ship.name,
            "added": [
                {"event": e.event, "kind": e.kind, "date": e.date, "revision": e.revision,
                 "figures": e.known, "doubts": list(e.doubts)} for e in added
            ],
            "doubts": list(dict.fromkeys(d for e in added for d in e.doubts)), "provenance": origin,
        })  # fmt: skip
        return
    for e in added:
        kept = f"{e.known:3d} figures" if e.values else "its date only"
        print(f"  {e.event:24s} {e.date[:10]}  revision {e.revision}  {kept}")
    for doubt, names in doubts_by_event(added).items():
        print(wrapped("  DOUBT  ", f"{doubt} ({names})"))
    print(f"{len(added)} events kept in {without_password(store)}")


@app.command("list", short_help="Events in the store, with rests and cycles.")
def list_(store: str = STORE, figure: str = FIGURE, basis: str = BASIS, craft: str = WHOSE, json: bool = JSON) -> None:
    """Events in the store in order of date, with days since the last actuation and cycles used, both from the dates."""
    from ..kit.errors import BadInput, some_of
    from ..trends.board import entries_in
    from ..trends.entry import MOVES
    from ..trends.statistics import cycles, rests, whole_days

    entries, name = entries_in(store, craft, curves=False)
    known = {v.figure for e in entries for v in e.values}
    if figure is not None and figure not in known:
        raise BadInput(f"the store holds no figure {figure!r}", remedy=f"It holds: {some_of(sorted(known))}.")
    moves = [e for e in entries if e.kind in MOVES]
    rest = rests(moves)
    rows: list[dict] = [
        {"event": e.event, "kind": e.kind, "date": e.date, "revision": e.revision, "motor": e.motor,
         "days_since_last": whole_days(rest[e.event]) if e.event in rest else None,
         "figures": e.known, "doubts": list(e.doubts)}
        | ({} if figure is None else {"value": value_of(e, figure, basis), "figure": figure}) for e in entries
    ]  # fmt: skip
    if json:
        print_json({
            "command": "trend list", "craft": name, "events": rows, "cycles_used": cycles(moves),
            "doubts": [], "provenance": provenance({}, {"store": without_password(store), "craft": craft}),
        })  # fmt: skip
        return
    print(f"{name}: {len(rows)} events, {cycles(moves):g} cycles")
    print(f"  {'event':24s} {'date':10s} {'kind':7s} {'days since last':>15s} {'revision':>8s} {'figures':>7s}")
    for r in rows:
        since = "" if r["days_since_last"] is None else str(r["days_since_last"])
        print(
            f"  {r['event']:24s} {r['date'][:10]} {r['kind']:7s} {since:>15s} {r['revision']:8d} {r['figures'] or '':>7}"
            + ("" if r.get("value") is None else f"  {r['value']:+.4g}")
        )


@app.command(short_help="A figure over the years, with its trend.")
def show(
    store: str = STORE,
    figure: str = FIGURE,
    basis: str = BASIS,
    kind: str = KIND,
    craft: str = WHOSE,
    limit: list[str] = LIMIT,
    plot: Path = typer.Option(None, "--plot", help="Draw the figure (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """A figure over the years: robust slope and change with intervals, permutation p-value, what would have been seen."""
    from ..trends.board import health_in
    from ..trends.entry import BEST
    from ..trends.record import figure_record

    health = health_in(store, craft, kind, limit)
    found = (
        [health.figure(figure, basis)]
        if figure
        else [f for f in health.figures if f.basis in (basis or BEST[0], BEST[1])]
    )
    if plot is not None:
        from ..plots.figure import save
        from ..plots.trend import trend_figure

        save(trend_figure(found[0]), plot)
        say(f"wrote {plot}")
    if json:
        rest = {} if figure else {"figures": [figure_record(f) for f in found]}
        print_json({
            "command": "trend show", "craft": health.craft, "kind": kind, **figure_record(found[0]), **rest,
            "doubts": list(health.doubts),
            "provenance": provenance({}, {"store": without_password(store), "figure": figure, "basis": basis, "limit": limit}),
        })  # fmt: skip
        return
    for f in found:
        print_figure(f, rows=figure is not None)
    print_doubts(health.doubts)


@app.command(short_help="Cold against warm, or any two events.")
def compare(
    first: str = typer.Argument(None, help="An event, to set a second against; cold and warm pairs unless given."),
    second: str = typer.Argument(None),
    store: str = STORE,
    figure: str = FIGURE,
    kind: str = KIND,
    craft: str = WHOSE,
    margin: float = typer.Option(15.0, "--margin", min=0.1, max=100, help="Difference that counts as none [%]."),
    json: bool = JSON,
) -> None:
    """Cold actuations against the warm ones after them: certainly no more different than a margin?"""
    from ..kit.errors import BadInput
    from ..trends.board import health_in
    from ..trends.record import cold_warm_record, two_record

    if (first is None) != (second is None):
        raise BadInput("one event alone cannot be compared", remedy="Name two, or none for cold against warm.")
    health = health_in(store, craft, kind, [], margin=margin / 100)
    record = cold_warm_record(health) if first is None else two_record(health, first, second)
    if figure is not None:
        health.figure(figure)
        for key in ("equivalence", "figures"):
            if key in record:
                record[key] = [r for r in record[key] if r["figure"] == figure]
    if json:
        print_json({
            "command": "trend compare", "craft": health.craft, "kind": kind, **record, "doubts": list(health.doubts),
            "provenance": provenance({}, {"store": without_password(store), "margin_percent": margin, "figure": figure}),
        })  # fmt: skip
        return
    print_two(record) if first else print_cold_warm(record)
    print_doubts(health.doubts)


@app.command(short_help="The newest actuation against the past: exit 3 on alarm.")
def watch(
    store: str = STORE,
    figure: str = FIGURE,
    event: str = typer.Option(None, "--event", help="Judge this event, later ones put aside; the newest unless given."),
    kind: str = KIND,
    craft: str = WHOSE,
    limit: list[str] = LIMIT,
    json: bool = JSON,
) -> None:
    """Judge the newest actuation against the family of the past ones: pass, watch or alarm, and why.  Exit 3 on alarm."""
    from ..trends.board import health_in
    from ..trends.entry import BEST
    from ..trends.record import cycles_record, figure_record, shape_record
    from ..trends.verdicts import ORDER

    health = health_in(store, craft, kind, limit, until=event)
    verdict, reasons = health.verdict, list(health.reasons)
    figures = [f for f in health.figures if f.newest is not None and f.basis in BEST]
    if figure is not None:
        figures = [health.figure(figure)]
        verdict, reasons = figures[0].verdict, list(figures[0].reasons)
    if json:
        print_json({
            "command": "trend watch", "craft": health.craft, "kind": kind, "event": health.entries[-1].event,
            "verdict": verdict, "reasons": reasons, "figures": [figure_record(f) for f in figures],
            "shape": shape_record(health), "cycles": cycles_record(health), "doubts": list(health.doubts),
            "provenance": provenance({}, {"store": without_password(store), "figure": figure, "event": event, "limit": limit}),
        })  # fmt: skip
    else:
        print(f"{verdict.upper()}: {health.craft}, {kind}, {health.entries[-1].event}")
        for r in reasons:
            print(wrapped("  ", r))
        print_newest(health, figures)
        print_doubts(health.doubts)
    if verdict == ORDER[-1]:
        raise typer.Exit(3)


def _events(path: Path, ship, channels, only: str | None):
    """Events to analyse and the inputs' SHA-256."""
    from ..kit.errors import BadInput, some_of
    from ..telemetry.load import load_telemetry
    from ..trends.entries import find_events, is_event_list, load_events

    found = (
        load_events(path) if is_event_list(path) else find_events(load_telemetry(path, channels=channels, craft=ship))
    )
    if only is not None:
        wanted = [name.strip() for name in only.split(",")]
        missing = [name for name in wanted if name not in {e.id for e in found}]
        if missing:
            raise BadInput(f"--only names {some_of(missing)}, which the list does not hold", file=path,
                           remedy=f"It holds: {some_of(e.id for e in found)}.")  # fmt: skip
        found = [e for e in found if e.id in wanted]
    return found, hashes(path)


def analysed(events, ship, channels=None, figures=None, jobs: int = 0):
    """Entries of all events, in order; nothing is kept before all are sound."""
    import os
    from concurrent.futures import ProcessPoolExecutor
    from functools import partial

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    work = partial(_one, ship=ship, channels=channels, figures=figures)
    jobs = min(jobs or os.cpu_count() or 1, max(1, sum(e.file is not None for e in events) // 2))
    with Progress(
        TextColumn("{task.description:36s}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=Console(stderr=True)
    ) as bar:  # fmt: skip
        task = bar.add_task("analysing", total=len(events))
        entries = []

        def take(found):
            for e in found:
                entries.append(e)
                bar.update(task, advance=1, description=f"analysed {e.event}")

        if jobs <= 1:
            take(map(work, events))
        else:
            with ProcessPoolExecutor(jobs) as pool:
                take(pool.map(work, events))
    return entries


def _one(event, ship, channels, figures):
    from ..telemetry.load import load_telemetry
    from ..trends.entries import analyse, load_figures

    if figures is not None:
        load_figures(figures)
    telemetry = None if event.file is None else load_telemetry(event.file, channels=channels, craft=ship)
    return analyse(event, ship, telemetry)


def without_password(store: str) -> str:
    from ..trends.store import label, url_of

    return label(url_of(store))
