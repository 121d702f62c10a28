"""An estimated inertia tensor beside a predicted one, in the form of Feldman and Lee's Table 1 (eqs 12, 13)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...craft.model import PREDICTED_SHARE, STALE_NS, Craft, InertiaRequirement, MassProperties, tensor
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.result import per_spin_inertia
from ...kit.schema import Annotated, Doc, DoubtRecord, Matrix, NotRequired, Number, TypedDict
from ...kit.table import Table
from ...kit.timeline import utc_label
from ...telemetry.attitude import MISTAKEN_UNITS

#: Rows of Table 1, and where they stand in the tensor.
ROWS = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}

MET, NOT_MET, OPEN = "met", "not met", "open"
#: Moments whose ratio is this near to a unit's factor, and alike within this, are taken for a wrong unit.
_NEAR_FACTOR, _ALIKE = 1.25, 1.5
#: An estimate so many of the prediction's sigmas away from it, and by this share at least, is no error of the prediction; three sigmas
#: of the estimate come on top.
_FAR_SIGMAS, _FAR_SHARE = 5.0, 0.1

NO_PREDICTION = Kind(
    "inertia.no-prediction", Severity.NOTE,
    "the craft file holds no prediction for this configuration: the estimate is compared with the craft's own tensor",
    "Add [[mass_properties]] with basis = \"predicted\" to the craft file.",
)  # fmt: skip
OLD_PREDICTION = Kind(
    "inertia.old-prediction", Severity.CAUTION,
    "the prediction is of {predicted}, the nearest in the craft file to {date}",
    "Add a prediction of that date to the craft file.",
)  # fmt: skip
IMPOSSIBLE = Kind(
    "inertia.impossible", Severity.SUSPECT, "no rigid body has the estimated inertia: its {quantity} is {value:.4g}",
    "Check wheel axes, spin inertia and units.",
)  # fmt: skip
WRONG_UNIT = Kind(
    "inertia.wrong-unit", Severity.SUSPECT,
    "all moments are {ratio:.3g} times the predicted ones: are the {guesses}?", "Check the units of these channels.",
)  # fmt: skip
OFF_SCALE = Kind(
    "inertia.off-scale", Severity.SUSPECT,
    "all moments are {ratio:.3g} times the predicted ones, more than a prediction is wrong by: the wheels' spin inertia, or the factor of "
    "their rates, is the scale of the tensor",
    "Check spin_inertia in the craft file and the wheels' rates, or the prediction.",
)  # fmt: skip
FAR_FROM_PREDICTION = Kind(
    "inertia.far-from-prediction", Severity.SUSPECT,
    "{element} is {ratio:.3g} times the predicted one, more than a prediction known to {percent:.0f} % is wrong by: the spin inertia, the sense "
    "or the axis of the wheels that turn the craft about that axis would do that",
    "Check these wheels in the craft file and their rates, or the prediction (its sigma is a key of [[mass_properties]]).",
)  # fmt: skip


class PredictedRecord(TypedDict):
    inertia_kgm2: Matrix | None
    basis: str
    date: str
    source: str
    inertia_per_spin_inertia: NotRequired[Matrix]


class ComponentRecord(TypedDict):
    """One element; percent for moments, kg m2 for products; values per unit spin inertia where kg m2 is null for both."""

    name: str
    predicted_kgm2: Number
    estimated_kgm2: Number
    estimated_sigma_kgm2: Number
    error_percent: Annotated[Number, Doc("predicted less estimated, of the predicted; moments")]
    error_sigma_percent: Number
    error_kgm2: Annotated[Number, Doc("predicted less estimated; products")]
    error_sigma_kgm2: Number
    requirement_percent: Number
    requirement_kgm2: Number
    verdict: Annotated[str | None, Doc("met, not met, or open: 95 % of the estimate lies on both sides")]
    predicted_per_spin_inertia: NotRequired[Number]
    estimated_per_spin_inertia: NotRequired[Number]
    estimated_sigma_per_spin_inertia: NotRequired[Number]
    error_per_spin_inertia: NotRequired[Number]
    error_sigma_per_spin_inertia: NotRequired[Number]


class ComparisonRecord(TypedDict):
    unit: Annotated[str, Doc("kg m2, or per spin inertia")]
    predicted: PredictedRecord
    components: list[ComponentRecord]
    smallest_moment_kgm2: Annotated[Number, Doc("smallest principal moment; positive for a rigid body")]
    triangle_margin_kgm2: Annotated[
        Number, Doc("half of what two principal moments exceed the third by; positive for a rigid body")
    ]
    doubts: list[str]
    doubts_detail: list[DoubtRecord]
    smallest_moment_per_spin_inertia: NotRequired[Number]
    triangle_margin_per_spin_inertia: NotRequired[Number]


@dataclass(frozen=True)
class Prediction:
    """A tensor (3, 3) to compare with, and where it is from."""

    inertia_kgm2: np.ndarray
    basis: str
    date: str
    source: str
    requirement: InertiaRequirement | None = None
    doubts: Doubts = Doubts()
    share: float = PREDICTED_SHARE  # one sigma of the moments


@dataclass(frozen=True)
class Compared:
    """One component.  ``error``: predicted less estimated, in percent of the predicted for moments (eq 12), else as
    it is (eq 13).  ``verdict``: whether the requirement is met; 'open' where 95 % of the estimate lies on both sides."""

    name: str
    predicted: float
    estimated: float
    sigma: float | None
    error: float
    sigma_error: float | None
    requirement: float | None
    verdict: str | None

    @property
    def moment(self) -> bool:
        return self.name[1] == self.name[2]

    def record(self, *, relative: bool) -> dict:
        """The JSON form, with the keys of earlier versions."""
        error, sigma, asked = self.error, self.sigma_error, self.requirement
        of_moment = (error, sigma, asked) if self.moment else (None, None, None)
        of_product = (None, None, None) if self.moment else (error, sigma, asked)
        record = {
            "name": self.name,
            "predicted_kgm2": self.predicted,
            "estimated_kgm2": self.estimated,
            "estimated_sigma_kgm2": self.sigma,
            **dict(zip(("error_percent", "error_sigma_percent", "requirement_percent"), of_moment, strict=True)),
            **dict(zip(("error_kgm2", "error_sigma_kgm2", "requirement_kgm2"), of_product, strict=True)),
            "verdict": self.verdict,
        }
        if relative:
            names = ["predicted_kgm2", "estimated_kgm2", "estimated_sigma_kgm2"]
            per_spin_inertia(record, names if self.moment else [*names, "error_kgm2", "error_sigma_kgm2"])
        return record | {
            "predicted": self.predicted, "estimated": self.estimated, "sigma": self.sigma, "error": of_product[0],
            "sigma_error": sigma, "requirement": asked,
        }  # fmt: skip

    def row(self) -> tuple[str, ...]:
        """As in Table 1."""
        unit = " %" if self.moment else ""
        error = f"{self.error:+.2f}{unit}" if self.moment else _short(self.error, "+")
        asked = () if self.requirement is None else (f"{self.requirement:g}{unit} {self.verdict}",)
        sigma = "" if self.sigma is None else f"{self.sigma:.3g}"
        return self.name, _short(self.predicted), _short(self.estimated), sigma, error, *asked


@dataclass(frozen=True)
class InertiaComparison:
    """All six, and how far the estimate is from what no rigid body can be.

    ``smallest_moment_kgm2``: the smallest principal moment; ``triangle_margin_kgm2``: the smallest eigenvalue of
    trace(I)/2 - I, half of what two principal moments exceed the third by.  Both must be positive.  All per unit spin
    inertia where ``relative``."""

    prediction: Prediction
    rows: tuple[Compared, ...]
    smallest_moment_kgm2: float
    triangle_margin_kgm2: float
    relative: bool
    doubts: Doubts

    def row(self, name: str) -> Compared:
        return next(r for r in self.rows if r.name == name)

    @property
    def unit(self) -> str:
        return "per spin inertia" if self.relative else "kg m2"

    def record(self) -> dict:
        """The JSON form, with the keys of earlier versions."""
        p = self.prediction
        predicted = {"inertia_kgm2": p.inertia_kgm2, "basis": p.basis, "date": p.date, "source": p.source}
        sizes = {"smallest_moment_kgm2": self.smallest_moment_kgm2, "triangle_margin_kgm2": self.triangle_margin_kgm2}
        if self.relative:
            per_spin_inertia(predicted, ["inertia_kgm2"])
            per_spin_inertia(sizes, list(sizes))
        return {
            "unit": self.unit,
            "predicted": predicted | {"inertia": p.inertia_kgm2},
            "components": [r.record(relative=self.relative) for r in self.rows],
            **sizes,
            "smallest_moment": self.smallest_moment_kgm2,
            "triangle_margin": self.triangle_margin_kgm2,
            **self.doubts.record(),
        }

    def table(self, title: str = "") -> Table:
        """Table 1, one window of it."""
        p = self.prediction
        what = f"{title}Estimate against {p.basis} inertia of {p.date} ({p.source}) [{self.unit}]"
        sizes = f"smallest principal moment {_short(self.smallest_moment_kgm2)}, triangle margin {_short(self.triangle_margin_kgm2)}"
        head = ("", "predicted", "estimated", "sigma", "error", "requirement")
        return Table(what, tuple(r.row() for r in self.rows), head, (sizes,))

    def __str__(self) -> str:
        return str(self.table())


def _short(value: float, sign: str = "") -> str:
    """In columns: tenths, or four digits where there would be too many."""
    return f"{value:{sign}.1f}" if abs(value) < 1e6 else f"{value:{sign}.4g}"


def predicted_inertia(craft: Craft, tai_ns: int | None) -> Prediction:
    """The tensor predicted for the configuration of a date (None: the latest), the nearest in time; where there is none,
    the craft's own tensor on that date.

    Raises BadInput where the craft has neither."""
    known = sorted((m for m in craft.mass_properties if m.basis != "predicted"), key=lambda m: m.date)
    moment = tai_ns if tai_ns is not None else max((m.date for m in craft.mass_properties), default=0)
    piece = next((m.piece for m in reversed(known) if m.date <= moment), known[0].piece if known else None)
    candidates = [m for m in craft.mass_properties if m.basis == "predicted" and piece in (None, m.piece)]
    asked = craft.inertia_requirement
    if candidates:
        m = min(candidates, key=lambda m: abs(m.date - moment))
        return Prediction(
            tensor(m.elements), "predicted", _day(m.date), m.source, asked, _age(m, moment), m.share or PREDICTED_SHARE
        )
    now = craft.at(tai_ns)
    if now.inertia_kgm2 is None:
        raise BadInput(
            f"{craft.name} has no inertia to compare an estimate with",
            remedy="Add [[mass_properties]] to the craft file, or give --inertia.",
        )
    share = craft.inertia_share or PREDICTED_SHARE
    if piece == "given":
        return Prediction(now.inertia_kgm2, "craft's", "any date", "given by the user", asked, now.doubts, share)
    source = "the craft's tensor on that date, which may itself be an estimate"
    doubts = Doubts([NO_PREDICTION(), *now.doubts])
    return Prediction(now.inertia_kgm2, "craft's", _day(moment), source, asked, doubts, share)


def _day(tai_ns: int) -> str:
    return utc_label(tai_ns)[:10]


def _age(m: MassProperties, moment: int) -> Doubts:
    if abs(m.date - moment) <= STALE_NS:
        return Doubts()
    return Doubts([OLD_PREDICTION(predicted=_day(m.date), date=_day(moment))])


def compare_inertia(estimate, prediction: Prediction, *, sigma=None, relative: bool = False) -> InertiaComparison:
    """Set an estimate (3, 3) against a prediction; ``sigma`` (3, 3): its total one sigma, where known.

    ``relative``: both are per unit spin inertia, of which no requirement on products speaks."""
    I_B, rows = np.asarray(estimate, float), []
    for name, at in ROWS.items():
        predicted, estimated = float(prediction.inertia_kgm2[at]), float(I_B[at])
        s = None if sigma is None else float(np.asarray(sigma, float)[at])
        scale = 100 / predicted if at[0] == at[1] else 1.0
        asked = None
        if prediction.requirement is not None and not (relative and at[0] != at[1]):
            asked = 100 * prediction.requirement.moments if at[0] == at[1] else prediction.requirement.products
        error = scale * (predicted - estimated)
        s_error = None if s is None else abs(scale) * s
        rows.append(Compared(name, predicted, estimated, s, error, s_error, asked, _verdict(error, s_error, asked)))
    moments = np.linalg.eigvalsh(I_B)
    margin = float(moments.sum() / 2 - moments[-1])
    found = [_impossible(float(moments[0]), margin), _far_away(I_B, prediction, sigma, relative=relative)]
    return InertiaComparison(
        prediction, tuple(rows), float(moments[0]), margin, relative, prediction.doubts + Doubts(found)
    )


def _verdict(error: float, sigma: float | None, asked: float | None) -> str | None:
    if asked is None:
        return None
    if sigma is not None and abs(abs(error) - asked) < 1.96 * sigma:
        return OPEN
    return MET if abs(error) <= asked else NOT_MET


def _impossible(smallest: float, margin: float) -> Doubt | None:
    if smallest <= 0:
        return IMPOSSIBLE(quantity="smallest principal moment", value=smallest)
    return IMPOSSIBLE(quantity="triangle margin", value=margin) if margin < 0 else None


def _far_away(estimate: np.ndarray, prediction: Prediction, sigma, *, relative: bool) -> Doubt | None:
    """Moments are a wheel's rate over the body's: a factor in either shows in all three, and that of one wheel in some."""
    predicted = np.diag(prediction.inertia_kgm2)
    ratio = np.diag(estimate) / predicted
    if (ratio <= 0).any():
        return None  # impossible, which is said
    mean = float(np.exp(np.mean(np.log(ratio))))
    alike = ratio.max() / ratio.min() < _ALIKE
    guesses = _units(mean) if alike else []
    if guesses:
        return WRONG_UNIT(ratio=mean, guesses=", or the ".join(guesses))
    if relative:
        return None
    apart = np.log(1 + max(_FAR_SIGMAS * prediction.share, _FAR_SHARE))
    if sigma is not None:
        apart = apart + 3 * np.diag(np.asarray(sigma, float)) / predicted
    far = np.abs(np.log(ratio)) > apart
    if far.all() and alike:
        return OFF_SCALE(ratio=mean)
    if not far.any():
        return None
    k = int(np.argmax(np.where(far, np.abs(np.log(ratio)), 0.0)))
    return FAR_FROM_PREDICTION(element=f"I{2 * 'xyz'[k]}", ratio=ratio[k], percent=100 * prediction.share)


def _units(ratio: float) -> list[str]:
    """Wrong units that would make all moments so many times too large."""
    return [
        f"{which} rates {words}"
        for which, scale in (("body", 1 / ratio), ("wheel", ratio))
        for factor, words in MISTAKEN_UNITS.items()
        if abs(np.log(scale / factor)) < np.log(_NEAR_FACTOR)
    ]
