"""Degradation: each new burn against the model before it (002, detecting degradation).

A burn is judged by what the burns before it foretell: its error's predictive distribution, tracking and what the model is
uncertain by included.  Three alarms, together wrong in ``false_alarm`` of all watches: one burn far out, a cumulated sum
of burns that all fall to one side, and (of pointing) one burn far out.  Burns that raised the alarm do not enter the model
that judges the next ones.  Beside them stand the papers' three criteria, which have no such rate."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy import optimize, stats

from ...kit.errors import BadInput
from ...maneuvers.model import Gates
from .fit import problems
from .foreseen import Foreseen, foresee, foresee_by
from .power import detectable
from .shift import Shift, find_shift

if TYPE_CHECKING:
    from ...maneuvers.history import PastModel
    from ...maneuvers.table import Maneuvers

#: Burns before the first that is watched, unless a model is given.
FEWEST_BEFORE = 15
#: The papers' rule: an error beyond two sigma of the model before it.
_SIGMAS = 2.0
#: The model changes significantly: a parameter moves by more of its sigmas than this.
_CHANGED = 1.0
#: Of the cumulated sum: half the mean shift, in sigmas, that it is quickest to see.
_REFERENCE = 0.5


@dataclass(frozen=True)
class Watched:
    """One burn against the model before it.  ``z``, ``p`` of the magnitude; ``pointing_p`` None where pointing is not known.

    ``low``, ``high``: cumulated sums towards underburn and overburn after this burn.  ``detectable_mps``: underburn of a burn
    of this size that alone would have raised the alarm in 8 of 10 cases.  ``change``: by how many of its sigmas the model's
    most moved parameter changes when the burn is taken in."""

    id: str
    dv_mps: float
    error_mps: float
    z: float
    p: float
    pointing_p: float | None
    low: float
    high: float
    detectable_mps: float
    change: float
    changed: str
    alarms: tuple[str, ...]
    follows: bool = False  # a later burn is an outlier too and changes the model: the papers' third criterion
    foreseen: Foreseen = field(repr=False, default=None)  # type: ignore[assignment]
    model: Gates = field(repr=False, default=None)  # type: ignore[assignment]  # before this burn

    @property
    def outlier(self) -> bool:
        return abs(self.z) > _SIGMAS

    @property
    def criteria(self) -> tuple[bool, bool, bool]:
        """The papers' three: outlier of the model before it; the model changes; following ones do likewise."""
        first, second = self.outlier, self.outlier and self.change > _CHANGED
        return first, second, second and self.follows

    def record(self) -> dict:
        return {
            "id": self.id, "dv_mps": self.dv_mps, "magnitude_error_mps": self.error_mps, "z": self.z, "p": self.p,
            "pointing_p": self.pointing_p, "outlier_2_sigma": self.criteria[0], "model_changes": self.criteria[1],
            "followed_by_more": self.criteria[2], "largest_change_in_sigmas": self.change, "changed": self.changed,
            "cusum_low": self.low, "cusum_high": self.high, "detectable_underburn_mps": self.detectable_mps,
            "detectable_underburn": self.detectable_mps / self.dv_mps, "alarms": list(self.alarms),
        }  # fmt: skip


