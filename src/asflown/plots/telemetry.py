"""Telemetry: channels over time, a panel for each family, samples that are not used marked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .figure import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, breaks, new_figure
from .torque import time_scale

if TYPE_CHECKING:
    from ..telemetry.telemetry import Channel, Telemetry

_COLORS = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY)


def draw_telemetry(telemetry: Telemetry, names: list[str]):
    """A figure with a panel for each family of channels that are numbers; times from the epoch. Returns it."""
    families: dict[str, list[Channel]] = {}
    for name in names:
        c = telemetry.channels[name]
        if c.values.dtype.kind == "f":
            families.setdefault(c.kind.stem, []).append(c)
    figure, panels = new_figure(max(len(families), 1), height=2.2)
    scale, unit = time_scale(telemetry.seconds(np.array(telemetry.span())))
    for ax, (stem, channels) in zip(panels, families.items(), strict=False):
        for k, c in enumerate(channels):
            _draw(telemetry, c, ax, scale, _COLORS[k % len(_COLORS)])
        kind = channels[0].kind
        ax.set_ylabel(f"{stem.replace('_', ' ')} [{kind.unit}]" if kind.unit else stem.replace("_", " "))
        ax.legend(loc="upper right", fontsize="small", ncols=3)
    panels[-1].set_xlabel(f"time from {telemetry.epoch_label} [{unit}]" if telemetry.dated else f"time [{unit}]")
    return figure


def _draw(telemetry: Telemetry, c: Channel, ax, scale: float, color: str) -> None:
    used = c.usable
    at, value = breaks(telemetry.seconds(used.tai_ns), used.values, 6.5 * c.cadence_ns / 1e9)
    ax.plot(at / scale, value, color=color, linewidth=1.0, label=c.member or c.name)
    if not c.valid.all():
        left = c.where(~c.valid)
        inside = (
            (left.values >= used.values.min()) & (left.values <= used.values.max())
            if len(used.values)
            else left.valid | True
        )
        ax.plot(telemetry.seconds(left.tai_ns[inside]) / scale, left.values[inside], "x", color=RED, markersize=4)
