"""The verb `wheels`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import (
    CHANNELS,
    CRAFT,
    EXCLUDE,
    JSON,
    KEEP_AS,
    KEEP_IN,
    START,
    STOP,
    check_picture,
    craft_from,
    hashes,
    telemetry_from,
)
from .output import keep, print_doubts, print_json, provenance, say


def wheels(
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
    from ..estimate.wheels import wheel_drag
    from ..kit.quantities import quantity

    check_picture(plot)
    ship = craft_from(craft, None, None)
    low = quantity(low_speed, "rad/s")
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    named = () if run_down is None else tuple(n.strip() for n in run_down.split(","))
    result = wheel_drag(telemetry, ship, low_speed=low, run_down=named)
    options = {"craft": craft, "run_down": run_down, "low_speed": low_speed, "start": start, "stop": stop}
    origin = provenance(inputs | hashes(craft), options)
    if store is not None:
        from ..trends.entries import wheel_entry

        keep(store, wheel_entry(result, telemetry, ship, name, origin))
    if plot is not None:
        from ..plots.wheels import save_wheels_figure

        save_wheels_figure(result, plot)
        say(f"wrote {plot}")
    if json:
        print_json({"command": "wheels"} | result.record() | {"provenance": origin})
        return
    print(result)
    print_doubts(result.doubts)
