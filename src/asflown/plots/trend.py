"""The pictures of an actuator's years: trends, overlays from old grey to new red, figures of merit, cold and warm, devices."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from ..trends.entries import FIRST_PHASE_S
from ..trends.statistics import FEWEST, TORQUE, YEAR, Pair, family_band
from .figure import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, new_figure

if TYPE_CHECKING:
    from ..trends.entry import Entry
    from ..trends.verdicts import FigureHealth

#: Greys of an overlay, oldest first; the newest is red.
GREYS = ("#d2d2d2", "#c2c2c2", "#b2b2b2", "#a2a2a2", "#929292", "#828282", "#727272", "#626262", "#525252", "#424242")
#: Unit of a figure of merit -> factor and unit to draw it in.
DRAWN_IN = {
    "N m": (1e3, "mN m"), "N m s": (1.0, "N m s"), "m/s": (1e3, "mm/s"), "s": (1.0, "s"), "rad": (180 / np.pi, "deg"), "A": (1e3, "mA"),
    "K": (1.0, "K"), "": (1.0, ""), "N m s/rad": (1e6, "µN m s/rad"), "rad/s": (60 / (2 * np.pi), "rpm"),
}  # fmt: skip
BASIS_LOOK = {
    "fused": (BLUE, "o"), "telemetry": (BLUE, "o"), "momentum, printed": (ORANGE, "*"), "transfer, printed": (GREEN, "^"),
}  # fmt: skip
_PAIR_COLORS = (BLUE, RED, GREEN, PURPLE, ORANGE)


def trend_figure(first: FigureHealth, *others: FigureHealth, title: str | None = None):
    """Values with their sigma over the years, the line of the first with the band of further events (000 Figs 17, 18)."""
    figure, (ax,) = new_figure(height=3.6)
    scale, unit = DRAWN_IN.get(first.unit, (1.0, first.unit))
    for f in (first, *others):
        color, marker = BASIS_LOOK.get(f.basis, (PURPLE, "s"))
        if not f.rows:
            continue
        when = [datetime.fromisoformat(r.date) for r in f.rows]
        values = [scale * r.value for r in f.rows]
        sigmas = [scale * (r.sigma or 0) for r in f.rows]
        several = len({x.figure for x in (first, *others)}) > 1
        label = f"{f.figure}, {f.basis}" if several else f.basis
        ax.errorbar(
            when, values, yerr=sigmas if any(sigmas) else None, fmt=marker, color=color, ms=5, lw=1, label=label
        )
        if f.doubted:
            doubted = [datetime.fromisoformat(r.date) for r in f.doubted]
            ax.plot(
                doubted,
                [scale * r.value for r in f.doubted],
                marker,
                mfc="none",
                color=color,
                ms=5,
                label="doubted, not judged",
            )
    t = first.trend
    if t is not None and len(first.rows) >= FEWEST:
        end = t.values.day[-1] + 0.1 * np.ptp(t.values.day)
        if first.limit_reached[0] is not None:  # far enough to see it happen
            end = max(end, min(first.limit_reached[0] + YEAR, t.values.day[-1] + 10 * YEAR))
        days = np.linspace(t.values.day[0], end, 100)
        when = [datetime(2000, 1, 1) + timedelta(days=d) for d in days]
        low, high = t.band(days)
        ax.plot(when, scale * t.at(days), color=BLUE, lw=1.3)
        ax.fill_between(when, scale * low, scale * high, color=BLUE, alpha=0.12, lw=0, label="95 % of further events")
    if first.limit is not None:
        ax.axhline(scale * first.limit, color=RED, lw=1.2, ls="--", label="limit")
    ax.set_ylabel(f"{first.figure.replace('_', ' ')} [{unit}]")
    ax.set_title(title or first.figure.replace("_", " "), loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(0, -0.12), ncols=3)
    return figure


def overlay_figure(entries: list[Entry], name: str, title: str):
    """One curve of every actuation, older ones in lighter grey, the newest red, the first dotted blue (000 Figs 13, 14, B2)."""
    figure, (ax,) = new_figure(height=3.8)
    shown = [(e, c) for e in entries if (c := e.curve(name)) is not None]
    for k, (e, c) in enumerate(shown):
        last, first = k == len(shown) - 1, k == 0 and len(shown) > 1
        grey = GREYS[round(k / max(len(shown) - 1, 1) * (len(GREYS) - 1))]
        color = RED if last else BLUE if first else grey
        ax.plot(
            c.time_s / 60, 1e3 * c.values, color=color, lw=1.0 if grey == color else 1.8, ls=":" if first else "-",
            zorder=3 if first or last else 2, label=e.event if first or last else None,
        )  # fmt: skip
    _torque_axes(ax, title)
    return figure


def family_figure(newest: Entry, past: list[Entry], title: str):
    """The newest torque in front of where 95 of 100 further ones would run at each instant."""
    figure, (ax,) = new_figure(height=3.8)
    curves = [c for e in past if (c := e.curve(TORQUE)) is not None]
    if len(curves) >= 3:
        t, low, high = family_band(curves)
        ax.fill_between(
            t / 60, 1e3 * low, 1e3 * high, color=GREY, alpha=0.25, lw=0, label=f"95 % of the {len(curves)} before"
        )
    c = newest.curve(TORQUE)
    if c is not None:
        ax.plot(c.time_s / 60, 1e3 * c.values, color=RED, lw=1.5, label=newest.event)
    _torque_axes(ax, title, last_s=t[-1] if len(curves) >= 3 else None)
    return figure


def merit_figure(entry: Entry, basis: str, title: str):
    """What the figures of merit are taken from: the area of the first phase, the excursions after it (000 Figs 15, 16)."""
    figure, (ax,) = new_figure(height=3.8)
    c = entry.curve(f"torque, {basis}")
    if c is not None:
        t, v = c.time_s / 60, 1e3 * c.values
        first = (c.time_s >= 0) & (c.time_s <= FIRST_PHASE_S)
        ax.plot(t, v, color=BLUE, lw=1.3)
        if c.sigma is not None:
            ax.fill_between(t, v - 1.96e3 * c.sigma, v + 1.96e3 * c.sigma, color=BLUE, alpha=0.15, lw=0)
        impulse = entry.value("angular_impulse", basis)
        words = "" if impulse is None or impulse.value is None else f"impulse {_with_sigma(impulse)} N m s"
        ax.fill_between(t[first], 0, v[first], color=ORANGE, alpha=0.35, lw=0, label=words)
        for name, color in (("peak_positive", RED), ("peak_negative", PURPLE)):
            peak = entry.value(name, basis)
            if peak is not None and peak.value is not None:
                ax.hlines(
                    1e3 * peak.value, FIRST_PHASE_S / 60, t[-1], color=color, lw=1.2, ls="--",
                    label=f"{name.replace('_', ' ')} {_with_sigma(peak, 1e3)} mN m",
                )  # fmt: skip
    _torque_axes(ax, title)
    return figure


def cold_warm_figure(pairs: tuple[Pair, ...], name: str, title: str):
    """Cold actuations (crosses) and the warm ones after them (rings), a colour a pair (000 Figs 19, 20)."""
    figure, (ax,) = new_figure(height=3.8)
    for p, color in zip(pairs, _PAIR_COLORS, strict=False):
        for e, marker in ((p.cold, "x"), (p.warm, "o")):
            c = e.curve(name)
            if c is not None:
                ax.plot(
                    c.time_s / 60, 1e3 * c.values, color=color, lw=1.0, marker=marker, markevery=12, ms=4, mfc="none",
                    label=f"{'cold' if marker == 'x' else 'warm'} {e.date[:10]}",
                )  # fmt: skip
    _torque_axes(ax, title)
    return figure


def methods_figure(entry: Entry, title: str):
    """The three bases of one actuation, fused with its 95 % band (000 Fig 12)."""
    figure, (ax,) = new_figure(height=3.8)
    for basis, (color, _) in BASIS_LOOK.items():
        c = entry.curve(f"torque, {basis}")
        if c is None:
            continue
        ax.plot(c.time_s / 60, 1e3 * c.values, color=color, lw=1.3, label=basis)
        if c.sigma is not None:
            reach = 1.96 * c.sigma
            ax.fill_between(
                c.time_s / 60, 1e3 * (c.values - reach), 1e3 * (c.values + reach), color=color, alpha=0.15, lw=0
            )
    _torque_axes(ax, title)
    return figure


def devices_figure(entry: Entry, title: str):
    """Torque, angle, temperature and current of one actuation, the stall between its two samples (000 Fig 9)."""
    panels = [("torque, fused", 1e3, "torque [mN m]"), ("cover_angle", 180 / np.pi, "angle [deg]"),
              ("motor_temperature", 1.0, "motor [K]"), ("motor_current", 1e3, "current [mA]")]  # fmt: skip
    curves = [(c, scale, label) for name, scale, label in panels if (c := entry.curve(name)) is not None]
    figure, axes = new_figure(len(curves), height=1.7)
    stall = entry.value("time_to_stall", "telemetry")
    for ax, (c, scale, label) in zip(axes, curves, strict=True):
        dense = len(c.time_s) > 40
        ax.plot(c.time_s / 60, scale * c.values, "-" if dense else "o-", color=BLUE, lw=1.1, ms=4)
        ax.set_ylabel(label)
        if stall is not None and stall.value is not None:
            reach = stall.sigma or 0.0
            ax.axvspan((stall.value - reach) / 60, (stall.value + reach) / 60, color=GREEN, alpha=0.18, lw=0)
    axes[0].set_title(title, loc="left", fontsize=11)
    axes[-1].set_xlabel("time from the motor's start [min]")
    return figure


def _torque_axes(ax, title: str, last_s: float | None = None) -> None:
    ax.axhline(0, color=GREY, lw=0.6)
    ax.set_title(title, loc="left", fontsize=11)
    ax.set_xlabel("time from the motor's start [min]")
    ax.set_ylabel("torque about the hinge [mN m]")
    ax.set_xlim(-0.7, (last_s or 360.0) / 60)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(0, -0.16), ncols=3)


def _with_sigma(value, scale: float = 1.0) -> str:
    sigma = "" if value.sigma is None else f" ± {scale * value.sigma:.2g}"
    return f"{scale * value.value:.3g}{sigma}"
