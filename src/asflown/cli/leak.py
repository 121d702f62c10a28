"""The verb `leak`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import (
    CHANNELS,
    CM,
    CRAFT,
    EXCLUDE,
    INERTIA,
    INERTIA_SIGMA,
    JSON,
    SPIN_SIGMA,
    START,
    STOP,
    UNLIKE,
    check_picture,
    craft_from,
    hashes,
    telemetry_from,
)
from .output import print_doubts, print_json, provenance, say


def leak(
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
        None, "--torque-sigma", help='Of the steady torque from outside, "3e-6 N m" unless given.'
    ),
    torque_walk: str = typer.Option(
        None, "--torque-walk", help='By how much that walks in an hour, "1e-6 N m" unless given.'
    ),
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
    from ..estimate.leak import LeakWatch, known_for
    from ..kit.quantities import numbers, quantity

    check_picture(plot)
    ship = craft_from(craft, inertia, cm)
    watch = LeakWatch(
        ship,
        method=method,
        false_alarms_per_hour=false_alarms,
        window_s=window,
        thrust_N=None if thrust is None else quantity(thrust, "N"),
        momentum_Nms=momentum,
        known=known_for(
            ship,
            thrust_share=thrust_sigma,
            each_share=unlike,
            pulse_share=pulse_scatter,
            center_of_mass_m=None if cm_sigma is None else numbers(cm_sigma, "m", 3),
            inertia_share=inertia_sigma,
            spin_share=spin_sigma,
            torque_Nm=None if torque_sigma is None else quantity(torque_sigma, "N m"),
            torque_in_an_hour_Nm=None if torque_walk is None else quantity(torque_walk, "N m"),
        ),
    )
    if follow:
        _followed(watch, file, patience, lambda part: telemetry_from(part, channels, exclude, start, stop, ship)[0])
        inputs = hashes(file, channels, exclude)
    else:
        telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
        watch.take(telemetry, final=True)
    result = watch.result()
    if plot is not None:
        from ..plots.leak import save_leak_figure

        save_leak_figure(result, plot)
        say(f"wrote {plot}")
    if json:
        options = {"craft": craft, "method": method, "false_alarms": false_alarms, "window": window, "momentum": momentum,
                   "thrust": thrust, "thrust_sigma": thrust_sigma, "unlike": unlike, "pulse_scatter": pulse_scatter, "cm": cm,
                   "cm_sigma": cm_sigma, "inertia": inertia, "inertia_sigma": inertia_sigma, "spin_sigma": spin_sigma,
                   "torque_sigma": torque_sigma, "torque_walk": torque_walk, "start": start, "stop": stop, "follow": follow}  # fmt: skip
        print_json({"command": "leak"} | result.record() | {"provenance": provenance(inputs | hashes(craft), options)})
    else:
        print(result)
        print_doubts(result.doubts)
    if result.alarm:
        raise typer.Exit(3)


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
