"""The sources of a torque: what each contributes over time, their sum over the torque estimated, what is left; shadow shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kit.digits import scaled_unit
from ..telemetry.channels import AXES
from .figure import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, breaks, new_figure, save, write_doubts
from .torque import time_scale

if TYPE_CHECKING:
    from ..estimate.sources import SourcesResult

_COLOURS = {
    "gravity-gradient": GREEN,
    "sunlight": ORANGE,
    "dipole": BLUE,
    "drag": PURPLE,
    "constant": SKY,
    "rods": GREY,
}


def draw_contributions(result: SourcesResult, ax, axis: int):
    """Each source's torque about one axis, their sum, and the torque estimated.  Returns ax."""
    factor, label, t, longest = _scales(result)
    _shade(result, ax)
    ax.plot(
        *breaks(t, factor * result.torque_Nm[:, axis], longest),
        color=GREY,
        linewidth=3.0,
        alpha=0.45,
        label="estimated",
    )
    for name, torque in result.contributions.items():
        ax.plot(*breaks(t, factor * torque[:, axis], longest), color=_COLOURS[name], linewidth=1.1, label=name)
    ax.plot(*breaks(t, factor * result.explained_Nm[:, axis], longest), color="black", linewidth=0.9, label="sum")
    ax.set_ylabel(f"torque {AXES[axis]} [{label}]")
    return ax


def draw_residual(result: SourcesResult, ax):
    """Mean residual torque over windows, the three axes, and twice the readings' noise.  Returns ax."""
    size, _ = time_scale(result.time_s)
    r = result.residual
    factor, label = scaled_unit(float(np.abs(r.torque_Nm).max()), "rad/s2" if result.relative else "N m")
    t = (result.time_s[0] + r.time_s) / size
    _shade(result, ax)
    noise = 2 * factor * float(np.max(r.noise_Nm))
    ax.axhspan(-noise, noise, color=GREY, alpha=0.15, linewidth=0)
    for column, axis, colour in zip(r.torque_Nm.T, AXES, (BLUE, ORANGE, GREEN), strict=True):
        ax.plot(t, factor * column, "o-", color=colour, markersize=2, linewidth=0.7, label=axis)
    ax.set_ylabel(f"left over [{label}]")
    ax.legend(frameon=False, fontsize=7, ncols=3, loc="best")
    return ax


def draw_sources(result: SourcesResult, ax):
    """Contributions about the axis with the largest torque.  Returns ax."""
    draw_contributions(result, ax, int(np.argmax(np.mean(result.explained_Nm**2, axis=0))))
    ax.legend(frameon=False, fontsize=7, ncols=4, loc="best")
    ax.set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    return ax


def save_sources_figure(result: SourcesResult, path) -> None:
    """A panel an axis, and the residual beneath; doubts at the foot."""
    figure, panels = new_figure(4, height=2.2)
    for j, ax in enumerate(panels[:3]):
        draw_contributions(result, ax, j)
    draw_residual(result, panels[3])
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=7, ncols=len(labels), loc="outside upper right")
    shaded = ", shadow shaded" if result.lit is not None and (result.lit < 0.5).any() else ""
    panels[0].set_title(f"Sources of the torque on {result.craft}{shaded}", loc="left", fontsize=10)
    panels[3].set_title("Residual torque; grey: twice the noise of the readings", loc="left", fontsize=8)
    panels[3].set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    write_doubts(figure, result.doubts)
    save(figure, path)


def _scales(result: SourcesResult):
    size, _ = time_scale(result.time_s)
    factor, label = scaled_unit(float(np.abs(result.torque_Nm).max()), "rad/s2" if result.relative else "N m")
    t = result.time_s / size
    return factor, label, t, 8 * float(np.median(np.diff(t)))


def _shade(result: SourcesResult, ax) -> None:
    if result.lit is None:
        return
    t = result.time_s / time_scale(result.time_s)[0]
    dark = np.r_[False, result.lit < 0.5, False].astype(int)
    starts, stops = np.flatnonzero(np.diff(dark) > 0), np.flatnonzero(np.diff(dark) < 0) - 1
    for first, last in zip(t[starts], t[stops], strict=True):
        ax.axvspan(first, last, color="#d9d9e6", linewidth=0, zorder=0)
