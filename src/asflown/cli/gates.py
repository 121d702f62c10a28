"""The verb `gates`: fit and history."""

from __future__ import annotations

from pathlib import Path

import typer
from typer.core import TyperGroup

from .options import JSON
from .output import print_doubts, print_json, provenance


class _FitUnlessNamed(TyperGroup):
    """`asflown gates FILE` is `asflown gates fit FILE`: what is no verb of the group is a file or an option of the fit."""

    def parse_args(self, ctx, args):
        if args and args[0] not in self.commands and args[0] != "--help":
            args = ["fit", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_FitUnlessNamed, help="How well an engine executes its maneuvers: `asflown gates FILE` fits a Gates model.",
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

FILE = typer.Argument(help="Maneuvers: CSV (plain or gzip), Parquet or TOML (docs/maneuvers.md).")
ENGINE = typer.Option(None, "--engine", help="Which engine's, where the file holds several.")
WITHOUT = typer.Option(None, "--without", help='Maneuvers left out, as in "OTM-264,OTM-265".')
AGAINST = typer.Option(None, "--against", help="A model of the history, as in 2012-1 or rcs/2012-1.")


@app.command(short_help="Fit a model; `fit` may be left out.")
def fit(
    file: Path = FILE,
    engine: str = ENGINE,
    model: str = typer.Option("estimated-bias", "--model", help="estimated-bias, zero-mean or mean-aware."),
    likelihood: str = typer.Option("additive", "--likelihood", help="additive, printed or unweighted."),
    hold: list[str] = typer.Option(
        [],
        "--hold",
        help='A term kept: "pointing_fixed=0 mm/s", "pointing_fixed=2000", "pointing=2000"; may be repeated.',
    ),
    prior: str = typer.Option(
        None, "--prior", help="An earlier model whose sigmas are taken as a prior, as in 2008-01."
    ),
    prior_width: float = typer.Option(0.5, "--prior-width", help="Its width, in parts of each sigma."),
    without: str = WITHOUT,
    bootstrap: int = typer.Option(0, "--bootstrap", min=0, max=100_000, help="Parametric refits."),
    seed: int = typer.Option(0, "--seed", min=0, help="Of the bootstrap."),
    json: bool = JSON,
) -> None:
    """Fixed and proportional sigmas and biases of magnitude and pointing, with intervals and doubts."""
    from asflown.estimate.gates_fit import fit_gates

    burns = maneuvers_from(file, engine, without)
    result = fit_gates(
        burns, model=model, likelihood=likelihood, hold=held(hold, burns), prior=model_named(prior, burns), prior_width=prior_width,
        bootstrap=bootstrap, seed=seed,
    )  # fmt: skip
    options = {
        "engine": engine, "model": model, "likelihood": likelihood, "hold": hold, "prior": prior, "prior_width": prior_width,
        "without": without, "bootstrap": bootstrap,
    }  # fmt: skip
    origin = provenance({burns.source: burns.sha256}, options, seed if bootstrap else None)
    if json:
        print_json({"command": "gates"} | result.record() | {"doubts": list(result.doubts), "provenance": origin})
        return
    print(result)
    print_doubts(result.doubts)


def maneuvers_from(file: Path, engine: str | None, without: str | None):
    """The maneuvers of one engine, without some."""
    from asflown.maneuvers.table import load_maneuvers

    burns = load_maneuvers(file).of(engine)
    return burns if without is None else burns.without([w.strip() for w in without.split(",")], "left out by --without")


def model_named(name: str | None, burns):
    """A model of the history; the maneuvers' engine says whose where the name does not."""
    from asflown.maneuvers.history import past_model

    return None if name is None else past_model(name, burns.engine[0]).model


def held(asked: list[str], burns) -> dict[str, float]:
    """'pointing_fixed=0 mm/s' or 'pointing=2000' (a model of the history) -> terms and their values."""
    from asflown.estimate.gates_fit import TERMS
    from asflown.kit.errors import BadInput, some_of
    from asflown.kit.quantities import quantity

    found: dict[str, float] = {}
    for text in asked:
        name, equals, value = (part.strip() for part in text.partition("="))
        terms = [t for t in TERMS if t == name or t.startswith(f"{name}_")]
        if not equals or not terms:
            raise BadInput(
                f"--hold {text!r} names no term",
                remedy=f"Write TERM=VALUE or TERM=MODEL; terms: {some_of(TERMS)}, magnitude, pointing.",
            )
        try:
            record = model_named(value, burns).record()
        except BadInput as why:
            if len(terms) > 1:
                raise BadInput(f"--hold {text!r}: {why.what}", remedy=why.remedy) from None
            unit = "m/s" if name.endswith("fixed") else "rad" if name.startswith("pointing") else ""
            found[name] = quantity(value, unit)
            continue
        for t in terms:
            part, _, kind = t.partition("_")
            found[t] = record[part]["fixed_mps"] if kind == "fixed" else record[part][_PROPORTIONAL[part]]
    return found


_PROPORTIONAL = {"magnitude": "proportional", "pointing": "proportional_rad"}


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
