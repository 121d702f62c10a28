"""The error budget: fly a scenario with many seeds, reconstruct the torque, set it against the truth.

The cover paper (section VI) did this with two profiles, one flight each and one method.  Here every figure comes with the
Monte-Carlo error that the number of flights leaves it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..estimate.torque import METHODS, VARIANTS, TorqueResult, torque
from ..kit.digits import plus_minus, scaled_unit
from ..kit.doubts import Doubt, Doubts, Kind, Severity, grouped
from ..kit.errors import BadInput, some_of
from ..kit.peaks import PEAK_REACH_S
from ..kit.result import Estimate, inputs_of, recorded
from ..kit.schema import Annotated, Doc, NotRequired, Number, Numbers, TypedDict
from ..kit.table import Table
from ..sim.flight import Flight, fly
from ..sim.scenario import Scenario, load_scenario
from ..telemetry.channels import AXES
from .truth import against_truth

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from ..craft.model import Craft

#: A method by name: its own, corrected, or with "-printed".
DEFAULT_METHODS = ("momentum-printed", "transfer-printed", "momentum", "transfer", "fused")

#: Within this of a true peak counts as at the corner. [s]
_CORNER_S = 2.0
_SIGMAS = {0.68: 1.0, 0.95: 1.96}

#: A doubt of a method's results with the number of flights that had it; one kind for each severity, which it keeps.
_IN_FLIGHTS = {
    severity: Kind(
        f"campaigns.{severity.label}-in-flights",
        severity,
        "{method}: {sentence} ({flights:d} of {runs:d} flights{numbers})",
        "{advice}",
    )
    for severity in Severity
}


@dataclass(frozen=True)
class Figure:
    """A mean over flights and its own standard error."""

    value: float
    sigma: float

    @classmethod
    def of(cls, samples) -> Figure:
        x = np.asarray(samples, float)
        x = x[np.isfinite(x)]
        if not len(x):
            return cls(float("nan"), float("nan"))
        return cls(float(x.mean()), float(x.std(ddof=1) / np.sqrt(len(x))) if len(x) > 1 else float("nan"))

    def text(self, factor: float = 1.0) -> str:
        return plus_minus(factor * self.value, factor * self.sigma)


#: Figures of a row, and the key of each one's standard error.
_SIGMA_OF = {
    "rms_Nm": "rms_sigma_Nm", "lag_s": "lag_sigma_s", "peak_lag_s": "peak_lag_sigma_s", "coverage_68": "coverage_68_sigma",
    "coverage_95": "coverage_95_sigma", "corner_coverage_95": "corner_coverage_95_sigma",
    "peak_coverage_95": "peak_coverage_95_sigma",
}  # fmt: skip


@dataclass(frozen=True)
class BudgetRow:
    """One method over all flights.  Coverages are shares of instants inside the band, and of peak figures inside
    their intervals; None without a band.  ``rise_s``: of the triangles, in a sweep."""

    method: str
    rms_Nm: Figure
    lag_s: Figure
    peak_lag_s: Figure
    coverage_68: Figure | None
    coverage_95: Figure | None
    corner_coverage_95: Figure | None
    peak_coverage_95: Figure | None
    peak_error_percent: tuple[Figure, ...]
    failed: int
    doubts: Doubts  # those that differ only in numbers once
    rise_s: float | None = None

    def record(self) -> dict:
        row: dict = {"method": self.method, "failed": self.failed}
        for name, sigma in _SIGMA_OF.items():
            f = getattr(self, name)
            row[name], row[sigma] = (None, None) if f is None else (f.value, f.sigma)
        row["peak_error_percent"] = [f.value for f in self.peak_error_percent]
        row["peak_error_sigma_percent"] = [f.sigma for f in self.peak_error_percent]
        return row | ({} if self.rise_s is None else {"rise_s": self.rise_s})


class BudgetRowRecord(TypedDict):
    """One method over all flights; ``x_sigma``: standard error that the number of flights leaves ``x``."""

    method: str
    failed: Annotated[int, Doc("flights that the method could not reconstruct")]
    rms_Nm: Number
    rms_sigma_Nm: Number
    lag_s: Annotated[Number, Doc("shift of best correlation; positive is late")]
    lag_sigma_s: Number
    peak_lag_s: Annotated[Number, Doc("mean time between the true and found peaks")]
    peak_lag_sigma_s: Number
    coverage_68: Annotated[Number, Doc("share of instants inside the 68 % band; null without a band")]
    coverage_68_sigma: Number
    coverage_95: Number
    coverage_95_sigma: Number
    corner_coverage_95: Annotated[Number, Doc("the same within 2 s of a true peak")]
    corner_coverage_95_sigma: Number
    peak_coverage_95: Annotated[Number, Doc("share of peaks inside their 95 % interval")]
    peak_coverage_95_sigma: Number
    peak_error_percent: Annotated[Numbers, Doc("at each true peak; positive is too large")]
    peak_error_sigma_percent: Numbers
    rise_s: NotRequired[Number]


class BudgetRecord(TypedDict):
    """JSON of `asflown budget`."""

    scenario: str
    craft: str
    noise: str
    runs: int
    rows: list[BudgetRowRecord]


@dataclass(frozen=True, kw_only=True, repr=False)
class ErrorBudget(Estimate):
    """How wrong each method is over ``runs`` flights of a scenario: one row a method, and one a rise in a sweep.

    Iterating gives the rows.  Doubts are those of the methods' results, each with the number of flights that had it."""

    RECORD: ClassVar[type] = BudgetRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        **{f"rows[].{name}_mc": sigma for name, sigma in _SIGMA_OF.items()},
        "rows[].peak_error_percent_mc": "peak_error_sigma_percent",
    }

    scenario: str
    noise: str
    runs: int
    rows: tuple[BudgetRow, ...]

    def __iter__(self) -> Iterator[BudgetRow]:
        return iter(self.rows)

    def _record(self) -> dict:
        return {
            "scenario": self.scenario,
            "craft": self.craft,
            "noise": self.noise,
            "runs": self.runs,
            "rows": [row.record() for row in self.rows],
        }

    def _tables(self) -> tuple[Table, ...]:
        rises = dict.fromkeys(row.rise_s for row in self.rows)
        return tuple(t for rise in rises for t in self._tables_of([row for row in self.rows if row.rise_s == rise]))

    def _tables_of(self, rows: list[BudgetRow]) -> Iterator[Table]:
        rise = "" if rows[0].rise_s is None else f" · rise {rows[0].rise_s:g} s"
        factor, unit = scaled_unit(max((r.rms_Nm.value for r in rows if r.rms_Nm.value > 0), default=0.0), "N m")
        shares = ("coverage_68", "coverage_95", "corner_coverage_95", "peak_coverage_95")
        yield Table(
            f"Error budget · {self.scenario} · {self.craft} · {self.runs} flights · noise {self.noise}{rise}",
            tuple(
                (r.method, r.rms_Nm.text(factor), r.lag_s.text(),
                 *("" if (f := getattr(r, name)) is None else f.text() for name in shares), str(r.failed))
                for r in rows
            ),
            ("method", f"rms [{unit}]", "lag [s]", "in 68 % band", "in 95 % band", "near peaks", "peaks in 95 %", "failed"),
        )  # fmt: skip
        peaks = max(len(r.peak_error_percent) for r in rows)
        if peaks:
            yield Table(
                "error at the peaks [%], mean over flights (+ is too large)",
                tuple((r.method, *(f.text() for f in r.peak_error_percent)) for r in rows),
                ("method", *(f"peak {k}" for k in range(1, peaks + 1))),
            )


