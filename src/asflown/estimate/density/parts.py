"""Parts of a density result: its peak, published peaks beside it, the span in which gas is seen, agreement of axes, momentum."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.result import with_old_keys
from ...kit.schema import Annotated, Doc, Interval, Number, TypedDict

if TYPE_CHECKING:
    from ...dynamics.flyby import PublishedPeak
    from ...kit.doubts import Doubts


class PeakRecord(TypedDict):
    """The largest density, its time from closest approach and its altitude; sigmas are null where they are not known."""

    density_kgm3: float
    time_s: float
    altitude_m: float
    density_sigma_shape_kgm3: Number
    density_sigma_kgm3: Annotated[Number, Doc("shape and scale together")]
    time_sigma_s: Number
    altitude_sigma_m: Number
    way: Annotated[str, Doc("of the curve, or of jets and a remainder")]


@dataclass(frozen=True)
class DensityPeak:
    """The largest density [kg/m3], its time from closest approach [s] and altitude [m]; sigmas are None where not known.

    ``density_sigma_kgm3`` has shape and scale error together."""

    density_kgm3: float
    time_s: float
    altitude_m: float
    density_sigma_shape_kgm3: float | None
    density_sigma_kgm3: float | None
    time_sigma_s: float | None
    altitude_sigma_m: float | None
    way: str = "of the curve"

    def wider(self, shape_kgm3: float, scale: float | None) -> DensityPeak:
        """With a further error of its height."""
        if self.density_sigma_shape_kgm3 is None:
            return self
        shape = float(np.hypot(self.density_sigma_shape_kgm3, shape_kgm3))
        whole = total(shape, scale, self.density_kgm3)
        return replace(self, density_sigma_shape_kgm3=shape, density_sigma_kgm3=whole)

    def record(self) -> dict:
        record = dict(vars(self))
        with_old_keys(record, {
            "sigma_shape_kgm3": "density_sigma_shape_kgm3", "sigma_kgm3": "density_sigma_kgm3",
            "sigma_time_s": "time_sigma_s", "sigma_altitude_m": "altitude_sigma_m",
        })  # fmt: skip
        return record


class PublishedRecord(TypedDict):
    """A published peak of the same flyby; ``ratio`` is this peak over the published one."""

    instrument: str
    density_kgm3: Annotated[Interval, Doc("from, to, as published")]
    density_sigma_kgm3: Number
    time_s: float
    altitude_m: float
    ratio: float
    ratio_sigma: Number
    later_s: Annotated[float, Doc("how much later this peak is")]


@dataclass(frozen=True)
class PeakRatio:
    """This peak over a published one of the same flyby, with the sigma of both, and how much later this one is."""

    published: PublishedPeak
    ratio: float
    ratio_sigma: float | None
    later_s: float

    def record(self) -> dict:
        p = self.published
        return {
            "instrument": p.instrument, "density_kgm3": list(p.density_kgm3), "density_sigma_kgm3": p.sigma_kgm3,
            "time_s": p.time_s, "altitude_m": p.altitude_m, "ratio": self.ratio, "ratio_sigma": self.ratio_sigma,
            "later_s": self.later_s,
        }  # fmt: skip


class NoticedRecord(TypedDict):
    first_s: float
    last_s: float
    criterion: str
    published_s: Annotated[Interval | None, Doc("points P and R of the plume paper")]


@dataclass(frozen=True)
class Noticed:
    """First and last instant from closest approach [s] at which gas is seen, by what criterion; and the plume paper's points P, R."""

    first_s: float
    last_s: float
    criterion: str
    published_s: tuple[float, float] | None

    def record(self) -> dict:
        return dict(vars(self))


class AgreementRecord(TypedDict):
    """Chi-square of several axes about one density, counted in independent instants."""

    chi_square: float
    degrees_of_freedom: float
    p: float


@dataclass(frozen=True)
class Agreement:
    """Chi-square of several axes about one density, and its degrees of freedom, both counted in independent instants."""

    chi_square: float
    freedom: float

    @property
    def p(self) -> float:
        return float(scipy.special.chdtrc(self.freedom, self.chi_square))

    def record(self) -> dict:
        return {"chi_square": self.chi_square, "degrees_of_freedom": self.freedom, "p": self.p}


@dataclass(frozen=True)
class MomentumHeld:
    """Momentum of wheels and body, and of the body alone, about the axes of the density, (M, n) [N m s], at instants (M,) from
    closest approach [s]."""

    time_s: np.ndarray
    momentum_Nms: np.ndarray
    body_Nms: np.ndarray
    doubts: Doubts


def total(shape, scale: float | None, density):
    """Shape and scale error together; None where one is not known. [kg/m3]"""
    return None if shape is None or scale is None else np.hypot(shape, scale * density)
