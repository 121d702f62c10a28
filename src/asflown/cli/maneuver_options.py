"""Options of the verbs on maneuvers, and what they mean."""

from __future__ import annotations

from pathlib import Path

import typer

FILE = typer.Argument(help="Maneuvers: CSV (plain or gzip), Parquet or TOML (docs/maneuvers.md).")
ENGINE = typer.Option(None, "--engine", help="Which engine's, where the file holds several.")
WITHOUT = typer.Option(None, "--without", help='Maneuvers left out, as in "OTM-264,OTM-265".')
AGAINST = typer.Option(
    None,
    "--against",
    help="A model to judge by: of the history, as in 2012-1 or rcs/2012-1, or the JSON of an earlier fit.",
)


def maneuvers_from(file: Path, engine: str | None, without: str | None):
    """The maneuvers of one engine, without some."""
    from ..maneuvers.table import load_maneuvers

    burns = load_maneuvers(file).of(engine)
    return burns if without is None else burns.without([w.strip() for w in without.split(",")], "left out by --without")


def past_named(name: str | None, engine: str):
    """A model of the history, or of an earlier fit's JSON; ``engine``, as the file calls it, says whose where the name does not."""
    from ..maneuvers.earlier import earlier_model
    from ..maneuvers.history import past_model

    if name is None:
        return None
    return earlier_model(Path(name), engine) if name.endswith(".json") else past_model(name, engine)


def held(asked: list[str], engine: str) -> dict[str, float]:
    """'pointing_fixed=0 mm/s' or 'pointing=2000' (a model of the history) -> terms and their values."""
    from ..estimate.gates import TERMS
    from ..kit.errors import BadInput, some_of
    from ..kit.quantities import quantity

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
            model = past_named(value, engine).model
        except BadInput as why:
            if len(terms) > 1:
                raise BadInput(f"--hold {text!r}: {why.what}", remedy=why.remedy) from None
            unit = "m/s" if name.endswith("fixed") else "rad" if name.startswith("pointing") else ""
            found[name] = quantity(value, unit)
            continue
        of = dict(zip(TERMS, (model.magnitude_fixed_mps, model.magnitude_proportional, model.pointing_fixed_mps, model.pointing_proportional_rad), strict=True))  # fmt: skip
        found |= {t: of[t] for t in terms}
    return found


def removed_bias(text: str | None) -> tuple[float, float]:
    """'-4 mm/s, 0.03 %' -> m/s and a fraction; the second may be left out."""
    from ..kit.errors import BadInput
    from ..kit.quantities import quantity

    parts = [p.strip() for p in (text or "0 mm/s").split(",")]
    if len(parts) > 2:
        raise BadInput(f"--removed {text!r} is not a bias", remedy='Write it as in "-4 mm/s" or "-4 mm/s, 0.03 %".')
    return quantity(parts[0], "m/s"), quantity(parts[1], "") if len(parts) == 2 else 0.0
