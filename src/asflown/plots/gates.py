"""Execution errors of maneuvers: over dV, in the pointing plane, their distribution and directions (Wagner 2014 Figures 1 to 11)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..maneuvers.model import Quantity
from .figure import BLUE, GREEN, GREY, RED, new_figure, save, write_doubts
from .labels import label_points

if TYPE_CHECKING:
    from ..estimate.gates import Directions, GatesResult, Shape
    from ..maneuvers.model import Gates

#: Burns up to which all are labelled; of more, those that stand out.
_ALL = 15


def draw_magnitude(gates: Gates | None, m, ax, marked=(), note: str = ""):
    """Magnitude errors over dV (semi-log) with tracking's error bars, the bias and one sigma about it.  Returns ax."""
    _draw_errors(ax, m, m.magnitude_error_mps, m.sigma_magnitude_mps, marked)
    if gates is not None:
        v = _sizes(m.dv_mps)
        _draw_model(ax, v, gates.mean_magnitude(v), gates.sigma_magnitude(v))
    ax.set_ylabel("magnitude error [mm/s]")
    _finish(ax, m, m.magnitude_error_mps, marked, note)
    return ax


def draw_pointing(gates: Gates | None, m, axis: int, ax, marked=(), note: str = ""):
    """Pointing errors along TVC X (0) or Y (1) over dV, likewise.  Returns ax."""
    od = np.sqrt(m.across[1][:, axis, axis])
    _draw_errors(ax, m, m.across[0][:, axis], od, marked)
    if gates is not None:
        v = _sizes(m.dv_mps)
        _draw_model(ax, v, gates.mean_pointing(v)[:, axis], gates.sigma_pointing(v))
    ax.set_ylabel(f"pointing error {'XY'[axis]} [mm/s]")
    _finish(ax, m, m.across[0][:, axis], marked, note)
    return ax


def _draw_errors(ax, m, error, od, marked) -> None:
    out = np.array([i in marked for i in m.id])
    for rows, color, size in ((~out, BLUE, 4), (out, RED, 5)):
        if rows.any():
            ax.errorbar(
                m.dv_mps[rows], 1e3 * error[rows], 1e3 * od[rows], fmt="o", color=color, ms=size, lw=0.8, alpha=0.85
            )
    ax.set_xscale("log")
    ax.set_xlim(0.75 * m.dv_mps.min(), 1.33 * m.dv_mps.max())  # burns of one size leave nothing to scale by


def _draw_model(ax, v, mean, sigma, color=GREEN, name="model") -> None:
    ax.axhline(0, color=GREY, linewidth=0.8)
    ax.plot(v, 1e3 * mean, "--", color=color, linewidth=1.2, label=f"{name}: bias")
    ax.fill_between(v, 1e3 * (mean - sigma), 1e3 * (mean + sigma), color=color, alpha=0.13, linewidth=0)
    for side in (-1, 1):
        ax.plot(
            v, 1e3 * (mean + side * sigma), color=color, linewidth=1.2, label=f"{name}: 1 sigma" if side > 0 else None
        )


def _finish(ax, m, error, marked, note: str) -> None:
    if note:
        ax.text(0.99, 0.98, note, transform=ax.transAxes, ha="right", va="top", fontsize=8, color=GREY)
    if ax.get_legend_handles_labels()[1]:
        ax.legend(frameon=False, fontsize=7, loc="lower left")
    shown = [k for k, i in enumerate(m.id) if i in marked or len(m) <= _ALL]
    label_points(ax, m.dv_mps[shown], 1e3 * error[shown], [m.id[k] for k in shown], avoid=(m.dv_mps, 1e3 * error))


def _sizes(dv) -> np.ndarray:
    return np.geomspace(0.85 * dv.min(), 1.15 * dv.max(), 200)


def draw_distribution(shape: Shape, ax):
    """Cumulative distribution of standardised errors over the normal one.  Returns ax."""
    z, normal = shape.quantiles, shape.normal_quantiles
    share = (np.arange(len(z)) + 1) / len(z)
    ax.step(z, share, where="post", color=BLUE, linewidth=1.2, label="errors")
    ax.plot(normal, share - 0.5 / len(z), color=RED, linewidth=1.2, label="normal")
    ax.set_xlabel("standardised error")
    ax.set_ylabel("share below")
    ax.legend(frameon=False, fontsize=7, loc="upper left")
    return ax


