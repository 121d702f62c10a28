"""The verbs `inertia FILE` and `inertia plan`."""

from __future__ import annotations

from pathlib import Path

import typer

from . import inertia_history, inertia_plan
from .groups import FitUnlessNamed
from .options import (
    CHANNELS,
    CRAFT,
    EXCLUDE,
    INERTIA,
    JSON,
    KEEP_AS,
    KEEP_IN,
    START,
    STOP,
    check_picture,
    craft_from,
    hashes,
    telemetry_from,
)
from .output import keep, print_doubts, print_json, progress, provenance, say

app = typer.Typer(
    cls=FitUnlessNamed,
    help="The inertia tensor and the external torque from slews: `asflown inertia FILE` (its options: asflown inertia FILE --help).",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("history", short_help="Tensors estimated and predicted over the mission.")(inertia_history.history)
app.command("plan", short_help="Which slew would tell most of what is not known yet.")(inertia_plan.plan)


@app.command("fit", short_help="What `asflown inertia FILE` does: the tensor from a file.")
def fit(
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
    from ..estimate.inertia import inertia_tensor
    from ..kit.quantities import quantity

    check_picture(plot)
    ship = craft_from(craft, inertia, None)
    scales = quantity(wheel_error, ""), quantity(rate_error, "")
    telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
    result = inertia_tensor(
        telemetry, ship, method=method, frame=frame, wheel_scale=scales[0], rate_scale=scales[1], progress=progress()
    )
    options = {"craft": craft, "method": method, "frame": frame, "wheel_error": wheel_error, "rate_error": rate_error,
               "start": start, "stop": stop, "inertia": inertia}  # fmt: skip
    origin = provenance(inputs | hashes(craft), options)
    if store is not None:
        from ..trends.entries import inertia_entry

        keep(store, inertia_entry(result, telemetry, ship, name, origin))
    if plot is not None:
        from ..plots.inertia import save_inertia_figure

        save_inertia_figure(result, plot)
        say(f"wrote {plot}")
    if json:
        print_json({"command": "inertia"} | result.record() | {"provenance": origin})
        return
    print(result)
    print_doubts(result.doubts)
