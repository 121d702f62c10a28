"""Is this mechanism degrading?  Every figure's trend and newest value, cold against warm, cycles: one verdict.

pass: no finding.  watch: a figure has a trend, may reach its limit within five years, or its newest value is
unusual.  alarm: the newest actuation deviates from the earlier ones, or a limit is passed.  Many figures are tested
together; p-values are adjusted for that (Holm).  A mechanism that does not change raises a false alarm in at most
5 % of evaluations, and a false trend in at most 5 %.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from ..kit.doubts import Doubt, Doubts, Kind, Severity
from ..kit.errors import BadInput, some_of
from .entries import END_WITHIN, FIGURES
from .entry import BEST, MOVES, Entry
from .statistics import (
    COLD_DAYS,
    FEW,
    FEWEST,
    FEWEST_PAST,
    MARGIN,
    TORQUE,
    WARM_DAYS,
    YEAR,
    Distances,
    Equivalence,
    Newest,
    Pair,
    Shape,
    Step,
    Trend,
    Values,
    curve_distances,
    cycles,
    equivalence,
    find_pairs,
    holm,
    newest_of,
    rests,
    shape_of,
    step_of,
    trend_of,
)

#: Adjusted p-values below which a figure deviates, and is unusual.
ALARM, WATCH = 0.05, 0.10
#: A limit that the 95 % band may reach within this time is watched. [years]
HORIZON_YEARS = 5.0
#: Share of the allowed cycles from which they are watched.
_CYCLES_WATCHED = 0.8
ORDER = ("pass", "watch", "alarm")
SHAPE = "shape of the torque"


@dataclass(frozen=True)
class Row:
    """One event's value of a figure."""

    event: str
    date: str
    value: float
    sigma: float | None


@dataclass(frozen=True)
class FigureHealth:
    """One figure over the years.  ``reasons``: why the verdict is not pass.

    ``doubted``: values that are shown, not judged, since their own event has a suspect or void doubt about them."""

    figure: str
    basis: str
    unit: str
    rows: tuple[Row, ...]
    trend: Trend | None = None
    step: Step | None = None
    newest: Newest | None = None
    trend_p_adjusted: float | None = None
    newest_p_adjusted: float | None = None
    limit: float | None = None
    limit_reached: tuple[float | None, float | None] = (None, None)  # days from 2000: band's edge, line
    verdict: str = "pass"
    reasons: tuple[str, ...] = ()
    doubted: tuple[Row, ...] = ()


@dataclass(frozen=True)
class Health:
    """The verdict on one kind of actuation, with its evidence."""

    craft: str
    kind: str
    entries: tuple[Entry, ...]  # of this kind, with figures, in order of date
    figures: tuple[FigureHealth, ...]
    shape: Shape | None
    shape_p_adjusted: float | None
    pairs: tuple[Pair, ...]
    equivalences: tuple[Equivalence, ...]
    distances: Distances | None
    rest_days: dict[str, float]
    cycles_used: float
    cycles_allowed: int | None
    verdict: str
    reasons: tuple[str, ...]
    doubts: Doubts = Doubts()

    def figure(self, name: str, basis: str | None = None) -> FigureHealth:
        """Raises BadInput where there is none of that name."""
        found = [f for f in self.figures if f.figure == name and basis in (None, f.basis)]
        if not found:
            raise BadInput(
                f"the store has no figure {name!r} of kind {self.kind}" + (f" on the basis {basis!r}" if basis else ""),
                remedy=f"Its figures: {some_of(dict.fromkeys(f.figure for f in self.figures))}.",
            )
        return found[0]


