"""The verb `sources`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, KEEP_AS, KEEP_IN, START, STOP, numbers_of


def sources(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    sources: str = typer.Option(
        None,
        "--sources",
        help="Those looked for, of dipole,sunlight,drag,constant; by default all whose vectors are known, the constant where needed.",
    ),
    without: str = typer.Option(None, "--without", help='Those left out, as in "constant,drag".'),
    air: str = typer.Option(
        None, "--air", help='F10.7 of the day before, its 81-day mean and Ap, for NRLMSIS: "150,145,12"; else exponential.'
    ),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    out: Path = typer.Option(None, "--out", help="Write contributions and torque over time (.csv, .parquet), or all (.json)."),
    plot: Path = typer.Option(None, "--plot", help="Draw contributions, their sum and the residual (SVG, PNG or PDF)."),
    json: bool = JSON,
) -> None:
    """What the torque is made of: residual dipole, sunlight, drag, a constant torque, gravity gradient."""
    from ..estimate.environment import Air
    from ..estimate.sources import sources as sources_of
    from ..kit.errors import BadInput

    def entry(result, name):
        from ..trends.entries import sources_entry

        return sources_entry(result, telemetry, job.craft, name)

    job = Job(context)
    given = None
    if air is not None:
        three = numbers_of(air, "--air")
        if len(three) != 3 or min(three) < 0:
            raise BadInput(f"--air {air!r} is not three numbers", remedy='Give F10.7, its 81-day mean and Ap: --air "150,145,12".')
        given = Air(*three)
    telemetry = job.telemetry()
    result = sources_of(telemetry, job.craft, which=_names(sources), without=_names(without) or (), air=given)
    job.finish(result, entry=entry)


def _names(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(n.strip() for n in text.split(",") if n.strip())
