"""Options that the verbs of the trend store share."""

from __future__ import annotations

import typer

from ..verb import weighed

STORE = typer.Option(..., "--store", help="A path (SQLite) or a URL (sqlite:///…, postgresql://…).")
KIND = typer.Option(
    None,
    "--kind",
    help="deploy, stow, wheels, inertia, thrust, sources or gates (default: deploy, or the only one in the store).",
)
WHOSE = typer.Option(None, "--craft", help="One craft, where the store has several.")
FIGURES = typer.Option(None, "--figures", help="A Python file that declares further figures of merit.")
LIMIT = typer.Option([], "--limit", help='A figure\'s limit, as in "angular_impulse=-0.5 N m s"; may be repeated.')
FIGURE = typer.Option(None, "--figure", help="One figure of merit; all unless given.")
BASIS = typer.Option(None, "--basis", help="fused (default), 'momentum, printed', 'transfer, printed' or telemetry.")


def without_password(store: str) -> str:
    from ...trends.store import label, url_of

    return label(url_of(store))


def weighed_all(healths: list) -> list:
    """Verdicts without the doubts that --accept takes off."""
    from dataclasses import replace

    return [replace(h, doubts=weighed(h.doubts)) for h in healths]
