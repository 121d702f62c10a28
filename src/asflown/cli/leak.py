"""The verb `leak`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import CHANNELS, CM, CRAFT, EXCLUDE, INERTIA, INERTIA_SIGMA, JSON, SPIN_SIGMA, START, STOP, UNLIKE
from .verb import verb


@verb
def leak(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option(
        "likelihood", "--method", help="Whose alarm counts: likelihood, or threshold (the papers' monitor)."
    ),
    false_alarms: float = typer.Option(0.01, "--false-alarms", help="Alarms an hour that noise alone may raise."),
    window: float = typer.Option(
        600.0, "--window", help="Age in s at which the smallest leak found is stated; the papers' monitor's duration."
    ),
    momentum: float = typer.Option(
        None, "--momentum", help="The papers' monitor's threshold in N m s; by default what gives the same rate."
    ),
    thrust: str = typer.Option(None, "--thrust", help='Of each thruster, as in "0.69 N"; the craft\'s on the date.'),
    thrust_sigma: float = typer.Option(
        None, "--thrust-sigma", help="One sigma of all thrusters together, as a share; 0.1."
    ),
    unlike: float = UNLIKE,
    pulse_scatter: float = typer.Option(
        None, "--pulse-scatter", help="One sigma of one pulse against another, as a share; 0.03."
    ),
    cm: str = CM,
    cm_sigma: str = typer.Option(
        None, "--cm-sigma", help='Its sigma; "0.02 0.02 0.02 m", or "0.1 0.1 0.5 m" without --cm.'
    ),
    inertia: str = INERTIA,
    inertia_sigma: float = INERTIA_SIGMA,
    spin_sigma: float = SPIN_SIGMA,
    torque_sigma: str = typer.Option(
        None, "--torque-sigma", help='One sigma of the steady external torque; "3e-6 N m".'
    ),
    torque_walk: str = typer.Option(None, "--torque-walk", help='One sigma of its change in an hour; "1e-6 N m".'),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    follow: bool = typer.Option(False, "--follow", help="Watch a CSV that is being written, until an alarm."),
    patience: float = typer.Option(
        60.0, "--patience", help="With --follow: seconds without a new line after which the record is at its end."
    ),
    plot: Path = typer.Option(None, "--plot", help="Draw momentum, statistic and posterior (SVG, PNG or PDF)."),
    json: bool = JSON,
) -> None:
    """Leaking and weak thrusters, from momentum that orders do not explain.  Exit code 3 on an alarm."""
    job = Job(context)
    watch = _watch(job)
    if follow:
        _followed(watch, file, patience, job.telemetry)
    else:
        watch.take(job.telemetry(), final=True)
    result = watch.result()
    job.finish(result, failed=result.alarm)


def _watch(job: Job):
    """The monitor that the options ask for."""
    from ..estimate.leak import LeakWatch, leak_known
    from ..kit.quantities import numbers, quantity

    given = job.given
    thrust, center, torque, walk = (given[n] for n in ("thrust", "cm_sigma", "torque_sigma", "torque_walk"))
    known = leak_known(
        job.craft,
        thrust_share=given["thrust_sigma"],
        each_share=given["unlike"],
        pulse_share=given["pulse_scatter"],
        center_of_mass_m=None if center is None else numbers(center, "m", 3),
        inertia_share=given["inertia_sigma"],
        spin_share=given["spin_sigma"],
        torque_Nm=None if torque is None else quantity(torque, "N m"),
        torque_in_an_hour_Nm=None if walk is None else quantity(walk, "N m"),
    )
    return LeakWatch(
        job.craft,
        method=given["method"],
        false_alarms_per_hour=given["false_alarms"],
        window_s=given["window"],
        thrust_N=None if thrust is None else quantity(thrust, "N"),
        momentum_Nms=given["momentum"],
        known=known,
    )


def _followed(watch, file: Path, patience: float, read) -> None:
    """Take the file as it grows, until an alarm or its end."""
    from ..kit.errors import BadInput
    from ..telemetry.growing import growing

    for telemetry, last in growing(file, read, patience_s=patience):
        try:
            if watch.take(telemetry, final=last):
                return
        except BadInput:
            if last:  # before the end it may only be too short
                raise
