"""The verb `wheels`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import CHANNELS, CRAFT, EXCLUDE, JSON, KEEP_AS, KEEP_IN, START, STOP
from .output import say


def wheels(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    run_down: list[str] = typer.Option(
        None,
        "--run-down",
        help='When a motor is off: "RWA1,RWA2" in all of the window, "RW3:60-240" from 60 to 240 s, or a CSV file with the '
        "columns wheel, start, stop; repeatable.",
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
    from ..kit.quantities import quantity
    from ..kit.result import inputs_of

    def entry(result, name):
        from ..trends.entries import wheel_entry

        guessed = [w.name for w in result.wheels if w.is_guessed]
        if guessed and not store_guesses:
            say(
                f"not kept, since their run-downs are only guessed: drag of {', '.join(guessed)} "
                "(name them with --run-down, or give --store-guesses)"
            )
        return wheel_entry(result, telemetry, job.craft, name, guesses=store_guesses)

    job = Job(context)
    low = quantity(low_speed, "rad/s")
    named = tuple(run_down or ())
    lists = inputs_of(*(n for n in named if n.lower().endswith(".csv")))
    telemetry = job.telemetry()
    result = drag_of_wheels(telemetry, job.craft, low_speed_rad_s=low, run_down=named)
    job.finish(result, inputs=lists, entry=entry)
