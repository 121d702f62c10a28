"""What was judged of a fit and its burns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from ...kit.result import Estimate
from ...kit.schema import Annotated, Doc, NotRequired, Number, TypedDict
from ...kit.table import Table
from .checks import Spread

if TYPE_CHECKING:
    from ...maneuvers.model import Quantity
    from .checks import Directions
    from .terms import Term

#: Adjusted p-value (Benjamini and Hochberg) up to which an outlier is one, and the paper's rule.
DISCOVERY, SIGMAS = 0.05, 2.0


class SpreadRecord(TypedDict):
    name: Annotated[str, Doc("magnitude, pointing X or pointing Y")]
    count: int
    below_zero: Annotated[int, Doc("underburns, of the magnitude")]
    above_zero: int
    sign_p: Number
    inside_1_sigma: Annotated[int | None, Doc("of model and orbit determination together")]
    inside_model_1_sigma: int | None
    inside_band95: Annotated[list[int] | None, Doc("how many inside 1 sigma are to be expected")]
    pit_counts: Annotated[list[int] | None, Doc("probability integral transform, in tenths")]
    distribution_p: Number


class LargestInfluenceRecord(TypedDict):
    id: str
    parameter: str
    in_sigmas: Number


class DirectionsRecord(TypedDict):
    mean_rad: Annotated[Number, Doc("from TVC X to Y")]
    resultant: Annotated[Number, Doc("length of the mean unit vector")]
    rayleigh_p: Number
    hodges_ajne_p: Number
    quadrants: dict[str, int]


class JudgementRecord(TypedDict):
    components: list[SpreadRecord]
    expected_beyond_2_sigma: Annotated[Number, Doc("by chance alone")]
    sufficient: Annotated[bool | None, Doc("whether no single burn decides the model")]
    largest_influence: LargestInfluenceRecord | None
    directions: DirectionsRecord | None


class OutlierRecord(TypedDict):
    id: str
    component: str
    z: Number
    p: Number
    q: Annotated[Number, Doc("p adjusted for all burns looked at")]
    beyond_2_sigma: bool
    discovered: bool


class InfluenceRecord(TypedDict):
    """What leaving one burn out changes; changes by quantity and term."""

    id: str
    magnitude: dict[str, Any]
    pointing: NotRequired[dict[str, Any]]
    largest: str
    in_sigmas: Number
    flips: Annotated[list[str], Doc("biases whose sign turns")]


class AgainstRecord(TypedDict):
    model: str
    components: list[SpreadRecord]
    within_ci95: Annotated[dict[str, dict[str, Any]], Doc("whether the model's value is in the fit's interval")]
    log_likelihood_gain: Number
    chi2: Number
    chi2_p: Number
    freedom: int


class GatesJudgementRecord(TypedDict):
    """Keys that `asflown gates` adds to those of the fit."""

    judgement: JudgementRecord
    outliers: list[OutlierRecord]
    influence: list[InfluenceRecord]
    against: AgainstRecord | None


@dataclass(frozen=True)
class Outlier:
    """A burn far from what the model without it says.  ``q``: p-value adjusted for all burns looked at."""

    id: str
    component: Quantity
    z: float
    p: float
    q: float

    @property
    def discovered(self) -> bool:
        return self.q <= DISCOVERY

    def record(self) -> dict:
        return {
            "id": self.id, "component": self.component, "z": self.z, "p": self.p, "q": self.q,
            "beyond_2_sigma": abs(self.z) > SIGMAS, "discovered": self.discovered,
        }  # fmt: skip


@dataclass(frozen=True)
class Influence:
    """What every parameter changes by when one burn is left out; the largest change in sigmas of its parameter."""

    id: str
    changes: dict[Quantity, dict]  # quantity -> key -> change
    largest: Term | None
    in_sigmas: float
    flips: tuple[Term, ...]  # biases whose sign turns

    def record(self) -> dict:
        return {
            "id": self.id,
            **self.changes,
            "largest": str(self.largest or ""),
            "in_sigmas": self.in_sigmas,
            "flips": list(map(str, self.flips)),
        }


@dataclass(frozen=True)
class Against:
    """The burns under a model of the history: magnitudes about the biases it left, pointing about zero, as such models were made.

    ``consistent``: quantity -> key -> whether the model's value is within the fit's interval (None: not known).  ``chi2_p`` is
    small where the model's sigmas are too small (``chi2`` above ``freedom``) or too large."""

    name: str
    spreads: tuple[Spread, ...]
    consistent: dict[Quantity, dict]
    log_likelihood_gain: float  # of the fit over that model
    chi2: float
    chi2_p: float
    freedom: int

    def record(self) -> dict:
        return {
            "model": self.name, "components": [s.record() for s in self.spreads], "within_ci95": self.consistent,
            "log_likelihood_gain": self.log_likelihood_gain, "chi2": self.chi2, "chi2_p": self.chi2_p, "freedom": self.freedom,
        }  # fmt: skip

    def table(self) -> Table:
        outside = [f"{of} {key}" for of, keys in self.consistent.items() for key, said in keys.items() if said is False]
        title = f"Against {self.name}: log likelihood {self.log_likelihood_gain:.1f} lower; outside the intervals: {', '.join(outside) or 'nothing'}"
        return Table(title, tuple(s.row() for s in self.spreads), Spread.HEAD)


