"""The verb `external-torque`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import AIR, CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, START, STOP, air_of, names_of
from .verb import verb


@verb
def external_torque(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option(
        None, "--method", help="drift (a hold) or momentum (slews too); chosen by what the file holds."
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: the paper's Appendix A with its errors (drift)."
    ),
    frame: str = typer.Option(
        "body", "--frame", help="Axes in which the torque is constant: body, or inertial (momentum)."
    ),
    turn_rate: str = typer.Option(
        None,
        "--turn-rate",
        help='Mean body rate for the drift\'s w x H, as in "0 2e-8 0 rad/s"; else from the quaternion.',
    ),
    known: str = typer.Option(
        None, "--with", help="Known torques taken off, some of gravity-gradient,sunlight,dipole,drag,rods."
    ),
    air: str = AIR,
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

    job = Job(context)
    turn = None if turn_rate is None else numbers(turn_rate, "rad/s", 3)
    result = steady_torque(
        job.telemetry(),
        job.craft,
        method=method,
        variant=variant,
        frame=frame,
        turn_rad_s=turn,
        known=names_of(known) or (),
        air=air_of(air),
    )
    job.finish(result, options={"method": result.method})
