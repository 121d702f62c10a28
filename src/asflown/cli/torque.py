"""The verb `torque`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..kit.progress import stage
from .job import Job
from .options import AIR, CHANNELS, CM, CRAFT, EXCLUDE, INERTIA, JSON, START, STOP, air_of, names_of
from .output import say
from .progress import shown
from .verb import verb

if TYPE_CHECKING:
    from ..estimate.torque import TorqueResult


@verb
def torque(
    context: typer.Context,
    file: Path = typer.Argument(help="Telemetry: CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    craft: str = CRAFT,
    method: str = typer.Option(
        None,
        "--method",
        help="fused (default), momentum, transfer, polynomial or on-times; --variant printed: momentum.",
    ),
    variant: str = typer.Option(
        "corrected", "--variant", help="corrected, or printed: the papers' method with its errors."
    ),
    axis: str = typer.Option("all", "--axis", help="x, y, z or all (body axes)."),
    model: str = typer.Option(
        None, "--model", help="Loop model of the transfer and polynomial methods: low, hankel or full (transfer)."
    ),
    order: int = typer.Option(None, "--order", help="Order of the polynomial method: 6, 12 (default), 15 or 18."),
    window: float = typer.Option(
        None, "--window", help="Full width of the local fits of momentum and transfer [s], in place of the studied one."
    ),
    prior: str = typer.Option(
        None, "--prior", help="Torque of the fused method: edges (default: lines with corners), matern or wiener."
    ),
    loop: str = typer.Option(
        None, "--loop", help="Controller of the fused method: modelled, or measured by the actuators' action."
    ),
    consider: str = typer.Option(
        None, "--consider", help='One sigma of what the fused method takes as known, as in "inertia=0.03,delay_s=0.2".'
    ),
    known: str = typer.Option(
        None, "--with", help="Known torques taken off, some of gravity-gradient,sunlight,dipole,drag,rods."
    ),
    air: str = AIR,
    impulse: str = typer.Option(None, "--impulse", help='Angular impulse between two times [s], as in "60,141".'),
    moving: str = typer.Option("auto", "--moving", help="Mechanism whose inertia is taken off: a name, none, or auto."),
    compare: bool = typer.Option(False, "--compare", help="Compare the other methods with the chosen one."),
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
    from ..estimate.torque import method_called, torque_comparison
    from ..estimate.torque import torque as torque_by

    job = Job(context)
    chosen = method_called(
        method,
        variant=variant,
        model=model,
        order=order,
        window_s=window,
        prior=prior,
        loop=loop,
        considered=_sigmas(consider),
    )
    telemetry, craft_then = job.telemetry(), job.craft
    if impulse is not None:  # before the work; the torque's own span may be shorter, and is asked again
        _span_of(impulse, *telemetry.seconds(telemetry.span()))
    mechanism = None if moving == "none" else moving
    # seconds for an event, minutes for an orbit at 1 Hz: say that something happens
    with shown(), stage("fitting and smoothing"):
        result = torque_by(
            telemetry,
            craft_then,
            method=chosen,
            axis=axis,
            moving=mechanism,
            known=names_of(known) or (),
            air=air_of(air),
        )
    if impulse is not None:
        result = _with_impulse(result, impulse)
    comparisons = []
    if compare:
        others = _others(telemetry, craft_then, result, mechanism, known=names_of(known) or (), air=air_of(air))
        result = replace(result, compared=tuple(others))
        comparisons = [torque_comparison(result, o, "xyz"[j]) for o in others for j in result.axes]
    job.finish(
        result,
        options={"method": result.method},
        more={"comparison": [c.record() for c in comparisons]} if compare else None,
        text=lambda: print(*comparisons, sep="\n") if comparisons else None,
    )


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


def _with_impulse(result: TorqueResult, text: str) -> TorqueResult:
    """The result with the angular impulse of a span about every axis asked for."""
    span = _span_of(text, result.time_s[0], result.time_s[-1])
    return result.with_impulse(*span)


def _others(telemetry, craft, result: TorqueResult, mechanism: str | None, **off) -> list[TorqueResult]:
    """Every other method and variant that this telemetry allows."""
    from ..estimate.torque import torque as torque_by
    from ..kit.errors import BadInput

    found = []
    for method, variant in (("momentum", "corrected"), ("momentum", "printed"), ("transfer", "corrected"),
                            ("transfer", "printed"), ("polynomial", "corrected"), ("fused", "corrected")):  # fmt: skip
        if (method, variant) == (result.method, result.variant):
            continue
        try:
            found.append(
                torque_by(telemetry, craft, method=method, variant=variant, axis=result.axis, moving=mechanism, **off)
            )
        except BadInput as why:
            say(f"not compared, {method} {variant}: {str(why).splitlines()[0]}")
    return found
