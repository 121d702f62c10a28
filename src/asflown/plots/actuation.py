"""The pictures of 000: telemetry of a cover actuation, its smoothing, and torques against truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..estimate.subject import Subject, grid_for, splined
from ..estimate.torque import TorqueResult, smoothed_as_printed, splined_momentum
from ..telemetry.channels import AXES
from .figure import BLUE, BY_AXIS, GREEN, GREY, ORANGE, RED, minutes, new_figure
from .torque import draw_torque, draw_truth

if TYPE_CHECKING:
    from ..telemetry.telemetry import Telemetry

_RPM = 60 / (2 * np.pi)


def wheel_rates_figure(telemetry: Telemetry):
    """Wheel rates since the start of the record (000 Fig 5)."""
    figure, (ax,) = new_figure(height=3.6)
    for name, color in zip(telemetry.members("wheel_rate"), (BLUE, ORANGE, GREEN, RED), strict=False):
        c = telemetry.channel(f"wheel_rate_{name}").usable
        ax.plot(
            telemetry.seconds(c.tai_ns) / 60,
            _RPM * (c.values - c.values[0]),
            ".-",
            color=color,
            ms=3,
            lw=0.8,
            label=name,
        )
    ax.set_ylabel("wheel rate since start [rpm]")
    ax.set_title("Wheel rates take up what the cover gives", loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8)
    minutes(ax)
    return figure


def body_rates_figure(telemetry: Telemetry):
    """Body rates as telemetered (000 Fig 6)."""
    figure, panels = new_figure(3, height=1.7)
    for axis, ax, color in zip(AXES, panels, BY_AXIS, strict=True):
        c = telemetry.channel(f"body_rate_{axis}").usable
        ax.plot(telemetry.seconds(c.tai_ns) / 60, 1e6 * c.values, ".-", color=color, ms=3, lw=0.8)
        ax.set_ylabel(f"{axis} [µrad/s]")
    panels[0].set_title("Body rates: small, but the wheels alone miss them", loc="left", fontsize=11)
    minutes(panels[-1])
    return figure


def momentum_figure(subject: Subject, title: str):
    """Wheel momentum since the start, splined to 1 s, before and after the paper's smoothing (000 Figs 7, B1)."""
    grid, momentum = splined_momentum(subject)
    smooth, span = smoothed_as_printed(momentum)
    figure, panels = new_figure(3, height=1.9)
    t = grid.from_epoch(subject.telemetry) / 60
    for j, ax in enumerate(panels):
        ax.plot(t, momentum[:, j] - momentum[0, j], color=BLUE, lw=1.0, label="interpolated")
        ax.plot(t, smooth[:, j] - momentum[0, j], color=ORANGE, lw=1.4, label=f"smoothed, {span} s")
        ax.set_ylabel(f"h {AXES[j]} [N m s]")
    panels[0].legend(frameon=False, fontsize=8)
    panels[0].set_title(title, loc="left", fontsize=11)
    minutes(panels[-1])
    return figure


def attitude_error_figure(telemetry: Telemetry, axis: str):
    """Attitude error, splined to 1 s, before and after the paper's smoothing (000 Fig 10)."""
    channel = telemetry.channel(f"attitude_error_{axis}")
    grid = grid_for([channel], step_s=1.0)
    e = splined(channel, grid)
    smooth, span = smoothed_as_printed(e[:, None])
    figure, (ax,) = new_figure(height=3.6)
    t = grid.from_epoch(telemetry) / 60
    ax.plot(t, 1e6 * e, color=BLUE, lw=0.9, label="interpolated")
    ax.plot(t, 1e6 * smooth[:, 0], color=ORANGE, lw=1.4, label=f"smoothed, {span} s")
    ax.set_ylabel(f"attitude error {axis} [µrad]")
    ax.set_title("Attitude error, commanded minus estimated", loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8)
    minutes(ax)
    return figure


def torque_figure(results: list[TorqueResult], axis: str, title: str, *, truth=None, stall_s: float | None = None):
    """One or more reconstructions (000 Figs 8, 11, 12), against truth where there is one (Figs 21, 22).

    ``truth``: (time_s, torque_Nm); ``stall_s``: when the motor stalled."""
    figure, (ax,) = new_figure(height=4.0)
    j = AXES.index(axis)
    if truth is not None:
        draw_truth(truth[0], truth[1], ax)
    for result, color in zip(results, (BLUE, RED, GREEN, ORANGE), strict=False):
        draw_torque(result, ax, j, color=color)
    if stall_s is not None:
        ax.axvline(stall_s / 60, color=GREEN, linestyle=":", linewidth=1.4, label="stall")
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set_title(title, loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, loc="upper right")
    minutes(ax)
    return figure
