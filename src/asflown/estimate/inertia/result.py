"""An inertia tensor as flown: values, random and systematic uncertainty apart, and what there is to doubt."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of
from ...kit.digits import plus_minus, scaled_unit
from ...kit.result import Estimate, Series, per_spin_inertia
from ...kit.schema import Annotated, Doc, Matrix, NotRequired, Number, Numbers, TypedDict, Vector
from ...kit.table import Table
from ...telemetry.channels import AXES
from .prediction import ComparisonRecord

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .excitation import Excitation
    from .prediction import InertiaComparison
    from .slews import Slew

_ORDER = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


class SlewFound(TypedDict):
    start_s: Number
    stop_s: Number
    about: Annotated[str, Doc("x, y, z, or skew")]
    axis: Vector
    rate_rad_s: Annotated[Number, Doc("largest")]
    angle_rad: Number


class InertiaRecord(TypedDict):
    """JSON of `asflown inertia`.  Where the wheels' spin inertia is unknown the keys in kg m2, N m and N m s are null and
    their siblings per unit spin inertia hold the values."""

    craft: str
    epoch: str
    method: Annotated[str, Doc("consistent, gls, all, axis, or momentum balance")]
    inertia_kgm2: Matrix | None
    inertia_sigma_kgm2: Annotated[Matrix | None, Doc("total: random and systematic")]
    inertia_sigma_random_kgm2: Annotated[Matrix | None, Doc("null where the fit has not settled, as the total is")]
    inertia_sigma_systematic_kgm2: Annotated[
        Matrix | None, Doc("scale errors of the wheels' spin inertia and of the rates")
    ]
    external_torque_Nm: Vector | None
    external_torque_sigma_Nm: Vector | None
    residual_rms_Nms: Number
    rank: Annotated[int, Doc("of 6")]
    singular_values: Annotated[Numbers, Doc("of S over root N [rad/s]; null where only the torque is known")]
    identifiable: list[str]
    not_identifiable: list[str]
    external_torque_frame: Annotated[str, Doc("axes in which the torque is constant: body or inertial")]
    slews: list[SlewFound]
    products_kgm2: Annotated[dict[str, Numbers], Doc("both estimates of each product of inertia; method axis only")]
    comparison: Annotated[ComparisonRecord | None, Doc("with the predicted tensor")]
    settings: dict
    inertia_per_spin_inertia: NotRequired[Matrix]
    inertia_sigma_per_spin_inertia: NotRequired[Matrix | None]
    inertia_sigma_random_per_spin_inertia: NotRequired[Matrix | None]
    inertia_sigma_systematic_per_spin_inertia: NotRequired[Matrix]
    external_torque_per_spin_inertia_rad_s2: NotRequired[Vector]
    external_torque_sigma_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    residual_rms_per_spin_inertia_rad_s: NotRequired[Number]


@dataclass(frozen=True)
class Evidence:
    """What the pictures show, at the wheels' instants (N,), seconds from the epoch.

    ``residual_Nms``: momentum of wheels and body less what the fit says of it, inertial axes (body axes where there
    is no attitude); per unit spin inertia where the result is."""

    time_s: np.ndarray
    omega_rad_s: np.ndarray  # (N, 3)
    wheels_Nms: np.ndarray  # (N, 3), body axes
    residual_Nms: np.ndarray  # (N, 3)
    used: np.ndarray  # (N,) bool


class Misread(NamedTuple):
    """A wheel whose vector (axis times spin inertia) fits otherwise: how, in words, the square of the difference in its own covariance
    (chi square of 3), and what it would move the elements by (6,)."""

    words: str
    square: float
    moved: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a method gives: elements (6,) with their covariance (6, 6), and the tensors (2, 3, 3) that unit scale errors of
    the wheels' spin inertia and of the body rates would add."""

    method: str
    elements: np.ndarray
    covariance: np.ndarray
    by_scale: np.ndarray
    excitation: Excitation
    torque_Nm: np.ndarray
    torque_sigma_Nm: np.ndarray
    frame: str
    evidence: Evidence
    slews: tuple[Slew, ...] = ()
    products: dict[str, tuple[float, float]] = field(default_factory=dict)
    settings: dict = field(default_factory=dict)
    misread: Misread | None = None
    doubts: list[Doubt | None]


