"""The verb `torque`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import (
    CHANNELS,
    CM,
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


def torque(
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option(
        None, "--method", help="fused (default), momentum, transfer or polynomial; --variant printed: momentum."
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: the papers' way, faults included."
    ),
    axis: str = typer.Option("all", "--axis", help="x, y, z or all (body axes)."),
    model: str = typer.Option(None, "--model", help="Loop model of the transfer method: low, hankel or full."),
    order: int = typer.Option(12, "--order", help="Order of the polynomial method: 6, 12, 15 or 18."),
    window: float = typer.Option(
        None, "--window", help="Full width of the local fits [s], in place of the studied one."
    ),
    prior: str = typer.Option(
        None, "--prior", help="Torque of the fused method: edges (default: lines with corners), matern or wiener."
    ),
    loop: str = typer.Option(
        None, "--loop", help="Controller of the fused method: modelled, or measured by what the actuators did."
    ),
    consider: str = typer.Option(
        None, "--consider", help='One sigma of what is taken as known, as in "inertia=0.03,delay_s=0.2" (fused).'
    ),
    impulse: str = typer.Option(None, "--impulse", help='Angular impulse between two times [s], as in "60,141".'),
    moving: str = typer.Option("auto", "--moving", help="Mechanism whose inertia is taken off: a name, none, or auto."),
    compare: bool = typer.Option(False, "--compare", help="Set the other methods beside the chosen one."),
    start: str = START,
    stop: str = STOP,
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    inertia: str = INERTIA,
    cm: str = CM,
    out: Path = typer.Option(None, "--out", help="Write the torque as CSV."),
    plot: Path = typer.Option(None, "--plot", help="Draw the torque (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """Reconstruct the disturbance torque on the body from telemetry."""
    from rich.console import Console

    from ..estimate.torque import compare_torques, disturbance_torque
    from ..kit.files import check_place

    if out is not None:
        check_place(out)
    check_picture(plot)
    ship = craft_from(craft, inertia, cm)
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    if impulse is not None:  # before the work; the torque's own span may be shorter, and is asked again
        _span_of(impulse, *telemetry.seconds(telemetry.span()))
    mechanism = None if moving == "none" else moving
    considered = _sigmas(consider)
    # seconds for an event, minutes for an orbit at 1 Hz: say that something happens, to a terminal only
    with Console(stderr=True).status("fitting and smoothing", spinner="line"):
        result = disturbance_torque(
            telemetry,
            ship,
            method=method,
            variant=variant,
            axis=axis,
            model=model,
            order=order,
            window_s=window,
            prior=prior,
            loop=loop,
            considered=considered,
            moving=mechanism,
        )
    if impulse is not None:
        result = _with_impulse(result, impulse)
    comparisons, others = [], []
    if compare:
        others = _others(telemetry, ship, result, mechanism)
        comparisons = [compare_torques(result, o, "xyz"[j]) for o in others for j in result.axes]
    options = {
        "craft": craft, "method": result.method, "variant": variant, "axis": axis, "model": model, "order": order, "window_s": window, "prior": prior,
        "loop": loop, "consider": consider, "impulse": impulse, "moving": moving, "start": start, "stop": stop, "inertia": inertia, "cm": cm,
    }  # fmt: skip
    origin = provenance(inputs | hashes(craft), options)
    if out is not None:
        from ..estimate.torque import save_csv

        save_csv(result, out, origin)
    if plot is not None:
        from ..plots.torque import save_torque_figure

        save_torque_figure([result, *others], plot)
    for written in (out, plot):
        if written is not None:
            say(f"wrote {written}")
    if json:
        record = {"command": "torque"} | result.record() | {"provenance": origin}
        if compare:
            record["comparison"] = [c.record() for c in comparisons]
        print_json(record)
        return
    print(result)
    for c in comparisons:
        print(c)
    print_doubts(result.doubts)


def _sigmas(text: str | None) -> dict[str, float] | None:
    """'inertia=0.03,delay_s=0.2' -> numbers by name."""
    from ..kit.errors import BadInput

    if text is None:
        return None
    found = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise BadInput(
                f"--consider {part.strip()!r} is not a name and a number", remedy='Write it as in "inertia=0.03,kp=0".'
            ) from None
    return found


def _span_of(text: str, first_s: float, last_s: float) -> tuple[float, float]:
    """'60,141' -> two times within a record. [s]"""
    from ..kit.errors import BadInput
    from .options import numbers_of

    span = numbers_of(text, "--impulse")
    if len(span) != 2 or not first_s <= span[0] < span[1] <= last_s:
        raise BadInput(
            f"--impulse {text!r} is not a span of this result",
            remedy=f"Give two times between {first_s:g} and {last_s:g} s from the epoch, the earlier first.",
        )
    return span[0], span[1]


def _with_impulse(result, text: str):
    """The result with the angular impulse of a span about every axis asked for."""
    from dataclasses import replace

    span = _span_of(text, result.time_s[0], result.time_s[-1])
    return replace(result, impulses=tuple((*span, "xyz"[j], *result.impulse(*span, "xyz"[j])) for j in result.axes))


def _others(telemetry, ship, result, mechanism):
    """Every other method and variant that this telemetry allows."""
    from ..estimate.torque import disturbance_torque
    from ..kit.errors import BadInput

    found = []
    for method, variant in (("momentum", "corrected"), ("momentum", "printed"), ("transfer", "corrected"),
                            ("transfer", "printed"), ("polynomial", "corrected"), ("fused", "corrected")):  # fmt: skip
        if (method, variant) == (result.method, result.variant):
            continue
        try:
            found.append(
                disturbance_torque(telemetry, ship, method=method, variant=variant, axis=result.axis, moving=mechanism)
            )
        except BadInput as why:
            say(f"not compared, {method} {variant}: {str(why).splitlines()[0]}")
    return found