TOO_FEW = Kind(
    "trends.too-few",
    Severity.CAUTION,
    "there are too few events ({events}) for the interval of a trend, which needs {needed}",
)
STEP_OR_SLOPE = Kind(
    "trends.step-or-slope",
    Severity.CAUTION,
    "{events} events hardly distinguish a sudden change from a slow one",
)
NEWEST_NOT_JUDGED = Kind(
    "trends.newest-not-judged", Severity.CAUTION, "the newest event is not judged: this needs {needed} earlier events"
)
NO_PAIR = Kind(
    "trends.no-pair", Severity.NOTE,
    "there is no cold and warm pair: no event after {cold_days:g} days of rest is followed by another within {warm_days:g} days",
)  # fmt: skip
DOUBTED = Kind(
    "trends.doubted", Severity.CAUTION,
    "{figure} is shown, not judged, in {events} of its events, whose doubts about it are suspect or void",
    "Look at the doubts of those events; a run-down can be named with --run-down.",
)  # fmt: skip
IN_EVENT = Kind("trends.in-event", Severity.SUSPECT, "{event}: {sentence}")


def judge(
    entries: list[Entry],
    *,
    kind: str = "deploy",
    cycles_allowed: int | None = None,
    limits: dict[str, float] | None = None,
    margin: float = MARGIN,
    until: str | None = None,
) -> Health:
    """Judge all actuations of one kind of one craft; ``entries`` of other kinds count for rests and cycles.

    ``limits``: largest (or, where negative or below the values, smallest) allowed values in SI by figure.
    ``until``: take this event as the newest and ignore later ones.  Raises BadInput where there is nothing to judge."""
    entries = sorted(entries, key=lambda e: (e.day, e.event))
    if until is not None:
        last = next((e.day for e in entries if e.event == until), None)
        if last is None:
            raise BadInput(
                f"the store has no event {until!r}", remedy=f"Its events: {some_of(e.event for e in entries)}."
            )
        entries = [e for e in entries if e.day <= last]
    of_kind = [e for e in entries if e.kind == kind and e.values]
    if not of_kind:
        kinds = some_of(sorted({e.kind for e in entries if e.values}))
        raise BadInput(f"the store has no figures of merit of kind {kind}", remedy=f"Its kinds: {kinds}.")
    limits = limits or {}
    figures = [_figure(of_kind, name, basis) for name, basis in _figures_of(of_kind)]
    family = [k for k, f in enumerate(figures) if _judged(f)]
    shape = _shape(of_kind)
    trended = {k: t.p_value for k in family if (t := figures[k].trend) is not None and len(figures[k].rows) >= FEWEST}
    adjusted = dict(zip(trended, holm(list(trended.values())), strict=True))
    # the newest value must be of the newest event itself
    fresh: dict[int | str, float] = {
        k: n.p_value
        for k in family
        if (n := figures[k].newest) is not None and figures[k].rows[-1].event == of_kind[-1].event
    }
    if shape is not None:
        fresh[SHAPE] = shape.p_value
    fresh = dict(zip(fresh, holm(list(fresh.values())).tolist(), strict=True))
    figures = [
        _judge_figure(f, adjusted.get(k), fresh.get(k), limits.get(f.figure)) if k in family else f
        for k, f in enumerate(figures)
    ]
    shape_p = fresh.get(SHAPE)
    pairs = find_pairs(entries, kind) if kind in MOVES else []  # rests do not apply to a wheel or a tensor
    same = [
        e for k in family
        if (t := figures[k].trend) is not None and (e := equivalence(figures[k].figure, pairs, t, margin)) is not None
    ]  # fmt: skip
    used = cycles(entries)
    verdicts = [(f.verdict, r) for f in figures for r in f.reasons]
    verdicts += _shape_verdict(shape_p) + _end_verdict(of_kind) + _cycle_verdict(used, cycles_allowed)
    worst = max((ORDER.index(v) for v, _ in verdicts), default=0)
    return Health(
        of_kind[-1].craft, kind, tuple(of_kind), tuple(figures), shape, shape_p, tuple(pairs), tuple(same),
        curve_distances(of_kind, pairs, kind), rests(entries), used, cycles_allowed, ORDER[worst],
        tuple(r for v, r in sorted(verdicts, key=lambda x: -ORDER.index(x[0]))), _doubts(of_kind, pairs, figures),
    )  # fmt: skip


