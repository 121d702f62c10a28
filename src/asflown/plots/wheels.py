"""Wheels: rates with their run-downs, and drag over speed."""

from __future__ import annotations

import numpy as np

from ..estimate.wheels import RUN_DOWN, WheelDrag, WheelsResult
from .figure import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, breaks, new_figure, save, write_doubts
from .torque import time_scale

_RPM = 60 / (2 * np.pi)
_BY_WHEEL = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY)


def draw_rate(wheel: WheelDrag, ax, low_rad_s: float, hours: float):
    """Rate over time, run-downs and their fit marked, low speeds shaded.  ``hours``: seconds per unit drawn. Returns ax."""
    _draw_course(wheel, ax, hours, BLUE, "measured", "fit")
    for k, r in enumerate(wheel.run_downs):
        ax.axvspan(
            r.start_s / hours, r.stop_s / hours, color=GREEN, alpha=0.10, linewidth=0, label=None if k else "run-down"
        )
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


def _draw_course(wheel: WheelDrag, ax, hours: float, color: str, name: str, fit: str | None) -> None:
    t = wheel.time_s
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    at, rate = breaks(t, _RPM * wheel.rate_rad_s, 6.5 * step)
    ax.plot(at / hours, rate, color=color, linewidth=1.0, label=name)
    for k, r in enumerate(wheel.run_downs):
        ax.plot(r.time_s / hours, _RPM * r.fit_rad_s, "--", color=RED, linewidth=1.4, label=None if k else fit)


def draw_drag(wheel: WheelDrag, ax):
    """Size of the drag over speed: samples, the fitted line with its 95 % band, spikes.  Returns ax."""
    f = wheel.fit
    if f is None:
        ax.text(0.5, 0.5, "drag not known", transform=ax.transAxes, ha="center", va="center", color=GREY)
        ax.set_xticks([])
        ax.set_yticks([])
        return ax
    scale = 1.0 if f.relative else 1e3
    speeds = [_RPM * f.mean_rate_rad_s, *_draw_samples(wheel, ax, scale), *_draw_run_downs(wheel, ax, scale)]
    if f.separable:
        for u, how, name in (
            (np.linspace(min(speeds), max(speeds), 100), "-", f"fit: {f.basis}"),
            (np.linspace(0, min(speeds), 50), ":", None),  # not seen, but where Coulomb drag is read off
        ):
            drag, sigma = scale * f.drag(u / _RPM), scale * f.sigma(u / _RPM)
            ax.plot(u, drag, how, color=BLUE, linewidth=1.4, label=name)
            ax.fill_between(u, drag - 1.96 * sigma, drag + 1.96 * sigma, color=BLUE, alpha=0.2, linewidth=0)
    else:  # a band as wide as the picture would hide what is known
        ax.errorbar(
            _RPM * f.mean_rate_rad_s, scale * f.drag_at_mean_Nm, 1.96 * scale * f.drag_at_mean_sigma_Nm, fmt="s", color=BLUE,
            ms=6, label=f"sum: {f.basis}",
        )  # fmt: skip
    ax.set_ylabel("slowing [rad/s²]" if f.relative else "drag [mN m]")
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    ax.legend(frameon=False, fontsize=7, loc="best")
    return ax


def _draw_samples(wheel: WheelDrag, ax, scale: float) -> list[float]:
    """The flight software's estimates, where the drag is in their unit; the speeds [rpm] of those used."""
    s = wheel.samples
    if s is None or wheel.fits[0].relative:
        return []
    speed = _RPM * np.abs(s.rate_rad_s)
    ax.plot(speed[~s.spiked], scale * s.drag_Nm[~s.spiked], ".", color=GREY, ms=2, label="flight software")
    if s.spiked.any():
        ax.plot(speed[s.spiked], scale * s.drag_Nm[s.spiked], "x", color=RED, ms=4, label="drag spike")
    return speed[s.used].tolist()


def _draw_run_downs(wheel: WheelDrag, ax, scale: float) -> list[float]:
    """The slowing of run-downs in blocks, where the drag is theirs; their speeds [rpm]."""
    f, speeds = wheel.fits[0], []
    if f.basis != RUN_DOWN:
        return []
    inertia = 1.0 if f.relative else wheel.spin_inertia_kgm2 or 1.0
    for k, r in enumerate(wheel.run_downs):
        rate, slowing, sigma = r.slowing_rad_s2()
        ax.errorbar(
            _RPM * np.abs(rate), scale * inertia * slowing, 1.96 * scale * inertia * sigma,
            fmt="o", color=GREEN, ms=4, lw=1, label=None if k else "run-down, in blocks",
        )  # fmt: skip
        speeds += (_RPM * np.abs(rate)).tolist()
    return speeds


def draw_wheels(result: WheelsResult, ax):
    """Rates of all wheels over time, with the fit of every run-down.  Returns ax."""
    hours, unit = _time_scale(result)
    for k, w in enumerate(result.wheels):
        _draw_course(w, ax, hours, _BY_WHEEL[k % len(_BY_WHEEL)], w.name, None)
    ax.set_ylabel("rate [rpm]")
    ax.set_xlabel(f"time from {result.epoch} [{unit}]")
    ax.legend(frameon=False, fontsize=7, loc="best")
    return ax


def save_wheels_figure(result: WheelsResult, path) -> None:
    """A row a wheel: rate over time, drag over speed; doubts beneath."""
    figure, panels = new_figure(len(result.wheels), 2, width=10.0, height=2.6, sharex=False)
    hours, unit = _time_scale(result)
    for w, left, right in zip(result.wheels, panels[::2], panels[1::2], strict=True):
        draw_rate(w, left, result.low_speed_rad_s, hours)
        draw_drag(w, right)
    panels[0].set_title(f"Wheels of {result.craft} (bands: 95 %)", loc="left", fontsize=11)
    panels[0].legend(frameon=False, fontsize=7, loc="best")
    panels[-2].set_xlabel(f"time from {result.epoch} [{unit}]")
    panels[-1].set_xlabel("speed [rpm]")
    write_doubts(figure, result.doubts, columns=150)
    save(figure, path)


def _time_scale(result: WheelsResult) -> tuple[float, str]:
    return time_scale(np.sort(np.concatenate([w.time_s for w in result.wheels])))
