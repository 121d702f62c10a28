"""Verdicts as plain records: the JSON of the verbs and of the report."""

from __future__ import annotations

import numpy as np

from ..kit.errors import BadInput, some_of
from .entry import BEST
from .statistics import COLD_DAYS, TORQUE, WARM_DAYS, Equivalence, Newest, Trend, distance, whole_days
from .verdicts import FigureHealth, Health, date_of

#: Sudden and slow changes for which the power is stated. [%]
POWER_AT = (10.0, 25.0, 50.0)


def figure_record(f: FigureHealth) -> dict:
    """One figure: rows, trend, forecast, newest, verdict.  Values in ``unit``."""
    t = f.trend
    return {
        "figure": f.figure,
        "basis": f.basis,
        "unit": f.unit,
        "rows": [{"event": r.event, "date": r.date, "value": r.value, "sigma": r.sigma} for r in f.rows],
        "doubted_rows": [{"event": r.event, "date": r.date, "value": r.value, "sigma": r.sigma} for r in f.doubted],
        "change_percent": t.change_percent if t else None,
        "change_percent_ci95": list(t.change_percent_ci95) if t and t.change_percent_ci95 else None,
        "p_value": t.p_value if t else None,
        "p_value_all_figures": f.trend_p_adjusted,
        "slope_per_year": t.slope_per_year if t else None,
        "slope_per_year_ci95": list(t.slope_ci95) if t else None,
        "scatter": t.scatter if t else None,
        "detectable_percent": t.detectable_percent if t else None,
        "power": _slow_power(t) if t else None,
        "change_point": _step_record(f),
        "limit": f.limit,
        "limit_from": date_of(f.limit_reached[0]),
        "limit_expected": date_of(f.limit_reached[1]),
        "newest": None if f.newest is None else newest_record(f.newest, f.newest_p_adjusted),
        "verdict": f.verdict,
        "reasons": list(f.reasons),
    }


def sudden_words(f: FigureHealth) -> str | None:
    """A sentence on a sudden change, where one is found and fits the history better than a slope."""
    s = f.step
    if s is None or s.p_value >= 0.05 or s.rather_than_slope <= 0 or s.percent is None:
        return None
    return (
        f"a sudden change of {s.percent:+.0f} % after {f.rows[s.before].event} fits better than a slope "
        f"(log likelihood {s.rather_than_slope:.1f} higher; p = {s.p_value:.2g} against no change)"
    )


def newest_record(n: Newest, adjusted: float | None) -> dict:
    return {
        "value": n.value, "expected": n.expected, "low_95": n.low, "high_95": n.high, "p_value": n.p_value,
        "p_value_all_figures": adjusted, "detectable_percent": n.detectable(),
        "power": {f"{p:g}_percent": n.power(p) for p in POWER_AT},
    }  # fmt: skip


def equivalence_record(e: Equivalence) -> dict:
    return {
        "figure": e.figure, "difference_percent": e.difference_percent, "difference_percent_ci90": list(e.ci90),
        "margin_percent": e.margin_percent, "p_value": e.p_value, "equivalent": e.equivalent,
        "provable_percent": e.provable_percent, "pairs": e.pairs,
    }  # fmt: skip


def cold_warm_record(h: Health) -> dict:
    d = h.distances
    return {
        "cold_after_days": COLD_DAYS, "warm_within_days": WARM_DAYS,
        "pairs": [{"cold": p.cold.event, "warm": p.warm.event, "rest_days": whole_days(p.rest_days)} for p in h.pairs],
        "equivalence": [equivalence_record(e) for e in h.equivalences],
        "curves": None if d is None else {"pairs": list(d.pairs), "others": list(d.others), "p_value": d.p_value},
    }  # fmt: skip


def two_record(health: Health, first: str, second: str) -> dict:
    """Figures of two events, their differences, and the distance between their curves.  Raises BadInput for an unknown one."""
    by_name = {e.event: e for e in health.entries}
    for name in (first, second):
        if name not in by_name:
            raise BadInput(
                f"there is no {health.kind} {name!r} with figures", remedy=f"Events with figures: {some_of(by_name)}."
            )
    a, b = by_name[first], by_name[second]
    rows = []
    for v in a.values:
        w = b.value(v.figure, v.basis)
        if v.basis not in BEST or w is None or v.value is None or w.value is None:
            continue
        sigma = None if v.sigma is None or w.sigma is None else float(np.hypot(v.sigma, w.sigma))
        rows.append({
            "figure": v.figure, "unit": v.unit, "first": v.value, "second": w.value,
            "difference": w.value - v.value, "sigma_difference": sigma,
        })  # fmt: skip
    one, other = a.curve(TORQUE), b.curve(TORQUE)
    apart = None if one is None or other is None else distance(one, other)
    return {"first": first, "second": second, "figures": rows, "curve_distance": apart}


def health_record(h: Health) -> dict:
    """Everything but curves."""
    return {
        "craft": h.craft, "kind": h.kind, "verdict": h.verdict, "reasons": list(h.reasons),
        "newest_event": h.entries[-1].event,
        "events": [
            {"event": e.event, "date": e.date, "revision": e.revision, "rest_days": h.rest_days.get(e.event),
             "doubts": e.doubts.sentences(), "provenance": e.provenance} for e in h.entries
        ],
        "figures": [figure_record(f) for f in h.figures],
        "shape": shape_record(h),
        "cold_warm": cold_warm_record(h),
        "cycles": cycles_record(h),
        **h.doubts.record(),
    }  # fmt: skip


def shape_record(h: Health) -> dict | None:
    if h.shape is None:
        return None
    return {
        "distance": h.shape.distance, "usual_distance": h.shape.usual, "p_value": h.shape.p_value,
        "p_value_all_figures": h.shape_p_adjusted,
    }  # fmt: skip


def cycles_record(h: Health) -> dict:
    return {"used": h.cycles_used, "allowed": h.cycles_allowed}


def _slow_power(t: Trend) -> dict:
    return {f"{p:g}_percent": t.power(p) for p in POWER_AT}


def _step_record(f: FigureHealth) -> dict | None:
    s = f.step
    if s is None:
        return None
    return {
        "after_event": f.rows[s.before].event, "percent": s.percent, "p_value": s.p_value,
        "log_likelihood_over_slope": s.rather_than_slope,
    }  # fmt: skip
