"""Density of a gas along a flyby: what was found, and how well its shape and its scale are known."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...kit.digits import plus_minus
from ...kit.result import Estimate, Series
from ...kit.schema import Annotated, Doc, Number, Numbers, Rows, TypedDict
from ...kit.table import Table
from .atmosphere import AtmosphereRecord
from .parts import AgreementRecord, NoticedRecord, PeakRecord, PublishedRecord, total

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby
    from ..fused import AxisData
    from .atmosphere import AtmosphereFit
    from .drag import DragAlong
    from .parts import Agreement, DensityPeak, MomentumHeld, Noticed, PeakRatio
    from .peak import DrawnPeaks


class DensityRecord(TypedDict):
    """JSON of `asflown density`.  Times count from closest approach; negative densities are noise and are kept.

    Where several axes are taken together, torques have one column an axis and the torque per density is a list."""

    craft: str
    epoch: Annotated[str, Doc("of the telemetry")]
    flyby: str
    closest_approach: str
    method: Annotated[str, Doc("of the torque")]
    variant: Annotated[str, Doc("corrected or printed")]
    axis: Annotated[str, Doc("axes taken together, as in yz")]
    time_s: Numbers
    altitude_m: Numbers
    density_kgm3: Numbers
    density_sigma_shape_kgm3: Annotated[Numbers | None, Doc("random part, different from instant to instant")]
    scale_sigma: Annotated[Number, Doc("one sigma, as a share, by which all densities are off together")]
    density_sigma_kgm3: Annotated[Numbers | None, Doc("shape and scale together")]
    bound_left_out_kgm3: Annotated[Numbers, Doc("the most that torques not modelled can mimic")]
    torque_Nm: Numbers | Rows
    gravity_gradient_Nm: Annotated[Numbers | Rows | None, Doc("taken off the torque; null where it is not modelled")]
    torque_per_density_m5_s2: Annotated[float | list[float], Doc("N m per kg/m3 at the peak, with the torque's sign")]
    axes_agree: Annotated[AgreementRecord | None, Doc("null for one axis")]
    peak: PeakRecord
    noticed: NoticedRecord | None
    published: list[PublishedRecord]
    atmosphere: Annotated[AtmosphereRecord | None, Doc("of a body that has one")]
    settings: dict


@dataclass(frozen=True, kw_only=True, repr=False)
class DensityResult(Estimate):
    """Density over time from closest approach, (N,), NaN where nothing is known; negative values are noise and are kept.

    ``density_sigma_shape_kgm3`` (N,) is random; ``scale_sigma`` is one sigma, as a share, by which all densities are off
    together, None where that is not known.  ``bound_kgm3`` (N,): the most that torques left out (gravity gradient, sunlight,
    ...) can mimic.  ``axis``: one, or all that were taken together; ``torque_Nm`` and ``gravity_gradient_Nm`` are (N,) then, or
    (N, n).  ``torque_per_density``: N m per kg/m3 about each axis at the peak.  ``closest_s``: closest approach, from the
    telemetry's epoch [s].  ``evidence``: by axis, what the fused torque rests on; ``drawn_peaks``: peaks of jets and a
    remainder, where they were looked for; ``momentum``: None where actuators are known by their torque only."""

    RECORD: ClassVar[type] = DensityRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "sigma_shape_kgm3": "density_sigma_shape_kgm3",
        "sigma_scale_fraction": "scale_sigma",
        "sigma_kgm3": "density_sigma_kgm3",
        "published[].sigma_kgm3": "density_sigma_kgm3",
        "published[].sigma_ratio": "ratio_sigma",
    }

    flyby: Flyby
    closest_approach: str
    closest_s: float
    axis: str
    time_s: np.ndarray
    density_kgm3: np.ndarray
    density_sigma_shape_kgm3: np.ndarray | None
    scale_sigma: float | None
    bound_kgm3: np.ndarray
    torque_Nm: np.ndarray
    gravity_gradient_Nm: np.ndarray | None
    torque_per_density: tuple[float, ...]
    peak: DensityPeak
    drag: DragAlong
    noticed: Noticed | None = None
    agreement: Agreement | None = None
    evidence: dict[str, AxisData] = field(default_factory=dict)
    drawn_peaks: DrawnPeaks | None = None
    published: tuple[PeakRatio, ...] = ()
    atmosphere: AtmosphereFit | None = None
    momentum: MomentumHeld | None = None

    @property
    def altitude_m(self) -> np.ndarray:
        return self.flyby.altitude(self.time_s)

    @property
    def density_sigma_kgm3(self) -> np.ndarray | None:
        """Shape and scale together, (N,)."""
        return total(self.density_sigma_shape_kgm3, self.scale_sigma, self.density_kgm3)

    @property
    def torque_sigma_Nm(self) -> np.ndarray | None:
        """Of the torque about the one axis, (N,); None where axes are taken together and where it is not known."""
        if len(self.axis) > 1 or self.density_sigma_shape_kgm3 is None:
            return None
        return self.density_sigma_shape_kgm3 * np.abs(self.per_density(self.axis, self.time_s))

    @property
    def noticed_s(self) -> tuple[float, float] | None:
        """When the gas was first and last noticed: as published, else as found; None where it was not."""
        if self.flyby.noticed_s is not None:
            return self.flyby.noticed_s
        return None if self.noticed is None else (self.noticed.first_s, self.noticed.last_s)

    @property
    def unit(self) -> tuple[float, str]:
        """Factor and label of the unit that suits the densities: (1e12, '1e-12 kg/m3')."""
        size = abs(self.peak.density_kgm3)
        power = 3 * math.floor(math.log10(size) / 3) if math.isfinite(size) and size > 0 else -12
        return 10.0**-power, f"1e{power} kg/m3"

    def per_density(self, axis: str, time_s) -> np.ndarray:
        """Torque per density about an axis at times from closest approach, with its sign. (N,) [N m / (kg/m3)]"""
        return self.drag.about("xyz".index(axis), time_s)

    def about(self, columns: np.ndarray) -> np.ndarray:
        """``torque_Nm`` or ``gravity_gradient_Nm`` with one column for each axis, (N, n)."""
        return columns.reshape(len(self.time_s), -1)

    def _record(self) -> dict:
        one = len(self.axis) == 1
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "flyby": self.flyby.name,
            "closest_approach": self.closest_approach,
            "method": self.method,
            "variant": self.variant,
            "axis": self.axis,
            "time_s": self.time_s,
            "altitude_m": self.altitude_m,
            "density_kgm3": self.density_kgm3,
            "density_sigma_shape_kgm3": self.density_sigma_shape_kgm3,
            "scale_sigma": self.scale_sigma,
            "density_sigma_kgm3": self.density_sigma_kgm3,
            "bound_left_out_kgm3": self.bound_kgm3,
            "torque_Nm": self.torque_Nm,
            "gravity_gradient_Nm": self.gravity_gradient_Nm,
            "torque_per_density_m5_s2": self.torque_per_density[0] if one else list(self.torque_per_density),
            "axes_agree": None if self.agreement is None else self.agreement.record(),
            "peak": self.peak.record(),
            "noticed": None if self.noticed is None else self.noticed.record(),
            "published": [p.record() for p in self.published],
            "atmosphere": None if self.atmosphere is None else self.atmosphere.record(),
            "settings": self.settings,
        }

    def series(self) -> Series:
        """Density with its sigmas and bound, altitude, torques; time counts from the epoch, a column from closest approach."""
        columns = {
            "from_closest_approach_s": self.time_s, "altitude_m": self.altitude_m, "density_kgm3": self.density_kgm3,
            "density_sigma_shape_kgm3": self.density_sigma_shape_kgm3, "density_sigma_kgm3": self.density_sigma_kgm3,
            "bound_left_out_kgm3": self.bound_kgm3, "torque_Nm": self.torque_Nm,
            "gravity_gradient_Nm": self.gravity_gradient_Nm,
        }  # fmt: skip
        known = {n: v for n, v in columns.items() if v is not None}
        return Series(self.time_s + self.closest_s, known, tuple(self.axis))

    def _tables(self) -> tuple[Table, ...]:
        (scale, unit), p = self.unit, self.peak
        own = (
            f"peak {p.way}",
            plus_minus(scale * p.density_kgm3, _times(p.density_sigma_kgm3 or p.density_sigma_shape_kgm3, scale)),
            plus_minus(p.time_s, p.time_sigma_s),
            plus_minus(p.altitude_m / 1e3, _times(p.altitude_sigma_m, 1e-3)),
        )
        title = (
            f"Density · {self.craft} · {self.flyby.name} · {self.method}, {self.variant}, axis {self.axis} · closest approach {self.closest_approach}\n"
            f"  {len(self.time_s)} instants from {self.time_s[0]:+.0f} s to {self.time_s[-1]:+.0f} s; "
            f"{', '.join(f'{k:+.4g}' for k in self.torque_per_density)} N m per kg/m3 at the peak"
        )
        head = (
            "",
            f"density [{unit}]",
            "time [s]",
            "altitude [km]",
            *(["ratio to published"] if self.published else []),
        )
        whole = Table(title, (own, *(_published(p, scale) for p in self.published)), head, tuple(self._remarks()))
        return (whole,) if self.atmosphere is None else (whole, self.atmosphere.table())

    def _remarks(self) -> list[str]:
        p, scale = self.peak, "unknown" if self.scale_sigma is None else f"{100 * self.scale_sigma:.1f} %"
        shape = p.density_sigma_shape_kgm3
        told = "unknown" if shape is None else f"{100 * shape / abs(p.density_kgm3):.1f} %"
        remarks = [f"one sigma of the peak: shape {told}, scale {scale}"]
        if self.agreement is not None:
            remarks.append(
                f"agreement of the axes: chi-square {self.agreement.chi_square:.1f} for {self.agreement.freedom:.0f} degrees of freedom"
            )
        if (n := self.noticed) is not None:
            theirs = "" if n.published_s is None else "; published {:+g} to {:+g} s".format(*n.published_s)
            remarks.append(f"noticed from {n.first_s:+.0f} s to {n.last_s:+.0f} s ({n.criterion}{theirs})")
        modelled = "taken off" if self.gravity_gradient_Nm is not None else "not modelled"
        at_peak, known = (
            np.interp(p.time_s, self.time_s, self.bound_kgm3),
            self.bound_kgm3[np.isfinite(self.bound_kgm3)],
        )
        remarks.append(
            f"torques left out can mimic {at_peak:.2g} kg/m3 at the peak, {known.max():.2g} at most (gravity gradient {modelled})"
        )
        return remarks


def _published(ratio: PeakRatio, scale: float) -> tuple[str, ...]:
    q = ratio.published
    low, high = (f"{scale * v:.4g}" for v in q.density_kgm3)
    return (
        f"{q.instrument}, published",
        low if low == high else f"{low} to {high}",
        f"{q.time_s:g}",
        f"{q.altitude_m / 1e3:.4g}",
        f"{ratio.ratio:.2f}" if ratio.ratio_sigma is None else plus_minus(ratio.ratio, ratio.ratio_sigma),
    )


def _times(value: float | None, by: float) -> float | None:
    return None if value is None else by * value
