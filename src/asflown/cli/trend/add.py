"""The verb `trend add`."""

from __future__ import annotations

from pathlib import Path

import typer

from ...kit.escapes import visible
from ..options import CHANNELS, CM, CRAFT, INERTIA, JSON, craft_from, hashes
from ..output import print_json, provenance, wrapped
from ..verb import verb, weighed
from .store_options import FIGURES, STORE, without_password
from .tables import doubts_by_event


@verb
def add(
    events: Path = typer.Argument(help="Event list (TOML or CSV), or telemetry with the motor's current."),
    store: str = STORE,
    craft: str = CRAFT,
    inertia: str = INERTIA,
    cm: str = CM,
    channels: Path = CHANNELS,
    figures: Path = FIGURES,
    only: str = typer.Option(None, "--only", help="Ids of some events of the list, separated by commas."),
    jobs: int = typer.Option(0, "--jobs", min=0, help="Events analysed at once; 0: as many as there are cores."),
    json: bool = JSON,
) -> None:
    """Analyse actuations and store their figures of merit; an event stored before gets a further revision."""
    from dataclasses import replace

    from ...kit.doubts import Doubts
    from ...trends.store import TrendStore

    ship = craft_from(craft, inertia, cm)
    chosen, inputs = _events(events, ship, channels, only)
    TrendStore.open(store).close()  # fail before the work where the store cannot be written
    entries = analysed(chosen, ship, channels, figures, jobs)
    options = {"craft": craft, "inertia": inertia, "cm": cm, "channels": channels, "figures": figures, "only": only}
    origin = provenance(inputs | hashes(craft, channels, figures), options)
    kept_with = {
        "versions": origin["versions"],
        "options": {k: None if v is None else str(v) for k, v in options.items()},
    }
    kept_with["list"] = origin["inputs"]
    entries = [replace(e, provenance=kept_with | e.provenance, doubts=weighed(e.doubts)) for e in entries]
    with TrendStore.open(store) as trends:
        added = trends.add(entries)
    if json:
        print_json({
            "command": "trend add", "store": without_password(store), "craft": ship.name,
            "added": [
                {"event": e.event, "kind": e.kind, "date": e.date, "revision": e.revision,
                 "figures": e.known, **e.doubts.record()} for e in added
            ],
            **Doubts(d for e in added for d in e.doubts).record(), "provenance": origin,
        })  # fmt: skip
        return
    for e in added:
        kept = f"{e.known:3d} figures" if e.values else "date only"
        print(f"  {e.event:24s} {e.date[:10]}  revision {e.revision}  {kept}")
    for doubt, names in doubts_by_event(added).items():
        print(wrapped("  DOUBT  ", f"{doubt} ({names})"))
    print(f"{len(added)} events stored in {without_password(store)}")


def _events(path: Path, ship, channels, only: str | None):
    """Events to analyse and the inputs' SHA-256."""
    from ...kit.errors import BadInput, some_of
    from ...telemetry.load import load_telemetry
    from ...trends.entries import find_events, is_event_list, load_events

    found = (
        load_events(path) if is_event_list(path) else find_events(load_telemetry(path, channels=channels, craft=ship))
    )
    if only is not None:
        wanted = [name.strip() for name in only.split(",")]
        missing = [name for name in wanted if name not in {e.id for e in found}]
        if missing:
            raise BadInput(f"--only names {some_of(missing)}, which are not in the list", file=path,
                           remedy=f"Events of the list: {some_of(e.id for e in found)}.")  # fmt: skip
        found = [e for e in found if e.id in wanted]
    return found, hashes(path)


def analysed(events, ship, channels=None, figures=None, jobs: int = 0):
    """Entries of all events, in order; nothing is stored before all are analysed."""
    import os
    from concurrent.futures import ProcessPoolExecutor
    from functools import partial

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    work = partial(_one, ship=ship, channels=channels, figures=figures)
    jobs = min(jobs or os.cpu_count() or 1, max(1, sum(e.file is not None for e in events) // 2))
    with Progress(
        TextColumn("{task.description:36s}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=Console(stderr=True)
    ) as bar:  # fmt: skip
        task = bar.add_task("analysing", total=len(events))
        entries = []

        def take(found):
            for e in found:
                entries.append(e)
                bar.update(task, advance=1, description=visible(f"analysed {e.event}"))

        if jobs <= 1:
            take(map(work, events))
        else:
            with ProcessPoolExecutor(jobs, initializer=_leave_ctrl_c) as pool:
                take(pool.map(work, events))
    return entries


def _leave_ctrl_c() -> None:
    """Ctrl-C reaches every process of a terminal: the one that started the others answers for all."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _one(event, ship, channels, figures):
    from ...telemetry.load import load_telemetry
    from ...trends.entries import analyse, load_figures

    if figures is not None:
        load_figures(figures)
    telemetry = None if event.file is None else load_telemetry(event.file, channels=channels, craft=ship)
    return analyse(event, ship, telemetry)
