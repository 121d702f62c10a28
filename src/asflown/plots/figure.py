"""How figures look, and how they are saved."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..kit.doubts import doubt_mark
from ..kit.errors import BadInput
from ..kit.escapes import visible
from ..kit.files import mark, write_whole

if TYPE_CHECKING:
    from ..kit.doubts import Doubts

#: Colours that also differ in grey and for the colour-blind (Okabe and Ito).
BLUE, ORANGE, GREEN, RED, PURPLE, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#777777"
SKY = "#56B4E9"
BY_AXIS = (BLUE, ORANGE, GREEN)
#: What pictures call themselves (see ``kit.files.is_ours``).
PICTURE = "picture"
_ROOM = 4  # doubts beneath a figure


def new_figure(rows: int = 1, columns: int = 1, *, width: float = 8.0, height: float = 3.0, sharex: bool = True):
    """A figure of its own, outside pyplot's global state, and its axes as a list."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height * rows), layout="constrained")
    FigureCanvasAgg(figure)
    axes = np.atleast_1d(figure.subplots(rows, columns, sharex=sharex)).ravel().tolist()
    for ax in axes:
        ax.grid(True, color="#e4e4e4", linewidth=0.6)
        ax.set_axisbelow(True)
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)
    return figure, axes


def write_doubts(figure, doubts: Doubts, *, columns: int = 125) -> None:
    """Doubts beneath a figure, the gravest first, and how many there was no room for."""
    ordered = doubts.gravest_first
    lines = [textwrap.fill(f"{doubt_mark(d)} {d}", columns) for d in ordered[:_ROOM]]
    if len(ordered) > _ROOM:
        lines.append(f"and {len(ordered) - _ROOM} more doubt{'s' if len(ordered) > _ROOM + 1 else ''}, in the text")
    if lines:
        figure.supxlabel("\n".join(lines), fontsize=6.5, color=RED, x=0.02, ha="left")


def as_written(drawn) -> None:
    """Show every text of a figure or of axes as it is: names from outside are no formulas, and hold no control characters.

    Ticks keep the formulas of their own numbers."""
    from matplotlib.axis import Axis
    from matplotlib.text import Text
    from matplotlib.ticker import FuncFormatter

    numbers: set[int] = set()
    for axis in drawn.findobj(Axis):
        words = axis.get_major_formatter()
        if isinstance(words, FuncFormatter):  # ticks that were given words
            words.func = lambda x, at, told=words.func: visible(told(x, at))
        else:
            numbers |= {id(t) for t in axis.findobj(Text) if t is not axis.label}
    for text in drawn.findobj(Text):
        if id(text) not in numbers:
            text.set_parse_math(False)
            text.set_text(visible(text.get_text()))


def picture_kind(path: str | Path) -> str:
    """'svg', 'png' or 'pdf'.  Raises BadInput for any other suffix."""
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in ("svg", "png", "pdf"):
        what = f"'.{kind}'" if kind else "a file without suffix"
        raise BadInput(f"cannot draw into {what}", file=path, remedy="Name it .svg, .png or .pdf.")
    return kind


def save(figure, path: str | Path) -> None:
    """SVG, PNG or PDF by the suffix; text stays text in SVG, and equal input gives equal bytes."""
    kind, ours = picture_kind(path), mark(PICTURE)
    told = {
        "svg": {"Date": None, "Creator": ours},
        "pdf": {"CreationDate": None, "Creator": ours},
        "png": {"Software": ours},
    }
    as_written(figure)
    with _look("asflown"):
        write_whole(path, lambda p: figure.savefig(p, format=kind, dpi=150, metadata=told[kind]))


def save_figures(figures: dict, folder: Path) -> list[Path]:
    """As SVG files into ``folder``."""
    paths = []
    for name, figure in figures.items():
        paths.append(Path(folder) / f"{name}.svg")
        save(figure, paths[-1])
    return paths


def save_svg(figure, stream, salt: str) -> None:
    """SVG into a text stream; ``salt`` makes its ids differ from other figures' in the same page."""
    as_written(figure)
    with _look(salt):
        figure.savefig(stream, format="svg", metadata={"Date": None})


def _look(salt: str):
    import matplotlib

    return matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt, "font.family": "sans-serif"})


def breaks(time_s, values, longest_step_s: float):
    """Time and values with a NaN put into every gap, so that no line is drawn across it."""
    time_s, values = np.asarray(time_s, float), np.asarray(values, float)
    at = np.flatnonzero(np.diff(time_s) > longest_step_s) + 1
    return np.insert(time_s, at, np.nan), np.insert(values, at, np.nan, axis=0)


def minutes(ax) -> None:
    ax.set_xlabel("time from epoch [min]")