def split_method(name: str) -> tuple[str, str]:
    """'momentum-printed' -> ('momentum', 'printed').  Raises BadInput for a method that is not there."""
    method, _, variant = name.partition("-")
    variant = variant or "corrected"
    if method not in METHODS or variant not in VARIANTS or (method, variant) == ("fused", "printed"):
        raise BadInput(
            f"method {name!r} is not known", remedy=f"Choose of: {some_of(METHODS)}, with -printed for the papers' way."
        )
    return method, variant


@recorded
def error_budget(
    scenario: str | Path | Scenario,
    craft: Craft,
    methods: Sequence[str] = DEFAULT_METHODS,
    *,
    runs: int = 20,
    seed: int = 0,
    noise: str | None = None,
    rises_s: Sequence[float] | None = None,
    tick: Callable[[], None] = lambda: None,
) -> ErrorBudget:
    """The error of each torque method over many simulated flights whose torque is known.

    Parameters
    ----------
    scenario : str, Path or Scenario
        What is flown: a shipped scenario with a torque, or a TOML file.  The axis is that of its largest torque.
    craft : Craft
        Flown, and assumed in the reconstruction.
    methods : sequence of str
        'momentum', 'transfer', 'polynomial', 'fused'; with '-printed' as the papers print them.
    runs : int
        Flights, with seeds ``seed`` to ``seed + runs - 1``.
    seed : int
        The first flight's seed.
    noise : str, optional
        'none', 'half', 'nominal' or 'double', in place of the scenario's own.
    rises_s : sequence of float, optional
        A sweep over the rise of the scenario's triangular torques [s]: ``runs`` flights for each.
    tick : callable
        Called after each reconstruction.

    Returns
    -------
    ErrorBudget
        One row a method (and rise), iterable.  A flight that a method cannot reconstruct counts in ``failed``.

    Raises
    ------
    BadInput
        If the scenario has no torque, or no triangles to sweep, a method is not known, or there are fewer than two runs.
    """
    if runs < 2:
        raise BadInput(
            f"{runs} runs have no spread", remedy="Take at least 2; 20 show the first digit, 200 the second."
        )
    for name in methods:
        split_method(name)
    plan = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    plans = [(None, plan)] if rises_s is None else [(r, of_rise(plan, r)) for r in rises_s]
    tallies = [
        tally
        for rise, one in plans
        for tally in _tallied(one, craft, [_Tally(m, rise) for m in methods], range(seed, seed + runs), noise, tick)
    ]
    return ErrorBudget(
        craft=craft.name,
        variant="",
        scenario=plan.name,
        noise=noise or plan.noise,
        runs=runs,
        rows=tuple(t.row() for t in tallies),
        doubts=Doubts(d for m in methods for d in _counted(m, tallies, runs * len(plans))),
        inputs=inputs_of(scenario),
        seed=seed,
    )


