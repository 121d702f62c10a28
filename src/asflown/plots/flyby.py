"""The set of figures of one flyby: geometry to scale, what the telemetry shows, torque, momentum, density, jets.

After 004: geometry is its Figures 9 (from the pole) and 10, attitude and rate errors its 4, 5, A3, C2 and C3, body rates A2, torque 6 and 8, momentum 7,
components 11, model and reconstruction 12.  Time is from closest approach.
"""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.plume import Jet, sources_passed
from ..dynamics.trajectory import Trajectory
from ..estimate.subject import samples_of, subject_of
from ..kit.errors import BadInput
from ..telemetry.channels import AXES
from .density import (
    OF_JETS,
    draw_bound,
    draw_density,
    draw_jets,
    draw_noticed,
    draw_peak,
    draw_published_peaks,
    finish,
    shown_s,
)
from .figure import BLUE, BY_AXIS, GREEN, GREY, ORANGE, RED, new_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..craft.model import Craft
    from ..estimate.density import DensityResult
    from ..estimate.jets import JetsResult
    from ..telemetry.telemetry import Telemetry

#: Family of channels -> file name, label, what one SI unit is in it.
_READINGS = {
    "attitude_error": ("attitude-error", "attitude error [mrad]", 1e3),
    "rate_error": ("rate-error", "rate error [10⁻⁵ rad/s]", 1e5),
    "body_rate": ("body-rate", "body rate [10⁻⁵ rad/s]", 1e5),
}


def flyby_figures(
    result: DensityResult,
    telemetry: Telemetry,
    craft: Craft,
    jets: JetsResult | None = None,
    sources: Sequence[Jet] | None = None,
) -> dict:
    """Figures by file name; those whose channels or places are not known are left out.  ``sources``: in place of the published; those of ``jets`` where they are fitted."""
    closest_s = _closest(result, telemetry)
    if jets is not None:
        sources = [s.jet for s in jets.sources]
    figures = {}
    if result.flyby.latitude_south_rad is not None:
        figures["geometry"] = _alone(draw_geometry, result, sources, height=5.6, width=7.2)
    if result.flyby.longitude_west_rad is not None:
        figures["geometry-pole"] = _alone(draw_from_pole, result, sources, height=5.4, width=6.6)
    for stem, (name, label, scale) in _READINGS.items():
        if telemetry.has_axes(stem):
            figure, (ax,) = new_figure(1, height=3.4)
            draw_readings(telemetry, stem, closest_s, ax, scale)
            ax.set_ylabel(label)
            figures[name] = _timed(figure, ax, result, f"{label.split(' [')[0].capitalize()}, {result.flyby.name}")
    figure, (ax,) = new_figure(1, height=3.6)
    draw_torque(result, ax)
    figures["torque"] = _timed(figure, ax, result, f"Torque about {result.axis}, {result.flyby.name}")
    try:
        samples = samples_of(subject_of(telemetry, craft))
    except BadInput:
        samples = None  # actuators known by their torque only have no momentum to show
    if samples is not None:
        figure, (ax,) = new_figure(1, height=3.4)
        draw_momentum(samples, result, telemetry, closest_s, ax)
        figures["momentum"] = _timed(figure, ax, result, f"Momentum about {result.axis}, {result.flyby.name}")
    figure, (ax,) = new_figure(1, height=4.0)
    draw_density(result, ax)
    draw_bound(result, ax)
    draw_noticed(result, ax)
    draw_published_peaks(result, ax)
    draw_peak(result, ax)
    if result.atmosphere is not None:
        ax.plot(
            result.time_s,
            1e12 * result.atmosphere.density(result.altitude_m),
            color=RED,
            linewidth=1.2,
            label="exponential",
        )
    finish(figure, ax, result, f"Density, {result.flyby.name}", result.doubts)
    figures["density"] = figure
    if jets is not None:
        figure, (ax,) = new_figure(1, height=4.0)
        draw_jets(jets, ax)
        ax.set_ylabel("density [10⁻¹² kg/m³]")
        finish(figure, ax, result, f"Jets and their sum, {result.flyby.name}: power {jets.power:g}", jets.doubts)
        figures["components"] = figure
        figure, (ax,) = new_figure(1, height=4.0)
        draw_density(result, ax)
        ax.plot(result.time_s, 1e12 * jets.model_kgm3, color=RED, linewidth=1.4, label="jets together")
        finish(figure, ax, result, f"Density reconstructed and of the jets, {result.flyby.name}", ())
        figures["model"] = figure
    return figures


def draw_geometry(result: DensityResult, ax, sources: Sequence[Jet] | None = None):
    """Plane of trajectory and spin axis, to scale, north up: moon, jets with their widths, the path with 004's points.  Returns ax.

    ``sources``: as the flyby passes them; those published unless given.

    P, Q, R: where the plume is first noticed, at its peak, last noticed; 004's own where they are published (E3)."""
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
    start, stop = _span(result) or (-60.0, 60.0)
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


