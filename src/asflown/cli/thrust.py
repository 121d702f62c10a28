"""The verb `thrust`."""

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
    KEEP_AS,
    KEEP_IN,
    SPIN_SIGMA,
    START,
    STOP,
    UNLIKE,
    check_picture,
    craft_from,
    hashes,
    telemetry_from,
)
from .output import keep, print_doubts, print_json, provenance, say


def thrust(
    files: list[Path] = typer.Argument(
        help="Telemetry of one event, or of several together: CSV, Parquet, NetCDF or HDF5."
    ),
    craft: str = CRAFT,
    method: str = typer.Option(
        "joint", "--method", help="joint, printed (001 eqs 14-23) or accelerometer (001 Appendix D)."
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="Pulse formula of printed and accelerometer: corrected, or printed."
    ),
    fall_time: str = typer.Option(None, "--fall-time", help="Fall time taken beforehand; the craft's, 65 ms."),
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
    from ..estimate.firing import priors_for
    from ..estimate.thrust import thrust as thrust_of
    from ..kit.quantities import numbers, quantity

    check_picture(plot)
    ship = craft_from(craft, inertia, cm)
    priors = priors_for(
        ship,
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
    read = [telemetry_from(f, channels, exclude, start, stop, ship) for f in files]
    telemetry = [t for t, _ in read]
    inputs = {k: v for _, found in read for k, v in found.items()}
    result = thrust_of(telemetry, ship, method=method, variant=variant, priors=priors)
    options = {"craft": craft, "method": method, "variant": variant, "fall_time": fall_time, "fall_sigma": fall_sigma, "cm": cm,
               "cm_sigma": cm_sigma, "pulse_scatter": pulse_scatter, "unlike": unlike, "spin_sigma": spin_sigma,
               "inertia_sigma": inertia_sigma, "mass": mass, "mass_sigma": mass_sigma, "start": start, "stop": stop,
               "inertia": inertia}  # fmt: skip
    origin = provenance(inputs | hashes(craft), options)
    if store is not None:
        from ..trends.entries import thrust_entry

        keep(store, thrust_entry(result, telemetry[0], ship, name, origin))
    if plot is not None:
        from ..plots.thrust import save_thrust_figure

        save_thrust_figure(result, plot)
        say(f"wrote {plot}")
    if json:
        print_json({"command": "thrust"} | result.record() | {"provenance": origin})
        return
    print(result)
    print_doubts(result.doubts)
