"""Density of a gas along a flyby: what was found, how well its shape and its scale are known."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby, PublishedPeak
    from ..fused import AxisData
    from .atmosphere import AtmosphereFit
    from .drag import DragAlong


@dataclass(frozen=True)
class DensityPeak:
    """The largest density [kg/m3], its time from closest approach [s] and altitude [m]; sigmas None where unknown.

    ``sigma_kgm3`` has shape and scale error together."""

    density_kgm3: float
    time_s: float
    altitude_m: float
    sigma_shape_kgm3: float | None
    sigma_kgm3: float | None
    sigma_time_s: float | None
    sigma_altitude_m: float | None
    way: str = "of the curve"

    def wider(self, shape_kgm3: float, scale: float | None) -> DensityPeak:
        """With a further error of its height."""
        if self.sigma_shape_kgm3 is None:
            return self
        shape = float(np.hypot(self.sigma_shape_kgm3, shape_kgm3))
        return replace(self, sigma_shape_kgm3=shape, sigma_kgm3=total(shape, scale, self.density_kgm3))

    def record(self) -> dict:
        return dict(vars(self))


@dataclass(frozen=True)
class Beside:
    """A published peak of the same flyby: this density over it, with the sigma of both, and how much later this one came."""

    published: PublishedPeak
    ratio: float
    sigma_ratio: float | None
    later_s: float

    def record(self) -> dict:
        p = self.published
        return {
            "instrument": p.instrument, "density_kgm3": list(p.density_kgm3), "sigma_kgm3": p.sigma_kgm3,
            "time_s": p.time_s, "altitude_m": p.altitude_m, "ratio": self.ratio, "sigma_ratio": self.sigma_ratio,
            "later_s": self.later_s,
        }  # fmt: skip


@dataclass(frozen=True)
class Noticed:
    """First and last instant from closest approach [s] at which the gas stands out, by what criterion; and 004's points P and R."""

    first_s: float
    last_s: float
    criterion: str
    published_s: tuple[float, float] | None

    def record(self) -> dict:
        return dict(vars(self))


@dataclass(frozen=True)
class Agreement:
    """Chi-square of several axes about one density, and its degrees of freedom, both counted in independent instants."""

    chi_square: float
    freedom: float

    @property
    def p(self) -> float:
        return float(chi2.sf(self.chi_square, self.freedom))

    def record(self) -> dict:
        return {"chi_square": self.chi_square, "degrees_of_freedom": self.freedom, "p": self.p}


