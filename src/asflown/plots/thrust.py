"""Thrust: wheels and on-times of each event (Feldman & Lee, Figures C1, C2), what the fit leaves, and every thruster's thrust."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .figure import BLUE, BY_AXIS, GREEN, GREY, ORANGE, PURPLE, RED, new_figure, save, write_doubts
from .torque import time_scale

if TYPE_CHECKING:
    from ..estimate.thrust import EventSeen, ThrustResult

_RPM = 60 / (2 * np.pi)
_COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, GREY)


def draw_wheels(event: EventSeen, ax, scale: float):
    """Wheel rates, as in Feldman & Lee, Figure C1.  Returns ax."""
    for k, (name, rate) in enumerate(event.wheel_rate_rad_s.items()):
        ax.plot(event.wheel_time_s / scale, _RPM * rate, color=_COLOURS[k % 6], linewidth=1.2, label=name)
    ax.set_ylabel("wheel rate [rpm]")
    if event.wheel_rate_rad_s:
        ax.legend(frameon=False, fontsize=7, loc="best", ncols=2)
    return ax


def draw_on_times(event: EventSeen, names: tuple[str, ...], ax, scale: float):
    """On-times of the thrusters that fired, as in Feldman & Lee, Figure C2: those that fire together share a line.  Returns ax."""
    t = event.counter_time_s / scale
    drawn = event.alike(names)
    for k, (group, on) in enumerate(drawn):
        ax.step(t, on, where="post", color=_COLOURS[k % 6], linewidth=1.2, label=", ".join(group))
    ax.set_ylabel("on-time [s]")
    if drawn:
        ax.legend(frameon=False, fontsize=7, loc="best", ncols=2)
    return ax


def draw_left(event: EventSeen, left, ax, scale: float):
    """Momentum gained that the fit does not explain, (K, 3), about each axis.  Returns ax."""
    for k, axis in enumerate("XYZ"):
        ax.plot(event.time_s / scale, 1e3 * left[:, k], ".-", color=BY_AXIS[k], linewidth=0.8, ms=3, label=axis)
    ax.axhline(0, color=GREY, linewidth=0.6)
    gained = np.abs(event.gained_Nms).max()
    ax.set_ylabel(f"not explained\n[mN m s of {gained:.3g} N m s]")
    ax.legend(frameon=False, fontsize=7, loc="best", ncols=3)
    return ax


def draw_thrust(result: ThrustResult, ax):
    """Every thruster with its 95 % interval, groups that fire together, and the mean with its band.  Returns ax."""
    rows = [(n, v, result.thrust_sigma_N[n]) for n, v in result.thrust_N.items() if v is not None]
    rows += [(p.name, p.thrust_N, p.thrust_sigma_N) for p in result.pairs]
    for k, (_, value, sigma) in enumerate(rows):
        colour = BLUE if k < len(rows) - len(result.pairs) else GREEN
        if sigma is None:
            ax.plot(k, value, "o", color=colour, ms=4)
        else:
            ax.errorbar(k, value, 1.96 * sigma, fmt="o", color=colour, ms=4, lw=1.2)
    mean, sigma = result.mean_thrust_N, result.mean_thrust_sigma_N
    ax.axhline(mean, color=RED, linewidth=1.2, label="mean" if sigma is None else "mean, 95 %")
    if sigma is not None:
        ax.axhspan(mean - 1.96 * sigma, mean + 1.96 * sigma, color=RED, alpha=0.15, linewidth=0)
    if result.predicted_thrust_N is not None:
        ax.axhline(result.predicted_thrust_N, color=GREY, linewidth=1.0, linestyle="--", label="predicted for the date")
    ax.set_xticks(range(len(rows)), [n for n, _, _ in rows], fontsize=8)
    ax.set_xlim(-0.6, len(rows) - 0.4)
    ax.set_ylabel("steady thrust [N]")
    ax.legend(frameon=False, fontsize=7, loc="best", ncols=2)
    return ax


def save_thrust_figure(result: ThrustResult, path) -> None:
    """Wheels, on-times and what is left of every record, then the thrusts; doubts beneath."""
    kinds = [
        (e, k) for e in result.events for k in ("wheels", "on-times", "left") if k != "left" or e.left_Nms is not None
    ]
    figure, panels = new_figure(len(kinds) + 1, height=2.2, sharex=False)
    for (event, kind), ax in zip(kinds, panels, strict=False):
        scale, unit = time_scale(event.counter_time_s)
        if kind == "wheels":
            draw_wheels(event, ax, scale).set_title(event.label, loc="left", fontsize=9)
        elif kind == "on-times":
            draw_on_times(event, result.names, ax, scale)
        else:
            draw_left(event, event.left_Nms, ax, scale)
        ax.set_xlim(event.counter_time_s[0] / scale, event.counter_time_s[-1] / scale)
        if kind == ("on-times" if event.left_Nms is None else "left"):
            ax.set_xlabel(f"time from the record's epoch [{unit}]")
    draw_thrust(result, panels[-1])
    panels[-1].set_title(f"Thrust of {result.craft}: {result.method}, {result.variant}", loc="left", fontsize=9)
    write_doubts(figure, result.doubts)
    save(figure, path)
