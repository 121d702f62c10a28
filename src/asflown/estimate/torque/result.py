"""A reconstructed torque: values, band, peaks, and what there is to doubt."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...kit.ensemble import spread
from ...telemetry.channels import AXES
from ..fused import PEAK_REACH_S, AxisData, excursions, heights


@dataclass(frozen=True)
class Peak:
    """One excursion: its time (seconds from the epoch), torque [N m], axis, and sigma and 95 % interval where there are any."""

    time_s: float
    torque_Nm: float
    axis: str
    sigma_Nm: float | None = None
    interval_95_Nm: tuple[float, float] | None = None

    def holds(self, torque_Nm: float) -> bool:
        """Whether a height lies in the 95 % interval."""
        return self.interval_95_Nm is not None and self.interval_95_Nm[0] <= torque_Nm <= self.interval_95_Nm[1]

    def record(self, with_axis: bool) -> dict:
        record: dict = {"time_s": self.time_s, "torque_Nm": self.torque_Nm}
        if self.sigma_Nm is not None:
            record |= {"sigma_Nm": self.sigma_Nm, "interval_95_Nm": self.interval_95_Nm}
        return record | ({"axis": self.axis} if with_axis else {})


@dataclass(frozen=True)
class TorqueResult:
    """Disturbance torque on the body, in body axes.

    ``torque_Nm``, ``sigma_Nm``, ``momentum_Nms``: (M, 3); NaN where nothing is known.  Where
    ``relative`` is set the wheels' spin inertia is unknown and all three are per unit of it (rad/s^2
    and rad/s).  ``time_s`` counts from the telemetry's epoch."""

    craft: str
    method: str
    variant: str
    axis: str  # x, y, z or all
    epoch: str
    time_s: np.ndarray
    torque_Nm: np.ndarray
    sigma_Nm: np.ndarray | None
    momentum_Nms: np.ndarray | None
    doubts: tuple[str, ...] = ()
    relative: bool = False
    settings: dict = field(default_factory=dict)  # what the estimator chose: windows, model, inertia
    fits: tuple[dict, ...] = ()  # the polynomial method's orders and misfits
    paths_Nm: np.ndarray | None = None  # (K, F, 3), torques drawn from the joint posterior, at paths_time_s
    evidence: dict[str, AxisData] = field(default_factory=dict)  # of the fused method: each axis's data and levels
    impulses: tuple[
        tuple[float, float, str, float, float | None], ...
    ] = ()  # asked for: start, stop, axis, value, sigma

    @property
    def axes(self) -> tuple[int, ...]:
        return (0, 1, 2) if self.axis == "all" else (AXES.index(self.axis),)

    @property
    def peaks(self) -> list[Peak]:
        return [p for a in self.axes for p in find_peaks(self, a)]

    def band(self, share: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Lower and upper bound (M, 3) of the middle ``share`` of the posterior; None for a method without one."""
        if self.paths_Nm is None:
            return None
        known = np.isfinite(self.torque_Nm)
        bounds = np.full((2, *self.torque_Nm.shape), np.nan)
        every = (self.paths_Nm.shape[1] - 1) // (len(self.time_s) - 1)
        bounds[:, known] = np.quantile(self.paths_Nm[:, ::every][:, known], [0.5 - share / 2, 0.5 + share / 2], axis=0)
        return bounds[0], bounds[1]

    @property
    def paths_time_s(self) -> np.ndarray:
        """Instants of ``paths_Nm``: those of the result, or as many again between."""
        return np.linspace(
            self.time_s[0], self.time_s[-1], len(self.time_s) if self.paths_Nm is None else self.paths_Nm.shape[1]
        )

    def impulse(self, start_s: float, stop_s: float, axis: str) -> tuple[float, float | None]:
        """Angular impulse about an axis between two instants (seconds from the epoch), and its sigma. [N m s]

        The sigma comes from torques drawn from the joint posterior, so that errors which follow each
        other in time are counted as such; None for a method without one."""
        j = AXES.index(axis)

        def area(time_s, torque):
            inside = (time_s > start_s) & (time_s < stop_s)
            t = np.concatenate([[start_s], time_s[inside], [stop_s]])
            return float(np.trapezoid(np.interp(t, time_s, torque), t))

        value = area(self.time_s, self.torque_Nm[:, j])
        if self.paths_Nm is None:
            return value, None
        return value, float(spread(np.array([area(self.paths_time_s, p[:, j]) for p in self.paths_Nm])))

    def peak(self, time_s: float, reach_s: float, axis: str) -> Peak:
        """The excursion within ``reach_s`` of a time.

        Height is the mean over drawn torques of each one's own extremum: the extremum of a mean curve is lower,
        since it is rounded by the doubt about where the corner is.  Sigma is these extrema's spread and the 95 % interval their
        middle, both times what flights of the model itself say of them (``peak_scale``).  The interval is not two sigma either way: tips may be
        rounder than they look, but hardly sharper."""
        j = AXES.index(axis)
        near = np.abs(self.time_s - time_s) <= reach_s
        mean = self.torque_Nm[near, j]
        sign = float(np.sign(mean[np.argmax(np.abs(mean))]))
        if self.paths_Nm is None:
            return Peak(time_s, sign * float(np.max(sign * mean)), axis)
        drawn, scale = heights(self.paths_time_s, self.paths_Nm[:, :, j], time_s, reach_s, sign), self.peak_scale(axis)
        low, middle, high = np.quantile(drawn, [0.025, 0.5, 0.975])
        interval = float(middle + scale * (low - middle)), float(middle + scale * (high - middle))
        return Peak(time_s, float(drawn.mean()), axis, scale * float(spread(drawn)), interval)

    def peak_scale(self, axis: str) -> float:
        """By what the spread of drawn peaks is multiplied about an axis, at least 1."""
        return self.settings.get("torque", {}).get(axis, {}).get("peak_scale", 1.0)

    @property
    def unit(self) -> str:
        return "rad/s^2, per unit spin inertia" if self.relative else "N m"

    def __str__(self) -> str:
        """The table a person scans."""
        T = self.torque_Nm[:, list(self.axes)]
        known = np.isfinite(T).all(axis=1)
        lines = [
            f"Disturbance torque · {self.craft} · {self.method}, {self.variant} · epoch {self.epoch}",
            f"  {known.sum()} instants from {self.time_s[0]:g} s to {self.time_s[-1]:g} s, {(~known).sum()} of {len(known)} unknown · "
            f"[{self.unit}]",
        ]
        for j in self.axes:
            t = self.torque_Nm[:, j]
            if not np.isfinite(t).any():
                continue
            band = "" if self.sigma_Nm is None else f"   1 sigma {np.nanmedian(self.sigma_Nm[:, j]):.2g}"
            lines.append(f"  {AXES[j]}   mean {np.nanmean(t):+.3g}   rms {np.sqrt(np.nanmean(t**2)):.3g}{band}")
            peaks = find_peaks(self, j)
            lines += [f"      peak at {p.time_s:5.0f} s  {_value(p)}" for p in peaks[:12]]
            if len(peaks) > 12:
                lines.append(f"      and {len(peaks) - 12} more peaks")
        for f in self.fits:
            if f["axis"] in self.axis or self.axis == "all":
                rms = next(v for k, v in f.items() if k.startswith("rms_") and k != "rms_percent")
                share = "" if f["rms_percent"] is None else f" ({f['rms_percent']:.2f} % of the mean size)"
                lines.append(f"  order {f['order']:2d}, {f['channel']} {f['axis']}: rms misfit {rms:.4g}{share}")
        for start, stop, axis, value, sigma in self.impulses:
            band = "" if sigma is None else f" +- {sigma:.2g}"
            unit = "rad/s, per unit spin inertia" if self.relative else "N m s"
            lines.append(f"  impulse {axis} from {start:g} to {stop:g} s: {value:+.4g}{band} {unit}")
        return "\n".join(lines)

    def _band_record(self, share: float) -> dict:
        low, high = self.band(share) or (None, None)
        return {"low": self.column(low), "high": self.column(high)}

    def column(self, values) -> np.ndarray | None:
        """(M,) of the one axis, or (M, 3)."""
        if values is None:
            return None
        return values if self.axis == "all" else values[:, self.axes[0]]

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        names = ("torque_Nm", "sigma_Nm", "momentum_Nms")
        values = {n: self.column(getattr(self, n)) for n in names}
        peaks = [p.record(with_axis=self.axis == "all") for p in self.peaks]
        bands = {f"band_{n}_Nm": self._band_record(n / 100) for n in (68, 95) if self.paths_Nm is not None}
        record = {
            "craft": self.craft,
            "method": self.method,
            "variant": self.variant,
            "axis": self.axis,
            "epoch": self.epoch,
            "time_s": self.time_s,
            **values,
            **bands,
            "peaks": peaks,
            "doubts": list(self.doubts),
            "settings": self.settings,
        }
        impulses = [
            {"start_s": a, "stop_s": b, "axis": x, "impulse_Nms": v, "sigma_Nms": e} for a, b, x, v, e in self.impulses
        ]
        if impulses:
            record["impulses"] = impulses
        if self.relative:  # a number per unit spin inertia must not stand under a key that says N m
            record |= {
                "torque_Nm": None,
                "sigma_Nm": None,
                "momentum_Nms": None,
                "torque_per_spin_inertia_rad_s2": values["torque_Nm"],
                "sigma_per_spin_inertia_rad_s2": values["sigma_Nm"],
                "momentum_per_spin_inertia_rad_s": values["momentum_Nms"],
            }
            for n in bands:
                record[n.replace("_Nm", "_per_spin_inertia_rad_s2")], record[n] = record[n], None
            for p in peaks:
                p["torque_per_spin_inertia_rad_s2"], p["torque_Nm"] = p["torque_Nm"], None
                if "sigma_Nm" in p:
                    p["sigma_per_spin_inertia_rad_s2"], p["sigma_Nm"] = p["sigma_Nm"], None
                    p["interval_95_per_spin_inertia_rad_s2"], p["interval_95_Nm"] = p["interval_95_Nm"], None
            for i in impulses:
                i["impulse_per_spin_inertia_rad_s"], i["impulse_Nms"] = i["impulse_Nms"], None
                i["sigma_per_spin_inertia_rad_s"], i["sigma_Nms"] = i["sigma_Nms"], None
        if self.fits:
            record["fits"] = list(self.fits)
        return record


def find_peaks(result: TorqueResult, axis: int) -> list[Peak]:
    """Excursions that stand out: prominence above a quarter of the largest, height above 4 sigma at that instant."""
    torque, name = result.torque_Nm[:, axis], AXES[axis]
    at = excursions(torque, None if result.sigma_Nm is None else result.sigma_Nm[:, axis])
    if result.paths_Nm is None:
        return [Peak(float(result.time_s[k]), float(torque[k]), name) for k in at]
    return [result.peak(float(result.time_s[k]), PEAK_REACH_S, name) for k in at]


def _value(peak: Peak) -> str:
    if peak.sigma_Nm is None or peak.interval_95_Nm is None:
        return f"{peak.torque_Nm:+.4g}"
    low, high = peak.interval_95_Nm
    return f"{peak.torque_Nm:+.4g} +- {peak.sigma_Nm:.2g}  95 %: {low:+.4g} to {high:+.4g}"
