"""One page on an engine's execution errors, and its JSON twin."""

from __future__ import annotations

import json
from pathlib import Path

from ..estimate.gates_judge import Judgement
from ..estimate.gates_patch import Patch
from ..estimate.gates_result import GatesFit
from ..kit.errors import BadInput
from ..kit.files import check_place, write_text
from ..kit.plain import plain
from ..plots.maneuvers import gates_figures
from .pictures import Picture, svg_of, template

#: Figure -> title and words.
_WORDS = {
    "magnitude": (
        "Magnitude errors over dV",
        "Bars: one sigma of the orbit determination. Band: one sigma of the model about its bias.",
    ),
    "pointing": ("Pointing errors over dV", "Along both TVC axes; band as above, the same sigma on each axis."),
    "plane": ("Pointing errors in the TVC plane", "One-sigma ellipses of the orbit determination."),
    "directions": (
        "Directions of the pointing errors",
        "Without a bias they are uniform. Grey: counts in sixteen sectors.",
    ),
    "distribution": (
        "Distribution",
        "Standardised errors, about the fitted biases; grey: 95 % of simulated sets fitted likewise.",
    ),
}


def check_report(out: Path) -> None:
    """Raise BadInput where the page or its twin cannot be written."""
    if out.suffix.lower() not in (".html", ".htm"):
        raise BadInput("a report is an HTML page", file=out, remedy="Name it .html.")
    check_place(out)
    check_place(out.with_suffix(".json"))


def write_gates_report(fit: GatesFit, judged: Judgement, patch: Patch | None, record: dict, out: Path) -> Path:
    """The page at ``out`` and ``record`` as its JSON twin beside it; returns the twin's path."""
    from .. import __version__

    found = [o.id for o in judged.outliers if o.discovered]
    if not fit.known:
        verdict, reason = "watch", f"{len(fit.maneuvers)} burns cannot carry a model."
    elif found or judged.sufficient is False:
        verdict, reason = "watch", f"Outliers: {', '.join(found)}." if found else "The set of burns is not sufficient."
    else:
        verdict, reason = "pass", "No outliers, and no single burn decides the model."
    pictures = [
        Picture(*_WORDS[name], svg_of(figure, name, titles=name == "distribution"))
        for name, figure in gates_figures(fit, judged).items()
    ]
    page = template("gates.html").render(
        engine=fit.engine or "engine not named", verdict=verdict, reason=reason, record=plain(record), fit=str(fit), judged=str(judged),
        patch="" if patch is None else str(patch), pictures=pictures, version=__version__,
    )  # fmt: skip
    twin = out.with_suffix(".json")
    write_text(out, page)
    write_text(twin, json.dumps(plain(record), allow_nan=False, indent=1) + "\n")
    return twin
