"""A mission's own earlier model, from the JSON that `asflown gates` printed of it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..kit.config import validated
from ..kit.errors import BadInput
from ..kit.reading import read_bytes, reading
from .history import PastModel, engine_called
from .model import Gates

if TYPE_CHECKING:
    from pathlib import Path

_Sigma = Annotated[float, Field(ge=0, le=1e3, allow_inf_nan=False)]
_Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
_Bias = Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False)] | None
_Size = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]


class _Part(BaseModel):
    """Numbers are numbers, not text or truth values; keys that are not needed are not looked at."""

    model_config = ConfigDict(strict=True, extra="ignore")


class _Magnitude(_Part):
    fixed_mps: _Sigma
    proportional: _Share
    bias_fixed_mps: _Bias
    bias_proportional: _Bias


class _Pointing(_Part):
    fixed_mps: _Sigma
    proportional_rad: _Share
    bias_fixed_mps: Annotated[list[_Bias], Field(min_length=2, max_length=2)]
    bias_proportional_rad: Annotated[list[_Bias], Field(min_length=2, max_length=2)]


class _Fit(_Part):
    """What is read of the record of a fit."""

    command: Literal["gates"]
    model: Literal["estimated-bias", "zero-mean", "mean-aware"]
    engine: str | None
    count: Annotated[int, Field(ge=1)]
    excluded: list
    dv_mps: Annotated[list[_Size], Field(min_length=2, max_length=2)]
    magnitude: _Magnitude
    pointing: _Pointing


def earlier_model(path: Path, engine: str) -> PastModel:
    """The model of a fit, to judge further burns of ``engine`` by ('' where the engine has no name).

    Its biases count as taken out of further burns, but for a fit that is mean-aware, as in `gates predict`.  Raises BadInput
    for what is no record of a fit, was made of too few burns to hold values, or is another engine's."""
    remedy = "Give what `asflown gates FILE --json` printed of maneuvers with magnitude and pointing errors."
    with reading(path, remedy, "this JSON is no record of a fit, it"):
        record = json.loads(read_bytes(path, "record of a fit", remedy))
    if not isinstance(record, dict):
        record = {}
    try:
        fit = validated(_Fit, record, path, remedy)
    except BadInput as why:
        raise BadInput(
            f"it is no record of a fit that holds a whole model ({why.what})", file=path, remedy=remedy
        ) from None
    whose, m, p = fit.engine or "", fit.magnitude, fit.pointing
    left = Gates(
        m.fixed_mps, m.proportional, p.fixed_mps, p.proportional_rad, valid_to_mps=fit.dv_mps[1], name=path.stem
    )
    model = replace(
        left, bias_fixed_mps=m.bias_fixed_mps or 0.0, bias_proportional=m.bias_proportional or 0.0,
        pointing_bias_fixed_mps=_pair(p.bias_fixed_mps), pointing_bias_proportional_rad=_pair(p.bias_proportional_rad),
    )  # fmt: skip
    counts, kept = (fit.count, len(fit.excluded)), fit.model
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
