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


def jets(
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    flyby: str = FLYBY,
    closest_approach: str = CLOSEST,
    craft: str = CRAFT,
    axis: str = AXIS,
    method: str = METHOD,
    sources: str = typer.Option(None, "--sources", help='Which of "Alexandria,Cairo,Damascus"; all unless given.'),
    widths: str = typer.Option("own", "--widths", help="Each jet its own, or one common."),
    fit: str = typer.Option(
        "momentum", "--fit", help="To momentum; forward: through the loop to all telemetry; printed: 004's simplex."
    ),
    power: float = typer.Option(1.0, "--power", help="n of exp(-(angle/width)^n): 1 as 004 eq 26 stands, 2 as eq 24."),
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
    """Densities and widths of a plume's jets, from what they did to a craft; what the telemetry does not tell is said."""
    from ..estimate.jets import jets as fitted_jets
    from ..kit.files import check_folder

    check_picture(plot)
    if plot_dir is not None:
        check_folder(plot_dir)
    ship = craft_from(craft, inertia, None)
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    path, of_path = flyby_from(flyby, closest_approach, trajectory, kernels, telemetry, ship)
    drag = drag_from(axis, method, area, arm, velocity, up, drag_table)
    names = None if sources is None else [n.strip() for n in sources.split(",")]
    result = fitted_jets(
        telemetry, ship, path, closest_approach, names=names, sources=sources_from(source, path), widths=widths, fit=fit,
        power=power, angle=angle, **drag,
    )  # fmt: skip
    if plot is not None:
        from ..plots.density import save_jets_figure

        save_jets_figure(result, plot)
        say(f"wrote {plot}")
    if plot_dir is not None:
        from ..plots.figure import save_figures
        from ..plots.flyby import flyby_figures

        for path in save_figures(flyby_figures(result.density, telemetry, ship, result), plot_dir):
            say(f"wrote {path}")
    if json:
        options = {"craft": craft, "flyby": result.density.flyby.name, "closest_approach": closest_approach, "axis": axis, "method": method,
                   "sources": sources, "widths": widths, "fit": fit, "power": power, "angle": angle, "area": area, "arm": arm,
                   "drag_table": drag_table, "source": source, "velocity": velocity, "up": up, "trajectory": trajectory,
                   "kernels": kernels, "start": start, "stop": stop, "inertia": inertia}  # fmt: skip
        record = {"command": "jets"} | result.record()
        print_json(record | {"provenance": provenance(inputs | of_path | hashes(craft, drag_table), options)})
        return
    print(result)
    print_doubts(result.doubts)
