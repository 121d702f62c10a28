"""The verb `density`."""

from __future__ import annotations

from pathlib import Path

import typer

from .flyby_options import (
    AREA,
    ARM,
    AXIS,
    CLOSEST,
    DRAG_TABLE,
    FLYBY,
    KERNELS,
    METHOD,
    SOURCE,
    TRAJECTORY,
    UP,
    VELOCITY,
    drag_from,
    flyby_from,
    sources_from,
)
from .job import Job
from .options import CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, PLOT_DIR, START, STOP
from .verb import verb


@verb
def density(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    flyby: str = FLYBY,
    closest_approach: str = CLOSEST,
    craft: str = CRAFT,
    axis: str = AXIS,
    method: str = METHOD,
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: the plume paper's constant and errors (E3 only)."
    ),
    area: str = AREA,
    arm: str = ARM,
    drag_table: Path = DRAG_TABLE,
    source: list[str] = SOURCE,
    velocity: str = VELOCITY,
    up: str = UP,
    trajectory: Path = TRAJECTORY,
    kernels: list[Path] = KERNELS,
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    plot: Path = typer.Option(None, "--plot", help="Draw the density (SVG, PNG or PDF by its suffix)."),
    plot_dir: Path = PLOT_DIR,
    json: bool = JSON,
) -> None:
    """Density of the gas that a craft meets in a flyby, from the torque it exerts."""
    from ..estimate.density import density as gas_density
    from ..plots.flyby import flyby_figures

    job = Job(context)
    telemetry = job.telemetry()
    path, of_path = flyby_from(job, telemetry)
    given = sources_from(source, path)
    result = gas_density(telemetry, job.craft, path, closest_approach, variant=variant, sources=given, **drag_from(job))
    job.finish(
        result,
        inputs=of_path,
        options={"flyby": path.name, "axis": result.axis, "method": result.method},
        figures=lambda _: flyby_figures(result, telemetry, sources=given),
    )
