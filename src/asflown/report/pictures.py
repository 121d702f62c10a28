"""Pictures inside a page, and the pages' templates: ink and greys are the page's own colours, so that they follow it into the dark."""

from __future__ import annotations

import io
import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..kit.errors import BadInput
from ..kit.escapes import visible
from ..kit.files import check_output, mark, together, write_text
from ..kit.plain import plain
from ..plots.figure import BLUE, GREY, save_svg
from ..plots.trend import GREYS

if TYPE_CHECKING:
    from pathlib import Path

#: What a page and its JSON call themselves (see ``kit.files.is_ours``).
REPORT = "report"
#: Ink in which the pictures are drawn, to be replaced by the page's.
_INK, _GRID = "#010203", "#e4e4e4"


def check_page(out: Path, *, inputs=(), force: bool = False) -> None:
    """Raise BadInput where the page or its JSON cannot be written, or would replace another's file."""
    if out.suffix.lower() not in (".html", ".htm"):
        raise BadInput("a report is an HTML page", file=out, remedy="Name it .html.")
    for place in (out, out.with_suffix(".json")):
        check_output(place, REPORT, inputs=inputs, force=force)


def write_page(out: Path, page: str, record: dict) -> Path:
    """The page and the same as JSON beside it, both or none; returns the path of the JSON."""
    twin = out.with_suffix(".json")
    with together():
        write_text(out, page)
        write_text(twin, json.dumps({"file": mark(REPORT)} | plain(record), allow_nan=False, indent=1) + "\n")
    return twin


@dataclass(frozen=True)
class Picture:
    title: str
    words: str
    svg: str


def svg_of(figure, name: str, *, titles: bool = False) -> str:
    """The figure as SVG to stand inside a page: no declaration, ids of its own, the page's colours."""
    for ax in figure.axes:
        if not titles:
            ax.set_title("", loc="left")  # the page has its own above
        _ink(ax)
    buffer = io.StringIO()
    save_svg(figure, buffer, salt=name)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r' (?:width|height)="[\d.]+pt"', "", text, count=2)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', text)
    text = re.sub(r'(url\(#|href="#)', rf"\1{name}-", text)
    for k, grey in enumerate(GREYS):
        text = text.replace(grey, f"var(--g{k})")
    for old, new in (
        (_INK, "currentColor"),
        ("#000000", "currentColor"),
        (_GRID, "var(--grid)"),
        (GREY, "var(--mid)"),
        (BLUE, "var(--blue)"),
    ):
        text = text.replace(old, new).replace(old.lower(), new)
    return text


def _ink(ax) -> None:
    ax.set_facecolor("none")
    ax.figure.patch.set_visible(False)
    ax.tick_params(colors=_INK)
    for spine in ax.spines.values():
        spine.set_color(_INK)
    legend = ax.get_legend()
    for words in (ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label, *(legend.get_texts() if legend else ())):
        words.set_color(_INK)
    ax.xaxis.get_offset_text().set_color(_INK)


def template(name: str, **filters):
    """A template of this room, all it is given escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("asflown.report"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=lambda value: visible(value) if type(value) is str else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters
    environment.globals["mark"] = mark(REPORT)
    return environment.get_template(name)
