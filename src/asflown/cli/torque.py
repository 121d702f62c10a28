"""The verb `torque`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import CHANNELS, CM, CRAFT, EXCLUDE, INERTIA, JSON, START, STOP, craft_from, hashes, telemetry_from
from .output import print_doubts, print_json, provenance, say


def torque(
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option("momentum", "--method", help="momentum, transfer, polynomial or fused."),
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
        "edges", "--prior", help="Torque of the fused method: edges (lines with corners) or smooth."
    ),
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
    from asflown.estimate.compare import compare_torques
    from asflown.estimate.torque import disturbance_torque

    _check_places(out, plot)
    ship = craft_from(craft, inertia, cm)
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    mechanism = None if moving == "none" else moving
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
        moving=mechanism,
    )
    comparisons, others = [], []
    if compare:
        others = _others(telemetry, ship, result, mechanism)
        comparisons = [compare_torques(result, o, "xyz"[j]) for o in others for j in result.axes]
    options = {
        "craft": craft, "method": method, "variant": variant, "axis": axis, "model": model, "order": order, "window_s": window, "prior": prior,
        "moving": moving, "start": start, "stop": stop, "inertia": inertia, "cm": cm,
    }  # fmt: skip
    origin = provenance(inputs | hashes(craft), options)
    if out is not None:
        from asflown.estimate.result import save_csv

        save_csv(result, out, origin)
    if plot is not None:
        from asflown.plots.torque import save_torque_figure

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


def _check_places(out, plot) -> None:
    """Where nothing can be written, say so before the work."""
    from asflown.kit.files import check_place

    for place in (out, plot):
        if place is not None:
            check_place(place)
    if plot is not None:
        from asflown.plots.figure import picture_kind

        picture_kind(plot)


def _others(telemetry, ship, result, mechanism):
    """Every other method and variant that this telemetry allows."""
    from asflown.estimate.torque import disturbance_torque
    from asflown.kit.errors import BadInput

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
