"""Cassini's execution-error models through the years, as data (002 Tables 2 and 3)."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any

from ..kit.errors import BadInput, some_of
from .model import Gates

MAIN_ENGINE, RCS = "main-engine", "rcs"
#: Words that files use for an engine of the history.
_CALLED = {
    "main-engine": MAIN_ENGINE, "main": MAIN_ENGINE, "main_engine": MAIN_ENGINE, "mainengine": MAIN_ENGINE, "me": MAIN_ENGINE,
    "mea": MAIN_ENGINE, "rcs": RCS, "rcs-a": RCS, "rcs-b": RCS, "rcs-b-branch": RCS, "rcs-a-branch": RCS,
}  # fmt: skip


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
    doubts: tuple[str, ...] = ()

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
            "doubts": list(self.doubts),
        }  # fmt: skip


@cache
def history() -> tuple[PastModel, ...]:
    """Every model, main engine first, in order of time."""
    text = (resources.files("asflown.maneuvers") / "history.toml").read_text(encoding="utf-8")
    return tuple(_entry(row) for row in tomllib.loads(text)["model"])


def engine_called(word: str) -> str | None:
    """'main-engine' or 'rcs' for what files call them; None for any other engine."""
    return _CALLED.get(word.strip().lower().replace(" ", "-"))


def past_model(name: str, engine: str | None = None) -> PastModel:
    """'2012-1' of an engine, or 'rcs/2012-1' whatever the engine.  Raises BadInput for one that is not there."""
    whose, _, short = name.rpartition("/")
    kind = engine_called(whose or engine or "")
    found = [m for m in history() if short in m.names and (kind is None or m.engine == kind)]
    if len({m.engine for m in found}) == 1 and (kind is not None or not whose):
        called = f"{found[0].engine}/{short}"
        return replace(found[0], model=replace(found[0].model, name=called), left=replace(found[0].left, name=called))
    known = [f"{m.engine}/{n}" for m in history() for n in m.names if kind in (None, m.engine)]
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
    doubts = tuple(d for d in (row.get("doubt"), model.contradiction()) if d)
    return PastModel(
        row["engine"], tuple(row["names"]), model, gates(1), row.get("burns"), tuple(row["count"]) if "count" in row else None,
        row.get("branch"), row["first_used"], "bias" in row, row.get("note", ""), doubts,
    )  # fmt: skip


def _over(printed: float, by: int) -> float:
    """A printed number in SI, without the last bit's noise: 0.7 % is 0.007."""
    return round(printed / by, 12)
