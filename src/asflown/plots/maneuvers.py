"""Execution errors of maneuvers: over dV, in the pointing plane, their distribution and directions (002 Figures 1 to 12)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .figure import BLUE, GREEN, GREY, ORANGE, RED, new_figure
from .labels import label_points

if TYPE_CHECKING:
    from ..estimate.gates import Directions, GatesFit, Judgement, Watch
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


def draw_distribution(standardised, ax):
    """Cumulative distribution of standardised errors over the normal one.  Returns ax."""
    from scipy import stats

    z = np.sort(standardised)
    x = np.linspace(min(-3.0, z[0]), max(3.0, z[-1]), 200)
    ax.step(z, (np.arange(len(z)) + 1) / len(z), where="post", color=BLUE, linewidth=1.2, label="errors")
    ax.plot(x, stats.norm.cdf(x), color=RED, linewidth=1.2, label="normal")
    ax.set_xlabel("standardised error")
    ax.set_ylabel("share below")
    ax.legend(frameon=False, fontsize=7, loc="upper left")
    return ax


def draw_quantiles(quantiles, envelope, ax, name: str):
    """Sorted standardised errors over normal quantiles, with the band of 95 % of refitted simulations.  Returns ax."""
    from scipy import stats

    n = len(quantiles)
    x = stats.norm.ppf((np.arange(n) + 0.5) / n)
    ax.fill_between(x, *envelope, color=GREY, alpha=0.25, linewidth=0, label="95 % of simulations")
    ax.plot(x, x, color=RED, linewidth=1.0)
    ax.plot(x, quantiles, "o", color=BLUE, ms=3, label=name)
    ax.set_xlabel("normal quantile")
    ax.set_ylabel("standardised error")
    ax.legend(frameon=False, fontsize=7, loc="upper left")
    return ax


def draw_pit(standardised, ax):
    """Where each error lies in its own distribution, counted in tenths, with the 95 % band of counts.  Returns ax."""
    from scipy import stats

    n = len(standardised)
    low, high = stats.binom.interval(0.95, n, 0.1)
    ax.axhspan(low, high, color=GREY, alpha=0.25, linewidth=0, label="95 % of counts")
    ax.hist(stats.norm.cdf(standardised), bins=10, range=(0, 1), color=BLUE, alpha=0.6, rwidth=0.92)
    ax.axhline(n / 10, color=RED, linewidth=1.0)
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
        ax.add_patch(
            Ellipse(
                (x, y),
                width,
                height,
                angle=angle,
                facecolor=color(m.dv_mps[k]),
                alpha=0.25,
                edgecolor=color(m.dv_mps[k]),
            )
        )
        ax.plot(x, y, ".", color=color(m.dv_mps[k]), ms=4)
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


def magnitude_figure(fit: GatesFit, judged: Judgement):
    """Magnitude errors over dV with the model (002 Figures 1, 3, 5, 7, 9)."""
    figure, (ax,) = new_figure(1, 1, height=4.2)
    ax.set_xlabel("dV [m/s]")
    ax.set_title(f"{fit.engine or 'engine not named'}: magnitude errors, {fit.model}", loc="left", fontsize=11)
    draw_magnitude(
        fit.gates if fit.known else None, fit.maneuvers, ax, _marked(judged, "magnitude"), _count(judged.spreads[0])
    )
    return figure


def pointing_figure(fit: GatesFit, judged: Judgement):
    """Pointing errors along both TVC axes over dV (002 Figures 2, 4, 6, 8)."""
    figure, panels = new_figure(2, 1, height=3.2)
    panels[-1].set_xlabel("dV [m/s]")
    panels[0].set_title(f"{fit.engine or 'engine not named'}: pointing errors, {fit.model}", loc="left", fontsize=11)
    for axis, ax in enumerate(panels):
        draw_pointing(
            fit.gates if fit.known else None,
            fit.maneuvers,
            axis,
            ax,
            _marked(judged, "pointing"),
            _count(judged.spreads[1 + axis]),
        )
    return figure


def distribution_figure(fit: GatesFit, judged: Judgement):
    """Distribution and quantiles of magnitude and pointing (002 Figures 1b, 1d, 3b, 5b)."""
    parts = [(s.name.split()[0], s) for s in judged.spreads[:2] if s.quantiles is not None]
    figure, panels = new_figure(len(parts), 3, width=11.0, height=3.2, sharex=False)
    for row, (name, s) in enumerate(parts):
        left, middle, right = panels[3 * row : 3 * row + 3]
        draw_distribution(s.quantiles, left)
        draw_quantiles(s.quantiles, s.envelope, middle, name)
        draw_pit(s.quantiles, right)
        left.set_title(f"{name}: p = {s.shape_p:.2g}", loc="left", fontsize=10)
    return figure


def plane_figure(fit: GatesFit, judged: Judgement):
    """Pointing errors in the TVC plane (002 Figure 10)."""
    figure, (ax,) = new_figure(1, 1, width=7.0, height=5.6)
    ax.set_title(f"{fit.engine or 'engine not named'}: pointing errors in the TVC plane", loc="left", fontsize=11)
    draw_plane(fit.maneuvers, ax, figure, _marked(judged, "pointing"))
    return figure


def directions_figure(fit: GatesFit, found: Directions):
    """Directions of pointing errors about the dV, coloured by its size, and their counts (002 Figure 11)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.add_subplot(projection="polar")
    dv = fit.maneuvers.dv_mps
    color, bar = _by_size(dv)
    counts, edges = np.histogram(np.mod(found.angle_rad, 2 * np.pi), bins=16, range=(0, 2 * np.pi))
    ax.bar(edges[:-1], counts / counts.max(), width=np.diff(edges), align="edge", color=GREY, alpha=0.2, linewidth=0)
    for angle, v in zip(found.angle_rad, dv, strict=True):
        ax.plot([angle, angle], [0, 1], color=color(v), linewidth=1.1)
        ax.plot(angle, 1, "o", color=color(v), ms=4)
    ax.set_xticks(np.arange(4) * np.pi / 2, ["+X", "+Y", "-X", "-Y"])
    ax.set_yticks([])
    ax.set_title(
        f"{fit.engine or 'engine not named'}: directions (uniform: p = {found.rayleigh_p:.2g})", loc="left", fontsize=11
    )
    _size_bar(figure, ax, bar, pad=0.1)
    return figure