def is_doubted(entry: Entry, figure: str) -> bool:
    """Whether a suspect or void doubt of an entry is about the wheel that a figure belongs to."""
    return any(d.is_grave and (w := d.about.get("wheel")) and figure.endswith(f"_{w}") for d in entry.doubts)


def values_of(entries: list[Entry], figure: str, basis: str) -> tuple[list[Entry], Values]:
    """Entries that hold a figure, and its values.  Nine digits are kept; differences beyond them are rounding."""
    held = [(e, v) for e in entries if (v := e.value(figure, basis)) is not None and v.value is not None]
    value = np.array([float(f"{v.value:.9g}") for _, v in held])
    sigma = np.array([v.sigma or 0.0 for _, v in held])
    return [e for e, _ in held], Values(
        np.array([e.day for e, _ in held]), value, np.where(sigma > 1e-9 * np.abs(value), sigma, 0.0)
    )


def date_of(day: float | None) -> str | None:
    """Days from 2000-01-01 as a date."""
    return None if day is None else (datetime(2000, 1, 1, tzinfo=UTC) + timedelta(days=day)).strftime("%Y-%m-%d")


def _figures_of(entries: list[Entry]) -> list[tuple[str, str]]:
    return list(dict.fromkeys((v.figure, v.basis) for e in entries for v in e.values))


def _judged(f: FigureHealth) -> bool:
    declared = FIGURES.get(f.figure)
    if declared is None:  # a wheel's drag, or a user's: those with an uncertainty, not counts
        return f.basis in BEST and any(r.sigma is not None for r in f.rows)
    return f.basis in BEST and declared.judged


def _figure(entries: list[Entry], name: str, basis: str) -> FigureHealth:
    sound = [e for e in entries if not is_doubted(e, name)]
    held, values = values_of(sound, name, basis)
    doubted = _rows(*values_of([e for e in entries if is_doubted(e, name)], name, basis))
    unit = next(v.unit for e in entries if (v := e.value(name, basis)) is not None)
    rows = _rows(held, values)
    if len(rows) < 3 or values.day[-1] <= values.day[0]:
        return FigureHealth(name, basis, unit, rows, doubted=doubted)
    trend = trend_of(values)
    found = FigureHealth(name, basis, unit, rows, trend, step_of(values, trend.sigmas), doubted=doubted)
    return replace(found, newest=newest_of(values)) if _judged(found) else found


def _rows(held: list[Entry], values: Values) -> tuple[Row, ...]:
    return tuple(
        Row(e.event, e.date, float(v), float(s) or None)
        for e, v, s in zip(held, values.value, values.sigma, strict=True)
    )


def _shape(entries: list[Entry]) -> Shape | None:
    drawn = [(c, e.day) for e in entries if (c := e.curve(TORQUE)) is not None]
    if not drawn or entries[-1].curve(TORQUE) is None:
        return None
    curves, days = zip(*drawn, strict=True)
    return shape_of(curves[-1], list(curves[:-1]), np.array(days))


