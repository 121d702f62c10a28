"""The verb `jets`."""

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
def jets(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    flyby: str = FLYBY,
    closest_approach: str = CLOSEST,
    craft: str = CRAFT,
    axis: str = AXIS,
    method: str = METHOD,
    sources: str = typer.Option(None, "--sources", help='Which of "Alexandria,Cairo,Damascus"; all unless given.'),
    widths: str = typer.Option("own", "--widths", help="Each jet its own, or one common."),
    fit: str = typer.Option(
        "momentum",
        "--fit",
        help="To momentum; forward: through the loop to all telemetry; printed: the plume paper's simplex.",
    ),
    power: float = typer.Option(
        1.0, "--power", help="n of exp(-(angle/width)^n): 1 as in the plume paper's eq 26, 2 as in its eq 24."
    ),
    angle: str = typer.Option("plane", "--angle", help="From a jet's axis: in the flyby's plane, or in space."),
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
    plot: Path = typer.Option(None, "--plot", help="Draw jets and density (SVG, PNG or PDF by its suffix)."),
    plot_dir: Path = PLOT_DIR,
    json: bool = JSON,
) -> None:
    """Densities and widths of a plume's jets, from what they did to a craft, and which of them the telemetry identifies."""
    from ..estimate.jets import jets as fitted_jets
    from ..plots.flyby import flyby_figures

    job = Job(context)
    telemetry = job.telemetry()
    path, of_path = flyby_from(job, telemetry)
    result = fitted_jets(
        telemetry,
        job.craft,
        path,
        closest_approach,
        names=None if sources is None else [n.strip() for n in sources.split(",")],
        sources=sources_from(source, path),
        widths=widths,
        fit=fit,
        power=power,
        angle=angle,
        **drag_from(job),
    )
    job.finish(
        result,
        inputs=of_path,
        options={"flyby": path.name},
        figures=lambda _: flyby_figures(result.density, telemetry, result),
    )
