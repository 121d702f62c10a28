"""Burns watched for degradation: z, cumulated sums and what could have been seen; the model before those that stand out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .figure import BLUE, GREEN, GREY, ORANGE, RED, new_figure, save, write_doubts
from .gates import draw_magnitude

if TYPE_CHECKING:
    from ..estimate.gates import GatesWatchResult


def draw_watch(result: GatesWatchResult, ax):
    """z of every watched burn, two sigma, and those that raised an alarm.  Returns ax."""
    at = np.arange(len(result.burns))
    z, alarmed = np.array([b.z for b in result.burns]), np.array([bool(b.alarms) for b in result.burns])
    ax.axhline(0, color=GREY, linewidth=0.8)
    for side in (-2, 2):
        ax.axhline(side, color=ORANGE, linewidth=0.8, linestyle=":")
    ax.plot(at, z, "o", color=BLUE, ms=4)
    ax.plot(at[alarmed], z[alarmed], "o", color=RED, ms=7, label="alarm")
    ax.set_ylabel("z of magnitude")
    _name_burns(result, ax)
    ax.set_title(f"{result.maneuvers.engine_label}: {result.verdict}", loc="left", fontsize=11)
    if alarmed.any():
        ax.legend(frameon=False, fontsize=7, loc="best")
    return ax


def _name_burns(result: GatesWatchResult, ax) -> None:
    ax.set_xticks(np.arange(len(result.burns)), [b.id for b in result.burns], rotation=90, fontsize=7)


def watch_figure(result: GatesWatchResult):
    """Each watched burn: its z and the cumulated sums with their limit; how large an underburn it could have shown."""
    figure, (top, middle, bottom) = new_figure(3, 1, height=2.2)
    draw_watch(result, top)
    at = np.arange(len(result.burns))
    middle.plot(at, [b.cusum_low for b in result.burns], "-o", color=RED, ms=3, lw=1, label="towards underburn")
    middle.plot(at, [b.cusum_high for b in result.burns], "-o", color=BLUE, ms=3, lw=1, label="towards overburn")
    middle.axhline(result.limit_cusum, color=GREY, linestyle="--", linewidth=1, label="limit")
    middle.set_ylabel("cumulated sum")
    middle.legend(frameon=False, fontsize=7, loc="best")
    bottom.semilogy(at, [100 * b.detectable_mps / b.dv_mps for b in result.burns], "o", color=GREEN, ms=4)
    bottom.yaxis.set_major_formatter("{x:g}")
    bottom.yaxis.set_minor_formatter("{x:g}")
    bottom.tick_params(axis="y", which="both", labelsize=7)
    bottom.set_ylabel("seen if short by [%]")
    _name_burns(result, bottom)  # the ticks are shared, their look is not
    return figure


def save_watch_figure(result: GatesWatchResult, path) -> None:
    """Every watched burn, with doubts beneath."""
    figure = watch_figure(result)
    write_doubts(figure, result.doubts)
    save(figure, path)


def degradation_figure(result: GatesWatchResult):
    """The model before each burn that stands out, and that burn (Wagner 2014 Figure 12); the last burn where none does."""
    shown = [b for b in result.burns if b.stands_out][-4:] or list(result.burns[-1:])
    columns = min(len(shown), 2)
    figure, panels = new_figure((len(shown) + 1) // 2, columns, width=5.0 * columns, height=3.4, sharex=False)
    m = result.maneuvers
    for ax, b in zip(panels, shown, strict=False):
        title, color = (f"up to {b.id}: alarm", RED) if b.alarms else (f"up to {b.id}", "black")
        ax.set_title(title, loc="left", fontsize=10, color=color)
        ax.set_xlabel("dV [m/s]")
        draw_magnitude(b.model, m.take(slice(0, m.place(b.id) + 1)), ax, (b.id,), f"z = {b.z:+.1f}")
    for ax in panels[len(shown) :]:
        ax.set_visible(False)
    return figure


def watch_figures(result: GatesWatchResult) -> dict:
    """Both figures, by name."""
    return {"watch": watch_figure(result), "degradation": degradation_figure(result)}
