"""The verb `trend show`."""

from __future__ import annotations

from pathlib import Path

import typer

from ..options import JSON
from ..output import print_doubts, print_json, provenance, say
from ..verb import Asked, verb
from .store_options import BASIS, FIGURE, KIND, LIMIT, STORE, WHOSE, weighed_all, without_password
from .tables import print_figure


@verb
def show(
    store: str = STORE,
    figure: str = FIGURE,
    basis: str = BASIS,
    kind: str | None = KIND,
    craft: str = WHOSE,
    limit: list[str] = LIMIT,
    plot: Path = typer.Option(None, "--plot", help="Draw the figure (SVG, PNG or PDF by its suffix)."),
    json: bool = JSON,
) -> None:
    """A figure over the years: robust slope and change with intervals, permutation p-value, detectable change."""
    from ...trends.board import health_in
    from ...trends.entry import BEST
    from ...trends.record import figure_record

    if plot is not None:
        from ...kit.files import check_output
        from ...plots.figure import PICTURE, picture_kind

        picture_kind(plot)
        check_output(plot, PICTURE, inputs=[store], force=Asked.force)
    (health,) = weighed_all([health_in(store, craft, kind, limit)])
    found = (
        [health.figure(figure, basis)]
        if figure
        else [f for f in health.figures if f.basis in (basis or BEST[0], BEST[1])]
    )
    if plot is not None:
        from ...plots.figure import save
        from ...plots.trend import trend_figure

        save(trend_figure(found[0]), plot)
        say(f"wrote {plot}")
    if json:
        rest = {} if figure else {"figures": [figure_record(f) for f in found]}
        print_json({
            "command": "trend show", "craft": health.craft, "kind": health.kind, **figure_record(found[0]), **rest,
            **health.doubts.record(),
            "provenance": provenance({}, {"store": without_password(store), "figure": figure, "basis": basis, "limit": limit}),
        })  # fmt: skip
        return
    for f in found:
        print_figure(f, rows=figure is not None)
    print_doubts(health.doubts)
