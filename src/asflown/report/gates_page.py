"""One page on an engine's execution errors, and its JSON twin."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from ..estimate.gates import FEWEST_BEFORE, GatesFit, Judgement, Patch, Watch, watch_maneuvers
from ..kit.errors import BadInput
from ..kit.files import check_place, write_text
from ..kit.plain import plain
from ..plots.maneuvers import degradation_figure, gates_figures, watch_figure
from .pictures import Picture, svg_of, template

if TYPE_CHECKING:
    from pathlib import Path

#: Figure -> title and words.
_WORDS = {
    "magnitude": ("Magnitude errors over dV", "Bars: one sigma of the orbit determination. Band: one sigma of the model about its bias."),
    "pointing": ("Pointing errors over dV", "Along both TVC axes; band as above, the same sigma on each axis."),
    "plane": ("Pointing errors in the TVC plane", "One-sigma ellipses of the orbit determination."),
    "directions": ("Directions of the pointing errors", "Without a bias they are uniform. Grey: counts in sixteen sectors."),
    "distribution": ("Distribution", "Standardised errors about the fitted biases; grey: 95 % of simulated sets fitted likewise."),
    "watch": ("Each burn against the model before it", "Dotted: 2 sigma. Lowest: the underburn that each burn alone could have shown."),
    "degradation": ("Burns that stand out, and the model before them", "The last four at most; the last burn where none does."),
}  # fmt: skip
#: Figures whose panels have titles of their own.
_PANELS = ("distribution", "degradation")


def check_report(out: Path) -> None:
    """Raise BadInput where the page or its twin cannot be written."""
    if out.suffix.lower() not in (".html", ".htm"):
        raise BadInput("a report is an HTML page", file=out, remedy="Name it .html.")
    check_place(out)
    check_place(out.with_suffix(".json"))


def write_gates_report(fit: GatesFit, judged: Judgement, patch: Patch | None, record: dict, out: Path) -> Path:
    """The page at ``out`` and its JSON twin beside it; returns the twin's path.

    Where there are burns enough, each is also watched against the model before it."""
    from .. import __version__

    figures = gates_figures(fit, judged)
    watched = watch_maneuvers(fit.maneuvers) if len(fit.maneuvers) > FEWEST_BEFORE else None
    if watched is not None:
        figures |= {"watch": watch_figure(watched), "degradation": degradation_figure(watched, fit.maneuvers)}
    verdict, reason = _verdict(fit, judged, watched)
    page = template("gates.html").render(
        engine=fit.engine or "engine not named", verdict=verdict, reason=reason, record=plain(record), fit=str(fit), judged=str(judged),
        watched=str(watched or ""), patch=str(patch or ""), version=__version__,
        pictures=[Picture(*_WORDS[name], svg_of(figure, name, titles=name in _PANELS)) for name, figure in figures.items()],
    )  # fmt: skip
    twin = out.with_suffix(".json")
    whole = record | {"verdict": verdict, "watch": None if watched is None else watched.record()}
    write_text(out, page)
    write_text(twin, json.dumps(plain(whole), allow_nan=False, indent=1) + "\n")
    return twin


def _verdict(fit: GatesFit, judged: Judgement, watched: Watch | None) -> tuple[str, str]:
    found = [o.id for o in judged.outliers if o.discovered]
    if watched is not None and watched.first_alarm is not None:
        return "alarm", f"{watched.first_alarm} is not what the burns before it foretold."
    if not fit.known:
        return "watch", f"{len(fit.maneuvers)} burns cannot carry a model."
    if found:
        return "watch", f"Outliers: {', '.join(found)}."
    if judged.sufficient is False:
        return "watch", "The set of burns is not sufficient: a single one decides the model."
    return "pass", "No outliers, and no single burn decides the model."
