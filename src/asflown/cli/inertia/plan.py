"""The verb `inertia plan`."""

from __future__ import annotations

from pathlib import Path

import typer

from ..job import Job
from ..options import CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, START, STOP
from ..verb import verb


@verb
def plan(
    context: typer.Context,
    file: Path = typer.Argument(None, help="What has been flown; left out: nothing."),
    craft: str = CRAFT,
    angle: str = typer.Option("25 deg", "--angle", help="Angle of the turn."),
    rate: str = typer.Option("2 mrad/s", "--rate", help="Its largest rate; less where the wheels cannot give it."),
    acceleration: str = typer.Option("2e-5 rad/s2", "--acceleration", help="Its angular acceleration."),
    at: str = typer.Option(
        None, "--at", help="Date of the craft where no file is given (UTC); the latest unless given."
    ),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    json: bool = JSON,
) -> None:
    """The slew that would tell most of the inertia tensor, and the sigmas it would leave."""
    from ...estimate.inertia import slew_plan
    from ...kit.quantities import quantity

    job = Job(context)
    result = slew_plan(
        job.craft,
        None if file is None else job.telemetry(),
        angle_rad=quantity(angle, "rad"),
        rate_rad_s=quantity(rate, "rad/s"),
        acceleration_rad_s2=quantity(acceleration, "rad/s2"),
        date=at,
    )
    job.finish(result)
