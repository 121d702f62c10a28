"""Pictures inside a page, and the pages' templates: ink and greys are the page's own colours, so that they follow it into the dark."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass

from ..plots.figure import BLUE, GREY, save_svg
from ..plots.trend import GREYS

#: Ink in which the pictures are drawn, to be replaced by the page's.
_INK, _GRID = "#010203", "#e4e4e4"


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
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters
    return environment.get_template(name)