@dataclass
class _Tally:
    """What a method's reconstructions of many flights gave."""

    method: str
    rise_s: float | None
    samples: list[dict] = field(default_factory=list)
    failed: int = 0
    doubts: list[Doubt] = field(default_factory=list)  # those of one flight that differ only in numbers once

    def add(self, flight: Flight, craft: Craft, axis: str) -> None:
        method, variant = split_method(self.method)
        try:
            result = torque(flight.telemetry, craft, method=method, variant=variant, axis=axis)
            self.samples.append(_judge(result, flight, axis))
            self.doubts += [d for d, _ in grouped(result.doubts)]
        except BadInput:
            self.failed += 1

    def row(self) -> BudgetRow:
        peaks = np.array([s["peaks"] for s in self.samples]) if self.samples else np.empty((0, 0))
        doubts = Doubts(d for d, _ in grouped(self.doubts))
        return BudgetRow(
            self.method, self._figure("rms"), self._figure("lag"), self._figure("peak_lag"), self._maybe("in68"),
            self._maybe("in95"), self._maybe("corner"), self._maybe("peak95"), tuple(Figure.of(c) for c in peaks.T),
            self.failed, doubts, self.rise_s,
        )  # fmt: skip

    def _figure(self, key: str) -> Figure:
        return Figure.of([s[key] for s in self.samples])

    def _maybe(self, key: str) -> Figure | None:
        return self._figure(key) if self.samples and key in self.samples[0] else None


