"""The verb `budget`."""

from __future__ import annotations

import typer

from .options import CM, CRAFT, INERTIA, JSON, craft_from, hashes, numbers_of
from .output import print_doubts, print_json, provenance


def budget(
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

    from ..campaigns.budget import DEFAULT_METHODS, error_budget, of_rise, split_method
    from ..sim.scenario import load_scenario

    ship = craft_from(craft, inertia, cm)
    names = [m.strip() for m in methods.split(",")] if methods else list(DEFAULT_METHODS)
    for name in names:
        split_method(name)
    plan = load_scenario(scenario)
    plans = [(w, of_rise(plan, w)) for w in numbers_of(widths, "--widths")] if widths else [(None, plan)]
    tables = []
    with Progress(TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), console=Console(stderr=True),
                  transient=True) as bar:  # fmt: skip
        task = bar.add_task(f"{plan.name}: {runs} flights", total=runs * len(names) * len(plans))
        for rise, one in plans:
            rows = error_budget(one, ship, names, runs=runs, seed=seed, noise=noise, tick=lambda: bar.advance(task))
            tables.append((rise, rows))
    doubts = list(dict.fromkeys(f"{r.method}: {d}" for _, rows in tables for r in rows for d in r.doubts))
    if json:
        records = [r.record() | ({} if rise is None else {"rise_s": rise}) for rise, rows in tables for r in rows]
        options = {"scenario": scenario, "runs": runs, "methods": names, "widths_s": widths, "noise": noise, "craft": craft,
                   "inertia": inertia, "cm": cm}  # fmt: skip
        print_json({"command": "budget", "scenario": plan.name, "runs": runs, "rows": records, "doubts": doubts,
                    "provenance": provenance(hashes(scenario, craft), options, seed)})  # fmt: skip
        return
    for rise, rows in tables:
        print(
            f"{plan.name}, {runs} flights, noise {noise or plan.noise}"
            + (f", rise {rise:g} s" if rise is not None else "")
        )
        _print(rows)
    print_doubts(doubts)


def _print(rows) -> None:
    def share(f) -> str:
        return "     ·      " if f is None else f"{f.value:5.3f} ±{f.error:5.3f}"

    print(
        f"  {'method':18s} {'rms [mN m]':>12s} {'lag [s]':>13s}  {'68 % band':12s} {'95 % band':12s} {'at corners':12s} {'peak figure':12s}  failed"
    )
    for r in rows:
        print(f"  {r.method:18s} {1e3 * r.rms_Nm.value:6.2f} ±{1e3 * r.rms_Nm.error:4.2f} {r.lag_s.value:+7.2f} ±{r.lag_s.error:4.2f}  "
              f"{share(r.coverage_68)} {share(r.coverage_95)} {share(r.corner_coverage_95)} {share(r.peak_coverage_95)}  {r.failed:6d}")  # fmt: skip
    if any(r.peak_error_percent for r in rows):
        print("  error at the peaks [%], mean over flights (+ is too large)")
        for r in rows:
            print(f"  {r.method:18s} " + " ".join(f"{f.value:+6.1f} ±{f.error:3.1f}" for f in r.peak_error_percent))
