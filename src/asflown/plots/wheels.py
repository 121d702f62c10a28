"""Wheels: rates with their run-downs, and drag over speed."""

from __future__ import annotations

import numpy as np

from ..estimate.wheels import RUN_DOWN, WheelDrag, WheelsResult
from .figure import BLUE, GREEN, GREY, ORANGE, RED, breaks, new_figure, save, write_doubts
from .torque import time_scale

_RPM = 60 / (2 * np.pi)


def draw_rate(wheel: WheelDrag, ax, low_rad_s: float, hours: float):
    """Rate over time, run-downs and their fit marked, low speeds shaded.  ``hours``: seconds per unit drawn. Returns ax."""
    t = wheel.time_s
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    at, rate = breaks(t, _RPM * wheel.rate_rad_s, 6.5 * step)
    ax.plot(at / hours, rate, color=BLUE, linewidth=1.0, label="measured")
    for k, r in enumerate(wheel.run_downs):
        ax.axvspan(
            r.start_s / hours, r.stop_s / hours, color=GREEN, alpha=0.10, linewidth=0, label=None if k else "run-down"
        )
        ax.plot(r.time_s / hours, _RPM * r.fit_rad_s, "--", color=RED, linewidth=1.4, label=None if k else "fit")
    for s in wheel.spikes or ():
        ax.axvspan(s.time_s / hours, (s.time_s + s.duration_s) / hours, color=RED, alpha=0.18, linewidth=0)
    seen = ax.get_ylim()
    low = max(seen[0], -_RPM * low_rad_s), min(seen[1], _RPM * low_rad_s)
    if low[1] > low[0]:
        ax.axhspan(*low, color=ORANGE, alpha=0.10, linewidth=0, label=f"below {_RPM * low_rad_s:.0f} rpm")
        ax.set_ylim(seen)
    for x in wheel.use.crossing_times_s:
        ax.plot(x / hours, 0, "|", color=GREY, markersize=9)
    ax.set_ylabel(f"{wheel.name} [rpm]")
    return ax


def draw_drag(wheel: WheelDrag, ax):
    """Size of the drag over speed: samples, the fitted line with its 95 % band, spikes.  Returns ax."""
    f = wheel.fit
    if f is None:
        ax.text(0.5, 0.5, "drag not known", transform=ax.transAxes, ha="center", va="center", color=GREY)
        ax.set_xticks([])
        ax.set_yticks([])
        return ax
    scale = 1.0 if f.relative else 1e3
    seen = [_RPM * f.mean_rate]
    if wheel.samples is not None and not f.relative:
        s = wheel.samples
        speed = _RPM * np.abs(s.rate_rad_s)
        spiked = np.zeros(len(s.time_s), bool)
        for p in wheel.spikes or ():
            spiked |= (s.time_s >= p.time_s) & (s.time_s <= p.time_s + p.duration_s)
        ax.plot(speed[~spiked], scale * s.drag_Nm[~spiked], ".", color=GREY, ms=2, label="flight software")
        if spiked.any():
            ax.plot(speed[spiked], scale * s.drag_Nm[spiked], "x", color=RED, ms=4, label="drag spike")
        seen += speed[s.used].tolist()
    if f.basis == RUN_DOWN:
        inertia = 1.0 if f.relative else wheel.spin_inertia_kgm2 or 1.0
        for k, r in enumerate(wheel.run_downs):
            rate, slowing, sigma = r.slowing()
            ax.errorbar(
                _RPM * np.abs(rate), scale * inertia * slowing, 1.96 * scale * inertia * sigma,
                fmt="o", color=GREEN, ms=4, lw=1, label=None if k else "run-down, in blocks",
            )  # fmt: skip
            seen += (_RPM * np.abs(rate)).tolist()
    if f.told_apart:
        for u, how, name in (
            (np.linspace(min(seen), max(seen), 100), "-", f"fit: {f.basis}"),
            (np.linspace(0, min(seen), 50), ":", None),  # not seen, but where Coulomb drag is read off
        ):
            drag, sigma = scale * f.drag(u / _RPM), scale * f.sigma(u / _RPM)
            ax.plot(u, drag, how, color=BLUE, linewidth=1.4, label=name)
            ax.fill_between(u, drag - 1.96 * sigma, drag + 1.96 * sigma, color=BLUE, alpha=0.2, linewidth=0)
    else:  # a band as wide as the picture would hide what is known
        ax.errorbar(
            _RPM * f.mean_rate, scale * f.at_mean, 1.96 * scale * f.sigma_at_mean, fmt="s", color=BLUE, ms=6,
            label=f"together: {f.basis}",
        )  # fmt: skip
    ax.set_ylabel("slowing [rad/s²]" if f.relative else "drag [mN m]")
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    ax.legend(frameon=False, fontsize=7, loc="best")
    return ax


def save_wheels_figure(result: WheelsResult, path) -> None:
    """A row a wheel: rate over time, drag over speed; doubts beneath."""
    figure, panels = new_figure(len(result.wheels), 2, width=10.0, height=2.6, sharex=False)
    all_times = np.concatenate([w.time_s for w in result.wheels])
    hours, unit = time_scale(np.sort(all_times))
    for w, left, right in zip(result.wheels, panels[::2], panels[1::2], strict=True):
        draw_rate(w, left, result.low_speed_rad_s, hours)
        draw_drag(w, right)
    panels[0].set_title(f"Wheels of {result.craft} (bands: 95 %)", loc="left", fontsize=11)
    panels[0].legend(frameon=False, fontsize=7, loc="best")
    panels[-2].set_xlabel(f"time from {result.epoch} [{unit}]")
    panels[-1].set_xlabel("speed [rpm]")
    write_doubts(figure, result.doubts, columns=150)
    save(figure, path)
