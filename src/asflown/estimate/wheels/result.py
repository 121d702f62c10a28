"""What was found of every wheel: bearing drag, spikes, and how it was used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.digits import plus_minus

if TYPE_CHECKING:
    from .run_downs import RunDown
    from .use import WheelUse

RUN_DOWN, FLIGHT_SOFTWARE, COMMAND = "run-down", "flight software estimate", "command"

#: The split of drag into both parts is doubted where it is uncertain by this share of the drag.
_SPLIT = 0.1
_RPM = 60 / (2 * np.pi)


@dataclass(frozen=True)
class DragFit:
    """drag = coulomb + viscous |rate|, opposing the rate; SI, or per unit spin inertia where ``relative``.

    Sigmas hold the scatter of the samples.  The spin inertia's own error scales a run-down's drag and is not in them."""

    basis: str
    coulomb: float
    sigma_coulomb: float
    viscous: float
    sigma_viscous: float
    correlation: float
    at_mean: float  # drag at ``mean_rate``, which is known better than either part
    sigma_at_mean: float
    mean_rate: float  # mean |rate| of the samples used
    relative: bool = False

    @classmethod
    def from_law(cls, basis, values, covariance, rate: float, scale: float = 1.0, relative=False) -> DragFit:
        values, covariance = scale * np.asarray(values, float), scale**2 * np.asarray(covariance, float)
        sigma = np.sqrt(np.diag(covariance))
        at = np.array([1.0, rate])
        product = sigma[0] * sigma[1]
        return cls(
            basis, float(values[0]), float(sigma[0]), float(values[1]), float(sigma[1]),
            float(np.clip(covariance[0, 1] / product, -1, 1)) if product > 0 else float("nan"),
            float(at @ values), float(np.sqrt(max(at @ covariance @ at, 0.0))), float(rate), relative,
        )  # fmt: skip

    @property
    def told_apart(self) -> bool:
        """Whether the split between both parts means something."""
        return bool(self.sigma_viscous * self.mean_rate <= _SPLIT * abs(self.at_mean))

    def drag(self, rate) -> np.ndarray:
        """Size of the drag at these rates."""
        return self.coulomb + self.viscous * np.abs(rate)

    def sigma(self, rate) -> np.ndarray:
        """One sigma of ``drag``, spread from the mean rate, where it is smallest."""
        off = np.abs(np.asarray(rate, float)) - self.mean_rate
        return np.hypot(self.sigma_at_mean, off * self.sigma_viscous)

    def record(self) -> dict:
        in_torque = {
            "coulomb_Nm": self.coulomb,
            "sigma_coulomb_Nm": self.sigma_coulomb,
            "viscous_Nms": self.viscous,
            "sigma_viscous_Nms": self.sigma_viscous,
            "correlation": self.correlation,
            "drag_at_mean_Nm": self.at_mean,
            "sigma_drag_at_mean_Nm": self.sigma_at_mean,
            "mean_rate_rad_s": self.mean_rate,
            "told_apart": self.told_apart,
            "basis": self.basis,
        }
        if not self.relative:
            return in_torque
        # a number per unit spin inertia must not stand under a key that says N m
        moved = {
            n.replace("_Nms", "_per_spin_inertia_per_s").replace("_Nm", "_per_spin_inertia_rad_s2"): v
            for n, v in in_torque.items()
            if "_Nm" in n
        }
        return {n: None if "_Nm" in n else v for n, v in in_torque.items()} | moved


_NOTHING = dict.fromkeys(
    ("coulomb_Nm", "sigma_coulomb_Nm", "viscous_Nms", "sigma_viscous_Nms", "correlation", "drag_at_mean_Nm",
     "sigma_drag_at_mean_Nm", "mean_rate_rad_s", "told_apart", "basis")
)  # fmt: skip


@dataclass(frozen=True)
class Spike:
    """Drag that stands out above the law: when it rises, its largest value and excess (medians of three samples, where
    it lasts as long), and how long it stays above half of that."""

    time_s: float
    drag_Nm: float
    excess_Nm: float
    duration_s: float

    def record(self) -> dict:
        return {n: getattr(self, n) for n in ("time_s", "drag_Nm", "excess_Nm", "duration_s")}


@dataclass(frozen=True)
class DragSamples:
    """The flight software's own estimates, opposing the rate: evidence, and where spikes are looked for."""

    time_s: np.ndarray
    rate_rad_s: np.ndarray
    drag_Nm: np.ndarray
    used: np.ndarray  # (N,) bool


