"""The verb `external-torque`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import (
    CHANNELS,
    CRAFT,
    EXCLUDE,
    INERTIA,
    JSON,
    START,
    STOP,
    check_picture,
    craft_from,
    hashes,
    telemetry_from,
)
from .output import print_doubts, print_json, provenance, say


def external_torque(
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option(
        None, "--method", help="drift (a hold) or momentum (slews too); chosen by what the file holds."
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: 001 Appendix A, faults included (drift)."
    ),
    frame: str = typer.Option(
        "body", "--frame", help="Axes in which the torque is constant: body, or inertial (momentum)."
    ),
    turn_rate: str = typer.Option(
        None,
        "--turn-rate",
        help='Mean body rate for the drift\'s w x H, as in "0 2e-8 0 rad/s"; else from the quaternion.',
    ),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    plot: Path = typer.Option(None, "--plot", help="Draw the momentum gained (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """The steady external torque on the craft, from the momentum it gains."""
    from ..estimate.external import external_torque as steady_torque
    from ..kit.quantities import numbers

    check_picture(plot)
    ship = craft_from(craft, inertia, None)
    turn = None if turn_rate is None else numbers(turn_rate, "rad/s", 3)
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    result = steady_torque(telemetry, ship, method=method, variant=variant, frame=frame, turn_rad_s=turn)
    if plot is not None:
        from ..plots.external_torque import save_external_torque_figure

        save_external_torque_figure(result, plot)
        say(f"wrote {plot}")
    if json:
        options = {"craft": craft, "method": result.method, "variant": variant, "frame": frame, "turn_rate": turn_rate,
                   "start": start, "stop": stop, "inertia": inertia}  # fmt: skip
        record = {"command": "external-torque"} | result.record()
        print_json(record | {"provenance": provenance(inputs | hashes(craft), options)})
        return
    print(result)
    print_doubts(result.doubts)
