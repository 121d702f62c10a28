"""The leak monitor: residual momentum with the papers' threshold, the likelihood ratio with its own, and the posterior."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .figure import BLUE, BY_AXIS, GREY, RED, new_figure, save, write_doubts
from .torque import time_scale

if TYPE_CHECKING:
    from ..estimate.leak import LeakResult

_AXES = "XYZ"


def draw_gained_momentum(result: LeakResult, ax):
    """Residual momentum gained within the papers' duration, about each axis, with their threshold.  Returns ax."""
    t = result.time_s / time_scale(result.time_s)[0]
    for k, color in enumerate(BY_AXIS):
        ax.plot(t, 1e3 * result.monitor.gained[:, k], color=color, linewidth=0.8, label=_AXES[k])
    limit = 1e3 * result.monitor.threshold_Nms
    for side in (-limit, limit):
        ax.axhline(side, color=RED, linewidth=1, linestyle="--", label="papers' threshold" if side > 0 else None)
    ax.set_ylabel(f"gained in {result.monitor.duration_s:.0f} s\n[mN m s]")
    return ax


def draw_statistic(result: LeakResult, ax):
    """Log likelihood ratio of the best change over none.  Returns ax."""
    t = result.time_s / time_scale(result.time_s)[0]
    ax.plot(t, np.maximum(result.statistic, 0.1), color=BLUE, linewidth=1)
    ax.axhline(result.threshold, color=RED, linewidth=1, linestyle="--", label="threshold")
    if result.statistic.max() > 5 * result.threshold:
        ax.set_yscale("log")
        ax.set_ylim(bottom=0.5)
    ax.set_ylabel("log likelihood\nratio")
    return ax


def draw_posterior(result: LeakResult, ax):
    """Which thruster, given that one is at fault.  Returns ax."""
    posterior = result.posterior or dict.fromkeys(result.smallest_detectable_N, 0.0)
    bars = ax.bar(list(posterior), list(posterior.values()), color=BLUE, width=0.6)
    ax.bar_label(bars, [f"{p:.3f}" if p >= 5e-4 else "" for p in posterior.values()], fontsize=7)
    ax.set_ylim(0, 1.12)
    ax.set_ylabel("posterior")
    if result.posterior is None:
        ax.text(0.5, 0.5, "no alarm" if not result.alarm else "not given by this method", transform=ax.transAxes,
                ha="center", color=GREY)  # fmt: skip
    return ax


def save_leak_figure(result: LeakResult, path) -> None:
    """Momentum and statistic over time, the posterior beneath; doubts at the foot."""
    figure, (momentum, statistic, posterior) = new_figure(3, height=2.3, sharex=False)
    draw_gained_momentum(result, momentum)
    draw_statistic(result, statistic)
    draw_posterior(result, posterior)
    scale, unit = time_scale(result.time_s)
    statistic.sharex(momentum)
    statistic.set_xlabel(f"time from {result.epoch} [{unit}]")
    for ax in (momentum, statistic):
        if result.onset_s is not None:
            ax.axvline(result.onset_s / scale, color=GREY, linewidth=1, linestyle=":", label="began")
        if result.alarm_s is not None:
            ax.axvline(result.alarm_s / scale, color=GREY, linewidth=1, label="alarm")
        ax.legend(frameon=False, fontsize=7, loc="upper left", ncols=6)
    what = "no alarm"
    if result.alarm:
        what = f"{result.thruster or 'unknown thruster'} {'is weak' if result.kind == 'weak' else 'leaks'}"
        if result.together:
            what = f"momentum as of {', '.join(result.together)} together"
    momentum.set_title(f"Leak monitor of {result.craft}, {result.method}: {what}", loc="left", fontsize=10)
    write_doubts(figure, result.doubts)
    save(figure, path)
