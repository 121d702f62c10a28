"""Thrust as flown: what was found for every thruster, how well it is known, and what cannot be told."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...kit.digits import plus_minus

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class EventSeen:
    """What one record shows, for figures; j thrusters.  Times count from the telemetry's epoch."""

    label: str
    wheel_time_s: np.ndarray  # (N,)
    wheel_rate_rad_s: dict[str, np.ndarray]
    counter_time_s: np.ndarray  # (M,)
    on_time_s: np.ndarray  # (M, j)
    time_s: np.ndarray  # (K,): ends of the momentum's steps
    gained: np.ndarray  # (K, 3): momentum since the first sample [N m s]
    left: np.ndarray | None  # (K, 3): of that, what the fit does not explain


@dataclass(frozen=True)
class ThrustResult:
    """Steady thrust of each thruster [N]; None where it did not fire or cannot be told.

    ``mean_thrust_N``: of those that fired, weighted by their impulse (printed: one thrust for all, 001 eq 23).  ``pairs``:
    groups that fire together, value and sigma.  ``center_m``: of mass, in the axes of the thrusters' positions.
    ``pulse_ratio``: R of these pulses by 001's formula and by the right one.  ``correlation``: of the mean thrust with what is
    known beside it, and ``mean_sigma_parts_N`` what not knowing each of them makes of its sigma.
    ``unadjusted_N``: without regard to delay, rise and fall, by what was fitted (printed and accelerometer methods)."""

    craft: str
    epoch: str
    method: str
    variant: str
    names: tuple[str, ...]
    thrust_N: dict[str, float | None]
    sigma_N: dict[str, float | None]
    mean_thrust_N: float
    mean_sigma_N: float | None
    pulse_ratio: dict[str, float]
    on_time_s: dict[str, float]
    pulses: dict[str, float]
    pulses_counted: bool
    fall_time_s: float
    fall_time_sigma_s: float | None = None
    center_m: tuple[float, float, float] | None = None
    center_sigma_m: tuple[float, float, float] | None = None
    pairs: dict[str, tuple[float, float | None]] = field(default_factory=dict)
    over_mean: dict[str, tuple[float, float]] = field(default_factory=dict)  # each thrust over the mean, and sigma
    unadjusted_N: dict[str, float] = field(default_factory=dict)
    correlation: dict[str, float] = field(default_factory=dict)
    mean_sigma_parts_N: dict[str, float] = field(default_factory=dict)
    misfit: float | None = None
    predicted_N: float | None = None
    delta_v: dict[str, float] = field(default_factory=dict)
    priors: dict = field(default_factory=dict)
    priors_told: str = ""
    doubts: tuple[str, ...] = ()
    events: tuple[EventSeen, ...] = ()

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "method": self.method,
            "variant": self.variant,
            "thrust_N": self.thrust_N,
            "sigma_N": self.sigma_N,
            "mean_thrust_N": self.mean_thrust_N,
            "mean_sigma_N": self.mean_sigma_N,
            "mean_sigma_parts_N": self.mean_sigma_parts_N,
            "predicted_thrust_N": self.predicted_N,
            "pairs_N": {n: {"thrust_N": v, "sigma_N": s} for n, (v, s) in self.pairs.items()},
            "over_mean": {n: {"ratio": v, "sigma": s} for n, (v, s) in self.over_mean.items()},
            "unadjusted_N": self.unadjusted_N,
            "fall_time_s": self.fall_time_s,
            "fall_time_sigma_s": self.fall_time_sigma_s,
            "center_of_mass_m": None if self.center_m is None else list(self.center_m),
            "center_of_mass_sigma_m": None if self.center_sigma_m is None else list(self.center_sigma_m),
            "pulse_ratio": self.pulse_ratio,
            "on_time_s": self.on_time_s,
            "pulses": self.pulses,
            "pulses_counted": self.pulses_counted,
            "delta_v": self.delta_v,
            "correlation": self.correlation,
            "misfit": self.misfit,
            "priors": self.priors,
            "doubts": list(self.doubts),
        }

    def __str__(self) -> str:
        """The table a person scans."""
        lines = [f"Thrust · {self.craft} · {self.method}, {self.variant} · epoch {self.epoch}", "  [N]"]
        for n in self.names:
            value, sigma = self.thrust_N[n], self.sigma_N[n]
            shown = "did not fire" if not self.on_time_s[n] else "not told apart"
            if value is not None:
                shown = _told(value, sigma)
            mark = "" if self.pulses_counted else "about "
            lines.append(f"    {n:<4}  {shown:<20}  {self.on_time_s[n]:.3f} s in {mark}{self.pulses[n]:.0f} pulses")
        lines += [f"    {n:<8}  {_told(*v)}" for n, v in self.pairs.items()]
        lines.append(f"  mean      {_told(self.mean_thrust_N, self.mean_sigma_N)}")
        if self.predicted_N is not None:
            lines.append(f"  predicted {self.predicted_N:.4g}")
        if self.mean_sigma_parts_N:
            parts = ", ".join(f"{n} {1e3 * v:.2g}" for n, v in self.mean_sigma_parts_N.items())
            lines.append(f"  of sigma  {parts} [mN]")
        if self.unadjusted_N:
            lines.append("  before R  " + ", ".join(f"{n} {v:.4g}" for n, v in self.unadjusted_N.items()))
        lines.append("  R         " + ", ".join(f"{v:.4f} {n}" for n, v in self.pulse_ratio.items()))
        if self.delta_v:
            lines.append("  burn      " + ", ".join(f"{n} {v:.6g}" for n, v in self.delta_v.items()))
        sigma = self.fall_time_sigma_s
        lines.append(f"  fall time {_told(1e3 * self.fall_time_s, None if sigma is None else 1e3 * sigma)} ms")
        if self.center_m is not None:
            s = self.center_sigma_m or (None,) * 3
            middle = ", ".join(_told(a, b) for a, b in zip(self.center_m, s, strict=True))
            lines.append(f"  centre    {middle} m")
        if self.correlation:
            lines.append(
                "  the mean's correlation with " + ", ".join(f"{n} {v:+.4f}" for n, v in self.correlation.items())
            )
        if self.priors_told:
            lines.append(f"  taken beforehand: {self.priors_told}")
        return "\n".join(lines)


def _told(value: float, sigma: float | None) -> str:
    return plus_minus(value, sigma) if sigma is not None else f"{value:.4g}"
