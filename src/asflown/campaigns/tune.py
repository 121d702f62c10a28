"""The papers' search for a smoothing span (000 section VI-A), taken apart.

The span was tuned on injected torques until the peaks of T_Hrwa came out right.  What it balances
shows when the same pipeline is run with the body's momentum put back: that smoothing alone takes off
what leaving I w out has put on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..estimate.subject import Subject, splined, subject_of
from ..estimate.torque import smoothed_as_printed, splined_momentum
from ..kit.errors import BadInput
from ..sim.flight import Flight, fly
from ..telemetry.channels import AXES
from .budget import of_rise

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..craft.model import Craft
    from ..sim.scenario import Scenario

#: Shares of the record that the search tries.
SPANS = (0.02, 0.04, 0.06, 0.07, 0.08, 0.09, 0.10, 0.12)
#: What the papers settled on: the least error "without overly damping" the excursions (000 section VI-A).
PAPERS_SPAN = 0.08
#: Rises of the injected triangles: the papers' two. [s]
RISES = (30.0, 15.0)


@dataclass(frozen=True)
class SpanRow:
    """One span over all profiles: mean errors at the peaks in percent, with sign."""

    span: float
    samples: tuple[int, ...]  # per profile: a record of longer triangles has more
    worst_percent: float  # largest mean error of a profile, what the search makes small
    peak_error_percent: tuple[float, ...]  # per profile: wheels alone, the paper's way
    smoothing_percent: tuple[float, ...]  # per profile: with I w put back, so smoothing alone
    rms_Nm: tuple[float, ...]

    def record(self) -> dict:
        return {
            "span": self.span, "samples": list(self.samples), "worst_percent": self.worst_percent,
            "peak_error_percent": list(self.peak_error_percent), "smoothing_percent": list(self.smoothing_percent),
            "rms_Nm": list(self.rms_Nm),
        }  # fmt: skip


def tune(
    craft: Craft,
    *,
    rises: Sequence[float] = RISES,
    spans: Sequence[float] = SPANS,
    runs: int = 4,
    noise: str = "none",
    scenario: str | Scenario = "profile-1",
    tick: Callable[[], None] = lambda: None,
) -> list[SpanRow]:
    """Fly triangles of every rise, reconstruct as printed with every span.

    Without noise one flight a profile says all.  Raises BadInput for spans outside 0 to 0.5."""
    if not spans or not all(0 < s < 0.5 for s in spans):
        raise BadInput("a span must lie between 0 and 0.5 of the record", remedy='Write them as in "0.04,0.08,0.12".')
    errors = np.empty((len(spans), len(rises), 3))  # as printed, smoothing alone, rms
    samples = np.zeros((len(spans), len(rises)), int)
    for j, rise in enumerate(rises):
        plan = of_rise(scenario, rise)
        found = np.zeros((len(spans), 3))
        count = 1 if noise == "none" else runs
        for seed in range(count):
            flight = fly(plan, craft=craft, seed=seed, noise=noise)
            subject = subject_of(flight.telemetry, craft)
            found += [_with_span(subject, flight, share) for share in spans]
            tick()
        errors[:, j] = found / count
        grid, _ = splined_momentum(subject)
        samples[:, j] = [smoothed_as_printed(np.zeros((grid.count, 1)), s)[1] for s in spans]
    return [
        SpanRow(
            s,
            tuple(n.tolist()),
            float(np.max(np.abs(e[:, 0]))),
            tuple(e[:, 0].tolist()),
            tuple(e[:, 1].tolist()),
            tuple(e[:, 2].tolist()),
        )
        for s, n, e in zip(spans, samples, errors, strict=True)
    ]


def best_of(rows: Sequence[SpanRow]) -> SpanRow:
    """What the papers' search settles on: the least of the largest mean errors."""
    return min(rows, key=lambda r: r.worst_percent)


def remarks(rows: Sequence[SpanRow]) -> list[str]:
    """What the search says, and what it does not."""
    found = [
        "the best span is the one at which smoothing takes off what leaving I w out puts on: it holds for these widths and "
        "this record length only"
    ]
    best = best_of(rows)
    papers = next((r for r in rows if abs(r.span - PAPERS_SPAN) < 1e-9), None)
    if papers is not None and best is not papers:
        found.append(
            f"the papers settled on 8 %, not on {100 * best.span:g} %, where the error at the peaks is least: they wanted it small without damping the "
            f"excursions, and smoothing alone takes {_listed(papers.smoothing_percent)} % off the peaks at 8 % and {_listed(best.smoothing_percent)} % at {100 * best.span:g} %. "
            "Where to stop between the two is their judgement, which no figure here makes"
        )
    return found


def _listed(percents: Sequence[float]) -> str:
    return " and ".join(f"{-p:.0f}" for p in percents)


def _with_span(subject: Subject, flight: Flight, share: float) -> tuple[float, float, float]:
    grid, wheels = splined_momentum(subject)
    rates = np.stack([splined(subject.telemetry.channel(f"body_rate_{a}"), grid) for a in AXES], axis=1)
    axis = AXES.index(flight.truth.peaks[0][2])
    t = grid.from_epoch(subject.telemetry)[:-1]
    out = []
    for momentum in (wheels, wheels + rates @ subject.known_inertia()):
        torque = np.diff(smoothed_as_printed(momentum[:, [axis]], share)[0][:, 0])
        out.append(float(np.mean([100 * (_height(t, torque, tp, v) / v - 1) for tp, v, _ in flight.truth.peaks])))
        if len(out) == 1:
            true = np.interp(t, flight.truth.time_s, flight.truth.torque_Nm[:, axis])
            rms = float(np.sqrt(np.mean((torque - true) ** 2)))
    return out[0], out[1], rms


def _height(t, torque, time_s: float, size: float) -> float:
    near = np.abs(t - time_s) <= 12.0
    return float(np.sign(size) * np.max(np.sign(size) * torque[near]))
