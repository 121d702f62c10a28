"""The pictures of the cover paper: telemetry of a cover actuation, its smoothing, and torques against truth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..telemetry.channels import AXES
from .figure import BLUE, BY_AXIS, GREEN, GREY, ORANGE, RED, minutes, new_figure
from .torque import draw_axis, draw_truth

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..estimate.torque import TorqueResult
    from ..telemetry.telemetry import Telemetry

_RPM = 60 / (2 * np.pi)


class Smoothed(Protocol):
    """Samples before and after smoothing: ``time_s`` (N,), the others (N, n)."""

    @property
    def time_s(self) -> np.ndarray: ...

    @property
    def values(self) -> np.ndarray: ...

    @property
    def smoothed(self) -> np.ndarray: ...

    @property
    def span(self) -> int: ...


def wheel_rates_figure(telemetry: Telemetry):
    """Wheel rates since the start of the record (its Fig 5)."""
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
    """Body rates as telemetered (its Fig 6)."""
    figure, panels = new_figure(3, height=1.7)
    for axis, ax, color in zip(AXES, panels, BY_AXIS, strict=True):
        c = telemetry.channel(f"body_rate_{axis}").usable
        ax.plot(telemetry.seconds(c.tai_ns) / 60, 1e6 * c.values, ".-", color=color, ms=3, lw=0.8)
        ax.set_ylabel(f"{axis} [µrad/s]")
    panels[0].set_title("Body rates: small, but the wheels alone miss them", loc="left", fontsize=11)
    minutes(panels[-1])
    return figure


def momentum_figure(momentum: Smoothed, title: str):
    """Wheel momentum since the start [N m s], before and after the paper's smoothing (its Figs 7, B1)."""
    figure, panels = new_figure(3, height=1.9)
    for j, ax in enumerate(panels):
        _draw_smoothed(momentum, j, 1.0, ax)
        ax.set_ylabel(f"h {AXES[j]} [N m s]")
    panels[0].legend(frameon=False, fontsize=8)
    panels[0].set_title(title, loc="left", fontsize=11)
    minutes(panels[-1])
    return figure


def attitude_error_figure(error: Smoothed, axis: str):
    """Attitude error about one axis [rad], before and after the paper's smoothing (its Fig 10)."""
    figure, (ax,) = new_figure(height=3.6)
    _draw_smoothed(error, 0, 1e6, ax)
    ax.set_ylabel(f"attitude error {axis} [µrad]")
    ax.set_title("Attitude error, commanded minus estimated", loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8)
    minutes(ax)
    return figure


def _draw_smoothed(samples: Smoothed, column: int, scale: float, ax) -> None:
    t = samples.time_s / 60
    ax.plot(t, scale * samples.values[:, column], color=BLUE, lw=1.0, label="interpolated")
    ax.plot(t, scale * samples.smoothed[:, column], color=ORANGE, lw=1.4, label=f"smoothed, {samples.span} s")


def torque_figure(results: Sequence[TorqueResult], axis: str, title: str, *, truth=None, stall_s: float | None = None):
    """One or more reconstructions (the paper's Figs 8, 11, 12), against truth where there is one (Figs 21, 22).

    ``truth``: (time_s, torque_Nm); ``stall_s``: when the motor stalled."""
    figure, (ax,) = new_figure(height=4.0)
    j = AXES.index(axis)
    if truth is not None:
        draw_truth(truth[0], truth[1], ax)
    for result, color in zip(results, (BLUE, RED, GREEN, ORANGE), strict=False):
        draw_axis(result, ax, j, color=color)
    if stall_s is not None:
        ax.axvline(stall_s / 60, color=GREEN, linestyle=":", linewidth=1.4, label="stall")
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set_title(title, loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, loc="upper right")
    minutes(ax)
    return figure


def profile_figures(profile: str, number: str, results: Sequence[TorqueResult], truth, axis: str) -> dict:
    """Figures by name of a test profile's torque by the printed methods, the corrected ones and the fused one, five results."""
    titles = {
        f"fig{number}-{profile}": (
            results[:2],
            f"the printed methods against the torque flown (cover paper, Fig {number})",
        ),
        f"fig{number}-{profile}-corrected": (results[2:4], "the corrected methods, 95 % bands of noise"),
        f"{profile}-fused": (results[4:], "all channels at once, 95 % band"),
    }
    return {n: torque_figure(those, axis, f"{profile}: {title}", truth=truth) for n, (those, title) in titles.items()}


def deployment_figures(results: Sequence[TorqueResult], truth, axis: str, stall_s: float) -> dict:
    """Figures by name of a deployment's torque, by the same five."""
    as_printed = {
        "fig08-torque-momentum": (results[:1], "Torque from wheel momentum (cover paper, Fig 8)"),
        "fig11-torque-transfer": (results[1:2], "Torque from attitude error (cover paper, Fig 11)"),
        "fig12-both": (results[:2], "Both printed methods (cover paper, Fig 12)"),
    }
    ours = {
        "cover-deploy-corrected": (results[2:4], "Deploy: corrected methods against the torque flown"),
        "cover-deploy-fused": (results[4:], "Deploy: all channels at once, 95 % band"),
    }
    drawn = {n: torque_figure(those, axis, title, stall_s=stall_s) for n, (those, title) in as_printed.items()}
    return drawn | {
        n: torque_figure(those, axis, title, truth=truth, stall_s=stall_s) for n, (those, title) in ours.items()
    }