def draw_quantiles(shape: Shape, ax, name: str):
    """Sorted standardised errors over normal quantiles, with the band of 95 % of refitted simulations.  Returns ax."""
    x = shape.normal_quantiles
    ax.fill_between(x, *shape.envelope, color=GREY, alpha=0.25, linewidth=0, label="95 % of simulations")
    ax.plot(x, x, color=RED, linewidth=1.0)
    ax.plot(x, shape.quantiles, "o", color=BLUE, ms=3, label=name)
    ax.set_xlabel("normal quantile")
    ax.set_ylabel("standardised error")
    ax.legend(frameon=False, fontsize=7, loc="upper left")
    return ax


def draw_pit(shape: Shape, ax):
    """Where each error lies in its own distribution, counted in tenths, with the 95 % band of counts.  Returns ax."""
    bins = 10
    ax.axhspan(*shape.count_band(bins), color=GREY, alpha=0.25, linewidth=0, label="95 % of counts")
    ax.hist(shape.pit, bins=bins, range=(0, 1), color=BLUE, alpha=0.6, rwidth=0.92)
    ax.axhline(len(shape.pit) / bins, color=RED, linewidth=1.0)
    ax.set_xlabel("share of its distribution below an error")
    ax.set_ylabel("errors")
    ax.legend(frameon=False, fontsize=7, loc="upper left")
    return ax


def draw_plane(m, ax, figure, marked=()):
    """Pointing errors in the TVC plane: one-sigma ellipses of tracking, coloured by dV.  Returns ax."""
    from matplotlib.patches import Ellipse

    color, bar = _by_size(m.dv_mps)
    for k in range(len(m)):
        values, axes = np.linalg.eigh(m.across[1][k])
        width, height = 2e3 * np.sqrt(np.maximum(values[::-1], 0))
        angle = np.degrees(np.arctan2(axes[1, 1], axes[0, 1]))
        x, y = 1e3 * m.across[0][k]
        own = color(m.dv_mps[k])
        ax.add_patch(Ellipse((x, y), width, height, angle=angle, facecolor=own, alpha=0.25, edgecolor=own))
        ax.plot(x, y, ".", color=own, ms=4)
    ax.axhline(0, color=GREY, linewidth=0.8)
    ax.axvline(0, color=GREY, linewidth=0.8)
    ax.set_aspect("equal", adjustable="box")
    reach = 1e3 * m.sigma_pointing_mps[:, None]
    corners = np.vstack([1e3 * m.across[0] - reach, 1e3 * m.across[0] + reach, np.zeros((1, 2))])
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = 0.55 * max(float(np.max(high - low)), 1e-6)
    (x0, y0) = (low + high) / 2
    ax.set(xlim=(x0 - half, x0 + half), ylim=(y0 - half, y0 + half))
    ax.set_xlabel("TVC X [mm/s]")
    ax.set_ylabel("TVC Y [mm/s]")
    _size_bar(figure, ax, bar)
    shown = [k for k, i in enumerate(m.id) if i in marked]
    xy = 1e3 * m.across[0]
    label_points(ax, xy[shown, 0], xy[shown, 1], [m.id[k] for k in shown], avoid=(xy[:, 0], xy[:, 1]))
    return ax


