"""Torques over time, with their bands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..telemetry.channels import AXES
from .figure import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, new_figure, save, write_doubts

if TYPE_CHECKING:
    from ..estimate.torque import TorqueResult

_COLORS = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, "black")


def torque_scale(result: TorqueResult) -> tuple[float, str]:
    """A factor and a unit that suit the torque's size."""
    if result.relative:
        return 1.0, "rad/s² per\nunit spin inertia"
    return (1.0, "N m") if np.nanmax(np.abs(result.torque_Nm), initial=0) > 1 else (1e3, "mN m")


def time_scale(time_s) -> tuple[float, str]:
    """Seconds to minutes, or to hours for long records."""
    return (3600.0, "h") if len(time_s) and time_s[-1] - time_s[0] > 3 * 3600 else (60.0, "min")


def draw_axis(result: TorqueResult, ax, axis: int, *, color=BLUE, label=None):
    """One axis of a torque with its 95 % band, that of the posterior where there is one; lines break where nothing is known.

    Returns ax."""
    scale, unit = torque_scale(result)
    t = result.time_s / time_scale(result.time_s)[0]
    torque = scale * result.torque_Nm[:, axis]
    ax.plot(
        t,
        torque,
        color=color,
        linewidth=1.4 if len(t) < 5000 else 0.6,
        label=label or f"{result.method}, {result.variant}",
    )
    if result.torque_sigma_Nm is not None:
        s = 1.96 * scale * result.torque_sigma_Nm[:, axis]
        low, high = (
            (torque - s, torque + s) if (band := result.band(0.95)) is None else (scale * b[:, axis] for b in band)
        )
        ax.fill_between(t, low, high, color=color, alpha=0.18, linewidth=0)
    ax.set_ylabel(f"torque {AXES[axis]} [{unit}]")
    return ax


def draw_torque(result: TorqueResult, ax):
    """The axis with the largest torque, of those asked for, with its 95 % band.  Returns ax."""
    sizes = {j: np.nanmax(np.abs(result.torque_Nm[:, j]), initial=0.0) for j in result.axes}
    draw_axis(result, ax, max(sizes, key=lambda j: sizes[j]))
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    return ax


def draw_truth(time_s, torque_Nm, ax, *, label="true torque"):
    """The true torque of a simulation, in mN m over minutes.  Returns ax."""
    ax.plot(
        np.asarray(time_s) / 60, 1e3 * np.asarray(torque_Nm), color=GREY, linewidth=1.2, linestyle="--", label=label
    )
    return ax


def save_torque_figure(result: TorqueResult, path) -> None:
    """One panel an axis, with the results compared behind the first; doubts of the first beneath."""
    axes, results = result.axes, [result, *result.compared]
    figure, panels = new_figure(len(axes), height=2.8 if len(axes) > 1 else 4.0)
    for j, ax in zip(axes, panels, strict=True):
        for k in reversed(range(len(results))):
            if np.isfinite(results[k].torque_Nm[:, j]).any():
                draw_axis(results[k], ax, j, color=_COLORS[k % len(_COLORS)])
        ax.axhline(0, color=GREY, linewidth=0.6)
        _draw_known(result, ax, j)
        _fit_height(ax, results, j)
    if len(results) > 1 or result.known:
        lines, labels = panels[0].get_legend_handles_labels()
        panels[0].legend(lines[::-1], labels[::-1], loc="upper right", fontsize=8, frameon=False)
    panels[0].set_title(
        f"Disturbance torque on {result.craft}: {result.method}, {result.variant} (bands: 95 %)",
        loc="left",
        fontsize=11,
    )
    panels[-1].set_xlabel(f"time from {result.epoch} [{time_scale(result.time_s)[1]}]")
    write_doubts(figure, result.doubts)
    save(figure, path)


def _draw_known(result: TorqueResult, ax, j: int) -> None:
    """The sum of what was taken off."""
    if result.known:
        t = result.time_s / time_scale(result.time_s)[0]
        total = torque_scale(result)[0] * np.sum([k.torque_Nm[:, j] for k in result.known], axis=0)
        names = ", ".join(k.name for k in result.known)
        ax.plot(t, total, color=GREY, linewidth=1.0, linestyle="--", label=f"taken off: {names}")


def _fit_height(ax, results: list[TorqueResult], j: int) -> None:
    """Ends of a polynomial, which swing far out, do not set the scale; all of the first result is seen."""
    scale, first = torque_scale(results[0])[0], results[0]
    sigma = 0.0 if first.torque_sigma_Nm is None else 1.96 * first.torque_sigma_Nm[:, j]
    seen = [first.torque_Nm[:, j] - sigma, first.torque_Nm[:, j] + sigma]
    for other in results[1:]:
        inner = slice(len(other.time_s) // 20, len(other.time_s) - len(other.time_s) // 20)
        seen.append(other.torque_Nm[inner, j])
    values = scale * np.concatenate(seen)
    values = values[np.isfinite(values)]
    if len(results) > 1 and len(values) and np.ptp(values) > 0:
        ax.set_ylim(values.min() - 0.05 * np.ptp(values), values.max() + 0.15 * np.ptp(values))
