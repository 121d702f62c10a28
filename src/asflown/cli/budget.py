"""The verb `budget`."""

from __future__ import annotations

import typer

from .job import Job
from .options import CM, CRAFT, INERTIA, JSON, numbers_of
from .verb import verb


@verb
def budget(
    context: typer.Context,
    scenario: str = typer.Argument(
        help="A shipped scenario with a torque (profile-1, cover-deploy, …) or a TOML file."
    ),
    runs: int = typer.Option(20, "--runs", min=2, help="Flights, each with its own seed."),
    methods: str = typer.Option(
        None,
        "--methods",
        help="Divided by commas: momentum, transfer, polynomial, fused; -printed for the papers' way.",
    ),
    widths: str = typer.Option(
        None, "--widths", help='Rises of the triangles to sweep [s], as in "5,7.5,10,15,30,60".'
    ),
    noise: str = typer.Option(None, "--noise", help="none, half, nominal or double."),
    seed: int = typer.Option(0, "--seed", min=0, help="The first flight's seed."),
    craft: str = CRAFT,
    inertia: str = INERTIA,
    cm: str = CM,
    json: bool = JSON,
) -> None:
    """Fly a scenario many times, reconstruct its torque, and tabulate how wrong each method is."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from ..campaigns.budget import DEFAULT_METHODS, error_budget
    from ..kit.result import inputs_of
    from ..sim.scenario import load_scenario

    job = Job(context)
    names = [m.strip() for m in methods.split(",")] if methods else list(DEFAULT_METHODS)
    rises = numbers_of(widths, "--widths") if widths else None
    plan, vehicle = load_scenario(scenario), job.craft
    with Progress(TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), console=Console(stderr=True),
                  transient=True) as bar:  # fmt: skip
        task = bar.add_task(f"{plan.name}: {runs} flights", total=runs * len(names) * len(rises or [None]))
        result = error_budget(
            plan, vehicle, names, runs=runs, seed=seed, noise=noise, rises_s=rises, tick=lambda: bar.advance(task)
        )
    job.finish(result, inputs=inputs_of(scenario), options={"methods": names, "widths_s": widths})
