"""Labels of points that keep clear of each other and of the points."""

from __future__ import annotations

import numpy as np

from .figure import GREY

#: Places tried around a point: direction and distance [points of type].
_AROUND = [(np.radians(a), r) for r in (9, 16, 26, 40, 58) for a in (35, 145, -35, -145, 90, -90, 0, 180)]
_SIZE = 7  # points


def label_points(ax, x, y, texts, avoid) -> None:
    """Write ``texts`` beside points (x, y), each at the first place that is free; ``avoid``: all points drawn, (x, y).

    Call it last, when limits, titles and labels are what they will be: places are found in the figure's own units."""
    from matplotlib.font_manager import FontProperties

    if not len(texts):
        return
    ax.margins(y=0.12)
    ax.autoscale_view(scalex=False)
    ax.figure.draw_without_rendering()  # settles the layout
    scale = ax.figure.dpi / 72
    font, renderer = FontProperties(size=_SIZE), ax.figure.canvas.get_renderer()
    frame = ax.transAxes.transform([(0, 0), (1, 1)])
    points = ax.transData.transform(np.column_stack([np.asarray(a, float) for a in avoid]))
    taken: list[tuple[float, float, float, float]] = [
        (p[0] - 3 * scale, p[1] - 3 * scale, p[0] + 3 * scale, p[1] + 3 * scale) for p in points
    ]
    for at, text in zip(
        ax.transData.transform(np.column_stack([np.asarray(x, float), np.asarray(y, float)])), texts, strict=True
    ):
        width, height, _ = renderer.get_text_width_height_descent(text, font, ismath=False)
        best, least = None, np.inf
        for angle, far in _AROUND:
            dx, dy = far * np.cos(angle), far * np.sin(angle)
            left = at[0] + dx * scale - (0 if dx > 1 else width if dx < -1 else width / 2)
            low = at[1] + dy * scale - height / 2
            box = (left - 1, low - 1, left + width + 1, low + height + 1)
            outside = box[0] < frame[0, 0] or box[1] < frame[0, 1] or box[2] > frame[1, 0] or box[3] > frame[1, 1]
            clashes = sum(_overlap(box, other) for other in taken) + 10.0 * outside
            if clashes < least:
                best, least = (dx, dy, box), clashes
            if clashes == 0:
                break
        dx, dy, box = best  # type: ignore[misc]
        taken.append(box)
        ax.annotate(
            text, ax.transData.inverted().transform(at), (dx, dy), textcoords="offset points", fontsize=_SIZE, va="center",
            ha="left" if dx > 1 else "right" if dx < -1 else "center", arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.5, "shrinkB": 2},
        )  # fmt: skip


def _overlap(a, b) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