@dataclass(frozen=True)
class DensityResult:
    """Density over time from closest approach, (N,), NaN where nothing is known; negative values are noise, kept.

    ``sigma_shape``: random, differs from instant to instant; ``scale``: share by which all of it is off together, one sigma, None
    where that is not known;
    ``bound``: the most that torques left out (gravity gradient, sunlight, ...) may feign.  ``axis``: one, or all that were
    taken together; torques are (N,) then, or (N, n)."""

    craft: str
    epoch: str
    flyby: Flyby
    closest_approach: str
    method: str
    variant: str
    axis: str
    time_s: np.ndarray
    density_kgm3: np.ndarray
    sigma_shape_kgm3: np.ndarray | None
    scale: float | None
    bound_kgm3: np.ndarray
    torque_Nm: np.ndarray
    gravity_gradient_Nm: np.ndarray | None  # taken off the torque; None: not modelled
    torque_per_density: tuple[float, ...]  # N m / (kg/m3), about each axis, at the peak
    peak: DensityPeak
    drag: DragAlong
    sign: float  # of the arm, where the drag does not know it
    noticed: Noticed | None = None
    agreement: Agreement | None = None  # of several axes
    evidence: dict[str, AxisData] = field(default_factory=dict)  # what the fused torque rests on
    beside: tuple[Beside, ...] = ()
    atmosphere: AtmosphereFit | None = None  # of a body that has one
    doubts: tuple[str, ...] = ()
    settings: dict = field(default_factory=dict)

    @property
    def altitude_m(self) -> np.ndarray:
        return self.flyby.altitude(self.time_s)

    @property
    def sigma_kgm3(self) -> np.ndarray | None:
        """Shape and scale together, (N,)."""
        return total(self.sigma_shape_kgm3, self.scale, self.density_kgm3)

    def per_density(self, axis: str, time_s) -> np.ndarray:
        """Torque per density about an axis at times from closest approach, with its sign. (N,) [N m / (kg/m3)]"""
        return self.sign * self.drag.at(time_s)[..., "xyz".index(axis)]

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
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
            "sigma_shape_kgm3": self.sigma_shape_kgm3,
            "sigma_scale_fraction": self.scale,
            "sigma_kgm3": self.sigma_kgm3,
            "bound_left_out_kgm3": self.bound_kgm3,
            "torque_Nm": self.torque_Nm,
            "gravity_gradient_Nm": self.gravity_gradient_Nm,
            "torque_per_density_m5_s2": self.torque_per_density[0]
            if len(self.axis) == 1
            else list(self.torque_per_density),
            "axes_agree": None if self.agreement is None else self.agreement.record(),
            "peak": self.peak.record(),
            "noticed": None if self.noticed is None else self.noticed.record(),
            "published": [b.record() for b in self.beside],
            "atmosphere": None if self.atmosphere is None else self.atmosphere.record(),
            "settings": self.settings,
            "doubts": list(self.doubts),
        }

    def __str__(self) -> str:
        """What a person reads."""
        p, scale = self.peak, "unknown" if self.scale is None else f"{100 * self.scale:.1f} %"
        lines = [
            f"Density · {self.craft} · {self.flyby.name} · {self.method}, {self.variant}, axis {self.axis} · closest approach {self.closest_approach}",
            f"  {len(self.time_s)} instants from {self.time_s[0]:+.0f} s to {self.time_s[-1]:+.0f} s · {', '.join(f'{k:+.4g}' for k in self.torque_per_density)} N m per kg/m3",
            f"  peak      {_of(p.density_kgm3, p.sigma_kgm3 or p.sigma_shape_kgm3)} kg/m3, shape {_share(p.sigma_shape_kgm3, p.density_kgm3)}, scale {scale}",
            f"            at {_time(p.time_s, p.sigma_time_s)} s from closest approach, {_time(p.altitude_m / 1e3, _over(p.sigma_altitude_m, 1e3), '')} km high",
        ]
        if self.agreement is not None:
            lines.append(
                f"  axes      chi-square {self.agreement.chi_square:.1f} for {self.agreement.freedom:.0f} that they agree"
            )
        if self.noticed is not None:
            theirs = (
                ""
                if self.noticed.published_s is None
                else "; published {:+g} to {:+g} s".format(*self.noticed.published_s)
            )
            lines.append(
                f"  noticed   from {self.noticed.first_s:+.0f} s to {self.noticed.last_s:+.0f} s ({self.noticed.criterion}{theirs})"
            )
        modelled = "taken off" if self.gravity_gradient_Nm is not None else "not modelled"
        at_peak = float(np.interp(p.time_s, self.time_s, self.bound_kgm3))
        lines.append(
            f"  left out  at most {at_peak:.2g} kg/m3 at the peak, {self.bound_kgm3[np.isfinite(self.bound_kgm3)].max():.2g} at most (gravity gradient {modelled})"
        )
        if self.atmosphere is not None:
            lines.append(f"  exponential  {self.atmosphere}")
        for b in self.beside:
            q = b.published
            low, high = (f"{1e12 * v:g}" for v in q.density_kgm3)
            whole = low if low == high else f"{low} to {high}"
            lines.append(
                f"  {q.instrument:<8}  {whole}e-12 at {q.time_s:+.0f} s: ratio {_of(b.ratio, b.sigma_ratio, '.2f')}, {abs(b.later_s):.0f} s {'later' if b.later_s >= 0 else 'earlier'}"
            )
        return "\n".join(lines)


def total(shape, scale: float | None, density):
    """Both errors together; None where one is not known. [kg/m3]"""
    return None if shape is None or scale is None else np.hypot(shape, scale * density)


def _of(value: float, sigma: float | None, form: str = ".3g") -> str:
    return f"{value:{form}}" if sigma is None else f"{value:{form}} ± {sigma:.2g}"


def _time(value: float, sigma: float | None, sign: str = "+") -> str:
    return f"{value:{sign}.0f}" if sigma is None else f"{value:{sign}.{1 if sigma < 2 else 0}f} ± {sigma:.2g}"


def _share(sigma: float | None, value: float) -> str:
    return "unknown" if sigma is None else f"{100 * sigma / abs(value):.1f} %"


def _over(value: float | None, by: float) -> float | None:
    return None if value is None else value / by
