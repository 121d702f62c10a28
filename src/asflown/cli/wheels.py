"""The verb `wheels`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from .job import Job
from .options import CHANNELS, CRAFT, EXCLUDE, JSON, KEEP_AS, KEEP_IN, START, STOP
from .output import progress, say

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..telemetry.telemetry import Telemetry
    from ..trends.entry import Entry


def wheels(
    context: typer.Context,
    files: list[Path] = typer.Argument(
        help="Telemetry of one record, or of many, as of a month: CSV (plain or gzip), Parquet, NetCDF or HDF5."
    ),
    craft: str = CRAFT,
    run_down: list[str] = typer.Option(
        None,
        "--run-down",
        help='When a motor is off: "RWA1,RWA2" in all of the window, "RW3:60-240" from 60 to 240 s, or a CSV file with the '
        "columns wheel, start, stop; repeatable.",
    ),
    run_downs: Path = typer.Option(
        None,
        "--run-downs",
        help="CSV list of all run-downs with the columns wheel, start, stop (UTC, or seconds for one file); all must lie in the "
        "files, and --store keeps an entry of each.",
    ),
    low_speed: str = typer.Option("300 rpm", "--low-speed", help="Below it a wheel dwells (assumed: 300 rpm)."),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    store_guesses: bool = typer.Option(
        False, "--store-guesses", help="Keep drag of run-downs that only their shape shows too."
    ),
    plot: Path = typer.Option(None, "--plot", help="Draw rates and drag (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """Bearing drag of every wheel, drag spikes, dwell at low speed, zero crossings and revolutions."""
    from ..estimate.wheels import wheels as drag_of_wheels
    from ..estimate.wheels import wheels_of_records
    from ..kit.quantities import quantity
    from ..kit.result import inputs_of
    from ..kit.timeline import utc_label

    def entries(result, telemetry):
        from ..trends.entries import run_down_entries, wheel_entry

        guessed.update(w.name for w in result.wheels if w.is_guessed)
        if run_downs is not None:
            return run_down_entries(result, telemetry, job.craft, name, guesses=store_guesses)
        own = name if len(files) == 1 else f"{name or 'wheels'}-{utc_label(telemetry.span()[0])}"
        return [wheel_entry(result, telemetry, job.craft, own, guesses=store_guesses)]

    job = Job(context)
    low = quantity(low_speed, "rad/s")
    named = (*(run_down or ()), *(() if run_downs is None else (str(run_downs),)))
    lists = inputs_of(*(n for n in named if n.lower().endswith(".csv")))
    kept: list[Entry] = []
    guessed: set[str] = set()

    def done(result, telemetry):
        if store is not None:
            kept.extend(entries(result, telemetry))

    if len(files) == 1 and run_downs is None:
        telemetry = job.telemetry(files[0])
        result = drag_of_wheels(telemetry, job.craft, low_speed_rad_s=low, run_down=named)
        done(result, telemetry)
    else:
        records = _each(files, job)
        result = wheels_of_records(records, job.craft, low_speed_rad_s=low, run_down=named, each=done)
    if guessed and not store_guesses:
        say(
            f"not kept, since their run-downs are only guessed: drag of {', '.join(sorted(guessed))} "
            "(name them with --run-down, or give --store-guesses)"
        )
    job.finish(result, inputs=lists, entry=lambda _, __: kept)


def _each(files: list[Path], job: Job) -> Iterator[Telemetry]:
    """One record after another, told as they come."""
    tell = progress() or (lambda _: None)
    for number, file in enumerate(files, start=1):
        tell(f"{number} of {len(files)}: {file}")
        yield job.telemetry(file)