def degradation_figure(watch: Watch, m):
    """The model before each burn that stands out, and that burn (002 Figure 12); the last burn where none does."""
    told = [b for b in watch.burns if b.outlier or b.alarms][-4:] or list(watch.burns[-1:])
    figure, panels = new_figure(
        (len(told) + 1) // 2, min(len(told), 2), width=5.0 * min(len(told), 2), height=3.4, sharex=False
    )
    for ax, b in zip(panels, told, strict=False):
        upto = m.take(slice(0, m.place(b.id) + 1))
        ax.set_title(
            f"up to {b.id}" + (": alarm" if b.alarms else ""),
            loc="left",
            fontsize=10,
            color=RED if b.alarms else "black",
        )
        ax.set_xlabel("dV [m/s]")
        draw_magnitude(b.model, upto, ax, (b.id,), f"z = {b.z:+.1f}")
    for ax in panels[len(told) :]:
        ax.set_visible(False)
    return figure


def watch_figure(watch: Watch):
    """Each watched burn: its z and the cumulated sums with their limit; how large an underburn it could have shown."""
    figure, (top, middle, bottom) = new_figure(3, 1, height=2.2)
    at = np.arange(len(watch.burns))
    z = np.array([b.z for b in watch.burns])
    alarmed = np.array([bool(b.alarms) for b in watch.burns])
    top.axhline(0, color=GREY, linewidth=0.8)
    for side in (-2, 2):
        top.axhline(side, color=ORANGE, linewidth=0.8, linestyle=":")
    top.plot(at, z, "o", color=BLUE, ms=4)
    top.plot(at[alarmed], z[alarmed], "o", color=RED, ms=7, label="alarm")
    top.set_ylabel("z of magnitude")
    middle.plot(at, [b.low for b in watch.burns], "-o", color=RED, ms=3, lw=1, label="towards underburn")
    middle.plot(at, [b.high for b in watch.burns], "-o", color=BLUE, ms=3, lw=1, label="towards overburn")
    middle.axhline(watch.limit_sum, color=GREY, linestyle="--", linewidth=1, label="limit")
    middle.set_ylabel("cumulated sum")
    bottom.semilogy(at, [100 * b.detectable_mps / b.dv_mps for b in watch.burns], "o", color=GREEN, ms=4)
    bottom.yaxis.set_major_formatter("{x:g}")
    bottom.yaxis.set_minor_formatter("{x:g}")
    bottom.tick_params(axis="y", which="both", labelsize=7)
    bottom.set_ylabel("seen if short by [%]")
    bottom.set_xticks(at, [b.id for b in watch.burns], rotation=90, fontsize=7)
    for ax in (top, middle):
        if ax.get_legend_handles_labels()[1]:
            ax.legend(frameon=False, fontsize=7, loc="best")
    top.set_title(f"{watch.engine or 'engine not named'}: {watch.verdict}", loc="left", fontsize=11)
    return figure


def gates_figures(fit: GatesFit, judged: Judgement) -> dict:
    """Every figure of a fit that there is enough for, by name."""
    figures = {"magnitude": magnitude_figure(fit, judged)}
    if judged.directions is not None:
        figures |= {
            "pointing": pointing_figure(fit, judged),
            "plane": plane_figure(fit, judged),
            "directions": directions_figure(fit, judged.directions),
        }
    if fit.known:
        figures["distribution"] = distribution_figure(fit, judged)
    return figures


def _marked(judged: Judgement, component: str) -> tuple[str, ...]:
    """Burns to be labelled: outliers, and the most influential."""
    found = [o.id for o in judged.outliers if o.component == component]
    worst = max(judged.influence, key=lambda i: i.in_sigmas, default=None)
    if worst is not None and worst.largest.startswith(component):
        found.append(worst.id)
    return tuple(dict.fromkeys(found))


def _count(s) -> str:
    return f"{s.count} burns" if s.inside_model is None else f"{s.inside_model} of {s.count} inside 1 sigma"
