"""The verb `density`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, START, STOP, craft_from, hashes, telemetry_from
from .output import print_doubts, print_json, provenance, say


def density(
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    flyby: str = typer.Option(..., "--flyby", help="Of Enceladus: E3, E4, E5 or E9."),
    closest_approach: str = typer.Option(..., "--closest-approach", help="UTC, or seconds from the file's epoch."),
    craft: str = CRAFT,
    axis: str = typer.Option(
        None, "--axis", help="About which gas turns the craft: x, y or z; that of the craft's arm unless given."
    ),
    method: str = typer.Option(
        None, "--method", help="Of the torque: fused (default), momentum, transfer, polynomial."
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: 004's constant and errors (E3)."
    ),
    area: str = typer.Option(None, "--area", help='Projected area, as in "18.4 m2"; the craft\'s unless given.'),
    arm: str = typer.Option(None, "--arm", help='Moment arm, as in "0.85 m"; the craft\'s unless given.'),
    velocity: str = typer.Option(
        None, "--velocity", help='Direction of flight "x,y,z" in body axes; with --up takes the gravity gradient off.'
    ),
    up: str = typer.Option(None, "--up", help='From the moon to the craft at closest approach, "x,y,z" in body axes.'),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    plot: Path = typer.Option(None, "--plot", help="Draw the density (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """Density of the gas that a craft meets in a flyby, from the torque it exerts."""
    from asflown.estimate.density import density as density_of
    from asflown.kit.files import check_place
    from asflown.kit.quantities import plain_numbers, quantity

    if plot is not None:
        from asflown.plots.figure import picture_kind

        check_place(plot)
        picture_kind(plot)
    ship = craft_from(craft, inertia, None)
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    result = density_of(
        telemetry,
        ship,
        flyby,
        closest_approach,
        axis=axis,
        method=method,
        variant=variant,
        area_m2=None if area is None else quantity(area, "m2"),
        arm_m=None if arm is None else quantity(arm, "m"),
        velocity_B=None if velocity is None else plain_numbers(velocity, 3, "--velocity"),
        up_B=None if up is None else plain_numbers(up, 3, "--up"),
    )
    if plot is not None:
        from asflown.plots.density import save_density_figure

        save_density_figure(result, plot)
        say(f"wrote {plot}")
    if json:
        options = {"craft": craft, "flyby": result.flyby.name, "closest_approach": closest_approach, "axis": result.axis,
                   "method": result.method, "variant": variant, "area": area, "arm": arm, "velocity": velocity, "up": up,
                   "start": start, "stop": stop, "inertia": inertia}  # fmt: skip
        record = {"command": "density"} | result.record()
        print_json(record | {"provenance": provenance(inputs | hashes(craft), options)})
        return
    print(result)
    print_doubts(result.doubts)
