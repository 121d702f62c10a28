"""The entry of a fitted Gates model: its sigmas and biases, for one engine's burns of one epoch.

The date is the last burn's.  Entries are independent only if each burn is in one of them: a model of all burns so
far changes little from one to the next, however much the engine has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...kit.errors import BadInput
from ...kit.plain import finite
from ...kit.timeline import utc_label
from ..entry import Entry, Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...craft.model import Craft
    from ...estimate.gates import Ends, GatesResult, Part

KIND = "gates"
#: Readings whose sigmas a trend is judged by, on the basis of that name: about biases that are estimated, by the additive
#: likelihood.  Others are kept under their own name.
_JUDGED, _JUDGED_READINGS = "telemetry", ("estimated-bias, additive", "mean-aware, additive")


def gates_entry(result: GatesResult, craft: Craft, name: str | None = None) -> Entry:
    """The entry of one fit.  Raises BadInput for a table without times: a trend needs dates."""
    m = result.maneuvers
    if m.tai_ns is None:
        raise BadInput(
            "the maneuvers have no times, so their model cannot enter a trend",
            file=m.source or None, channel="time", remedy="Add the column 'time [utc]'.",
        )  # fmt: skip
    date = utc_label(int(m.tai_ns.max()))
    reading = f"{result.model}, {result.likelihood}"
    basis = _JUDGED if reading in _JUDGED_READINGS else reading
    engine = "" if result.engine is None else f"_{result.engine}"
    values = tuple(v for part in result.parts for v in _values(part, basis, engine))
    name = name or f"{KIND}{engine.replace('_', '-')}-{date[:10]}"
    return Entry(craft.name, name, KIND, date, values=values, doubts=result.doubts, provenance=result.provenance)


def _values(part: Part, basis: str, engine: str) -> Iterator[Value]:
    """Every parameter except those held, which are not estimates."""
    for term, number, ends in zip(part.terms, part.point.values.tolist(), part.ci95, strict=True):
        if term.bias_axis is None and term.law in part.held:
            continue
        sigma = _sigma(number, ends) if part.known else None
        yield Value(f"{term.key}{engine}", basis, finite(number) if sigma is not None else None, sigma, term.unit)


def _sigma(number: float, ends: Ends) -> float | None:
    """One sigma from a 95 % interval; of an estimate on its bound from the limit.  None where an end is open."""
    low, high = ends
    if low is None or high is None:
        return None
    return high / 1.96 if number == 0 else (high - low) / 3.92
