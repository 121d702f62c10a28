"""The verb `wheels`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from .job import Job
from .options import CHANNELS, CRAFT, EXCLUDE, JSON, KEEP_AS, KEEP_IN, START, STOP
from .output import progress, say
from .verb import verb

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..estimate.wheels import WheelsResult
    from ..telemetry.telemetry import Telemetry
    from ..trends.entry import Entry


@verb
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

    job = Job(context)
    low = quantity(low_speed, "rad/s")
    named = (*(run_down or ()), *(() if run_downs is None else (str(run_downs),)))
    lists = inputs_of(*(n for n in named if n.lower().endswith(".csv")))
    keeping = _Entries(job)
    if len(files) == 1 and run_downs is None:
        telemetry = job.telemetry(files[0])
        result = drag_of_wheels(telemetry, job.craft, low_speed_rad_s=low, run_down=named)
        keeping.take(result, telemetry)
    else:
        records = _each(files, job)
        result = wheels_of_records(records, job.craft, low_speed_rad_s=low, run_down=named, each=keeping.take)
    keeping.say_guessed()
    job.finish(result, inputs=lists, entry=lambda _, __: keeping.found)


class _Entries:
    """What the store is to keep of each record, where there is one: an entry of it, or one of every run-down listed."""

    def __init__(self, job: Job):
        self.job, self.given = job, job.given
        self.found: list[Entry] = []
        self.guessed: set[str] = set()

    def take(self, result: WheelsResult, telemetry: Telemetry) -> None:
        if self.given["store"] is None:
            return
        from ..kit.timeline import utc_label
        from ..trends.entries import run_down_entries, wheel_entry

        name, guesses = self.given["name"], self.given["store_guesses"]
        self.guessed.update(w.name for w in result.wheels if w.is_guessed)
        if self.given["run_downs"] is not None:
            self.found += run_down_entries(result, telemetry, self.job.craft, name, guesses=guesses)
            return
        if len(self.given["files"]) > 1:
            name = f"{name or 'wheels'}-{utc_label(telemetry.span()[0])}"
        self.found.append(wheel_entry(result, telemetry, self.job.craft, name, guesses=guesses))

    def say_guessed(self) -> None:
        if self.guessed and not self.given["store_guesses"]:
            say(
                f"not kept, since their run-downs are only guessed: drag of {', '.join(sorted(self.guessed))} "
                "(name them with --run-down, or give --store-guesses)"
            )


def _each(files: list[Path], job: Job) -> Iterator[Telemetry]:
    """One record after another, told as they come."""
    tell = progress() or (lambda _: None)
    for number, file in enumerate(files, start=1):
        tell(f"{number} of {len(files)}: {file}")
        yield job.telemetry(file)
