"""The verb `thrust`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import (
    CHANNELS,
    CM,
    CRAFT,
    EXCLUDE,
    INERTIA,
    INERTIA_SIGMA,
    JSON,
    KEEP_AS,
    KEEP_IN,
    SPIN_SIGMA,
    START,
    STOP,
    UNLIKE,
)
from .verb import verb


@verb
def thrust(
    context: typer.Context,
    files: list[Path] = typer.Argument(
        help="Telemetry of one event, or of several together: CSV, Parquet, NetCDF or HDF5."
    ),
    craft: str = CRAFT,
    method: str = typer.Option(
        "joint", "--method", help="joint, printed (Feldman & Lee eqs 14-23) or accelerometer (their Appendix D)."
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="Pulse formula of printed and accelerometer: corrected, or printed."
    ),
    fall_time: str = typer.Option(
        None, "--fall-time", help="Fall time assumed beforehand; by default the craft's, 65 ms."
    ),
    fall_sigma: str = typer.Option("13 ms", "--fall-sigma", help="Its sigma."),
    cm: str = CM,
    cm_sigma: str = typer.Option(
        None, "--cm-sigma", help='Sigma of the centre of mass, as in "0.1 0.1 0.5 m" (the default where it is given).'
    ),
    pulse_scatter: float = typer.Option(0.02, "--pulse-scatter", help="One sigma from pulse to pulse, as a share."),
    unlike: float = UNLIKE,
    spin_sigma: float = SPIN_SIGMA,
    inertia_sigma: float = INERTIA_SIGMA,
    mass: str = typer.Option(None, "--mass", help='Mass of the craft, for the accelerometer, as in "3160 kg".'),
    mass_sigma: float = typer.Option(None, "--mass-sigma", help="Its sigma, as a share; 0.001."),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    store: str = KEEP_IN,
    name: str = KEEP_AS,
    plot: Path = typer.Option(
        None, "--plot", help="Draw wheels, on-times and thrusts (SVG, PNG or PDF by its suffix)."
    ),
    json: bool = JSON,
) -> None:
    """Thrust of every thruster, fall time and centre of mass, from wheel biasing, run-downs and burns."""
    from ..estimate.firing import thrust_priors
    from ..estimate.thrust import thrust as thrust_of
    from ..kit.quantities import numbers, quantity

    def entry(result, name):
        from ..trends.entries import thrust_entry

        return thrust_entry(result, telemetry[0], job.craft, name)

    job = Job(context)
    priors = thrust_priors(
        job.craft,
        fall_s=None if fall_time is None else quantity(fall_time, "s"),
        fall_sigma_s=quantity(fall_sigma, "s"),
        center_sigma_m=None if cm_sigma is None else numbers(cm_sigma, "m", 3),
        pulse_scatter=pulse_scatter,
        unlike=unlike,
        spin_share=spin_sigma,
        inertia_share=inertia_sigma,
        mass_kg=None if mass is None else quantity(mass, "kg"),
        mass_share=mass_sigma,
    )
    telemetry = [job.telemetry(f) for f in files]
    result = thrust_of(telemetry, job.craft, method=method, variant=variant, priors=priors)
    job.finish(result, entry=entry)
