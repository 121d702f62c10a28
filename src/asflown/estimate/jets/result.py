"""Jets of a plume: densities, widths, and which of them the telemetry identifies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from ...kit.digits import interval, plus_minus
from ...kit.result import Estimate, Series
from ...kit.schema import Annotated, Doc, Interval, Number, Numbers, Rows, TypedDict
from ...kit.table import Table

if TYPE_CHECKING:
    from ...dynamics.plume import Jet
    from ..density import DensityResult
    from .form import JetForm

#: What the samples of a fit are.
_OF = {
    "momentum": "of momentum",
    "forward": "of all channels through the loop",
    "printed": "of momentum; the density is fitted as in the plume paper",
}


class SourceRecord(TypedDict):
    """A fitted jet; null at an open end of an interval, and at both where there is none."""

    name: str
    density_kgm3: float
    density_ci95_kgm3: Interval
    width_rad: float
    width_ci95_rad: Interval
    density_identified: bool
    width_identified: bool


class ScoreRecord(TypedDict):
    """One choice of jets and widths: free parameters, and Schwarz's criterion above that of the best."""

    sources: list[str]
    widths: str
    free: int
    bic_above_best: float


class EvidenceRecord(TypedDict):
    criterion: str
    models: Annotated[list[ScoreRecord], Doc("the best first")]


class JetsPeakRecord(TypedDict):
    """The largest density of all jets together, its time from closest approach and altitude."""

    density_kgm3: float
    time_s: float
    altitude_m: float


class JetsRecord(TypedDict):
    """JSON of `asflown jets`.  Times count from closest approach."""

    craft: str
    epoch: Annotated[str, Doc("of the telemetry")]
    flyby: str
    closest_approach: str
    widths: Annotated[str, Doc("own or common")]
    power: Annotated[float, Doc("n of exp(-(angle/width)^n)")]
    angle: Annotated[str, Doc("plane or space")]
    sources: list[SourceRecord]
    correlation: Annotated[Rows, Doc("of densities, then widths; null where a jet is not there")]
    rms_kgm3: Annotated[float, Doc("of the model less the density reconstructed")]
    scale_sigma: Annotated[
        Number, Doc("one sigma, as a share, by which all densities are off together; not in the intervals")
    ]
    evidence: EvidenceRecord
    fit: Annotated[str, Doc("momentum, forward or printed")]
    momentum_rms_Nms: Annotated[Number, Doc("residual; null where several axes or the loop are fitted")]
    innovations_rms_sigma: Annotated[Number, Doc("residual, there")]
    samples: int
    independent_samples: Annotated[float, Doc("effective sample size of the residuals")]
    peak: JetsPeakRecord
    time_s: Numbers
    model_kgm3: Numbers
    density_kgm3: Annotated[Numbers, Doc("reconstructed without jets")]


@dataclass(frozen=True)
class Source:
    """A fitted jet and the 95 % intervals of its density [kg/m3] and width [rad]; None at an open end, both None where there is none.

    ``explained``: whether the jets together explain the telemetry; where they do not, intervals mean nothing and none is identified."""

    jet: Jet
    density_ci95_kgm3: tuple[float | None, float | None] = (None, None)
    width_ci95_rad: tuple[float | None, float | None] = (None, None)
    explained: bool = True

    @property
    def density_known(self) -> bool:
        low, high = self.density_ci95_kgm3
        return self.explained and low is not None and low > 0 and high is not None

    @property
    def width_known(self) -> bool:
        return self.density_known and None not in self.width_ci95_rad

    def record(self) -> dict:
        density, width = list(self.density_ci95_kgm3), list(self.width_ci95_rad)
        return {
            "name": self.jet.name,
            "density_kgm3": self.jet.density_kgm3,
            "density_ci95_kgm3": density,
            "width_rad": self.jet.width_rad,
            "width_ci95_rad": width,
            "density_identified": self.density_known,
            "width_identified": self.width_known,
            "ci95": {"density_kgm3": density, "width_rad": width},  # of earlier versions
        }

    def row(self, scale: float) -> tuple[str, ...]:
        """For the table; densities times ``scale``."""
        name, density, width = self.jet.name, f"{scale * self.jet.density_kgm3:.3g}", f"{self.jet.width_rad:.2f}"
        if self.density_ci95_kgm3[0] is None:
            return name, density, "no interval", width, ""
        low, high = (None if v is None else scale * v for v in self.density_ci95_kgm3)
        within = interval(low, high)
        if not self.density_known:
            return name, density, within, "", "", "not identified"
        return (
            name,
            density,
            within,
            width,
            interval(*self.width_ci95_rad),
            "" if self.width_known else "width not identified",
        )


