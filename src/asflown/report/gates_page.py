"""One page on an engine's execution errors, and its JSON twin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..estimate.gates import FEWEST_BEFORE, gates_watch
from ..kit.plain import plain
from ..plots.gates import gates_figures
from ..plots.gates_watch import watch_figures
from .pictures import Picture, svg_of, template, write_page

if TYPE_CHECKING:
    from pathlib import Path

    from ..estimate.gates import GatesResult, GatesWatchResult

#: Figure -> title and caption.
_WORDS = {
    "magnitude": ("Magnitude errors over dV", "Bars: one sigma of the orbit determination. Band: one sigma of the model about its bias."),
    "pointing": ("Pointing errors over dV", "Along both TVC axes; band as above, the same sigma on each axis."),
    "plane": ("Pointing errors in the TVC plane", "One-sigma ellipses of the orbit determination."),
    "directions": ("Directions of the pointing errors", "Without a bias they are uniform. Grey: counts in sixteen sectors."),
    "distribution": ("Distribution", "Standardised errors about the fitted biases; grey: 95 % of simulated sets fitted likewise."),
    "watch": ("Each burn against the model before it", "Dotted: 2 sigma. Lowest panel: the underburn that each burn alone could have revealed."),
    "degradation": ("Outlying burns, and the model before them", "The last four at most; the last burn where there are none."),
}  # fmt: skip
#: Figures whose panels have titles of their own.
_PANELS = ("distribution", "degradation")


def write_gates_report(result: GatesResult, out: Path) -> Path:
    """Write the page of a judged fit to ``out`` and the same as JSON next to it; returns the path of the JSON.

    Where there are enough burns, each is also judged by the model of those before it."""
    from .. import __version__

    figures = gates_figures(result)
    watched = gates_watch(result.maneuvers) if len(result.maneuvers) > FEWEST_BEFORE else None
    if watched is not None:
        figures |= watch_figures(watched)
    verdict, reason = _verdict(result, watched)
    record = {"command": "gates"} | result.record() | {"provenance": result.provenance}
    page = template("gates.html").render(
        engine=result.maneuvers.engine_label, verdict=verdict, reason=reason, record=plain(record), doubts=result.doubts.gravest_first,
        told=str(result), watched=str(watched or ""), version=__version__,
        pictures=[Picture(*_WORDS[name], svg_of(figure, name, titles=name in _PANELS)) for name, figure in figures.items()],
    )  # fmt: skip
    whole = record | {"verdict": verdict, "watch": None if watched is None else watched.record()}
    return write_page(out, page, whole)


def _verdict(result: GatesResult, watched: GatesWatchResult | None) -> tuple[str, str]:
    """alarm, watch or pass, and why."""
    if watched is not None and watched.first_alarm is not None:
        return "alarm", f"{watched.first_alarm} deviates from the model of the burns before it."
    if not result.known:
        return "watch", f"{len(result.maneuvers)} burns are too few for a model."
    found = [] if result.judgement is None else [o.id for o in result.judgement.outliers if o.discovered]
    if found:
        return "watch", f"Outliers: {', '.join(found)}."
    if result.judgement is not None and result.judgement.sufficient is False:
        return "watch", "The set of burns is not sufficient: a single burn determines the model."
    return "pass", "No outliers, and no single burn determines the model."
