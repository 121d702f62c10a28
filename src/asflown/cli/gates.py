"""The verb `gates`."""

from __future__ import annotations

import typer

from .options import JSON
from .output import print_doubts, print_json, provenance

app = typer.Typer(
    help="How well an engine executes its maneuvers: the Gates model.", no_args_is_help=True, rich_markup_mode=None
)


@app.command(short_help="Cassini's models and biases through the years.")
def history(
    engine: str = typer.Option(None, "--engine", help="main-engine or rcs; both unless given."), json: bool = JSON
) -> None:
    """Cassini's execution-error models and biases from launch to 2012, as published."""
    from asflown.kit.errors import BadInput
    from asflown.maneuvers.history import MAIN_ENGINE, RCS, engine_called
    from asflown.maneuvers.history import history as models

    kind = None if engine is None else engine_called(engine)
    if engine is not None and kind is None:
        raise BadInput(f"the history holds no engine {engine!r}", remedy=f"Name {MAIN_ENGINE} or {RCS}.")
    chosen = [m for m in models() if kind in (None, m.engine)]
    doubts = list(dict.fromkeys(f"{m.engine} {', '.join(m.names)}: {d}" for m in chosen for d in m.doubts))
    if json:
        print_json({"command": "gates history", "models": [m.record() for m in chosen], "doubts": doubts,
                    "provenance": provenance({}, {"engine": engine})})  # fmt: skip
        return
    print_history(chosen)
    print_doubts(doubts)


def print_history(models) -> None:
    """Sigmas and biases, a model a line, in the units of the tables."""
    print(
        f"  {'1-sigma, pointing per axis':30s} {'magnitude':>15s}   {'pointing':>15s}  {'bias: magnitude':>16s}  {'X':>14s}  {'Y':>14s}"
    )
    print(
        f"  {'':30s} {'%':>7s} {'mm/s':>7s}   {'mrad':>7s} {'mm/s':>7s}  {'%':>7s} {'mm/s':>8s}  {'mrad':>7s} {'mm/s':>6s}  {'mrad':>7s} {'mm/s':>6s}"
    )
    for m in models:
        g = m.model
        (fx, fy), (px, py) = g.pointing_bias_fixed_mps, g.pointing_bias_proportional_rad
        sigmas = f"{100 * g.magnitude_proportional:7.2f} {1e3 * g.magnitude_fixed_mps:7.1f}   {1e3 * g.pointing_proportional_rad:7.1f} {1e3 * g.pointing_fixed_mps:7.1f}"
        biases = (
            f"  {100 * g.bias_proportional:7.2f} {1e3 * g.bias_fixed_mps:8.1f}  {1e3 * px:7.1f} {1e3 * fx:6.1f}  {1e3 * py:7.1f} {1e3 * fy:6.1f}"
            if m.bias_known else ""
        )  # fmt: skip
        print(f"  {m.engine:11s} {', '.join(m.names):18s} {sigmas}{biases}")