def _tallied(plan: Scenario, craft: Craft, tallies: list[_Tally], seeds, noise, tick) -> list[_Tally]:
    """Flights of a scenario added to every method's tally."""
    for seed in seeds:
        flight = fly(plan, craft=craft, seed=seed, noise=noise)
        axis = _axis(flight)
        for tally in tallies:
            tally.add(flight, craft, axis)
            tick()
    return tallies


def _counted(method: str, tallies: list[_Tally], runs: int) -> list[Doubt]:
    """Doubts of a method's results with how many flights had them, the most frequent first."""
    found = grouped(d for t in tallies if t.method == method for d in t.doubts)
    return [
        _IN_FLIGHTS[d.severity](
            method=method,
            sentence=str(d),
            kind=d.kind.id,
            advice=d.remedy,
            flights=flights,
            runs=runs,
            numbers="; numbers of the first" if d.numbers and flights > 1 else "",
        )
        for d, flights in sorted(found, key=lambda pair: -pair[1])
    ]


def _axis(flight: Flight) -> str:
    size = np.max(np.abs(flight.truth.torque_Nm), axis=0)
    if not np.any(size > 0):
        raise BadInput(
            f"{flight.scenario.name} has no torque to reconstruct",
            remedy="Name a scenario with one, such as profile-1.",
        )
    return AXES[int(np.argmax(size))]


def _judge(result: TorqueResult, flight: Flight, axis: str) -> dict:
    j = AXES.index(axis)
    time_s, torque = flight.truth.time_s, flight.truth.torque_Nm[:, j]
    peaks = [(t, v) for t, v, a in flight.truth.peaks if a == axis]
    errors = against_truth(result, time_s, torque, peaks, axis)
    sample = {
        "rms": errors.rms_Nm,
        "lag": errors.lag_s,
        "peak_lag": errors.peak_lag_s,
        "peaks": errors.peak_error_percent,
    }
    if result.torque_sigma_Nm is not None:
        true = np.interp(result.time_s, time_s, torque)
        inside = {share: _inside(result, j, true, share) for share in (0.68, 0.95)}
        sample |= {"in68": np.mean(inside[0.68]), "in95": np.mean(inside[0.95])}
        if peaks:
            near = np.min(np.abs(result.time_s[:, None] - [t for t, _ in peaks]), axis=1) <= _CORNER_S
            sample["corner"] = np.mean(inside[0.95][near])
        if peaks and result.paths_Nm is not None:
            sample["peak95"] = np.mean([result.peak(t, PEAK_REACH_S, axis).holds(v) for t, v in peaks])
    return sample


def _inside(result: TorqueResult, axis: int, true: np.ndarray, share: float) -> np.ndarray:
    """Where the truth lies in the band of that share; a method without a posterior has one of so many sigma."""
    bounds = result.band(share)
    if bounds is not None:
        low, high = (b[:, axis] for b in bounds)
        return (low <= true) & (true <= high)
    sigma = np.full_like(result.torque_Nm, np.nan) if result.torque_sigma_Nm is None else result.torque_sigma_Nm
    return np.abs(result.torque_Nm[:, axis] - true) < _SIGMAS[share] * sigma[:, axis]


def of_rise(scenario: str | Path | Scenario, rise_s: float) -> Scenario:
    """The scenario with its triangles' rise changed, the record long enough for all of them.

    Raises BadInput for a scenario without triangles, and for a rise that is none."""
    if not 0 < rise_s < 1e4:
        raise BadInput(f"a rise of {rise_s:g} s is not possible", remedy='Give positive seconds, as in "5,15,30".')
    plan = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    torques = [dict(t) for t in plan.as_written.get("torques", [])]
    pulses = [t for t in torques if t.get("shape") == "triangles"]
    if not pulses:
        raise BadInput(f"{plan.name} has no triangular torque to widen", remedy="Name profile-1 or profile-2.")
    for t in pulses:
        t["rise"] = f"{rise_s} s"
    last = max(60 + 2 * rise_s * int(t.get("count", 1)) for t in pulses)
    return plan.changed(torques=torques, duration=f"{max(480.0, np.ceil(last / 60 + 1) * 60)} s")
