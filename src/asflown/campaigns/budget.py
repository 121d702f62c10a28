"""The error budget: fly a scenario with many seeds, reconstruct the torque, set it against the truth.

000 section VI did this with two profiles, one flight each and one method.  Here every figure comes with
the Monte-Carlo error that the number of flights leaves it.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..estimate.fused import PEAK_REACH_S
from ..estimate.torque import METHODS, VARIANTS, TorqueResult, disturbance_torque
from ..kit.errors import BadInput, some_of
from ..sim.flight import fly
from ..sim.scenario import Scenario, load_scenario
from ..telemetry.channels import AXES
from .truth import against_truth

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..craft.model import Craft

#: A method by name: its own, corrected, or with "-printed".
DEFAULT_METHODS = ("momentum-printed", "transfer-printed", "momentum", "transfer", "fused")

#: Within this of a true peak counts as at the corner. [s]
_CORNER_S = 2.0
#: A number, not one within a name.
_NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")
_SIGMAS = {0.68: 1.0, 0.95: 1.96}


@dataclass(frozen=True)
class Figure:
    """A mean over flights and its own standard error."""

    value: float
    error: float

    @classmethod
    def of(cls, samples) -> Figure:
        x = np.asarray(samples, float)
        x = x[np.isfinite(x)]
        if not len(x):
            return cls(float("nan"), float("nan"))
        return cls(float(x.mean()), float(x.std(ddof=1) / np.sqrt(len(x))) if len(x) > 1 else float("nan"))


@dataclass(frozen=True)
class BudgetRow:
    """One method over all flights.  Coverages are shares of instants inside the band, and of peak figures inside
    theirs; None without a band."""

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
    doubts: tuple[str, ...]  # each with the number of flights that had it

    def record(self) -> dict:
        row: dict = {"method": self.method, "failed": self.failed}
        for name in ("rms_Nm", "lag_s", "peak_lag_s", "coverage_68", "coverage_95", "corner_coverage_95",
                     "peak_coverage_95"):  # fmt: skip
            f = getattr(self, name)
            row[name], row[f"{name}_mc"] = (None, None) if f is None else (f.value, f.error)
        row["peak_error_percent"] = [f.value for f in self.peak_error_percent]
        row["peak_error_percent_mc"] = [f.error for f in self.peak_error_percent]
        return row


def split_method(name: str) -> tuple[str, str]:
    """'momentum-printed' -> ('momentum', 'printed').  Raises BadInput for a method that is not there."""
    method, _, variant = name.partition("-")
    variant = variant or "corrected"
    if method not in METHODS or variant not in VARIANTS or (method, variant) == ("fused", "printed"):
        raise BadInput(
            f"method {name!r} is not known", remedy=f"Choose of: {some_of(METHODS)}, with -printed for the papers' way."
        )
    return method, variant


def error_budget(
    scenario: str | Scenario,
    craft: Craft,
    methods: Sequence[str] = DEFAULT_METHODS,
    *,
    runs: int = 20,
    seed: int = 0,
    noise: str | None = None,
    tick: Callable[[], None] = lambda: None,
) -> list[BudgetRow]:
    """Seeds ``seed`` to ``seed + runs - 1``; the axis is that of the scenario's torque.

    A flight that a method cannot reconstruct counts in ``failed``.  Raises BadInput for a scenario
    without a torque, an unknown method and fewer than two runs."""
    if runs < 2:
        raise BadInput(
            f"{runs} runs have no spread", remedy="Take at least 2; 20 show the first digit, 200 the second."
        )
    ways = [split_method(m) for m in methods]
    plan = load_scenario(scenario) if isinstance(scenario, str) else scenario
    found: list[list[dict]] = [[] for _ in ways]
    failed = [0] * len(ways)
    doubted: list[Counter[str]] = [Counter() for _ in ways]
    for k in range(runs):
        flight = fly(plan, craft=craft, seed=seed + k, noise=noise)
        axis = _axis(flight)
        for i, (method, variant) in enumerate(ways):
            try:
                result = disturbance_torque(flight.telemetry, craft, method=method, variant=variant, axis=axis)
                found[i].append(_judge(result, flight, axis))
                doubted[i].update(result.doubts)
            except BadInput:
                failed[i] += 1
            tick()
    return [
        _row(name, samples, f, _said(said, runs))
        for name, samples, f, said in zip(methods, found, failed, doubted, strict=True)
    ]


def _said(doubted: Counter[str], runs: int) -> tuple[str, ...]:
    """Doubts of a method's results, the most frequent first; where only numbers differ between flights they are left out."""
    alike: dict[str, list[str]] = {}
    for doubt in doubted:
        alike.setdefault(_NUMBER.sub("…", doubt), []).append(doubt)
    counted = {(same[0] if len(same) == 1 else form): sum(doubted[d] for d in same) for form, same in alike.items()}
    order = sorted(counted, key=lambda d: -counted[d])
    return tuple(f"{d} ({min(counted[d], runs)} of {runs} flights)" for d in order)


def _axis(flight) -> str:
    size = np.max(np.abs(flight.truth.torque_Nm), axis=0)
    if not np.any(size > 0):
        raise BadInput(
            f"{flight.scenario.name} has no torque to reconstruct",
            remedy="Name a scenario with one, such as profile-1.",
        )
    return AXES[int(np.argmax(size))]


def _judge(result: TorqueResult, flight, axis: str) -> dict:
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
    if result.sigma_Nm is not None:
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
    sigma = np.full_like(result.torque_Nm, np.nan) if result.sigma_Nm is None else result.sigma_Nm
    return np.abs(result.torque_Nm[:, axis] - true) < _SIGMAS[share] * sigma[:, axis]


def _row(name: str, samples: list[dict], failed: int, doubts: tuple[str, ...]) -> BudgetRow:
    def figure(key: str) -> Figure:
        return Figure.of([s[key] for s in samples])

    def maybe(key: str) -> Figure | None:
        return figure(key) if samples and key in samples[0] else None

    peaks = np.array([s["peaks"] for s in samples]) if samples else np.empty((0, 0))
    return BudgetRow(
        name, figure("rms"), figure("lag"), figure("peak_lag"), maybe("in68"), maybe("in95"), maybe("corner"), maybe("peak95"),
        tuple(Figure.of(column) for column in peaks.T), failed, doubts,
    )  # fmt: skip


def of_rise(scenario: str | Scenario, rise_s: float) -> Scenario:
    """The scenario with its triangles' rise changed, the record long enough for all of them.

    Raises BadInput for a scenario without triangles, and for a rise that is none."""
    if not 0 < rise_s < 1e4:
        raise BadInput(f"a rise of {rise_s:g} s is not possible", remedy='Give positive seconds, as in "5,15,30".')
    plan = load_scenario(scenario) if isinstance(scenario, str) else scenario
    torques = [dict(t) for t in plan.as_written.get("torques", [])]
    pulses = [t for t in torques if t.get("shape") == "triangles"]
    if not pulses:
        raise BadInput(f"{plan.name} has no triangular torque to widen", remedy="Name profile-1 or profile-2.")
    for t in pulses:
        t["rise"] = f"{rise_s} s"
    last = max(60 + 2 * rise_s * int(t.get("count", 1)) for t in pulses)
    return plan.changed(torques=torques, duration=f"{max(480.0, np.ceil(last / 60 + 1) * 60)} s")
