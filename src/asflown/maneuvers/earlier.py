"""A mission's own earlier model, from the JSON that `asflown gates` printed of it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

from ..kit.config import read_bytes
from ..kit.errors import BadInput
from .history import PastModel, engine_called
from .model import Gates

if TYPE_CHECKING:
    from pathlib import Path


def earlier_model(path: Path, engine: str) -> PastModel:
    """The model of a fit, to judge further burns of ``engine`` by ('' where the engine has no name).

    Its biases count as taken out of further burns, but for a fit that is mean-aware, as in `gates predict`.  Raises BadInput
    for what is no record of a fit, was made of too few burns to hold values, or is another engine's."""
    remedy = "Give what `asflown gates FILE --json` printed of maneuvers with magnitude and pointing errors."
    data = read_bytes(path, "record of a fit", remedy)
    try:
        record = json.loads(data)
        if record["command"] != "gates":
            raise KeyError
        whose, m, p = record["engine"] or "", record["magnitude"], record["pointing"]
        largest, counts, kept = (
            float(record["dv_mps"][1]),
            (int(record["count"]), len(record["excluded"])),
            record["model"],
        )
        left = Gates(
            float(m["fixed_mps"]), float(m["proportional"]), float(p["fixed_mps"]), float(p["proportional_rad"]),
            valid_to_mps=largest, name=path.stem,
        )  # fmt: skip
        model = replace(
            left, bias_fixed_mps=float(m["bias_fixed_mps"] or 0), bias_proportional=float(m["bias_proportional"] or 0),
            pointing_bias_fixed_mps=_pair(p["bias_fixed_mps"]), pointing_bias_proportional_rad=_pair(p["bias_proportional_rad"]),
        )  # fmt: skip
    except (ValueError, KeyError, TypeError, IndexError, UnicodeDecodeError):
        raise BadInput("it is no record of a fit that holds a whole model", file=path, remedy=remedy) from None
    if engine and whose and whose != engine and (engine_called(whose) or whose) != (engine_called(engine) or engine):
        raise BadInput(
            f"it is a model of {whose}, the maneuvers are of {engine}",
            file=path,
            remedy="Name a model of the same engine.",
        )
    return PastModel(whose, (path.stem,), model, model if kept == "mean-aware" else left, count=counts)


def _pair(values) -> tuple[float, float]:
    x, y = values
    return float(x or 0), float(y or 0)