@dataclass(frozen=True, kw_only=True, repr=False)
class InertiaResult(Estimate):
    """The tensor (3, 3) about the craft's own centre of mass, body axes, wheels counted as if they did not spin.

    ``inertia_sigma_random_kgm2``, ``inertia_sigma_systematic_kgm2`` (3, 3): noise, and the scale errors considered.
    ``external_torque_Nm`` (3,) with sigma: constant in the axes of ``frame``, body or inertial.  Where ``relative`` is set
    the wheels' spin inertia is unknown, and tensor, torque and momentum are per unit of it.  Elements that no slew
    identifies are NaN.  ``products``: both estimates of each product of inertia, method axis only."""

    RECORD: ClassVar[type] = InertiaRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "sigma_random_kgm2": "inertia_sigma_random_kgm2",
        "sigma_systematic_kgm2": "inertia_sigma_systematic_kgm2",
        "sigma_total_kgm2": "inertia_sigma_kgm2",
        "sigma_random_per_spin_inertia": "inertia_sigma_random_per_spin_inertia",
        "sigma_systematic_per_spin_inertia": "inertia_sigma_systematic_per_spin_inertia",
        "sigma_total_per_spin_inertia": "inertia_sigma_per_spin_inertia",
        "told": "identifiable",
        "untold": "not_identifiable",
    }

    inertia_kgm2: np.ndarray
    inertia_sigma_random_kgm2: np.ndarray
    inertia_sigma_systematic_kgm2: np.ndarray
    excitation: Excitation
    external_torque_Nm: np.ndarray
    external_torque_sigma_Nm: np.ndarray
    frame: str
    slews: tuple[Slew, ...]
    evidence: Evidence
    comparison: InertiaComparison | None = None
    relative: bool = False
    products: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def inertia_sigma_kgm2(self) -> np.ndarray:
        """Total, (3, 3)."""
        return np.hypot(self.inertia_sigma_random_kgm2, self.inertia_sigma_systematic_kgm2)

    @property
    def settled(self) -> bool:
        """Whether the fit settled; where it did not, random and total sigmas are NaN here and null in the record."""
        return self.settings.get("converged") is not False

    @property
    def residual_rms_Nms(self) -> float:
        """Of all components."""
        return float(np.sqrt(np.nanmean(self.evidence.residual_Nms[self.evidence.used] ** 2)))

    def _record(self) -> dict:
        measured = {
            "inertia_kgm2": self.inertia_kgm2,
            "inertia_sigma_kgm2": self.inertia_sigma_kgm2,
            "inertia_sigma_random_kgm2": self.inertia_sigma_random_kgm2,
            "inertia_sigma_systematic_kgm2": self.inertia_sigma_systematic_kgm2,
            "external_torque_Nm": self.external_torque_Nm,
            "external_torque_sigma_Nm": self.external_torque_sigma_Nm,
            "residual_rms_Nms": self.residual_rms_Nms,
        }
        if not self.settled:
            of_noise = ("inertia_sigma_kgm2", "inertia_sigma_random_kgm2", "external_torque_sigma_Nm")
            measured |= dict.fromkeys(of_noise)
        record = {
            "craft": self.craft,
            "epoch": self.epoch,
            "method": self.method,
            **measured,
            "rank": self.excitation.rank,
            "singular_values": self.excitation.singular_values,
            "identifiable": list(self.excitation.identifiable),
            "not_identifiable": list(self.excitation.not_identifiable),
            "external_torque_frame": self.frame,
            "slews": [s.record() for s in self.slews],
            "products_kgm2": {k: list(v) for k, v in self.products.items()},
            "comparison": None if self.comparison is None else self.comparison.record(),
            "settings": self.settings,
        }
        if self.relative:
            per_spin_inertia(record, measured)
        return record

    def series(self) -> Series:
        """Body rates, momentum of the wheels, residual momentum, and which samples counted."""
        e = self.evidence
        columns = {
            "omega_rad_s": e.omega_rad_s,
            "wheels_Nms": e.wheels_Nms,
            "residual_Nms": e.residual_Nms,
            "used": e.used,
        }
        return Series(e.time_s, columns)

    def _tables(self) -> tuple[Table, ...]:
        unit = "spin inertia of a wheel" if self.relative else "kg m2"
        values, random, systematic = (
            dict(zip(ELEMENTS, elements_of(v), strict=True))
            for v in (self.inertia_kgm2, self.inertia_sigma_random_kgm2, self.inertia_sigma_systematic_kgm2)
        )
        rows = tuple(
            (n, plus_minus(values[n], random[n]), f"{systematic[n]:.2g}") if np.isfinite(values[n]) else (n, "not identifiable")
            for n in _ORDER
        )  # fmt: skip
        title = f"Inertia tensor · {self.craft} · {self.method} · epoch {self.epoch}"
        tensor = Table(title, rows, ("", f"inertia [{unit}]", "systematic"), tuple(self._remarks()))
        return (tensor,) if self.comparison is None else (tensor, self.comparison.table())

    def _remarks(self) -> list[str]:
        remarks = [
            f"{name} from both its slews: {one:.1f} and {other:.1f}, difference {one - other:+.1f}"
            for name, (one, other) in self.products.items()
            if np.isfinite([one, other]).all()
        ]
        unknown = self.excitation.not_identifiable
        found = f"slews: {len(self.slews)}; rank {self.excitation.rank} of 6"
        remarks.append(found + (f"; not identifiable: {', '.join(unknown)}" if unknown else ""))
        torque, sigma = self.external_torque_Nm, self.external_torque_sigma_Nm
        if np.isfinite(torque).all():
            factor, unit = 1.0, "rad/s^2 per unit spin inertia"
            if not self.relative:
                factor, unit = scaled_unit(float(np.nanmax([*np.abs(torque), *sigma])), "N m")
            each = zip(AXES, factor * torque, factor * sigma, strict=True)
            remarks.append(
                f"external torque: {', '.join(f'{a} {plus_minus(t, s)}' for a, t, s in each)} {unit}, {self.frame} axes"
            )
        factor, unit = self.residual_unit
        remarks.append(f"residual momentum: {factor * self.residual_rms_Nms:.3g} {unit} rms")
        return remarks

    @property
    def residual_unit(self) -> tuple[float, str]:
        """Factor and label of the unit that suits the residual momentum."""
        if self.relative:
            return 1.0, "rad/s per unit spin inertia"
        return scaled_unit(float(np.nanmax(np.abs(self.evidence.residual_Nms[self.evidence.used]))), "N m s")