@dataclass(frozen=True)
class Score:
    """One choice of jets and widths: free parameters, and Schwarz's criterion above that of the best."""

    names: tuple[str, ...]
    widths: str
    free: int
    bic: float

    def record(self) -> dict:
        return {"sources": list(self.names), "widths": self.widths, "free": self.free, "bic_above_best": self.bic}


class JetsPeak(NamedTuple):
    """Largest density of all jets together [kg/m3], and its time from closest approach [s]."""

    density_kgm3: float
    time_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class JetsResult(Estimate):
    """Jets that explain what a craft met in a flyby, and the density reconstructed without them.

    ``method``: the fit, 'momentum', 'forward' or 'printed'.  ``correlation``: of densities, then widths (one where common), NaN
    where a jet is not there; ``rms_kgm3``: of the model less the reconstruction (plume paper eq 28); ``model_kgm3`` (N,) and
    ``each_kgm3`` (J, N) at the reconstruction's instants: all jets together, and each.  ``rms``: of the residuals, in ``unit``
    ('N m s' or 'sigma'); ``effective_samples``: how many independent samples the ``samples`` amount to."""

    RECORD: ClassVar[type] = JetsRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {"sigma_scale_fraction": "scale_sigma"}

    density: DensityResult
    sources: tuple[Source, ...]
    form: JetForm
    correlation: np.ndarray
    rms_kgm3: float
    scores: tuple[Score, ...]
    model_kgm3: np.ndarray
    each_kgm3: np.ndarray
    rms: float
    unit: str
    samples: int
    effective_samples: float

    @cached_property
    def peak(self) -> JetsPeak:
        """Of all jets together; between the reconstruction's instants, where a cusp may lie."""
        d, near = self.density, float(self.density.time_s[np.argmax(self.model_kgm3)])
        t = np.arange(near - 2, near + 2, 0.05)
        rho = self.form.together([s.jet for s in self.sources], d.flyby, t)
        return JetsPeak(float(rho.max()), float(t[np.argmax(rho)]))

    def _record(self) -> dict:
        d, peak = self.density, self.peak
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "flyby": d.flyby.name,
            "closest_approach": d.closest_approach,
            "widths": self.form.widths,
            "power": self.form.power,
            "angle": self.form.angle,
            "sources": [s.record() for s in self.sources],
            "correlation": self.correlation,
            "rms_kgm3": self.rms_kgm3,
            "scale_sigma": d.scale_sigma,
            "evidence": {"criterion": "Schwarz", "models": [s.record() for s in self.scores]},
            "fit": self.method,
            "momentum_rms_Nms": self.rms if self.unit == "N m s" else None,
            "innovations_rms_sigma": self.rms if self.unit == "sigma" else None,
            "samples": self.samples,
            "independent_samples": self.effective_samples,
            "peak": peak._asdict() | {"altitude_m": float(d.flyby.altitude(peak.time_s))},
            "time_s": d.time_s,
            "model_kgm3": self.model_kgm3,
            "density_kgm3": d.density_kgm3,
        }

    def series(self) -> Series:
        """Density reconstructed, of all jets and of each; time counts from the epoch, a column from closest approach."""
        d = self.density
        columns = {
            "from_closest_approach_s": d.time_s, "density_kgm3": d.density_kgm3, "model_kgm3": self.model_kgm3,
            "jet_kgm3": self.each_kgm3.T,
        }  # fmt: skip
        return Series(d.time_s + d.closest_s, columns, tuple(s.jet.name for s in self.sources), "source")

    def _tables(self) -> tuple[Table, ...]:
        d, peak, form = self.density, self.peak, self.form
        scale, unit = d.unit
        together = "on an unknown scale" if d.scale_sigma is None else f"± {100 * d.scale_sigma:.1f} % together"
        title = (
            f"Jets · {self.craft} · {d.flyby.name} · {form.widths} width{'' if form.common else 's'}, power {form.power:g} · "
            f"closest approach {d.closest_approach}\n"
            f"  {self.samples} samples {_OF[self.method]}, effective sample size {self.effective_samples:.0f}; all densities {together}"
        )
        head = ("source", f"density [{unit}]", "95 % interval", "width [rad]", "95 % interval", "")
        remark = (
            f"all jets: at most {scale * peak.density_kgm3:.3g}, at {plus_minus(peak.time_s, None)} s; "
            f"rms difference from the density reconstructed {scale * self.rms_kgm3:.2g} [{unit}]"
        )
        jets = Table(title, tuple(s.row(scale) for s in self.sources), head, (remark,))
        if not self.scores:
            return (jets,)
        rows = tuple((" ".join(s.names), s.widths, str(s.free), f"+{s.bic:.1f}") for s in self.scores[:3])
        return jets, Table("Models by Schwarz's criterion", rows, ("sources", "widths", "parameters", "above the best"))
