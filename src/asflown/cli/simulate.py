"""The verb `simulate`."""

from __future__ import annotations

from pathlib import Path

import typer

from .job import Job
from .options import CM, INERTIA, JSON
from .output import progress
from .verb import Asked, verb


@verb
def simulate(
    context: typer.Context,
    scenario: str = typer.Argument(
        help="A shipped scenario (profile-1, cover-deploy, …), a mission (cassini-mission), or a TOML file."
    ),
    folder: Path = typer.Option(
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
    from ..kit.result import inputs_of
    from ..sim.flight import check_flight, fly, write_flight
    from ..sim.mission import is_mission
    from ..sim.scenario import load_scenario

    job = Job(context)
    changes = changes_of(settings or (), "--set")
    if is_mission(scenario):
        if changes:
            raise BadInput(
                "--set changes a scenario, and this is a mission", remedy="Copy its TOML and change it there."
            )
        _simulate_mission(job, scenario, folder, seed, noise)
        return
    plan = load_scenario(scenario).changed(**changes)
    check_flight(folder, force=Asked.force, inputs=job.inputs)
    flight = fly(plan, craft=job.craft_named(craft or plan.craft), seed=seed, noise=noise, progress=progress())
    files = write_flight(flight, folder, force=Asked.force)

    def text() -> None:
        print(f"{flight.scenario.name}: {flight.ended} (seed {flight.seed}, noise {flight.scenario.noise})")
        for path in files.values():
            print(f"  {path}")

    record = {"scenario": flight.scenario.name, "files": files, "seed": flight.seed, "ended": flight.ended}
    job.tell(
        record, flight.doubts, text, inputs=inputs_of(scenario, craft), options={"set": settings}, seed=flight.seed
    )


def _simulate_mission(job: Job, name: str, folder: Path, seed: int | None, noise: str | None) -> None:
    from ..kit.doubts import Doubts, doubt_from
    from ..kit.result import inputs_of
    from ..sim.mission import check_mission, fly_mission, load_mission

    mission, craft = load_mission(name), job.given["craft"]
    vehicle = job.craft_named(craft or mission.craft)
    check_mission(folder, mission, force=Asked.force, inputs=job.inputs)
    done = fly_mission(mission, folder, craft=vehicle, seed=seed, noise=noise, progress=progress(), force=Asked.force)
    events, truth = folder / "events.toml", folder / "mission.json"

    def text() -> None:
        counts = f"{done['flown']} flown of {done['listed']} listed"
        print(f"{done['mission']}: {counts} (seed {done['seed']}, noise {done['noise']})\n  {events}\n  {truth}")

    record = {
        "mission": done["mission"], "events": events, "flown": done["flown"], "listed": done["listed"], "truth": truth,
        "seed": done["seed"],
    }  # fmt: skip
    doubts = Doubts(doubt_from(dict(d)) for d in done["doubts_detail"])
    job.tell(record, doubts, text, inputs=inputs_of(name, craft), options={"set": None}, seed=done["seed"])
