"""Execution errors to be expected of burns yet to be flown, as a Gates model says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy

from ...kit.digits import plus_minus
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.result import Estimate, recorded
from ...kit.schema import Annotated, Doc, Matrix, Number, Numbers, TypedDict, Vector
from ...kit.table import Table
from ...maneuvers.history import PastModel
from ...maneuvers.model import Quantity
from .foreseen import foresee

if TYPE_CHECKING:
    from ...maneuvers.plan import Plan
    from .result import GatesResult

_CONFIDENCE = 0.95
#: Where a quantity stands in TVC axes X, Y, Z, Z along the dV.
_PLACE = {Quantity.MAGNITUDE: slice(2, 3), Quantity.POINTING: slice(0, 2)}

POINTING_ABOUT_ZERO = Kind(
    "gates.pointing-about-zero", Severity.NOTE,
    "pointing errors are taken to be about zero, as {model} was used: where pointing has biases, the sigmas include them or they are left out",
)  # fmt: skip
OUTSIDE_SIZES = Kind(
    "gates.outside-sizes", Severity.CAUTION,
    "{burns}: the dV lies outside the range that the model was made for, {low_mps:.3g} to {high_mps:.3g} m/s",
    "Use a model made from burns of that size.",
)  # fmt: skip


class PlannedRecord(TypedDict):
    """One burn, TVC axes X, Y, Z, Z along the dV."""

    id: str
    dv_mps: Number
    mean_mps: Vector
    magnitude_sigma_mps: Number
    pointing_sigma_mps: Annotated[Numbers, Doc("X, Y")]
    pointing_sigma_rad: Annotated[Numbers, Doc("X, Y; over the dV")]
    covariance_tvc_m2_s2: Matrix
    ellipsoid95_tvc_mps: Annotated[Vector, Doc("semi-axes of the ellipsoid that holds 95 % of the errors")]
    covariance_inertial_m2_s2: Annotated[Matrix | None, Doc("where the plan has directions")]


class GatesPredictionRecord(TypedDict):
    """JSON of `asflown gates predict`."""

    model: str
    burns: list[PlannedRecord]


@dataclass(frozen=True)
class PlannedError:
    """Of one burn, in TVC axes X, Y, Z (Z along the dV); inertial covariance where the plan has directions."""

    id: str
    dv_mps: float
    mean_mps: np.ndarray  # (3,)
    covariance_m2_s2: np.ndarray  # (3, 3)
    covariance_N_m2_s2: np.ndarray | None

    @property
    def magnitude_sigma_mps(self) -> float:
        return float(np.sqrt(self.covariance_m2_s2[2, 2]))

    @property
    def pointing_sigma_mps(self) -> tuple[float, float]:
        x, y = np.sqrt(np.diag(self.covariance_m2_s2)[:2])
        return float(x), float(y)

    @property
    def ellipsoid_mps(self) -> np.ndarray:
        """Semi-axes (3,) of the ellipsoid that holds 95 of 100 errors, along TVC X, Y, Z."""
        return np.sqrt(scipy.stats.chi2.ppf(_CONFIDENCE, 3) * np.diag(self.covariance_m2_s2))

    def samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Errors drawn, (count, 3), TVC. [m/s]"""
        return self.mean_mps + np.sqrt(np.diag(self.covariance_m2_s2)) * rng.standard_normal((count, 3))

    def record(self) -> dict:
        return {
            "id": self.id, "dv_mps": self.dv_mps, "mean_mps": self.mean_mps, "magnitude_sigma_mps": self.magnitude_sigma_mps,
            "pointing_sigma_mps": list(self.pointing_sigma_mps), "pointing_sigma_rad": [s / self.dv_mps for s in self.pointing_sigma_mps],
            "covariance_tvc_m2_s2": self.covariance_m2_s2, "ellipsoid95_tvc_mps": self.ellipsoid_mps,
            "covariance_inertial_m2_s2": self.covariance_N_m2_s2,
        }  # fmt: skip

    def row(self) -> tuple[str, ...]:
        sigmas = (*self.pointing_sigma_mps, self.magnitude_sigma_mps)
        x, y, z = (plus_minus(1e3 * m, 1e3 * s) for m, s in zip(self.mean_mps, sigmas, strict=True))
        across = 1e3 * max(self.pointing_sigma_mps) / self.dv_mps
        return (self.id, f"{self.dv_mps:.3g}", z, x, y, f"{across:.2f}")


