"""A reconstructed torque: values, band, peaks, and what there is to doubt."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...kit.digits import interval, plus_minus, scaled_unit
from ...kit.ensemble import spread
from ...kit.files import write_text
from ...kit.peaks import PEAK_REACH_S, excursions, heights
from ...kit.plain import plain
from ...kit.result import Estimate, Series, per_spin_inertia
from ...kit.schema import Annotated, Doc, Interval, NotRequired, Number, Numbers, Rows, TypedDict
from ...kit.table import Table
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ..firing import Gained
    from ..fused import AxisData

Column = Annotated[Numbers | Rows, Doc("one number an instant; for all axes three")]


class PeakRecord(TypedDict):
    """An excursion that stands out; its sigma and interval where the method has a posterior, its axis where all were asked for."""

    time_s: Number
    torque_Nm: Number
    torque_sigma_Nm: NotRequired[Number]
    torque_ci95_Nm: NotRequired[Interval | None]
    axis: NotRequired[str]


class ImpulseRecord(TypedDict):
    """An angular impulse asked for."""

    start_s: Number
    stop_s: Number
    axis: str
    impulse_Nms: Number
    impulse_sigma_Nms: Number


class KnownRecord(TypedDict):
    """A torque of the surroundings that was taken off."""

    name: Annotated[str, Doc("gravity-gradient, sunlight, dipole, drag or rods")]
    source: Annotated[str, Doc("where its vectors are from")]
    torque_Nm: Column
    torque_sigma_Nm: Annotated[Column, Doc("one sigma, by the craft file; it is in the torque's own")]


class FitRecord(TypedDict):
    """Misfit of one polynomial; attitude error in rad, momentum in N m s."""

    order: int
    channel: str
    axis: str
    rms_Nms: NotRequired[Number]
    rms_rad: NotRequired[Number]
    rms_percent: Annotated[Number, Doc("of the mean size")]


class TorqueRecord(TypedDict):
    """JSON of `asflown torque`.  Where the wheels' spin inertia is unknown the keys in N m and N m s are null and their
    siblings per unit spin inertia hold the values."""

    craft: str
    method: Annotated[str, Doc("fused, momentum, transfer, polynomial or on-times")]
    variant: Annotated[str, Doc("corrected or printed")]
    axis: Annotated[str, Doc("x, y, z or all")]
    epoch: str
    time_s: Annotated[Numbers, Doc("from the epoch")]
    torque_Nm: Annotated[Column | None, Doc("positive turns the body about +axis")]
    torque_sigma_Nm: Column | None
    momentum_Nms: Annotated[Column | None, Doc("of wheels and body, body axes")]
    band_68_Nm: NotRequired[Annotated[dict | None, Doc("kept for this version; see torque_ci68_Nm")]]
    band_95_Nm: NotRequired[Annotated[dict | None, Doc("kept for this version; see torque_ci95_Nm")]]
    torque_ci68_Nm: NotRequired[Annotated[list[Column] | None, Doc("[low, high] over time, of the posterior")]]
    torque_ci95_Nm: NotRequired[Annotated[list[Column] | None, Doc("[low, high] over time, of the posterior")]]
    peaks: list[PeakRecord]
    settings: dict
    impulses: NotRequired[list[ImpulseRecord]]
    known: NotRequired[Annotated[list[KnownRecord], Doc("with --with: what was taken off")]]
    fits: NotRequired[list[FitRecord]]
    comparison: NotRequired[Annotated[list[dict], Doc("with --compare: every other method against this one")]]
    torque_per_spin_inertia_rad_s2: NotRequired[Column | None]
    torque_sigma_per_spin_inertia_rad_s2: NotRequired[Column | None]
    momentum_per_spin_inertia_rad_s: NotRequired[Column | None]
    band_68_per_spin_inertia_rad_s2: NotRequired[Annotated[dict | None, Doc("kept for this version")]]
    band_95_per_spin_inertia_rad_s2: NotRequired[Annotated[dict | None, Doc("kept for this version")]]
    torque_ci68_per_spin_inertia_rad_s2: NotRequired[list[Column] | None]
    torque_ci95_per_spin_inertia_rad_s2: NotRequired[list[Column] | None]


@dataclass(frozen=True)
class Peak:
    """One excursion: its time (seconds from the epoch), torque [N m], axis, and sigma and 95 % interval where there are any."""

    time_s: float
    torque_Nm: float
    axis: str
    torque_sigma_Nm: float | None = None
    torque_ci95_Nm: tuple[float, float] | None = None

    def holds(self, torque_Nm: float) -> bool:
        """Whether a height lies in the 95 % interval."""
        return self.torque_ci95_Nm is not None and self.torque_ci95_Nm[0] <= torque_Nm <= self.torque_ci95_Nm[1]

    def record(self) -> dict:
        record: dict = {"time_s": self.time_s, "torque_Nm": self.torque_Nm}
        if self.torque_sigma_Nm is not None:
            record |= {"torque_sigma_Nm": self.torque_sigma_Nm, "torque_ci95_Nm": self.torque_ci95_Nm}
        return record


@dataclass(frozen=True)
class Impulse:
    """Angular impulse about an axis between two instants (seconds from the epoch); sigma None for a method without a posterior."""

    start_s: float
    stop_s: float
    axis: str
    impulse_Nms: float
    impulse_sigma_Nms: float | None

    def record(self) -> dict:
        return {
            "start_s": self.start_s, "stop_s": self.stop_s, "axis": self.axis, "impulse_Nms": self.impulse_Nms,
            "impulse_sigma_Nms": self.impulse_sigma_Nms,
        }  # fmt: skip


@dataclass(frozen=True)
class KnownTorque:
    """One torque that was taken off: its name, where its vectors are from, its size and one sigma (M, 3) [N m]."""

    name: str
    source: str
    torque_Nm: np.ndarray
    torque_sigma_Nm: np.ndarray


@dataclass(frozen=True, kw_only=True, repr=False)
class TorqueResult(Estimate):
    """Disturbance torque on the body, in body axes; positive turns the body about +axis.

    ``torque_Nm``, ``torque_sigma_Nm``, ``momentum_Nms``: (M, 3); NaN where nothing is known.  Where ``relative`` is set the
    wheels' spin inertia is unknown and all three are per unit of it (rad/s^2 and rad/s).  ``time_s`` (M,) counts from the
    telemetry's epoch.  ``paths_Nm``: (K, F, 3), torques drawn from the joint posterior, at ``paths_time_s``; None for a method
    without one.  ``fits``: the polynomial method's orders and misfits.  By axis: ``peak_scales``, by what the spread of drawn
    peaks is multiplied, and ``evidence``, the fused method's data and levels.  ``gained``: the on-times method's steps.
    ``impulses``: those asked for; ``known``: torques of the surroundings that were taken off; ``compared``: other methods' results, drawn in the same figure."""

    RECORD: ClassVar[type] = TorqueRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "sigma_Nm": "torque_sigma_Nm",
        "sigma_per_spin_inertia_rad_s2": "torque_sigma_per_spin_inertia_rad_s2",
        "peaks[].sigma_Nm": "torque_sigma_Nm",
        "peaks[].interval_95_Nm": "torque_ci95_Nm",
        "peaks[].sigma_per_spin_inertia_rad_s2": "torque_sigma_per_spin_inertia_rad_s2",
        "peaks[].interval_95_per_spin_inertia_rad_s2": "torque_ci95_per_spin_inertia_rad_s2",
        "impulses[].sigma_Nms": "impulse_sigma_Nms",
        "impulses[].sigma_per_spin_inertia_rad_s": "impulse_sigma_per_spin_inertia_rad_s",
    }

    axis: str  # x, y, z or all
    time_s: np.ndarray
    torque_Nm: np.ndarray
    torque_sigma_Nm: np.ndarray | None = None
    momentum_Nms: np.ndarray | None = None
    relative: bool = False
    fits: tuple[dict, ...] = ()
    paths_Nm: np.ndarray | None = None
    peak_scales: dict[str, float] = field(default_factory=dict)
    evidence: dict[str, AxisData] = field(default_factory=dict)
    gained: Gained | None = None
    impulses: tuple[Impulse, ...] = ()
    known: tuple[KnownTorque, ...] = ()
    compared: tuple[TorqueResult, ...] = ()

    # ---- over time ----

    @property
    def sigma_Nm(self) -> np.ndarray | None:
        """Kept for this version; see ``torque_sigma_Nm``."""
        return self.torque_sigma_Nm

    @property
    def axes(self) -> tuple[int, ...]:
        return (0, 1, 2) if self.axis == "all" else (AXES.index(self.axis),)

    @property
    def paths_time_s(self) -> np.ndarray:
        """Instants of ``paths_Nm``: those of the result, or one more between each two."""
        return np.linspace(
            self.time_s[0], self.time_s[-1], len(self.time_s) if self.paths_Nm is None else self.paths_Nm.shape[1]
        )

    def band(self, share: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Lower and upper bound (M, 3) of the middle ``share`` of the posterior; None for a method without one."""
        if self.paths_Nm is None:
            return None
        known = np.isfinite(self.torque_Nm)
        bounds = np.full((2, *self.torque_Nm.shape), np.nan)
        every = (self.paths_Nm.shape[1] - 1) // (len(self.time_s) - 1)
        bounds[:, known] = np.quantile(self.paths_Nm[:, ::every][:, known], [0.5 - share / 2, 0.5 + share / 2], axis=0)
        return bounds[0], bounds[1]

    def impulse(self, start_s: float, stop_s: float, axis: str) -> tuple[float, float | None]:
        """Angular impulse about an axis between two instants (seconds from the epoch), and its sigma. [N m s]

        The sigma comes from torques drawn from the joint posterior, so that errors correlated in time count as such; None for
        a method without one."""
        j = AXES.index(axis)

        def area(time_s, torque):
            inside = (time_s > start_s) & (time_s < stop_s)
            t = np.concatenate([[start_s], time_s[inside], [stop_s]])
            return float(np.trapezoid(np.interp(t, time_s, torque), t))

        value = area(self.time_s, self.torque_Nm[:, j])
        if self.paths_Nm is None:
            return value, None
        return value, float(spread(np.array([area(self.paths_time_s, p[:, j]) for p in self.paths_Nm])))

    def with_impulse(self, start_s: float, stop_s: float) -> TorqueResult:
        """The same with the angular impulse between two instants about every axis asked for."""
        asked = (Impulse(start_s, stop_s, AXES[j], *self.impulse(start_s, stop_s, AXES[j])) for j in self.axes)
        return replace(self, impulses=(*self.impulses, *asked))

    # ---- peaks ----

    @property
    def peaks(self) -> list[Peak]:
        return [p for a in self.axes for p in find_peaks(self, a)]

    def peak(self, time_s: float, reach_s: float, axis: str) -> Peak:
        """The excursion within ``reach_s`` of a time.

        Height is the mean over drawn torques of each one's own extremum: the extremum of the mean curve is lower, since it is
        rounded by the uncertainty of where the corner is.  Sigma is these extrema's spread and the 95 % interval their middle,
        both times ``peak_scale``.  The interval is not two sigma to either side: tips may be rounder than they look, but hardly
        sharper."""
        j = AXES.index(axis)
        near = np.abs(self.time_s - time_s) <= reach_s
        mean = self.torque_Nm[near, j]
        sign = float(np.sign(mean[np.argmax(np.abs(mean))]))
        if self.paths_Nm is None:
            return Peak(time_s, sign * float(np.max(sign * mean)), axis)
        drawn, scale = heights(self.paths_time_s, self.paths_Nm[:, :, j], time_s, reach_s, sign), self.peak_scale(axis)
        low, middle, high = np.quantile(drawn, [0.025, 0.5, 0.975])
        ends = float(middle + scale * (low - middle)), float(middle + scale * (high - middle))
        return Peak(time_s, float(drawn.mean()), axis, scale * float(spread(drawn)), ends)

    def peak_scale(self, axis: str) -> float:
        """By what the spread of drawn peaks is multiplied about an axis, at least 1."""
        return self.peak_scales.get(axis, 1.0)

    # ---- the face ----

    def column(self, values) -> np.ndarray | None:
        """(M,) of the one axis, or (M, 3)."""
        if values is None:
            return None
        return values if self.axis == "all" else values[:, self.axes[0]]

    def _record(self) -> dict:
        in_torque: dict = {
            "torque_Nm": self.column(self.torque_Nm),
            "torque_sigma_Nm": self.column(self.torque_sigma_Nm),
            "momentum_Nms": self.column(self.momentum_Nms),
        }
        for n in (68, 95):
            bounds = self.band(n / 100)
            if bounds is not None:
                low, high = map(self.column, bounds)
                in_torque |= {f"band_{n}_Nm": {"low": low, "high": high}, f"torque_ci{n}_Nm": [low, high]}
        peaks = [p.record() | ({"axis": p.axis} if self.axis == "all" else {}) for p in self.peaks]
        record = {
            "craft": self.craft,
            "method": self.method,
            "variant": self.variant,
            "axis": self.axis,
            "epoch": self.epoch,
            "time_s": self.time_s,
            **in_torque,
            "peaks": peaks,
            "settings": self.settings,
        }
        impulses = [i.record() for i in self.impulses]
        if impulses:
            record["impulses"] = impulses
        if self.known:
            record["known"] = [
                {"name": k.name, "source": k.source, "torque_Nm": self.column(k.torque_Nm), "torque_sigma_Nm": self.column(k.torque_sigma_Nm)}
                for k in self.known
            ]  # fmt: skip
        if self.fits:
            record["fits"] = list(self.fits)
        if self.relative:
            per_spin_inertia(record, in_torque)
            for row in peaks:
                per_spin_inertia(row, ("torque_Nm", "torque_sigma_Nm", "torque_ci95_Nm"))
            for row in impulses:
                per_spin_inertia(row, ("impulse_Nms", "impulse_sigma_Nms"))
        return record

    def series(self) -> Series:
        """Torque, sigma, momentum and the posterior's 95 % band, of the axes asked for."""
        low, high = self.band(0.95) or (None, None)
        named = {
            "torque_Nm": self.torque_Nm, "torque_sigma_Nm": self.torque_sigma_Nm, "momentum_Nms": self.momentum_Nms,
            "torque_ci95_low_Nm": low, "torque_ci95_high_Nm": high,
        }  # fmt: skip
        columns = {n: v[:, list(self.axes)] for n, v in named.items() if v is not None}
        if self.relative:
            per_spin_inertia(columns, list(columns))
            columns = {n: v for n, v in columns.items() if v is not None}
        return Series(self.time_s, columns, tuple(AXES[j] for j in self.axes))

    def _save_csv(self, path) -> None:
        """Time, torque, sigma, momentum and bands per axis; blank where unknown; doubts and provenance in comment lines.

        Column names are those of earlier versions."""
        unit, momentum_unit = ("rad/s2", "rad/s") if self.relative else ("N m", "N m s")
        suffix = "_per_spin_inertia" if self.relative else ""
        named = [
            ("disturbance_torque", self.torque_Nm, unit),
            ("sigma_torque", self.torque_sigma_Nm, unit),
            ("momentum", self.momentum_Nms, momentum_unit),
        ]
        for n in (68, 95):
            named += [
                (f"band_{n}_{end}", v, unit) for end, v in zip(("low", "high"), self.band(n / 100) or (), strict=False)
            ]
        columns = [("time [s]", self.time_s)]
        columns += [(f"{n}{suffix}_{AXES[j]} [{u}]", v[:, j]) for n, v, u in named if v is not None for j in self.axes]
        lines = [
            f"# epoch: {self.epoch}",
            f"# disturbance torque on the body, body axes; craft {self.craft}; {self.method}, {self.variant}",
            *(f"# DOUBT ({d.severity.label}) {d}" for d in self.doubts),
            *(f"# input {i.file} sha256 {i.sha256}" for i in self.inputs),
            f"# asflown {version('asflown')}, options {plain(self.options)}",
            ",".join(name for name, _ in columns),
        ]
        rows = zip(*(v for _, v in columns), strict=True)
        lines += [",".join(repr(float(v)) if np.isfinite(v) else "" for v in row) for row in rows]
        write_text(path, "\n".join(lines) + "\n")

    def _scaled(self) -> tuple[float, str]:
        if self.relative:
            return 1.0, "rad/s^2, per unit spin inertia"
        return scaled_unit(float(np.nanmax(np.abs(self.torque_Nm[:, list(self.axes)]), initial=0.0)), "N m")

    def _tables(self) -> tuple[Table, ...]:
        known = np.isfinite(self.torque_Nm[:, list(self.axes)]).all(axis=1)
        factor, unit = self._scaled()
        title = (
            f"Disturbance torque · {self.craft} · {self.method}, {self.variant} · epoch {self.epoch}\n"
            f"  {known.sum()} instants from {self.time_s[0]:g} s to {self.time_s[-1]:g} s, {(~known).sum()} of {len(known)} unknown"
        )
        sigma = None if self.torque_sigma_Nm is None else factor * self.torque_sigma_Nm
        rows = []
        for j in self.axes:
            t = factor * self.torque_Nm[:, j]
            if np.isfinite(t).any():
                width = [] if sigma is None else [f"{np.nanmedian(sigma[:, j]):.2g}"]
                rows.append((AXES[j], f"{np.nanmean(t):+.3g}", f"{np.sqrt(np.nanmean(t**2)):.3g}", *width))
        head = ("axis", f"mean [{unit}]", "rms", *([] if sigma is None else ["1 sigma"]))
        remarks = (*map(self._known_text, self.known), *map(self._impulse_text, self.impulses))
        found = [Table(title, tuple(rows), head, remarks)]
        return (*found, *self._peak_table(factor, unit), *self._fit_table())

    def _known_text(self, k: KnownTorque) -> str:
        factor, unit = self._scaled()
        rms, sigma = (factor * np.sqrt(np.mean(v[:, list(self.axes)] ** 2)) for v in (k.torque_Nm, k.torque_sigma_Nm))
        return f"taken off: {k.name}, rms {plus_minus(rms, sigma, unit)} ({k.source})"

    def _impulse_text(self, i: Impulse) -> str:
        unit = "rad/s, per unit spin inertia" if self.relative else "N m s"
        size = plus_minus(i.impulse_Nms, i.impulse_sigma_Nms, "" if self.relative else unit)
        return f"impulse {i.axis} from {i.start_s:g} to {i.stop_s:g} s: {size}{' ' + unit if self.relative else ''}"

    def _peak_table(self, factor: float, unit: str) -> list[Table]:
        rows, remarks = [], []
        for j in self.axes:
            peaks = find_peaks(self, j)
            for p in peaks[:_SHOWN]:
                size = None if p.torque_sigma_Nm is None else factor * p.torque_sigma_Nm
                low, high = p.torque_ci95_Nm or (0.0, 0.0)
                ends = [interval(factor * low, factor * high, digits=4)] if p.torque_ci95_Nm else []
                rows.append((AXES[j], f"{p.time_s:.0f}", plus_minus(factor * p.torque_Nm, size), *ends))
            if len(peaks) > _SHOWN:
                remarks.append(f"and {len(peaks) - _SHOWN} more peaks about {AXES[j]}")
        if not rows:
            return []
        head = ("axis", "time [s]", f"peak [{unit}]", *(["95 % interval"] if self.paths_Nm is not None else []))
        return [Table("Peaks", tuple(rows), head, tuple(remarks))]

    def _fit_table(self) -> list[Table]:
        rows = []
        for f in self.fits:
            if f["axis"] in self.axis or self.axis == "all":
                rms, unit = (f["rms_Nms"], "N m s") if "rms_Nms" in f else (f["rms_rad"], "rad")
                share = "" if f["rms_percent"] is None else f"{f['rms_percent']:.2f}"
                rows.append((f"{f['order']}", f["channel"], f["axis"], plus_minus(rms, None, unit), share))
        head = ("order", "channel", "axis", "rms misfit", "% of the mean size")
        return [Table("Polynomials", tuple(rows), head)] if rows else []


#: Peaks of an axis that a table shows.
_SHOWN = 12


def find_peaks(result: TorqueResult, axis: int) -> list[Peak]:
    """Excursions that stand out: prominence above a quarter of the largest, height above 4 sigma at that instant."""
    torque, name = result.torque_Nm[:, axis], AXES[axis]
    at = excursions(torque, None if result.torque_sigma_Nm is None else result.torque_sigma_Nm[:, axis])
    if result.paths_Nm is None:
        return [Peak(float(result.time_s[k]), float(torque[k]), name) for k in at]
    return [result.peak(float(result.time_s[k]), PEAK_REACH_S, name) for k in at]
