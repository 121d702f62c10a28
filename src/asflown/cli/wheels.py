"""The verb `wheels`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import CHANNELS, CRAFT, EXCLUDE, JSON, KEEP_AS, KEEP_IN, START, STOP


def wheels(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    run_down: str = typer.Option(
        None, "--run-down", help='Wheels whose motor is off in all of the window, as in "RWA1,RWA2".'
    ),
    low_speed: str = typer.Option("300 rpm", "--low-speed", help="Below it a wheel dwells (assumed: 300 rpm)."),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    plot: Path = typer.Option(None, "--plot", help="Draw rates and drag (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """Bearing drag of every wheel, drag spikes, dwell at low speed, zero crossings and revolutions."""
    from ..estimate.wheels import wheels as drag_of_wheels
    from ..kit.quantities import quantity

    def entry(result, name):
        from ..trends.entries import wheel_entry

        return wheel_entry(result, telemetry, job.craft, name)

    job = Job(context)
    low = quantity(low_speed, "rad/s")
    named = () if run_down is None else tuple(n.strip() for n in run_down.split(","))
    telemetry = job.telemetry()
    job.finish(drag_of_wheels(telemetry, job.craft, low_speed_rad_s=low, run_down=named), entry=entry)
