"""Options of the verbs on maneuvers, and what they mean."""

from __future__ import annotations

from pathlib import Path

import typer

FILE = typer.Argument(help="Maneuvers: CSV (plain or gzip), Parquet, Excel or TOML (docs/maneuvers.md).")
ENGINE = typer.Option(None, "--engine", help="Which engine's, where the file holds several.")
WITHOUT = typer.Option(None, "--without", help='Maneuvers left out, as in "OTM-264,OTM-265".')
COLUMNS = typer.Option(None, "--columns", help="Dictionary of the table's columns (TOML), where it has other ones.")
AGAINST = typer.Option(
    None,
    "--against",
    help="A model to judge by: of the history, as in 2012-1 or rcs/2012-1, or the JSON of an earlier fit.",
)


def maneuvers_from(file: Path, engine: str | None, without: str | None = None, columns: Path | None = None):
    """The maneuvers of one engine, without some."""
    from ...maneuvers.table import load_maneuvers

    burns = load_maneuvers(file, columns=columns).of(engine)
    return burns if without is None else burns.without([w.strip() for w in without.split(",")], "left out by --without")


def past_named(name: str | None, engine: str | None):
    """A model of the history, or of an earlier fit's JSON; ``engine``, as the file calls it, says whose where the name does not."""
    from ...maneuvers.earlier import earlier_model
    from ...maneuvers.history import past_model

    if name is None:
        return None
    return earlier_model(Path(name), engine or "") if Path(name).suffix == ".json" else past_model(name, engine)


def held(asked: list[str], engine: str | None) -> dict[str, float]:
    """'pointing_fixed=0 mm/s' or 'pointing=2000' (a model of the history) -> terms and their values."""
    from ...estimate.gates import SIGMAS
    from ...kit.errors import BadInput, some_of

    found: dict[str, float] = {}
    for text in asked:
        name, equals, value = (part.strip() for part in text.partition("="))
        terms = [term for key, term in SIGMAS.items() if name in (key, term.quantity)]
        if not equals or not terms:
            raise BadInput(
                f"--hold {text!r} names no term",
                remedy=f"Write TERM=VALUE or TERM=MODEL; terms: {some_of(SIGMAS)}, magnitude, pointing.",
            )
        found |= _values(text, terms, value, engine)
    return found


def _values(text: str, terms: list, value: str, engine: str | None) -> dict[str, float]:
    """The values of these sigmas in a model, or the one value of a single one."""
    from ...estimate.gates import Law
    from ...kit.errors import BadInput
    from ...kit.quantities import quantity

    try:
        model = past_named(value, engine).model
    except BadInput as why:
        if len(terms) > 1:
            raise BadInput(f"--hold {text!r}: {why.what}", remedy=why.remedy) from None
        return {terms[0].key: quantity(value, terms[0].unit)}
    return {t.key: dict(zip(Law, model.parameters(t.quantity), strict=False))[t.law] for t in terms}


def removed_bias(text: str | None) -> tuple[float, float]:
    """'-4 mm/s, 0.03 %' -> m/s and a fraction; the second may be left out."""
    from ...kit.errors import BadInput
    from ...kit.quantities import quantity

    parts = [p.strip() for p in (text or "0 mm/s").split(",")]
    if len(parts) > 2:
        raise BadInput(f"--removed {text!r} is not a bias", remedy='Write it as in "-4 mm/s" or "-4 mm/s, 0.03 %".')
    return quantity(parts[0], "m/s"), quantity(parts[1], "") if len(parts) == 2 else 0.0