def _by_size(dv):
    """Colour of a burn by the logarithm of its size, and what a colour bar needs."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    norm = LogNorm(dv.min(), max(dv.max(), 1.001 * dv.min()))
    scale = colormaps["viridis"]
    return (lambda v: scale(norm(v))), ScalarMappable(norm, scale)


def _size_bar(figure, ax, bar, **how) -> None:
    drawn = figure.colorbar(bar, ax=ax, label="dV [m/s]", shrink=0.8, format="{x:g}", **how)
    drawn.ax.yaxis.set_minor_formatter("{x:g}")
    drawn.ax.tick_params(which="both", labelsize=8)


def draw_gates(result: GatesResult, ax):
    """Magnitude errors over dV with the model (Wagner 2014 Figures 1, 3, 5, 7, 9).  Returns ax."""
    ax.set_xlabel("dV [m/s]")
    ax.set_title(f"{result.maneuvers.engine_label}: magnitude errors, {result.model}", loc="left", fontsize=11)
    marked, note = _judged(result, Quantity.MAGNITUDE)
    return draw_magnitude(result.known_gates, result.maneuvers, ax, marked, note)


def save_gates_figure(result: GatesResult, path) -> None:
    """Magnitude errors and, where known, pointing errors along both axes over dV; doubts beneath."""
    figure, panels = new_figure(1 if result.pointing is None else 3, 1, height=3.2)
    draw_gates(result, panels[0])
    _draw_both_axes(result, panels[1:])
    panels[0].set_xlabel("")
    panels[-1].set_xlabel("dV [m/s]")
    write_doubts(figure, result.doubts)
    save(figure, path)


def magnitude_figure(result: GatesResult):
    """Magnitude errors over dV with the model."""
    figure, (ax,) = new_figure(1, 1, height=4.2)
    draw_gates(result, ax)
    return figure


def pointing_figure(result: GatesResult):
    """Pointing errors along both TVC axes over dV (Wagner 2014 Figures 2, 4, 6, 8)."""
    figure, panels = new_figure(2, 1, height=3.2)
    panels[-1].set_xlabel("dV [m/s]")
    panels[0].set_title(f"{result.maneuvers.engine_label}: pointing errors, {result.model}", loc="left", fontsize=11)
    _draw_both_axes(result, panels)
    return figure


def _draw_both_axes(result: GatesResult, panels) -> None:
    for axis, ax in enumerate(panels):
        marked, note = _judged(result, Quantity.POINTING, axis)
        draw_pointing(result.known_gates, result.maneuvers, axis, ax, marked, note)


def distribution_figure(result: GatesResult):
    """Distribution and quantiles of magnitude and pointing (Wagner 2014 Figures 1b, 1d, 3b, 5b)."""
    spreads = () if result.judgement is None else result.judgement.spreads
    shapes = {s.quantity: s.shape for s in spreads if s.shape is not None}
    figure, panels = new_figure(len(shapes), 3, width=11.0, height=3.2, sharex=False)
    for row, (quantity, shape) in enumerate(shapes.items()):
        left, middle, right = panels[3 * row : 3 * row + 3]
        draw_distribution(shape, left)
        draw_quantiles(shape, middle, quantity)
        draw_pit(shape, right)
        left.set_title(f"{quantity}: p = {shape.p:.2g}", loc="left", fontsize=10)
    return figure


def plane_figure(result: GatesResult):
    """Pointing errors in the TVC plane (Wagner 2014 Figure 10)."""
    figure, (ax,) = new_figure(1, 1, width=7.0, height=5.6)
    ax.set_title(f"{result.maneuvers.engine_label}: pointing errors in the TVC plane", loc="left", fontsize=11)
    draw_plane(result.maneuvers, ax, figure, _judged(result, Quantity.POINTING)[0])
    return figure


def directions_figure(result: GatesResult, found: Directions):
    """Directions of pointing errors about the dV, coloured by its size, and their counts (Wagner 2014 Figure 11)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.add_subplot(projection="polar")
    dv = result.maneuvers.dv_mps
    color, bar = _by_size(dv)
    counts, edges = np.histogram(np.mod(found.angle_rad, 2 * np.pi), bins=16, range=(0, 2 * np.pi))
    ax.bar(edges[:-1], counts / counts.max(), width=np.diff(edges), align="edge", color=GREY, alpha=0.2, linewidth=0)
    for angle, v in zip(found.angle_rad, dv, strict=True):
        ax.plot([angle, angle], [0, 1], color=color(v), linewidth=1.1)
        ax.plot(angle, 1, "o", color=color(v), ms=4)
    ax.set_xticks(np.arange(4) * np.pi / 2, ["+X", "+Y", "-X", "-Y"])
    ax.set_yticks([])
    title = f"{result.maneuvers.engine_label}: directions (uniform: p = {found.rayleigh_p:.2g})"
    ax.set_title(title, loc="left", fontsize=11)
    _size_bar(figure, ax, bar, pad=0.1)
    return figure


def gates_figures(result: GatesResult) -> dict:
    """Every figure of a judged fit that there is enough for, by name."""
    figures = {"magnitude": magnitude_figure(result)}
    directions = None if result.judgement is None else result.judgement.directions
    if directions is not None:
        figures |= {
            "pointing": pointing_figure(result),
            "plane": plane_figure(result),
            "directions": directions_figure(result, directions),
        }
    if result.known and result.judgement is not None:
        figures["distribution"] = distribution_figure(result)
    return figures


def _judged(result: GatesResult, quantity: Quantity, axis: int = 0) -> tuple[tuple[str, ...], str]:
    """Burns that stand out, to be labelled, and how many lie inside one sigma; nothing of a fit that is not judged."""
    if result.judgement is None:
        return (), ""
    s = [s for s in result.judgement.spreads if s.quantity is quantity][axis]
    note = f"{s.count} burns" if s.inside_model is None else f"{s.inside_model} of {s.count} inside 1 sigma"
    return result.judgement.standing_out(quantity), note