def draw_readings(telemetry: Telemetry, stem: str, closest_s: float, ax, scale: float):
    """A family of channels about the three axes.  Returns ax."""
    for axis, color in zip(AXES, BY_AXIS, strict=True):
        u = telemetry.channel(f"{stem}_{axis}").usable
        ax.plot(telemetry.seconds(u.tai_ns) - closest_s, scale * u.values, color=color, linewidth=1.0, label=axis)
    return ax


def draw_torque(result: DensityResult, ax):
    """Torque about the flyby's axes, with its 95 % band where it is one, and the gravity gradient where it is taken off.  Returns ax."""
    t = result.time_s
    torques = 1e3 * result.torque_Nm.reshape(len(t), -1)
    one = len(result.axis) == 1
    if one and result.sigma_shape_kgm3 is not None:
        half = 1.96 * 1e3 * result.sigma_shape_kgm3 * np.abs(result.per_density(result.axis, t))
        ax.fill_between(
            t, torques[:, 0] - half, torques[:, 0] + half, color=BLUE, alpha=0.25, linewidth=0, label="95 %"
        )
    for a, T in zip(result.axis, torques.T, strict=True):
        color = BLUE if one else BY_AXIS[AXES.index(a)]
        ax.plot(t, T, color=color, linewidth=1.4, label=f"{result.method}, {result.variant}{'' if one else f', {a}'}")
    if result.gravity_gradient_Nm is not None:
        for T in 1e3 * result.gravity_gradient_Nm.reshape(len(t), -1).T:
            ax.plot(t, T, color=ORANGE, linewidth=1.0, label="gravity gradient")
    ax.set_ylabel("torque [mN m]")
    return ax


def draw_momentum(samples, result: DensityResult, telemetry: Telemetry, closest_s: float, ax):
    """Momentum of wheels and body about the flyby's axes, less its first value.  Returns ax."""
    t = telemetry.seconds(samples.tai_ns) - closest_s
    for a in result.axis:
        j = AXES.index(a)
        H, body = samples.momentum[:, j], samples.momentum[:, j] - samples.stored[:, j]
        one = len(result.axis) == 1
        name = "" if one else f", {a}"
        ax.plot(t, H - H[0], ".", color=BLUE if one else BY_AXIS[j], markersize=3, label=f"wheels and body{name}")
        ax.plot(t, body, color=GREEN if one else BY_AXIS[j], linewidth=0.8, label=f"of it the body{name}")
    ax.set_ylabel("momentum gained [N m s]")
    return ax


def _closest(result: DensityResult, telemetry: Telemetry) -> float:
    """Closest approach from the telemetry's epoch. [s]"""
    text = result.closest_approach
    return float(telemetry.seconds(telemetry.moment(text.removesuffix(" UTC").removesuffix(" s"))))


def _span(result: DensityResult) -> tuple[float, float] | None:
    """When the gas was first and last noticed, as published, else as found. [s]"""
    if result.flyby.noticed_s is not None:
        return result.flyby.noticed_s
    return None if result.noticed is None else (result.noticed.first_s, result.noticed.last_s)


def _points(result: DensityResult) -> dict[str, float]:
    first, last = _span(result) or (None, None)
    found = {"P": first, "Q": result.peak.time_s, "R": last}
    return {k: float(v) for k, v in found.items() if v is not None}


def _projected(flyby, time_s) -> np.ndarray:
    """Out of the spin axis and north, (..., 2). [km]"""
    return flyby.in_plane(time_s) * np.array([1e-3, -1e-3])


def _from_south(flyby, time_s) -> np.ndarray:
    """Towards 0 and towards 90 degrees west, (..., 2). [km]"""
    if isinstance(flyby, Trajectory):
        return flyby.place(time_s)[..., :2] * np.array([1e-3, -1e-3])
    west = flyby.longitude_west_rad
    return flyby.in_plane(time_s)[..., :1] * np.array([np.cos(west), np.sin(west)]) / 1e3


def _ray(source, along, length: float):
    end = source + length * along
    return [source[0], end[0]], [source[1], end[1]]


def _alone(draw, result: DensityResult, sources, **size):
    figure, (ax,) = new_figure(1, **size)
    draw(result, ax, sources)
    return figure


def _timed(figure, ax, result: DensityResult, title: str):
    low, high = shown_s(result)
    if high > low:
        ax.set_xlim(low, high)
        _fit_height(ax, low, high)
    ax.axvline(0, color=GREY, linewidth=0.6, linestyle=":")
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set_xlabel(f"time from closest approach, {result.closest_approach} [s]")
    ax.set_title(title, loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, ncols=3)
    return figure


def _fit_height(ax, low: float, high: float) -> None:
    """What lies outside the span shown does not set the scale; bands count as lines do."""
    drawn = [np.column_stack([np.asarray(v, float) for v in line.get_data()]) for line in ax.lines]
    drawn += [path.vertices for band in ax.collections for path in band.get_paths()]
    seen = np.concatenate([xy[(xy[:, 0] >= low) & (xy[:, 0] <= high), 1] for xy in drawn])
    seen = seen[np.isfinite(seen)]
    if len(seen) and np.ptp(seen) > 0:
        ax.set_ylim(seen.min() - 0.12 * np.ptp(seen), seen.max() + 0.22 * np.ptp(seen))
