"""Slews: body rates as in Feldman and Lee's Figures B1-B3, what the wheels held, and the residual momentum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..telemetry.channels import AXES
from .figure import BY_AXIS, GREY, breaks, new_figure, save, write_doubts

if TYPE_CHECKING:
    from ..estimate.inertia import InertiaResult


def draw_inertia(result: InertiaResult, ax):
    """Body rates with the slews.  Returns ax."""
    draw_rates(result, ax)
    ax.set_xlabel(f"time from {result.epoch} [s]")
    return ax


def draw_rates(result: InertiaResult, ax):
    """Body rates [mrad/s] per axis, slews shaded and named by their axis.  Returns ax."""
    _lines(result, 1e3 * result.evidence.omega_rad_s, ax)
    ax.set_ylabel("body rate [mrad/s]")
    top = ax.get_ylim()[1]
    for s in result.slews:
        ax.axvspan(s.start_s, s.stop_s, color=GREY, alpha=0.12, linewidth=0)
        ax.text(0.5 * (s.start_s + s.stop_s), top, s.about, ha="center", va="bottom", fontsize=8, color=GREY)
    ax.legend(frameon=False, fontsize=8, loc="lower right", bbox_to_anchor=(1, 1.0), ncol=3)
    return ax


def draw_momentum(result: InertiaResult, ax):
    """Momentum of the wheels in body axes.  Returns ax."""
    _lines(result, result.evidence.wheels_Nms, ax)
    ax.set_ylabel("wheels / spin inertia\n[rad/s]" if result.relative else "wheels' momentum\n[N m s]")
    return ax


def draw_residual(result: InertiaResult, ax):
    """Residual momentum of the fit: noise around zero where it explains the data.  Returns ax."""
    e = result.evidence
    scale, unit = result.residual_unit
    for k, colour in enumerate(BY_AXIS):
        ax.plot(e.time_s[e.used], scale * e.residual_Nms[e.used, k], ".", ms=2, color=colour, label=AXES[k])
    ax.axhline(0, color=GREY, linewidth=0.8)
    ax.set_ylabel("residual / spin inertia\n[rad/s]" if result.relative else f"residual momentum\n[{unit}]")
    ax.set_title(f"rms {scale * result.residual_rms_Nms:.3g} {unit}", loc="right", fontsize=8, color=GREY)
    return ax


def _lines(result: InertiaResult, values: np.ndarray, ax) -> None:
    t = result.evidence.time_s
    longest = 6.5 * float(np.median(np.diff(t)))
    for k, colour in enumerate(BY_AXIS):
        at, v = breaks(t, values[:, k], longest)
        ax.plot(at, v, color=colour, linewidth=1.1, label=AXES[k])


def save_inertia_figure(result: InertiaResult, path) -> None:
    """Rates, wheels, residual; doubts beneath."""
    figure, (rates, wheels, left) = new_figure(3, 1, width=9.0, height=2.4)
    draw_rates(result, rates)
    draw_momentum(result, wheels)
    draw_residual(result, left)
    rates.set_title(f"Slews of {result.craft}, {result.method} fit", loc="left", fontsize=11, pad=14)
    left.set_xlabel(f"time from {result.epoch} [s]")
    write_doubts(figure, result.doubts, columns=150)
    save(figure, path)
