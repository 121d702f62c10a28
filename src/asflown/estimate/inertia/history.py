"""A craft's inertia over its mission: every estimate in the craft file that has a prediction of its own date beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from ...craft.model import tensor
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.result import Estimate, recorded
from ...kit.schema import Annotated, Doc, TypedDict
from ...kit.table import Table
from ...kit.timeline import utc_label
from .prediction import ComparisonRecord, InertiaComparison, Prediction, compare_inertia

if TYPE_CHECKING:
    from ...craft.model import Craft

NO_WINDOWS = Kind(
    "inertia.no-history", Severity.VOID,
    "the craft file holds no estimate with a prediction of the same date beside it",
    "Add [[mass_properties]] of both kinds with one date.",
)  # fmt: skip


class WindowRecord(ComparisonRecord):
    date: str
    configuration: str


class InertiaHistoryRecord(TypedDict):
    """JSON of `asflown inertia history`."""

    craft: str
    windows: Annotated[list[WindowRecord], Doc("in order of time")]


class InertiaWindow(NamedTuple):
    """An estimate of one date, in one configuration of the craft, against the prediction of that date."""

    date: str
    configuration: str
    comparison: InertiaComparison


@dataclass(frozen=True, kw_only=True, repr=False)
class InertiaHistoryResult(Estimate):
    """Estimates and predictions, in order of time: Feldman and Lee's Table 1 for Cassini."""

    RECORD: ClassVar[type] = InertiaHistoryRecord

    windows: tuple[InertiaWindow, ...]

    def _record(self) -> dict:
        windows = [{"date": w.date, "configuration": w.configuration} | w.comparison.record() for w in self.windows]
        return {"craft": self.craft, "windows": windows}

    def _tables(self) -> tuple[Table, ...]:
        title = Table(f"Inertia over the mission · {self.craft} · {len(self.windows)} estimates with a prediction")
        return (title, *(w.comparison.table(f"{w.date}  {w.configuration}\n") for w in self.windows))


@recorded
def inertia_history(craft: Craft) -> InertiaHistoryResult:
    """Tensors estimated and predicted over the mission, as the craft file has them.

    Parameters
    ----------
    craft : Craft
        Its [[mass_properties]], estimated and predicted.

    Returns
    -------
    InertiaHistoryResult
        A comparison for every estimate that has a prediction of its own date and configuration: errors in percent of the
        predicted moments (Feldman and Lee eq 12), in kg m2 for products (eq 13).
    """
    known = craft.mass_properties
    predicted = {(m.date, m.piece): m for m in reversed(known) if m.basis == "predicted"}
    windows = []
    for m in sorted(known, key=lambda m: m.date):
        p = predicted.get((m.date, m.piece))
        if m.basis != "estimated" or p is None:
            continue
        date = utc_label(m.date)[:10]
        against = Prediction(tensor(p.elements), "predicted", date, p.source, craft.inertia_requirement)
        comparison = compare_inertia(tensor(m.elements), against, relative=m.inertia is None)
        windows.append(InertiaWindow(date, m.piece, comparison))
    doubts = [d for w in windows for d in w.comparison.doubts] if windows else [NO_WINDOWS()]
    return InertiaHistoryResult(craft=craft.name, method="craft file", windows=tuple(windows), doubts=Doubts(doubts))