@dataclass(frozen=True)
class Watch:
    """A sequence of burns watched; ``limit_p`` of one burn's magnitude or pointing, ``limit_sum`` of the cumulated sums."""

    engine: str | None
    before: int
    burns: tuple[Watched, ...]
    false_alarm: float
    limit_p: float
    limit_sum: float
    shift: Shift | None
    against: str | None
    doubts: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """alarm, watch (an outlier, or the papers' criteria met) or pass."""
        if any(b.alarms for b in self.burns):
            return "alarm"
        return "watch" if any(b.criteria[1] for b in self.burns) else "pass"

    @property
    def first_alarm(self) -> str | None:
        return next((b.id for b in self.burns if b.alarms), None)

    def record(self) -> dict:
        return {
            "engine": self.engine, "verdict": self.verdict, "first_alarm": self.first_alarm, "burns_before": self.before,
            "against": self.against, "false_alarm": self.false_alarm, "limit_p": self.limit_p, "limit_cusum": self.limit_sum,
            "burns": [b.record() for b in self.burns], "shift": None if self.shift is None else self.shift.record(), "doubts": list(self.doubts),
        }  # fmt: skip

    def __str__(self) -> str:
        lines = [
            f"{self.verdict.upper()}: {self.engine or 'engine not named'}, {len(self.burns)} burns watched after {self.before}"
            + (f", by {self.against}" if self.against else "")
            + (f", first alarm {self.first_alarm}" if self.first_alarm else ""),
            f"  {'':16s} {'dV m/s':>8s} {'error mm/s':>10s} {'z':>6s} {'p':>8s} {'sums':>11s}  {'seen if short by':>16s}  papers' criteria",
        ]
        for b in self.burns:
            met = " ".join(w for w, said in zip(("outlier", "changes", "followed"), b.criteria, strict=True) if said)
            lines.append(
                f"  {b.id:16s} {b.dv_mps:8.3g} {1e3 * b.error_mps:10.2f} {b.z:6.1f} {b.p:8.2g} {b.low:5.1f} {b.high:5.1f}  {1e3 * b.detectable_mps:7.2f} mm/s "
                f"{100 * b.detectable_mps / b.dv_mps:4.1f} %  {met}"
                + (f"  ALARM ({', '.join(b.alarms)})" if b.alarms else "")
            )
        if self.shift is not None:
            lines.append(f"  {self.shift}")
        return "\n".join(line.rstrip() for line in lines)


def watch_maneuvers(
    m: Maneuvers, *, first: str | None = None, against: PastModel | None = None, false_alarm: float = 0.05
) -> Watch:
    """Watch the burns from ``first`` on (after the fifteenth, or all where ``against`` gives a model to judge by).

    ``against``: read about the biases it left.  ``false_alarm``: share of watches as long that raise a false alarm.
    Raises BadInput where too few burns come before the first one watched."""
    if not 0 < false_alarm < 1:
        raise BadInput(
            f"a false-alarm rate of {false_alarm:g} is none", remedy="Give a share between 0 and 1, as in 0.05."
        )
    start = m.place(first) if first is not None else 0 if against is not None else FEWEST_BEFORE
    if against is None and (start < FEWEST_BEFORE or start >= len(m)):
        raise BadInput(
            f"{min(start, len(m))} burns come before the first to be watched; a model takes {FEWEST_BEFORE}, and one burn to judge by it",
            file=m.source or None, remedy="Watch from a later burn on (--from), or judge by a model (--against).",
        )  # fmt: skip
    count = len(m) - start
    pointed = m.pointing_error_mps is not None
    share = false_alarm / (3 if pointed else 2)
    limit_p = -np.expm1(np.log1p(-share) / count)
    limit_sum = cusum_limit(count, share / 2)  # a sum on each side
    kept = np.ones(len(m), bool)
    low = high = 0.0
    burns: list[Watched] = []
    for k in range(start, len(m)):
        rows = np.flatnonzero(kept[:k])
        told, across, change, model = _foretold(m, rows, k, against)
        error = m.magnitude_error_mps[k]
        score, p = told.score(error), told.p_value(error)
        low, high = max(0.0, low - score - _REFERENCE), max(0.0, high + score - _REFERENCE)
        pointing_p = None if across is None else across.p_value(m.across[0][k])
        alarms = [w for w, said in (
            ("one burn", p < limit_p), ("cumulated sum", max(low, high) > limit_sum),
            ("pointing", pointing_p is not None and pointing_p < limit_p),
        ) if said]  # fmt: skip
        burns.append(Watched(
            m.id[k], float(m.dv_mps[k]), float(error), told.z(error), p, pointing_p, low, high, detectable(told, limit_p), change[0], change[1],
            tuple(alarms),
            foreseen=told, model=model,
        ))  # fmt: skip
        if alarms:
            low = high = 0.0
            kept[k] = False
    burns = _followed(burns)
    shift = find_shift(
        [b.id for b in burns], m.dv_mps[start:], m.magnitude_error_mps[start:], [b.foreseen for b in burns]
    )
    name = None if against is None else against.model.name
    engine = m.engine[0] if m.engines != [""] else None
    return Watch(
        engine, start, tuple(burns), false_alarm, float(limit_p), limit_sum, shift, name, tuple(_doubts(m, burns, against))
    )  # fmt: skip


