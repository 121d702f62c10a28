"""Fly a scenario in the closed loop: telemetry as a spacecraft would send it, and the truth beside it."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import CM, INERTIA, JSON, craft_from, hashes
from .output import print_doubts, print_json, progress, provenance


def simulate(
    scenario: str = typer.Argument(
        help="A shipped scenario (profile-1, cover-deploy, …), a mission (cassini-mission), or a TOML file."
    ),
    out: Path = typer.Option(
        ..., "--out", help="Directory for telemetry.csv, truth.csv and truth.json; of a mission, for events.toml."
    ),
    craft: str = typer.Option(None, "--craft", help="A built-in craft or a TOML file, instead of the scenario's."),
    seed: int = typer.Option(None, "--seed", min=0, help="Another draw of the noise."),
    noise: str = typer.Option(None, "--noise", help="none, half, nominal or double."),
    settings: list[str] = typer.Option(
        None, "--set", help="A value of the scenario changed, as in flyby.exponent=2; may be repeated."
    ),
    inertia: str = INERTIA,
    cm: str = CM,
    json: bool = JSON,
) -> None:
    """Fly a scenario in the closed loop: telemetry as a spacecraft would send it, and the truth beside it."""
    from ..kit.config import changes_of
    from ..kit.errors import BadInput
    from ..kit.files import check_folder
    from ..sim.flight import fly, write_flight
    from ..sim.mission import is_mission
    from ..sim.scenario import load_scenario

    check_folder(out)
    options = {"craft": craft, "noise": noise, "set": settings, "inertia": inertia, "cm": cm}
    changes = changes_of(settings or (), "--set")
    if is_mission(scenario):
        if changes:
            raise BadInput(
                "--set changes a scenario, and this is a mission", remedy="Copy its TOML and change it there."
            )
        _simulate_mission(scenario, out, seed, options, json)
        return
    plan = load_scenario(scenario).changed(**changes)
    vehicle = craft_from(craft or plan.craft, inertia, cm)
    flight = fly(plan, craft=vehicle, seed=seed, noise=noise, progress=progress())
    files = write_flight(flight, out)
    if json:
        print_json({
            "command": "simulate",
            "scenario": flight.scenario.name,
            "files": files,
            "seed": flight.seed,
            "ended": flight.ended,
            "doubts": list(flight.doubts),
            "provenance": provenance(hashes(scenario, craft), options, flight.seed),
        })  # fmt: skip
        return
    print(f"{flight.scenario.name}: {flight.ended} (seed {flight.seed}, noise {flight.scenario.noise})")
    for path in files.values():
        print(f"  {path}")
    print_doubts(flight.doubts)


def _simulate_mission(name: str, out: Path, seed: int | None, options: dict, json: bool) -> None:
    from ..sim.mission import fly_mission, load_mission

    mission = load_mission(name)
    vehicle = craft_from(options["craft"] or mission.craft, options["inertia"], options["cm"])
    done = fly_mission(mission, out, craft=vehicle, seed=seed, noise=options["noise"], progress=progress())
    events, truth = out / "events.toml", out / "mission.json"
    if json:
        print_json({
            "command": "simulate",
            "mission": done["mission"],
            "events": events,
            "flown": done["flown"],
            "listed": done["listed"],
            "truth": truth,
            "seed": done["seed"],
            "doubts": done["doubts"],
            "provenance": provenance(hashes(name, options["craft"]), options, done["seed"]),
        })  # fmt: skip
        return
    counts = f"{done['flown']} flown of {done['listed']} listed"
    print(f"{done['mission']}: {counts} (seed {done['seed']}, noise {done['noise']})\n  {events}\n  {truth}")
    print_doubts(done["doubts"])
