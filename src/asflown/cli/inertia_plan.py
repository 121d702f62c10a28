"""The verb `inertia plan`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import CHANNELS, CRAFT, EXCLUDE, INERTIA, JSON, START, STOP, craft_from, hashes, telemetry_from
from .output import print_doubts, print_json, provenance


def plan(
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
    from ..estimate.inertia import plan_slew, what_was_flown
    from ..kit.quantities import quantity
    from ..kit.timeline import utc_to_tai_ns

    ship = craft_from(craft, inertia, None)
    turn = {
        "angle": quantity(angle, "rad"), "rate": quantity(rate, "rad/s"), "acceleration": quantity(acceleration, "rad/s2"),
    }  # fmt: skip
    if file is None:
        inputs: dict[str, str] = {}
        result = plan_slew(ship.at(None if at is None else int(utc_to_tai_ns(at))), **turn)
    else:
        telemetry, inputs = telemetry_from(file, channels, exclude, start, stop, ship)
        now, flown = what_was_flown(telemetry, ship)
        result = plan_slew(now, **flown, **turn)
    if json:
        options = {"craft": craft, "angle": angle, "rate": rate, "acceleration": acceleration, "at": at, "start": start,
                   "stop": stop, "inertia": inertia}  # fmt: skip
        print_json(
            {"command": "inertia plan"} | result.record() | {"provenance": provenance(inputs | hashes(craft), options)}
        )
        return
    print(result)
    print_doubts(result.doubts)
