"""Density along a flyby, with both its errors and the peaks that others found, and the jets that make it."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.plume import jet_density
from .figure import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, new_figure, save, write_doubts

if TYPE_CHECKING:
    from ..estimate.density import DensityResult
    from ..estimate.jets import JetsResult

_PLUME_S = (-60.0, 180.0)  # where jets are met
_TALL = 4  # of the tallest peak: an axis of so many has nothing to do with gas
_HEIGHTS = 6  # scale heights of an atmosphere that are shown
_SCALE = 1e12
#: What a reader of a density must know before all else.
_FIRST = (
    "no gas is seen",
    "do not explain",
    "does not explain",
    "scale is not known",
    "the sources named",
    "from on-times a cusp",
    "is negative",
    "may lie outside",
    "gravity gradient is not",
)
#: Colours of sources, again from the first where there are more.
OF_JETS = (GREEN, ORANGE, PURPLE, SKY, "black")


def draw_density(result: DensityResult, ax):
    """Density over time from closest approach; dark band: shape, light: shape and scale together (95 %).  Returns ax."""
    t, rho = result.time_s, _SCALE * result.density_kgm3
    for sigma, strength, label in (
        (result.sigma_kgm3, 0.15, "with the scale, 95 %"),
        (result.sigma_shape_kgm3, 0.3, "shape, 95 %"),
    ):
        if sigma is not None:
            half = 1.96 * _SCALE * sigma
            ax.fill_between(t, rho - half, rho + half, color=BLUE, alpha=strength, linewidth=0, label=label)
    ax.plot(t, rho, color=BLUE, linewidth=1.4, label=f"{result.method}, {result.variant}")
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.axvline(0, color=GREY, linewidth=0.6, linestyle=":")
    ax.set_ylabel("density [10⁻¹² kg/m³]")
    return ax


def draw_published_peaks(result: DensityResult, ax):
    """Peaks of 004 Table 4 for the same flyby, with what is published of their error.  Returns ax."""
    for beside, color, mark in zip(result.beside, (ORANGE, RED), "sD", strict=False):
        p = beside.published
        middle = _SCALE * float(np.mean(p.density_kgm3))
        half = _SCALE * (p.sigma_kgm3 or 0.5 * (p.density_kgm3[1] - p.density_kgm3[0]))
        ax.errorbar(
            p.time_s, middle, half, fmt=mark, color=color, markersize=5, capsize=3, label=f"{p.instrument}, published"
        )
    return ax


def draw_noticed(result: DensityResult, ax):
    """First and last instant at which the gas stands out (triangles down), and 004's points P and R (up).  Returns ax."""
    n = result.noticed
    if n is not None:
        ax.plot([n.first_s, n.last_s], [0, 0], "v", color=BLUE, markersize=6, label="gas stands out from, to")
        if n.published_s is not None:
            ax.plot(n.published_s, [0, 0], "^", color=ORANGE, markersize=5, label="P and R, published")
    return ax


def draw_peak(result: DensityResult, ax):
    """The peak with its 95 % in time and in shape.  Returns ax."""
    p = result.peak
    if p.sigma_time_s is not None and p.sigma_shape_kgm3 is not None:
        bars = [1.96 * _SCALE * p.sigma_shape_kgm3], [1.96 * p.sigma_time_s]
        ax.errorbar(
            [p.time_s],
            [_SCALE * p.density_kgm3],
            *bars,
            fmt="o",
            color="black",
            markersize=4,
            capsize=3,
            label=f"peak {p.way}, 95 %",
        )
    return ax


def draw_bound(result: DensityResult, ax):
    """What torques left out may feign at most.  Returns ax."""
    ax.plot(
        result.time_s, _SCALE * result.bound_kgm3, color=GREY, linewidth=1.0, linestyle="--", label="left out, at most"
    )
    return ax


def draw_jets(result: JetsResult, ax):
    """Density of the jets together and of each, as in 004 Figures 11 and 12.  Returns ax."""
    d = result.density
    ax.plot(d.time_s, _SCALE * result.model_kgm3, color=RED, linewidth=1.4, label="jets together")
    for source, color in zip(result.sources, cycle(OF_JETS)):
        rho = jet_density(source.jet, d.flyby, d.time_s, power=result.power, angle=result.angle)
        known = "" if source.density_known else " (not identified)"
        ax.plot(d.time_s, _SCALE * rho, color=color, linewidth=1.0, label=source.jet.name + known)
    return ax


def save_density_figure(result: DensityResult, path) -> None:
    """Density, bound and published peaks; altitude along the top, doubts beneath."""
    figure, (ax,) = new_figure(1, height=4.4)
    draw_density(result, ax)
    draw_bound(result, ax)
    draw_noticed(result, ax)
    draw_published_peaks(result, ax)
    draw_peak(result, ax)
    finish(figure, ax, result, f"Density met by {result.craft}, {result.flyby.name}", result.doubts)
    save(figure, path)


def save_jets_figure(result: JetsResult, path) -> None:
    """The jets' density over the one reconstructed; altitude along the top, doubts beneath."""
    figure, (ax,) = new_figure(1, height=4.4)
    draw_density(result.density, ax)
    draw_jets(result, ax)
    d = result.density
    finish(figure, ax, d, f"Jets met by {d.craft}, {d.flyby.name}: power {result.power:g}", result.doubts)
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
    """Where an arm passes through zero, bound and band grow beyond all gas: they do not set the scale."""
    p = result.peak
    heights = [
        p.density_kgm3 + 1.96 * (p.sigma_shape_kgm3 or 0.0),
        *(b.published.density_kgm3[1] for b in result.beside),
    ]
    tallest, (low, high) = _SCALE * max(heights), ax.get_ylim()
    if 0 < _TALL * tallest < high - low:
        ax.set_ylim(max(low, -0.4 * tallest), min(high, 1.4 * tallest))


def finish(figure, ax, result: DensityResult, title: str, doubts) -> None:
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
    write_doubts(figure, doubts, first=[d for d in doubts if any(w in d for w in _FIRST)])