@dataclass(frozen=True, kw_only=True, repr=False)
class GatesPredictionResult(Estimate):
    """Errors to be expected of planned burns, by the model of that name."""

    RECORD: ClassVar[type] = GatesPredictionRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "burns[].sigma_magnitude_mps": "magnitude_sigma_mps",
        "burns[].sigma_pointing_mps": "pointing_sigma_mps",
        "burns[].sigma_pointing_rad": "pointing_sigma_rad",
    }

    model: str
    burns: tuple[PlannedError, ...]

    def _record(self) -> dict:
        return {"model": self.model, "burns": [b.record() for b in self.burns]}

    def _tables(self) -> tuple[Table, ...]:
        head = ("burn", "dV [m/s]", "magnitude [mm/s]", "X [mm/s]", "Y [mm/s]", "pointing sigma [mrad]")
        return (Table(f"Execution errors to be expected · {self.model}", tuple(b.row() for b in self.burns), head),)


@recorded
def gates_prediction(plan: Plan, source: GatesResult | PastModel) -> GatesPredictionResult:
    """Execution errors of planned burns, by a fit or by a model of the history.

    Parameters
    ----------
    plan : Plan
        Burns to come: sizes [m/s], and TVC axes where their directions are known.
    source : GatesResult or PastModel
        A fit's covariance includes the uncertainty of its biases.  Means are zero, as biases are taken to be removed, but for
        a mean-aware fit, and for a model of the history whose magnitude bias was left.

    Returns
    -------
    GatesPredictionResult
        Mean (3,) [m/s] and covariance (3, 3) [m2/s2] of each burn in TVC axes; reconstructed minus expected.

    Raises
    ------
    BadInput
        For a fit to too few burns to hold values.
    """
    sizes = plan.dv_mps.tolist()
    high: float | None
    if isinstance(source, PastModel):
        name, low, high = source.model.name, 0.0, source.model.valid_to_mps
        doubts: list[Doubt | None] = [*source.doubts.passed_on_by("model"), POINTING_ABOUT_ZERO(model=name)]
        errors = [_of_past(source, v) for v in sizes]
    else:
        if not source.known:
            raise BadInput(
                f"{len(source.maneuvers)} burns cannot carry a model",
                file=source.maneuvers.source or None,
                remedy="Use a model of the history (--by), or more burns.",
            )
        name, dv = source.gates.name, source.maneuvers.dv_mps
        low, high, doubts = float(dv.min()), float(dv.max()), list(source.doubts.passed_on_by("fit"))
        errors = [_of_fit(source, v) for v in sizes]
    doubts.append(_outside(plan, low, np.inf if high is None else high))
    burns = tuple(_planned(plan, k, *error) for k, error in enumerate(errors))
    return GatesPredictionResult(method="gates", model=name, burns=burns, doubts=Doubts(doubts))


def _outside(plan: Plan, low: float, high: float) -> Doubt | None:
    out = [i for i, v in zip(plan.id, plan.dv_mps, strict=True) if not low <= v <= high]
    return OUTSIDE_SIZES(burns=out, low_mps=low, high_mps=high) if out else None


def _planned(plan: Plan, k: int, mean: np.ndarray, covariance: np.ndarray) -> PlannedError:
    turned = None if plan.axes is None else plan.axes[k].T @ covariance @ plan.axes[k]
    return PlannedError(plan.id[k], float(plan.dv_mps[k]), mean, covariance, turned)


def _of_past(past: PastModel, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean (3,) and covariance (3, 3) of a burn, TVC axes."""
    return np.array([0.0, 0.0, float(past.left.mean_magnitude(v))]), past.left.covariance(v)


def _of_fit(fit: GatesResult, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean (3,) and covariance (3, 3) of a burn, TVC axes; NaN where the fit does not know."""
    mean, covariance = np.full(3, np.nan), np.full((3, 3), np.nan)
    for part in fit.parts:
        if part.known:
            at, c = _PLACE[part.quantity], len(part.quantity.axes)
            told = foresee(part.problem, part.point, v, np.zeros((c, c)))
            mean[at], covariance[at, at] = (told.mean if fit.model == "mean-aware" else 0.0), told.covariance
    covariance[2, :2] = covariance[:2, 2] = 0.0
    return mean, covariance
