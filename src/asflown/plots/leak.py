"""The leak monitor: residual momentum with the papers' threshold, the likelihood ratio with its own, and the posterior."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..telemetry.channels import AXES
from .figure import BLUE, BY_AXIS, GREY, RED, new_figure, save, write_doubts
from .torque import time_scale

if TYPE_CHECKING:
    from ..estimate.leak import LeakResult


def draw_gained_momentum(result: LeakResult, ax):
    """Residual momentum gained within the papers' duration, about each axis, with their threshold.  Returns ax."""
    t = result.time_s / time_scale(result.time_s)[0]
    for axis, color, gained in zip(AXES, BY_AXIS, result.monitor.gained_Nms.T, strict=True):
        ax.plot(t, 1e3 * gained, color=color, linewidth=0.8, label=axis)
    limit = 1e3 * result.monitor.threshold_Nms
    for side in (-limit, limit):
        ax.axhline(side, color=RED, linewidth=1, linestyle="--", label="papers' threshold" if side > 0 else None)
    ax.set_ylabel(f"gained in {result.monitor.duration_s:.0f} s\n[mN m s]")
    return _with_events(result, ax)


def draw_statistic(result: LeakResult, ax):
    """Log likelihood ratio of the best change over none.  Returns ax."""
    t = result.time_s / time_scale(result.time_s)[0]
    ax.plot(t, np.maximum(result.statistic, 0.1), color=BLUE, linewidth=1)
    ax.axhline(result.threshold, color=RED, linewidth=1, linestyle="--", label="threshold")
    if result.statistic.max() > 5 * result.threshold:
        ax.set_yscale("log")
        ax.set_ylim(bottom=0.5)
    ax.set_ylabel("log likelihood\nratio")
    return _with_events(result, ax)


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


def draw_leak(result: LeakResult, ax):
    """What the method looks at, over time: the likelihood ratio, or the momentum gained.  Returns ax."""
    (draw_gained_momentum if result.method == "threshold" else draw_statistic)(result, ax)
    ax.set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    return ax


def save_leak_figure(result: LeakResult, path) -> None:
    """Momentum and statistic over time, the posterior beneath; doubts at the foot."""
    figure, (momentum, statistic, posterior) = new_figure(3, height=2.3, sharex=False)
    draw_gained_momentum(result, momentum)
    draw_statistic(result, statistic)
    draw_posterior(result, posterior)
    statistic.sharex(momentum)
    statistic.set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    momentum.set_title(f"Leak monitor of {result.craft}, {result.method}: {result.verdict()}", loc="left", fontsize=10)
    write_doubts(figure, result.doubts)
    save(figure, path)


def _with_events(result: LeakResult, ax):
    """Onset and alarm marked, and the legend."""
    scale = time_scale(result.time_s)[0]
    if result.onset_s is not None:
        ax.axvline(result.onset_s / scale, color=GREY, linewidth=1, linestyle=":", label="onset")
    if result.alarm_s is not None:
        ax.axvline(result.alarm_s / scale, color=GREY, linewidth=1, label="alarm")
    ax.legend(frameon=False, fontsize=7, loc="best", ncols=3)
    return ax
