"""The verb `sources`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import (
    AIR,
    CHANNELS,
    CRAFT,
    EXCLUDE,
    INERTIA,
    JSON,
    KEEP_AS,
    KEEP_IN,
    START,
    STOP,
    air_of,
    names_of,
)  # fmt: skip
from .verb import verb


@verb
def sources(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    sources: str = typer.Option(
        None,
        "--sources",
        help="Those looked for, of dipole,sunlight,drag,constant; by default all whose vectors are known, the constant torque averaged over its size.",
    ),
    without: str = typer.Option(None, "--without", help='Those left out, as in "constant,drag".'),
    air: str = AIR,
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    out: Path = typer.Option(
        None, "--out", help="Write contributions and torque over time (.csv, .parquet), or all (.json)."
    ),
    plot: Path = typer.Option(None, "--plot", help="Draw contributions, their sum and the residual (SVG, PNG or PDF)."),
    json: bool = JSON,
) -> None:
    """What the torque is made of: residual dipole, sunlight, drag, a constant torque, gravity gradient."""
    from ..estimate.sources import sources as sources_of

    def entry(result, name):
        from ..trends.entries import sources_entry

        return sources_entry(result, telemetry, job.craft, name)

    job = Job(context)
    telemetry = job.telemetry()
    result = sources_of(telemetry, job.craft, which=names_of(sources), without=names_of(without) or (), air=air_of(air))
    job.finish(result, entry=entry)