def _foretold(m: Maneuvers, rows, k: int, against: PastModel | None):
    """What is foreseen of burn k in magnitude and pointing, what taking it in changes (sigmas, which parameter), and the model."""
    od, across_od = m.sigma_magnitude_mps[k] ** 2, None if m.pointing_covariance is None else m.pointing_covariance[k]
    v = float(m.dv_mps[k])
    if against is not None:
        across = None if across_od is None else foresee_by(against.left, v, across_od)
        return foresee_by(against.left, v, od), across, (0.0, ""), against.left
    prior = problems(m.take(rows))
    points = {name: p.minimum() for name, p in prior.items()}
    told = foresee(prior["magnitude"], points["magnitude"], v, od)
    across = foresee(prior["pointing"], points["pointing"], v, across_od) if "pointing" in prior else None
    before, after = points["magnitude"], problems(m.take([*rows, k]))["magnitude"].minimum()
    spread = _sigmas(prior["magnitude"], before)
    moved = (
        np.abs([after.fixed - before.fixed, after.proportional - before.proportional, *(after.beta - before.beta)])
        / spread
    )
    names = ("fixed sigma", "proportional sigma", "fixed bias", "proportional bias")
    most = int(np.argmax(moved))
    model = Gates(before.fixed, before.proportional, np.nan, np.nan, *before.beta, name=f"{len(rows)} burns before")
    return told, across, (float(moved[most]), names[most]), model


def _sigmas(problem, point) -> np.ndarray:
    """One sigma of fixed, proportional and biases, from the information; of a sigma by its variance's, at least half of it."""
    variances = np.square([point.fixed, point.proportional] / problem.units)
    spread = np.sqrt(np.diag(np.linalg.pinv(point.information, hermitian=True)))
    # near zero a sigma is uncertain by the root of its variance's spread
    sigmas = spread / (2 * np.maximum(np.sqrt(variances), 0.5 * np.sqrt(spread))) * problem.units
    return np.concatenate([sigmas, np.sqrt(np.diag(problem.bias_covariance(point)))])


def _followed(burns: list[Watched]) -> list[Watched]:
    later, out = False, []
    for b in reversed(burns):
        out.append(replace(b, follows=later))
        later = later or b.criteria[1]
    return out[::-1]


@cache
def cusum_limit(steps: int, share: float) -> float:
    """The height that a cumulated sum of standard normal scores passes within ``steps`` in this share of cases.

    A Markov chain over the sum's values (Brook and Evans 1972), a passed limit keeping what passes it."""

    def passed(limit: float) -> float:
        n = 120
        width = limit / (n - 0.5)
        centre = width * np.arange(n)  # the first state is zero, half as wide
        edge = np.concatenate([[-np.inf], centre[:-1] + width / 2, [limit]])
        moves = np.diff(stats.norm.cdf(edge[None, :] - centre[:, None] + _REFERENCE), axis=1)
        chance = np.zeros(n)
        chance[0] = 1.0
        for _ in range(steps):
            chance = chance @ moves
        return 1 - float(chance.sum())

    return float(optimize.brentq(lambda h: passed(h) - share, 0.3, 30.0, xtol=1e-4))


def _doubts(m: Maneuvers, burns: list[Watched], against: PastModel | None):
    yield from m.doubts
    blind = [b.id for b in burns if b.detectable_mps > 0.1 * b.dv_mps]
    if blind:
        some = ", ".join(blind[:6]) + (f" and {len(blind) - 6} more" if len(blind) > 6 else "")
        yield f"too small to show an underburn of a tenth: {some}"
    if against is not None:
        yield f"judged by {against.model.name}, about the biases it left: as good as that model is for these burns"
    if m.tai_ns is None:
        yield "without times the burns are taken in the file's order"
