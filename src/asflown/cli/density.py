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
from .options import (
    CHANNELS,
    CRAFT,
    EXCLUDE,
    INERTIA,
    JSON,
    PLOT_DIR,
    START,
    STOP,
    check_picture,
    craft_from,
    hashes,
    telemetry_from,
)
from .output import print_doubts, print_json, provenance, say


def density(
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    flyby: str = FLYBY,
    closest_approach: str = CLOSEST,
    craft: str = CRAFT,
    axis: str = AXIS,
    method: str = METHOD,
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: 004's constant and errors (E3)."
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
    from ..estimate.density import density as density_of
    from ..kit.files import check_folder

    check_picture(plot)
    if plot_dir is not None:
        check_folder(plot_dir)
    ship = craft_from(craft, inertia, None)
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    path, of_path = flyby_from(flyby, closest_approach, trajectory, kernels, telemetry, ship)
    drag = drag_from(axis, method, area, arm, velocity, up, drag_table)
    given = sources_from(source, path)
    result = density_of(telemetry, ship, path, closest_approach, variant=variant, sources=given, **drag)
    if plot is not None:
        from ..plots.density import save_density_figure

        save_density_figure(result, plot)
        say(f"wrote {plot}")
    if plot_dir is not None:
        from ..plots.figure import save_figures
        from ..plots.flyby import flyby_figures

        for path in save_figures(flyby_figures(result, telemetry, ship, sources=given), plot_dir):
            say(f"wrote {path}")
    if json:
        options = {"craft": craft, "flyby": result.flyby.name, "closest_approach": closest_approach, "axis": result.axis,
                   "method": result.method, "variant": variant, "area": area, "arm": arm, "drag_table": drag_table, "source": source,
                   "velocity": velocity, "up": up, "trajectory": trajectory, "kernels": kernels, "start": start, "stop": stop,
                   "inertia": inertia}  # fmt: skip
        record = {"command": "density"} | result.record()
        print_json(record | {"provenance": provenance(inputs | of_path | hashes(craft, drag_table), options)})
        return
    print(result)
    print_doubts(result.doubts)
