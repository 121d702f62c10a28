"""The report: one HTML file that opens offline, light and dark, on paper and on a phone, and its JSON twin.

Reads a verdict, draws with plots, fills a template.  Pictures are SVG inside the page (see ``pictures``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kit.doubts import Doubts
from ..plots import trend as draw
from ..trends.entries import BASES
from ..trends.entry import MOVES
from ..trends.record import health_record, sudden_words
from .pictures import Picture, svg_of, template, write_page

if TYPE_CHECKING:
    from pathlib import Path

    from ..trends.verdicts import FigureHealth, Health

#: Figures whose history is always drawn first (cover paper Figs 17, 18).
_FIRST = ("angular_impulse", "peak_positive", "peak_negative")


def write_report(healths: list[Health], out: Path, provenance: dict) -> tuple[Path, dict]:
    """Write the page to ``out`` and the same as JSON next to it; returns the path and the content of the JSON.

    ``healths``: a verdict for each kind, the one that decides first.  Raises BadInput where the places cannot be written."""
    from .. import __version__

    record = {
        "command": "report", "verdict": healths[0].verdict, "reasons": list(healths[0].reasons),
        "kinds": [health_record(h) for h in healths],
        **Doubts(d for h in healths for d in h.doubts).record(), "provenance": provenance,
    }  # fmt: skip
    page = template("report.html", quantity=_quantity, number=_number, interval=_interval).render(
        healths=healths, main=healths[0], sections=[(h, _pictures(h)) for h in healths],
        provenance=provenance, version=__version__, moves=MOVES,
    )  # fmt: skip
    return write_page(out, page, record), record


def _pictures(h: Health) -> list[Picture]:
    """Pictures of one kind of actuation, in the order of the page."""
    made = [*_over_the_years(h), *(_of_moves(h) if h.kind in MOVES else ())]
    return [Picture(title, words, svg_of(figure, f"{h.kind}-{name}")) for name, title, words, figure in made]


def _over_the_years(h: Health):
    """(name, title, words, figure) of figures of merit over time."""
    for name in _FIRST:
        found = [f for f in h.figures if f.figure == name and len(f.rows) > 1]
        if found:
            yield name, f"{name.replace('_', ' ')} over the years", _trend_words(found[0]), draw.trend_figure(*found)
    for f in h.figures:
        if f.figure not in _FIRST and (f.verdict != "pass" or (h.kind not in MOVES and f.trend_p_adjusted is not None)):
            yield f.figure, f"{f.figure.replace('_', ' ')} over the years", _trend_words(f), draw.trend_figure(f)


def _of_moves(h: Health):
    """(name, title, words, figure) of the curves of actuations."""
    entries, newest = list(h.entries), h.entries[-1]
    one = f"the {h.kind} of {newest.date[:10]}"
    if len(entries) > 3:
        yield ("family", "The newest compared with its family", f"{one}, fused, and the 95 % prediction band of a further one "
               "at each instant.", draw.family_figure(newest, entries[:-1], "newest against the past"))  # fmt: skip
    for basis in BASES:
        if any(e.curve(f"torque, {basis}") is not None for e in entries):
            yield (f"overlay-{basis[:5]}", f"All {h.kind}s, {basis}", "Older ones in lighter grey, the first dotted blue, the newest red.",
                   draw.overlay_figure(entries, f"torque, {basis}", basis))  # fmt: skip
    for basis in BASES:
        if newest.curve(f"torque, {basis}") is not None:
            yield (f"merit-{basis[:5]}", f"Figures of merit, {basis}", f"{one}: the shaded area is the impulse of the first phase, the dashed lines are the "
                   "means of the two largest excursions of each sign after it.", draw.merit_figure(newest, basis, basis))  # fmt: skip
    for basis in BASES if h.pairs else ():
        yield (f"cold-{basis[:5]}", f"Cold and warm, {basis}", "Crosses: after a long rest; rings: the next one. Each pair has its colour.",
               draw.cold_warm_figure(h.pairs, f"torque, {basis}", basis))  # fmt: skip
    if newest.curve("motor_current") is not None:
        yield ("devices", "Devices", f"{one}: the motor stalls in the green span, between two samples.",
               draw.devices_figure(newest, "torque with thermal and device data"))  # fmt: skip
    yield ("methods", "Methods compared", f"{one}: the fused method with its 95 % band, and the two methods of the cover paper.",
           draw.methods_figure(newest, "three bases"))  # fmt: skip


def _trend_words(f: FigureHealth) -> str:
    t = f.trend
    if t is None:
        return "Too few events for a trend."
    said = f"{len(f.rows)} events; p = {t.p_value:.2g}"
    if t.change_percent is not None and t.change_percent_ci95 is not None:
        low, high = t.change_percent_ci95
        said = f"Change over the years {t.change_percent:+.0f} % (95 %: {low:+.0f} to {high:+.0f} %), {said}"
    if t.detectable_percent is not None:
        said += f"; a change of {t.detectable_percent:.0f} % would be detected with 80 % power"
    sudden = sudden_words(f)
    return said + "." + ("" if sudden is None else f" {sudden[0].upper()}{sudden[1:]}.")


def _number(value, digits: int = 3) -> str:
    return "" if value is None or not np.isfinite(value) else f"{value:.{digits}g}"


def _interval(ends) -> str:
    """'+13 to +40 %'; '' where an end is not known."""
    return "" if ends is None or not np.isfinite(ends).all() else f"{ends[0]:+.0f} to {ends[1]:+.0f} %"


def _quantity(value, sigma, unit: str) -> str:
    """'-0.282 ± 0.004 N m s', in a unit suited to its size."""
    if value is None:
        return "not known"
    scale, shown = draw.DRAWN_IN.get(unit, (1.0, unit))
    if shown.startswith("N") and 0 < abs(scale * value) < 1e-3:
        scale, shown = 1e6 * scale, f"µ{shown}"
    if not sigma:
        return f"{scale * value:.4g} {shown}".strip()
    digits = max(0, 1 - int(np.floor(np.log10(scale * sigma))))
    return f"{scale * value:.{digits}f} ± {scale * sigma:.{digits}f} {shown}".strip()
