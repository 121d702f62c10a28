"""What is kept of a fitted Gates model: its sigmas and biases, one engine's burns of one epoch an entry.

The date is the last burn's.  Entries are told apart by chance only if each burn is in one of them: a model of all burns so
far moves by little from one to the next, however much the engine has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...kit.errors import BadInput
from ...kit.plain import finite
from ...kit.timeline import utc_label
from ..entry import Entry, Value

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...estimate.gates import GatesFit, Interval, Part

KIND = "gates"
#: What sigmas are judged by: about biases that are estimated, by the additive likelihood; others are kept under their own name.
_JUDGED = "telemetry"


def gates_entry(result: GatesFit, craft: Craft, event_id: str | None, provenance: dict) -> Entry:
    """The entry of one fit.  Raises BadInput for a table without times: what has no date has no place in a trend."""
    m = result.maneuvers
    if m.tai_ns is None:
        raise BadInput(
            "the maneuvers have no times, so their model has no place in a trend",
            file=m.source or None, channel="time", remedy="Add the column 'time [utc]'.",
        )  # fmt: skip
    date = utc_label(int(m.tai_ns.max()))
    basis = f"{result.model}, {result.likelihood}"
    basis = _JUDGED if basis in ("estimated-bias, additive", "mean-aware, additive") else basis
    engine = "" if result.engine is None else f"_{result.engine}"
    values = tuple(v for part in result.parts for v in _values(part, basis, engine))
    name = event_id or f"{KIND}{engine.replace('_', '-')}-{date[:10]}"
    return Entry(craft.name, name, KIND, date, values=values, doubts=result.doubts, provenance=provenance)


def _values(part: Part, basis: str, engine: str):
    numbers = [part.point.fixed, part.point.proportional, *part.point.beta]
    for term, number, interval in zip(part.terms, numbers, [*part.sigmas, *part.biases], strict=True):
        if term in part.held:
            continue
        known = part.known and _sigma(number, interval) is not None
        # "bias X, fixed" -> bias_x_fixed; a share of the dV is an angle across it
        figure = f"{part.name}_{term.replace(', ', '_').replace(' ', '_').lower()}{engine}"
        unit = "m/s" if term.endswith("fixed") else "" if part.name == "magnitude" else "rad"
        yield Value(figure, basis, finite(number) if known else None, _sigma(number, interval) if known else None, unit)


def _sigma(number: float, interval: Interval) -> float | None:
    """One sigma from a 95 % interval; of an estimate on its bound from the limit.  None where an end is open."""
    low, high = interval
    if low is None or high is None:
        return None
    return high / 1.96 if number == 0 else (high - low) / 3.92