def _judge_figure(f: FigureHealth, trend_p, newest_p, limit) -> FigureHealth:
    said: list[tuple[str, str]] = []
    reached: tuple[float | None, float | None] = (None, None)
    name = f.figure
    n = f.newest
    if n is not None and newest_p is not None and newest_p < WATCH:
        off = f" ({100 * (n.value / n.expected - 1):+.1f} %)" if n.expected else ""
        how = "deviates from" if newest_p < ALARM else "is unusual among"
        said.append((
            "alarm" if newest_p < ALARM else "watch",
            f"{name} of {f.rows[-1].event} {how} the earlier events: {n.value:.3g} {f.unit}, "
            f"{n.expected:.3g} expected{off}, p = {newest_p:.2g} over all figures",
        ))  # fmt: skip
    t = f.trend
    if t is not None and trend_p is not None and trend_p < ALARM:
        span = (t.values.day[-1] - t.values.day[0]) / YEAR
        if t.change_percent is not None and t.change_percent_ci95 is not None:
            low, high = t.change_percent_ci95
            word = "increased" if t.change_percent > 0 else "decreased"
            said.append(("watch", f"{name} has {word} by {abs(t.change_percent):.0f} % in {span:.1f} years "
                                  f"(95 %: {low:+.0f} to {high:+.0f} %), p = {trend_p:.2g} over all figures"))  # fmt: skip
        else:
            said.append(
                (
                    "watch",
                    f"{name} changes by {t.slope_per_year:+.2g} {f.unit} a year, p = {trend_p:.2g} over all figures",
                )
            )
    if limit is not None and f.trend is not None:
        now = f.rows[-1].value
        rising = limit >= f.rows[0].value  # a limit lies beyond the start of the history
        if (now >= limit) if rising else (now <= limit):
            said.append(("alarm", f"{name} exceeds its limit: {now:.3g} {f.unit}, limit {limit:.3g}"))
        elif len(f.rows) >= FEWEST:
            reached = f.trend.crossing(limit)
            if reached[0] is not None and reached[0] - f.trend.values.day[-1] <= HORIZON_YEARS * YEAR:
                said.append(
                    ("watch", f"{name} may reach its limit of {limit:.3g} {f.unit} from {date_of(reached[0])} on")
                )
    worst = ORDER[max((ORDER.index(v) for v, _ in said), default=0)]
    return replace(
        f, trend_p_adjusted=None if trend_p is None else float(trend_p),
        newest_p_adjusted=None if newest_p is None else float(newest_p), limit=limit, limit_reached=reached,
        verdict=worst, reasons=tuple(r for _, r in said),
    )  # fmt: skip


def _shape_verdict(p: float | None) -> list[tuple[str, str]]:
    if p is None or p >= WATCH:
        return []
    how = "deviates from" if p < ALARM else "is unusual among"
    return [("alarm" if p < ALARM else "watch", f"the {SHAPE} {how} that of the earlier events, p = {p:.2g}")]


def _end_verdict(entries: list[Entry]) -> list[tuple[str, str]]:
    """Whether the newest reached its end position: its switch, and its angle compared with the usual one."""
    newest = entries[-1]
    switch = newest.value("microswitch", "telemetry")
    found = []
    if switch is not None and switch.value == 0:
        found.append(("alarm", f"the microswitch of {newest.event} does not show the end position"))
    angles = [v.value for e in entries if (v := e.value("end_angle", "telemetry")) is not None and v.value is not None]
    if len(angles) > 1 and newest.value("end_angle", "telemetry") is not None:
        off = angles[-1] - float(np.median(angles[:-1]))
        if abs(off) > END_WITHIN:
            found.append(("alarm", f"{newest.event} ends {np.degrees(off):+.2f} deg from the end angle of the others"))
    return found


def _cycle_verdict(used: float, allowed: int | None) -> list[tuple[str, str]]:
    if not allowed or used < _CYCLES_WATCHED * allowed:
        return []
    level = "alarm" if used >= allowed else "watch"
    return [(level, f"{used:g} of {allowed} allowed cycles are used")]


def _doubts(entries: list[Entry], pairs: list[Pair], figures: list[FigureHealth]) -> Doubts:
    found: list[Doubt] = []
    n = len(entries)
    if n < FEWEST:
        found.append(TOO_FEW(events=n, needed=FEWEST))
    elif n <= FEW:
        found.append(STEP_OR_SLOPE(events=n))
    if n <= FEWEST_PAST:
        found.append(NEWEST_NOT_JUDGED(needed=FEWEST_PAST))
    if not pairs and entries[-1].kind in MOVES:
        found.append(NO_PAIR(cold_days=COLD_DAYS, warm_days=WARM_DAYS))
    found += [DOUBTED(figure=f.figure, events=len(f.doubted)) for f in figures if f.doubted]
    for e in entries:
        found += [IN_EVENT(event=e.event, sentence=str(d), of=d.kind.id) for d in e.doubts if d.is_grave]
    return Doubts(found)
