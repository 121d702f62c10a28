"""A steady external torque: momentum gained over time, and the line that is the torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..telemetry.channels import AXES
from .figure import BLUE, GREY, RED, breaks, new_figure, save, write_doubts
from .torque import time_scale

if TYPE_CHECKING:
    from ..estimate.external import ExternalTorqueResult

_BLOCKS = 30


def draw_gained(result: ExternalTorqueResult, ax, axis: int):
    """Momentum gained about one axis: samples, their means in blocks, the fit with its 95 % band.  Returns ax."""
    scale, unit = (1.0, "rad/s per\nunit spin inertia") if result.relative else (1e3, "mN m s")
    t = result.time_s / time_scale(result.time_s)[0]
    gained, fitted = scale * result.gained_Nms[:, axis], scale * result.fitted_Nms[:, axis]
    used = result.used
    if result.fitted_ci95_Nms is None:  # the printed method looks at two readings only
        ax.plot(*breaks(t, gained, 6.5 * float(np.median(np.diff(t)))), color=GREY, linewidth=0.7, label="wheels")
        ax.plot(t[used], gained[used], "o", color=BLUE, markersize=5, label="readings used")
    else:
        ax.plot(t[used], gained[used], ".", color=GREY, markersize=2, alpha=0.5, label="samples")
        if not used.all():
            ax.plot(t[~used], gained[~used], "x", color=RED, markersize=4, label="not counted")
        parts = np.array_split(np.flatnonzero(used), min(_BLOCKS, max(int(used.sum()) // 8, 1)))
        means = [(t[p].mean(), gained[p].mean(), gained[p].std() / np.sqrt(len(p))) for p in parts if len(p)]
        at, mean, error = np.array(means).T
        ax.errorbar(at, mean, 1.96 * error, fmt="o", color=BLUE, markersize=3, linewidth=1, label="means, 95 %")
        band = scale * result.fitted_ci95_Nms[:, axis]
        ax.fill_between(t, fitted - band, fitted + band, color=RED, alpha=0.2, linewidth=0)
        seen = np.percentile(gained[used], [1, 99])
        room = 0.3 * float(np.ptp(seen))
        low, high = min(seen[0], fitted.min()), max(seen[1], fitted.max())
        if high > low:
            ax.set_ylim(low - room, high + room)
    ax.plot(t, fitted, color=RED, linewidth=1.4, label="fit")
    ax.set_ylabel(f"gained {AXES[axis]} [{unit}]")
    return ax


def draw_external_torque(result: ExternalTorqueResult, ax):
    """Momentum gained about the axis with the largest torque.  Returns ax."""
    draw_gained(result, ax, int(np.argmax(np.abs(result.torque_Nm))))
    ax.set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    return ax


def save_external_torque_figure(result: ExternalTorqueResult, path) -> None:
    """A panel an axis, in axes that do not turn and were the body's at the start; doubts beneath."""
    figure, panels = new_figure(3, height=2.3)
    for j, ax in enumerate(panels):
        draw_gained(result, ax, j)
    panels[0].set_title(
        f"Momentum gained by {result.craft}: {result.method}, {result.variant}; torque constant in {result.frame} axes",
        loc="left",
        fontsize=10,
    )
    panels[0].legend(frameon=False, fontsize=7, loc="best", ncols=4)
    panels[-1].set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    write_doubts(figure, result.doubts)
    save(figure, path)
