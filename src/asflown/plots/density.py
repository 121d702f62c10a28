"""Density along a flyby, with both its errors and the published peaks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .figure import BLUE, GREY, ORANGE, RED, new_figure, save, write_doubts

if TYPE_CHECKING:
    from ..estimate.density import DensityResult
    from ..kit.doubts import Doubts

_PLUME_S = (-60.0, 180.0)  # where jets are met
_TALL = 4  # tallest peaks: a taller axis would not show the gas
_HEIGHTS = 6  # scale heights of an atmosphere that are shown
SCALE = 1e12


def draw_density(result: DensityResult, ax):
    """Density over time from closest approach; dark band: shape, light: shape and scale together (95 %).  Returns ax."""
    t, rho = result.time_s, SCALE * result.density_kgm3
    for sigma, strength, label in (
        (result.density_sigma_kgm3, 0.15, "with the scale, 95 %"),
        (result.density_sigma_shape_kgm3, 0.3, "shape, 95 %"),
    ):
        if sigma is not None:
            half = 1.96 * SCALE * sigma
            ax.fill_between(t, rho - half, rho + half, color=BLUE, alpha=strength, linewidth=0, label=label)
    ax.plot(t, rho, color=BLUE, linewidth=1.4, label=f"{result.method}, {result.variant}")
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.axvline(0, color=GREY, linewidth=0.6, linestyle=":")
    ax.set_ylabel("density [10⁻¹² kg/m³]")
    return ax


def draw_published_peaks(result: DensityResult, ax):
    """Peaks of the plume paper's Table 4 for the same flyby, with their published error.  Returns ax."""
    for ratio, color, mark in zip(result.published, (ORANGE, RED), "sD", strict=False):
        p = ratio.published
        ax.errorbar(
            p.time_s,
            SCALE * p.middle_kgm3,
            SCALE * p.half_width_kgm3,
            fmt=mark,
            color=color,
            markersize=5,
            capsize=3,
            label=f"{p.instrument}, published",
        )
    return ax


def draw_noticed(result: DensityResult, ax):
    """First and last instant at which gas is noticed (triangles down), and the plume paper's points P and R (up).  Returns ax."""
    n = result.noticed
    if n is not None:
        ax.plot([n.first_s, n.last_s], [0, 0], "v", color=BLUE, markersize=6, label="gas noticed from, to")
        if n.published_s is not None:
            ax.plot(n.published_s, [0, 0], "^", color=ORANGE, markersize=5, label="P and R, published")
    return ax


def draw_peak(result: DensityResult, ax):
    """The peak with its 95 % in time and in shape.  Returns ax."""
    p = result.peak
    if p.time_sigma_s is not None and p.density_sigma_shape_kgm3 is not None:
        bars = [1.96 * SCALE * p.density_sigma_shape_kgm3], [1.96 * p.time_sigma_s]
        ax.errorbar(
            [p.time_s],
            [SCALE * p.density_kgm3],
            *bars,
            fmt="o",
            color="black",
            markersize=4,
            capsize=3,
            label=f"peak {p.way}, 95 %",
        )
    return ax


def draw_bound(result: DensityResult, ax):
    """The most that torques left out can mimic.  Returns ax."""
    ax.plot(
        result.time_s,
        SCALE * result.bound_kgm3,
        color=GREY,
        linewidth=1.0,
        linestyle="--",
        label="torques left out, at most",
    )
    return ax


def draw_whole_density(result: DensityResult, ax):
    """Density with bound, span noticed, published peaks, its own peak, and the atmosphere where one is fitted.  Returns ax."""
    draw_density(result, ax)
    draw_bound(result, ax)
    draw_noticed(result, ax)
    draw_published_peaks(result, ax)
    draw_peak(result, ax)
    if result.atmosphere is not None:
        fitted = SCALE * result.atmosphere.density(result.altitude_m)
        ax.plot(result.time_s, fitted, color=RED, linewidth=1.2, label="exponential atmosphere")
    return ax


def save_density_figure(result: DensityResult, path) -> None:
    """Density, bound and published peaks; altitude along the top, doubts beneath."""
    figure, (ax,) = new_figure(1, height=4.4)
    draw_whole_density(result, ax)
    finish(figure, ax, result, f"Density met by {result.craft}, {result.flyby.name}", result.doubts)
    save(figure, path)


def shown_s(result: DensityResult) -> tuple[float, float]:
    """The part of a result in which gas is met."""
    low, high = _PLUME_S
    flyby = result.flyby
    if flyby.moon.atmosphere is not None:
        top = flyby.closest_m + _HEIGHTS * flyby.moon.atmosphere.scale_height_m
        high = float(np.sqrt(top**2 - flyby.closest_m**2)) / flyby.speed_m_s
        low = -high
    return max(low, float(result.time_s[0])), min(high, float(result.time_s[-1]))


def _fit_height(ax, result: DensityResult) -> None:
    """Where an arm passes through zero, bound and band grow without limit: they do not set the scale."""
    p = result.peak
    heights = [
        p.density_kgm3 + 1.96 * (p.density_sigma_shape_kgm3 or 0.0),
        *(r.published.density_kgm3[1] for r in result.published),
    ]
    tallest, (low, high) = SCALE * max(heights), ax.get_ylim()
    if 0 < _TALL * tallest < high - low:
        ax.set_ylim(max(low, -0.4 * tallest), min(high, 1.4 * tallest))


def finish(figure, ax, result: DensityResult, title: str, doubts: Doubts) -> None:
    """Span shown, altitude along the top, legend, title, doubts beneath."""
    low, high = shown_s(result)
    if high > low:
        ax.set_xlim(low, high)
        ticks = [v for v in ax.get_xticks() if low <= v <= high]
        top = ax.secondary_xaxis("top")
        top.set_xticks(ticks, [f"{result.flyby.altitude(v) / 1e3:.0f}" for v in ticks])
        top.set_xlabel("altitude [km]")
    _fit_height(ax, result)
    ax.legend(frameon=False, fontsize=8)
    ax.set_title(title, loc="left", fontsize=11)
    ax.set_xlabel(f"time from closest approach, {result.closest_approach} [s]")
    write_doubts(figure, doubts)
