"""Jets of a plume: densities, widths, and which of them the telemetry tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.plume import Jet, plume_density

if TYPE_CHECKING:
    from ..density import DensityResult

#: What the samples of a fit are.
_OF = {
    "momentum": " of momentum",
    "forward": " of all channels through the loop",
    "printed": " of momentum beside, the density fitted as in 004",
}


@dataclass(frozen=True)
class Source:
    """A fitted jet and the 95 % intervals of its density [kg/m3] and width [rad]; None at an open end, both None where there is none.

    ``explained``: whether the jets together explain the telemetry; where they do not, intervals mean nothing and none is identified."""

    jet: Jet
    density_95: tuple[float | None, float | None]
    width_95: tuple[float | None, float | None]
    explained: bool = True

    @property
    def density_known(self) -> bool:
        low, high = self.density_95
        return self.explained and low is not None and low > 0 and high is not None

    @property
    def width_known(self) -> bool:
        return self.density_known and None not in self.width_95

    def record(self) -> dict:
        return {
            "name": self.jet.name,
            "density_kgm3": self.jet.density_kgm3,
            "width_rad": self.jet.width_rad,
            "ci95": {"density_kgm3": list(self.density_95), "width_rad": list(self.width_95)},
            "density_identified": self.density_known,
            "width_identified": self.width_known,
        }

    def __str__(self) -> str:
        low, high = self.density_95
        if low is None:
            return f"  {self.jet.name:<12}{1e12 * self.jet.density_kgm3:6.3g}   no interval                    {self.jet.width_rad:.2f}"
        K = f"{1e12 * self.jet.density_kgm3:6.3g}   95 %: {1e12 * low:.3g} to {_end(high, 1e12)}"
        if not self.density_known:
            return f"  {self.jet.name:<12}{K:<36}   not identified"
        w = f"{self.jet.width_rad:.2f}   95 %: {_end(self.width_95[0])} to {_end(self.width_95[1])}"
        return f"  {self.jet.name:<12}{K:<36}   {w}{'' if self.width_known else '   width not identified'}"


@dataclass(frozen=True)
class Score:
    """One choice of jets and widths: free parameters, and Schwarz's criterion above that of the best."""

    names: tuple[str, ...]
    widths: str
    free: int
    bic: float

    def record(self) -> dict:
        return {"sources": list(self.names), "widths": self.widths, "free": self.free, "bic_above_best": self.bic}


@dataclass(frozen=True)
class JetsResult:
    """Jets that explain the momentum gained in a flyby, beside the density reconstructed without them.

    ``correlation``: of densities, then widths (one where common), NaN where a jet is not there; ``rms_kgm3``: of model less
    reconstruction (004 eq 28); ``model_kgm3`` at the reconstruction's instants."""

    density: DensityResult
    sources: tuple[Source, ...]
    correlation: np.ndarray
    rms_kgm3: float
    scores: tuple[Score, ...]
    widths: str
    power: float
    angle: str
    model_kgm3: np.ndarray
    fit: str
    rms: float  # of what the fit leaves, in ``unit``
    unit: str
    samples: int
    worth: float
    doubts: tuple[str, ...] = ()

    @property
    def peak(self) -> tuple[float, float]:
        """Largest density of the model [kg/m3] and its time from closest approach [s]."""
        d, near = self.density, float(self.density.time_s[np.argmax(self.model_kgm3)])
        t = np.arange(near - 2, near + 2, 0.05)  # a cusp lies between instants
        rho = plume_density([s.jet for s in self.sources], d.flyby, t, power=self.power, angle=self.angle)
        return float(rho.max()), float(t[np.argmax(rho)])

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        d, (peak, at) = self.density, self.peak
        return {
            "craft": d.craft,
            "epoch": d.epoch,
            "flyby": d.flyby.name,
            "closest_approach": d.closest_approach,
            "widths": self.widths,
            "power": self.power,
            "angle": self.angle,
            "sources": [s.record() for s in self.sources],
            "correlation": self.correlation,
            "rms_kgm3": self.rms_kgm3,
            "sigma_scale_fraction": d.scale,
            "evidence": {"criterion": "Schwarz", "models": [s.record() for s in self.scores]},
            "fit": self.fit,
            "momentum_rms_Nms": self.rms if self.unit == "N m s" else None,
            "innovations_rms_sigma": self.rms if self.unit == "sigma" else None,
            "samples": self.samples,
            "independent_samples": self.worth,
            "peak": {"density_kgm3": peak, "time_s": at, "altitude_m": float(d.flyby.altitude(at))},
            "time_s": d.time_s,
            "model_kgm3": self.model_kgm3,
            "density_kgm3": d.density_kgm3,
            "doubts": list(self.doubts),
        }

    def __str__(self) -> str:
        d, (peak, at) = self.density, self.peak
        lines = [
            f"Jets · {d.craft} · {d.flyby.name} · {self.widths} width{'s' if self.widths == 'own' else ''}, power {self.power:g} · closest approach {d.closest_approach}",
            f"  {self.samples} samples{_OF[self.fit]}, worth {self.worth:.0f} · all densities {'on an unknown scale' if d.scale is None else f'± {100 * d.scale:.1f} % together'}",
            "              density [1e-12 kg/m3]                  width [rad]",
            *map(str, self.sources),
            f"  together     {1e12 * peak:.3g}e-12 at the most, at {at:+.0f} s; {1e12 * self.rms_kgm3:.2g}e-12 rms from the density reconstructed",
        ]
        for s in self.scores[:3]:
            lines.append(f"  {'+' + format(s.bic, '.1f'):>6}  {' '.join(s.names)}, {s.widths}, {s.free} parameters")
        return "\n".join(lines)


def _end(value: float | None, scale: float = 1.0) -> str:
    return "open" if value is None else f"{scale * value:.3g}"
