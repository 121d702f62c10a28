"""Geometry of a flyby to scale: in its plane (plume paper Figure 10), and from the pole (Figure 9)."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.plume import Jet, sources_passed
from .figure import BLUE, GREY, RED
from .jets import OF_JETS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..dynamics.flyby import Flyby
    from ..estimate.density import DensityResult


def draw_geometry(result: DensityResult, ax, sources: Sequence[Jet] | None = None):
    """Plane of trajectory and spin axis, to scale, north up: moon, jets with their widths, the path with points P, Q, R.  Returns ax.

    ``sources``: as the flyby passes them; those published unless given.

    P, Q, R: where the plume is first noticed, at its peak, last noticed; P and R as published where they are (E3)."""
    flyby, radius = result.flyby, result.flyby.moon.radius_m / 1e3
    turn = np.linspace(0, 2 * np.pi, 121)
    ax.fill(radius * np.sin(turn), radius * np.cos(turn), color="#dfe7ee", edgecolor=GREY, linewidth=1.0)
    ax.text(0, 0, flyby.moon.name, ha="center", va="center", fontsize=9, color=GREY)
    start, stop = -30.0, max(120.0, (flyby.noticed_s or (0, 0))[1] + 8)
    path = _projected(flyby, np.linspace(start, stop, 50))
    far = float(np.abs(path).max())
    if flyby.moon.atmosphere is None and flyby.longitude_west_rad is not None:
        for j, color in zip(sources_passed(flyby, sources), cycle(OF_JETS)):
            axis = np.array([np.sin(j.tilt_rad), -np.cos(j.tilt_rad)])
            source = radius * axis
            for side in (-j.width_rad, j.width_rad):
                edge = np.array([np.sin(j.tilt_rad + side), -np.cos(j.tilt_rad + side)])
                ax.plot(*_ray(source, edge, 0.45 * far), color=color, linewidth=0.7, linestyle=":")
            ax.plot(*_ray(source, axis, 0.75 * far), color=color, linewidth=1.2, label=j.name)
            ax.plot(*source, "o", color=color, markersize=3.5)
    ax.plot(*path.T, color=BLUE, linewidth=1.4, label=f"trajectory {flyby.name}")
    closest = _projected(flyby, 0.0)
    level = abs(path[-1, 0] - path[0, 0]) > abs(
        path[-1, 1] - path[0, 1]
    )  # labels stand beside the path, or above and below it
    ax.plot(*closest, "|", color=BLUE, markersize=9)
    place = {"xytext": (0, -29), "ha": "center"} if level else {"xytext": (6, 4)}
    ax.annotate("closest approach", closest, textcoords="offset points", fontsize=8, color=BLUE, **place)
    for name, time_s in _points(result).items():
        if start <= time_s <= stop:
            at = _projected(flyby, time_s)
            ax.plot(*at, "o", color=RED, markersize=5)
            place = {"xytext": (0, -15 if name == "Q" else 8), "ha": "center"} if level else {"xytext": (8, -3)}
            ax.annotate(f"{name}, {time_s:+.0f} s", at, textcoords="offset points", fontsize=9, color=RED, **place)
    ax.axvline(0, color=GREY, linewidth=0.6, linestyle="--")
    ax.set_aspect("equal")
    ax.set_xlabel("from the spin axis, on the side of closest approach [km]")
    ax.set_ylabel("north of the centre [km]")
    ax.set_title(f"{flyby.name} past {flyby.moon.name}, to scale", loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def draw_from_pole(result: DensityResult, ax, sources: Sequence[Jet] | None = None):
    """The south pole's surroundings seen from the south, to scale: sources, and the path projected along the spin axis.  Returns ax."""
    flyby, radius = result.flyby, result.flyby.moon.radius_m / 1e3
    turn = np.linspace(0, 2 * np.pi, 121)
    for degrees in (10, 20, 30):
        size = radius * np.sin(np.radians(degrees))
        ax.plot(size * np.cos(turn), size * np.sin(turn), color=GREY, linewidth=0.6, linestyle=":")
        ax.annotate(f"{90 - degrees}° S", (0, -size), fontsize=7, color=GREY, ha="center")
    reach = 1.15 * radius * np.sin(np.radians(30))
    for west in range(0, 360, 45):
        way = np.array([np.cos(np.radians(west)), np.sin(np.radians(west))])
        ax.plot(*np.outer(way, [0, reach]), color=GREY, linewidth=0.4)
        ax.annotate(f"{west}° W", 1.04 * reach * way, fontsize=7, color=GREY, ha="center", va="center")
    start, stop = result.noticed_s or (-60.0, 60.0)
    path = _from_south(flyby, np.linspace(start - 60, stop + 60, 400))
    inside = np.hypot(*path.T) <= reach
    ax.plot(*path[inside].T, color=BLUE, linewidth=1.6, label=f"trajectory {flyby.name}")
    if flyby.moon.atmosphere is None:
        for jet, color in zip(sources_passed(flyby, sources), cycle(OF_JETS)):
            w, out = jet.longitude_west_rad, radius * np.cos(jet.latitude_south_rad)
            ax.plot(out * np.cos(w), out * np.sin(w), "o", color=color, markersize=6, label=jet.name)
    peak = _from_south(flyby, result.peak.time_s)
    if np.hypot(*peak) <= reach:
        ax.plot(*peak, "o", color=RED, markersize=5)
        ax.annotate(
            f"Q, {result.peak.time_s:+.0f} s", peak, xytext=(7, 4), textcoords="offset points", fontsize=9, color=RED
        )
    ax.set_aspect("equal")
    ax.set_xlabel("towards 0° W [km]")
    ax.set_ylabel("towards 90° W [km]")
    ax.set_title(f"{flyby.name} from below the south pole of {flyby.moon.name}", loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def _points(result: DensityResult) -> dict[str, float]:
    first, last = result.noticed_s or (None, None)
    found = {"P": first, "Q": result.peak.time_s, "R": last}
    return {k: float(v) for k, v in found.items() if v is not None}


def _projected(flyby: Flyby, time_s) -> np.ndarray:
    """Out of the spin axis and north, (..., 2). [km]"""
    return flyby.in_plane(time_s) * np.array([1e-3, -1e-3])


def _from_south(flyby: Flyby, time_s) -> np.ndarray:
    """Towards 0 and towards 90 degrees west, (..., 2). [km]"""
    return flyby.from_south(time_s) / 1e3


def _ray(source, along, length: float):
    end = source + length * along
    return [source[0], end[0]], [source[1], end[1]]
