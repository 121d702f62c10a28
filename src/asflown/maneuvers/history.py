"""Cassini's execution-error models through the years, as data (Wagner 2014 Tables 2 and 3)."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any, ClassVar

from ..kit.doubts import Doubts, Kind, Severity
from ..kit.errors import BadInput, some_of
from ..kit.result import Estimate, recorded
from ..kit.schema import Annotated, Doc, DoubtRecord, NotRequired, Number, Numbers, TypedDict
from ..kit.table import Table
from .model import Gates

MAIN_ENGINE, RCS = "main-engine", "rcs"
#: Words that files use for an engine of the history.
_CALLED = {
    "main-engine": MAIN_ENGINE, "main": MAIN_ENGINE, "main_engine": MAIN_ENGINE, "mainengine": MAIN_ENGINE, "me": MAIN_ENGINE,
    "mea": MAIN_ENGINE, "rcs": RCS, "rcs-a": RCS, "rcs-b": RCS, "rcs-b-branch": RCS, "rcs-a-branch": RCS,
}  # fmt: skip

SIGMA_IS_LIMIT = Kind(
    "maneuvers.past-sigma-is-limit", Severity.CAUTION,
    "{model}: its proportional magnitude sigma of 0 lies on its bound: it is a limit, not an estimate",
)  # fmt: skip
BIAS_SIGN = Kind(
    "maneuvers.past-bias-sign", Severity.SUSPECT,
    "{model}: the paper gives the proportional magnitude bias as +1.5 % and says that 1.5 % less predicted thrust removed it, "
    "which would have made it +3 %: one of the two signs is wrong",
)  # fmt: skip
BURNS_UNSURE = Kind(
    "maneuvers.past-burns-unsure", Severity.NOTE,
    "{model}: Table 2 of the paper says that the burns end with OTM-325, its text four times that they end with OTM-328",
)  # fmt: skip
#: What the tables themselves leave in doubt, by its word in history.toml.
_DOUBTS = {"bound": SIGMA_IS_LIMIT, "sign": BIAS_SIGN, "burns": BURNS_UNSURE}


class MagnitudeModel(TypedDict):
    fixed_mps: Number
    proportional: Number
    bias_fixed_mps: Annotated[Number, Doc("as found, before it was removed")]
    bias_proportional: Number


class PointingModel(TypedDict):
    """Sigmas per axis; biases along TVC X and Y."""

    fixed_mps: Number
    proportional_rad: Number
    bias_fixed_mps: Numbers | None
    bias_proportional_rad: Numbers | None


class BiasLeft(TypedDict):
    bias_fixed_mps: Number
    bias_proportional: Number


class PastModelRecord(TypedDict):
    engine: str
    names: list[str]
    magnitude: MagnitudeModel
    pointing: PointingModel
    magnitude_bias_left: Annotated[BiasLeft, Doc("what stayed after the removal")]
    burns: str | None
    count: int | None
    left_out: int | None
    branch: str | None
    valid_to_mps: Annotated[Number, Doc("largest dV that the model was made for")]
    first_used: str
    note: str | None
    doubts: list[str]
    doubts_detail: NotRequired[list[DoubtRecord]]


class GatesHistoryRecord(TypedDict):
    """JSON of `asflown gates history`; null: not published."""

    models: list[PastModelRecord]


@dataclass(frozen=True)
class PastModel:
    """One column of the tables.  ``model`` has the biases as found, ``left`` those that stayed after the removal."""

    engine: str
    names: tuple[str, ...]
    model: Gates
    left: Gates
    burns: str | None = None
    count: tuple[int, int] | None = None  # used, left out
    branch: str | None = None
    first_used: str = ""
    bias_known: bool = True
    note: str = ""
    doubts: Doubts = Doubts()

    def record(self) -> dict:
        found, left = self.model.record(), self.left.record()
        unknown = {} if self.bias_known else {"bias_fixed_mps": None}
        magnitude = found["magnitude"] | unknown
        pointing = found["pointing"] | unknown
        if not self.bias_known:
            magnitude["bias_proportional"] = pointing["bias_proportional_rad"] = None
        return {
            "engine": self.engine, "names": list(self.names), "magnitude": magnitude, "pointing": pointing,
            "magnitude_bias_left": {k: left["magnitude"][k] if self.bias_known else None for k in ("bias_fixed_mps", "bias_proportional")},
            "burns": self.burns, "count": self.count[0] if self.count else None,
            "left_out": self.count[1] if self.count else None, "branch": self.branch,
            "valid_to_mps": self.model.valid_to_mps, "first_used": self.first_used, "note": self.note or None,
            **self.doubts.record(),
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True, repr=False)
class GatesHistoryResult(Estimate):
    """Published models of one engine or both, in order of time."""

    RECORD: ClassVar[type] = GatesHistoryRecord

    models: tuple[PastModel, ...]

    def _record(self) -> dict:
        return {"models": [m.record() for m in self.models]}

    def _tables(self) -> tuple[Table, ...]:
        sigmas, biases = [], []
        for m in self.models:
            g, name = m.model, f"{m.engine} {', '.join(m.names)}"
            (fx, fy), (px, py) = g.pointing_bias_fixed_mps, g.pointing_bias_proportional_rad
            sigmas.append((name, f"{100 * g.magnitude_proportional:.2f}", f"{1e3 * g.magnitude_fixed_mps:.1f}",
                           f"{1e3 * g.pointing_proportional_rad:.1f}", f"{1e3 * g.pointing_fixed_mps:.1f}"))  # fmt: skip
            if m.bias_known:
                across = (f"{1e3 * x:.1f}" for x in (px, fx, py, fy))
                biases.append((name, f"{100 * g.bias_proportional:.2f}", f"{1e3 * g.bias_fixed_mps:.1f}", *across))
        of_sigmas = ("", "magnitude %", "mm/s", "pointing mrad", "mm/s")
        of_biases = ("", "magnitude %", "mm/s", "X mrad", "mm/s", "Y mrad", "mm/s")
        return (
            Table("Sigmas, of pointing per axis", tuple(sigmas), of_sigmas),
            Table("Biases as found", tuple(biases), of_biases),
        )


@recorded
def gates_history(*, engine: str | None = None) -> GatesHistoryResult:
    """Cassini's execution-error models and biases from launch to 2012 (Wagner 2014 Tables 2 and 3).

    Parameters
    ----------
    engine : str, optional
        'main-engine' or 'rcs', or a common name of either; both unless given.

    Returns
    -------
    GatesHistoryResult

    Raises
    ------
    BadInput
        For an engine that has no published model.
    """
    kind = None if engine is None else engine_called(engine)
    if engine is not None and kind is None:
        raise BadInput(f"the history holds no engine {engine!r}", remedy=f"Name {MAIN_ENGINE} or {RCS}.")
    models = tuple(m for m in past_models() if kind in (None, m.engine))
    return GatesHistoryResult(method="published", models=models, doubts=Doubts(d for m in models for d in m.doubts))


@cache
def past_models() -> tuple[PastModel, ...]:
    """Every model, main engine first, in order of time."""
    text = (resources.files("asflown.maneuvers") / "history.toml").read_text(encoding="utf-8")
    return tuple(_entry(row) for row in tomllib.loads(text)["model"])


def engine_called(word: str) -> str | None:
    """'main-engine' or 'rcs' for what files call them; None for any other engine."""
    return _CALLED.get(word.strip().lower().replace(" ", "-"))


def past_model(name: str, engine: str | None = None) -> PastModel:
    """One of Cassini's published models (Wagner 2014 Tables 2 and 3).

    Parameters
    ----------
    name : str
        '2012-1', or with its engine 'rcs/2012-1'.
    engine : str, optional
        Whose, where the name does not say.

    Returns
    -------
    PastModel

    Raises
    ------
    BadInput
        For a model that is not there, or a name that both engines have.
    """
    whose, _, short = name.rpartition("/")
    kind = engine_called(whose or engine or "")
    found = [m for m in past_models() if short in m.names and (kind is None or m.engine == kind)]
    if len({m.engine for m in found}) == 1 and (kind is not None or not whose):
        called = f"{found[0].engine}/{short}"
        return replace(found[0], model=replace(found[0].model, name=called), left=replace(found[0].left, name=called))
    known = [f"{m.engine}/{n}" for m in past_models() for n in m.names if kind in (None, m.engine)]
    what = "is a model of both engines" if found and not whose else "is not a model of the history"
    raise BadInput(f"{name!r} {what}", remedy=f"Name one of: {some_of(known, 24)}.")


def _entry(row: dict) -> PastModel:
    def gates(which: int) -> Gates:
        """With the biases as found (0), or as left after their removal (1)."""
        bias: dict[str, Any] = {}
        if b := row.get("bias"):
            fixed, proportional = (
                values[min(which, len(values) - 1)] for values in (b["magnitude_mm_s"], b["magnitude_percent"])
            )
            bias = {
                "bias_fixed_mps": _over(fixed, 1000), "bias_proportional": _over(proportional, 100),
                "pointing_bias_fixed_mps": (_over(b["x_mm_s"], 1000), _over(b["y_mm_s"], 1000)),
                "pointing_bias_proportional_rad": (_over(b["x_mrad"], 1000), _over(b["y_mrad"], 1000)),
            }  # fmt: skip
        return Gates(
            _over(row["magnitude"]["fixed_mm_s"], 1000), _over(row["magnitude"]["proportional_percent"], 100),
            _over(row["pointing"]["fixed_mm_s"], 1000), _over(row["pointing"]["proportional_mrad"], 1000),
            valid_to_mps=row.get("valid_to_m_s"), name=f"{row['engine']}/{row['names'][-1]}", **bias,
        )  # fmt: skip

    model = gates(0)
    printed = _DOUBTS[row["doubt"]](model=model.name) if "doubt" in row else None
    return PastModel(
        row["engine"], tuple(row["names"]), model, gates(1), row.get("burns"), tuple(row["count"]) if "count" in row else None,
        row.get("branch"), row["first_used"], "bias" in row, row.get("note", ""),
        Doubts([printed, model.contradiction()]),
    )  # fmt: skip


def _over(printed: float, by: int) -> float:
    """A printed number in SI, without the last bit's noise: 0.7 % is 0.007."""
    return round(printed / by, 12)