@dataclass(frozen=True, kw_only=True, repr=False)
class GatesJudgement(Estimate):
    """Of one fit.  ``spreads``: of magnitude and of both pointing axes about the fitted means.  ``sufficient``: no single burn
    decides the model; None where there are too few burns to tell."""

    RECORD: ClassVar[type] = GatesJudgementRecord

    spreads: tuple[Spread, ...]
    outliers: tuple[Outlier, ...]
    expected_beyond_2_sigma: float
    influence: tuple[Influence, ...]
    sufficient: bool | None
    directions: Directions | None
    against: Against | None

    @property
    def most_influential(self) -> Influence | None:
        return max(self.influence, key=lambda i: i.in_sigmas, default=None)

    def standing_out(self, quantity: Quantity) -> tuple[str, ...]:
        """Burns to be labelled: outliers in a quantity, and the most influential burn where it moves that quantity most."""
        found = [o.id for o in self.outliers if o.component == quantity]
        worst = self.most_influential
        if worst is not None and worst.largest is not None and worst.largest.quantity is quantity:
            found.append(worst.id)
        return tuple(dict.fromkeys(found))

    def _record(self) -> dict:
        worst = self.most_influential
        largest = None
        if worst is not None:
            largest = {"id": worst.id, "parameter": str(worst.largest or ""), "in_sigmas": worst.in_sigmas}
        return {
            "judgement": {
                "components": [s.record() for s in self.spreads],
                "expected_beyond_2_sigma": self.expected_beyond_2_sigma,
                "sufficient": self.sufficient,
                "largest_influence": largest,
                "directions": None if self.directions is None else self.directions.record(),
            },
            "outliers": [o.record() for o in self.outliers],
            "influence": [i.record() for i in self.influence],
            "against": None if self.against is None else self.against.record(),
        }

    def _tables(self) -> tuple[Table, ...]:
        found = ", ".join(f"{o.id} ({o.component}, z {o.z:+.1f})" for o in self.outliers if o.discovered)
        remarks = [
            f"outliers: {found or 'none'}; beyond 2 sigma {len(self.outliers)}, expected by chance {self.expected_beyond_2_sigma:.1f}"
        ]
        if self.directions is not None:
            remarks.insert(0, str(self.directions))
        worst = self.most_influential
        if worst is not None and worst.largest is not None:
            remarks.append(
                f"influence: {worst.id} most; without it {worst.largest} moves by {worst.in_sigmas:.2f} of its sigma"
            )
        own = Table("Judgement", tuple(s.row() for s in self.spreads), Spread.HEAD, tuple(remarks))
        return (own,) if self.against is None else (own, self.against.table())