@dataclass(frozen=True)
class WheelDrag:
    """One wheel.  ``fits``: every way its drag could be had, the best one first; empty where there is none.

    ``spikes``: None where the file holds nothing to look for them in."""

    name: str
    spin_inertia_kgm2: float | None
    rate_limit_rad_s: float | None
    use: WheelUse
    time_s: np.ndarray
    rate_rad_s: np.ndarray
    fits: tuple[DragFit, ...] = ()
    run_downs: tuple[RunDown, ...] = ()
    spikes: tuple[Spike, ...] | None = None
    samples: DragSamples | None = None

    @property
    def fit(self) -> DragFit | None:
        return self.fits[0] if self.fits else None

    def record(self) -> dict:
        return {
            "name": self.name,
            **(self.fit.record() if self.fit else _NOTHING),
            "spin_inertia_kgm2": self.spin_inertia_kgm2,
            "run_downs": [r.record() for r in self.run_downs],
            "spikes": None if self.spikes is None else [s.record() for s in self.spikes],
            "low_speed_dwell_s": self.use.low_speed_dwell_s,
            "zero_crossings": self.use.zero_crossings,
            "zero_crossing_times_s": list(self.use.crossing_times_s),
            "revolutions": self.use.revolutions,
            "largest_rate_rad_s": self.use.largest_rate_rad_s,
            "rate_limit_rad_s": self.rate_limit_rad_s,
            "seen_s": self.use.seen_s,
            "gaps_s": self.use.gaps_s,
            "other_bases": [f.record() for f in self.fits[1:]],
        }


@dataclass(frozen=True)
class WheelsResult:
    """Every wheel of a record.  Times count from the telemetry's epoch; what is not known is null."""

    craft: str
    epoch: str
    low_speed_rad_s: float
    wheels: tuple[WheelDrag, ...]
    doubts: tuple[str, ...] = ()

    def wheel(self, name: str) -> WheelDrag:
        return next(w for w in self.wheels if w.name == name)

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "low_speed_rad_s": self.low_speed_rad_s,
            "wheels": [w.record() for w in self.wheels],
            "doubts": list(self.doubts),
        }

    def __str__(self) -> str:
        """The table a person scans."""
        lines = [f"Wheels · {self.craft} · epoch {self.epoch}"]
        for w in self.wheels:
            lines += ["  " + w.name, *("    " + line for line in _told(w, self.low_speed_rad_s))]
        return "\n".join(lines)


def _told(w: WheelDrag, low_rad_s: float):
    if w.fit is None:
        yield "drag          not known"
    for f in w.fits:
        unit, per_rate = ("rad/s^2", "1/s") if f.relative else ("mN m", "µN m s")
        scale, fine, of = (1.0, 1.0, ", per unit spin inertia") if f.relative else (1e3, 1e6, "")
        yield f"drag          from {f.basis}{of}"
        if f.told_apart:
            yield f"  coulomb     {plus_minus(scale * f.coulomb, scale * f.sigma_coulomb)} {unit}"
            yield f"  viscous     {plus_minus(fine * f.viscous, fine * f.sigma_viscous)} {per_rate}   correlation {f.correlation:+.3f}"
        else:
            yield "  coulomb and viscous drag are not told apart"
        at = plus_minus(scale * f.at_mean, scale * f.sigma_at_mean)
        yield f"  together    {at} {unit} at {_RPM * f.mean_rate:.0f} rpm"
    for r in w.run_downs:
        yield (
            f"run-down      {r.start_s:.0f} to {r.stop_s:.0f} s, {_RPM * r.from_rad_s:.1f} to {_RPM * r.to_rad_s:.1f} rpm"
        )
    for s in (w.spikes or ())[:12]:
        yield f"drag spike    {1e3 * s.drag_Nm:.2f} mN m at {s.time_s:.0f} s for {s.duration_s:.0f} s"
    if w.spikes and len(w.spikes) > 12:
        yield f"              and {len(w.spikes) - 12} more"
    u = w.use
    times = "once" if u.zero_crossings == 1 else f"{u.zero_crossings} times"
    yield (
        f"use           {u.revolutions:.1f} revolutions in {u.seen_s:.0f} s; {u.low_speed_dwell_s:.0f} s below "
        f"{_RPM * low_rad_s:.0f} rpm; zero crossed {times}; largest {_RPM * u.largest_rate_rad_s:.1f} rpm"
    )
