"""The verb `inertia FILE`."""

from __future__ import annotations

from pathlib import Path

import typer

from ..job import Job
from ..options import CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, KEEP_AS, KEEP_IN, START, STOP
from ..output import progress
from ..verb import verb


@verb
def fit(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option(
        "consistent", "--method", help="consistent (default), gls, all or axis: the papers' are all and axis."
    ),
    frame: str = typer.Option(
        "body", "--frame", help="Axes in which the external torque is constant: body or inertial."
    ),
    wheel_error: str = typer.Option(
        "0.24 %", "--wheel-error", help="One sigma of the wheels' common spin inertia, which scales the answer."
    ),
    rate_error: str = typer.Option(
        "0.1 %", "--rate-error", help="One sigma of the body rates' scale (assumed: 0.1 %)."
    ),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    plot: Path = typer.Option(None, "--plot", help="Draw rates, momentum and what is left (SVG, PNG or PDF)."),
    json: bool = JSON,
) -> None:
    """Inertia tensor as flown and external torque, from reaction-wheel slews."""
    from ...estimate.inertia import inertia as tensor
    from ...kit.quantities import quantity

    def entry(result, name):
        from ...trends.entries import inertia_entry

        return inertia_entry(result, telemetry, job.craft, name)

    job = Job(context)
    wheel_scale, rate_scale = quantity(wheel_error, ""), quantity(rate_error, "")
    telemetry = job.telemetry()
    result = tensor(
        telemetry,
        job.craft,
        method=method,
        frame=frame,
        wheel_scale=wheel_scale,
        rate_scale=rate_scale,
        progress=progress(),
    )
    job.finish(result, entry=entry)
