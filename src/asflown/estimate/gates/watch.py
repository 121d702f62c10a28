"""Degradation: each new burn against the model before it (Wagner 2014, detecting degradation).

A burn is judged by what the burns before it foretell: its error's predictive distribution, tracking and what the model is
uncertain by included.  Three alarms, together wrong in ``false_alarm`` of all watches: one burn far out, a cumulated sum
of burns that all fall to one side, and (of pointing) one burn far out.  Burns that raised the alarm do not enter the model
that judges the next ones.  Beside them stand the paper's three criteria, which have no such rate."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
import scipy

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.result import Estimate, recorded
from ...kit.schema import Annotated, Doc, Number, TypedDict
from ...kit.table import Table
from ...maneuvers.model import Gates, Quantity
from .foreseen import Foreseen, foresee, foresee_by
from .likelihoods import problems
from .power import detectable
from .shift import Shift, ShiftRecord, find_shift

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...maneuvers.history import PastModel
    from ...maneuvers.table import Maneuvers

MAGNITUDE, POINTING = Quantity.MAGNITUDE, Quantity.POINTING
#: Burns before the first that is watched, unless a model is given.
FEWEST_BEFORE = 15
#: The paper's rule: an error beyond two sigma of the model before it.
_SIGMAS = 2.0
#: The model changes significantly: a parameter moves by more of its sigmas than this.
_CHANGED = 1.0
#: Of the cumulated sum: half the mean shift, in sigmas, that it is quickest to see.
_REFERENCE = 0.5
#: Share of the dV by which an underburn should show.
_SHOULD_SHOW = 0.1

TOO_SMALL = Kind(
    "gates.too-small-to-show", Severity.CAUTION, "too small for an underburn of {percent:g} % to raise the alarm: {burns}",
)  # fmt: skip
JUDGED_BY_MODEL = Kind(
    "gates.judged-by-model", Severity.NOTE,
    "the burns are judged by {model}, about the biases that it left: the false-alarm rate holds if that model does",
)  # fmt: skip
NO_TIMES = Kind(
    "gates.no-times", Severity.NOTE, "the table has no times: the burns are taken in its order", "Add the column time [utc].",
)  # fmt: skip


class Alarm(StrEnum):
    """What raised it."""

    ONE_BURN = "one burn"
    CUSUM = "cumulated sum"
    POINTING = "pointing"


class WatchedRecord(TypedDict):
    id: str
    dv_mps: Number
    magnitude_error_mps: Number
    z: Annotated[Number, Doc("of the magnitude, by the model before the burn")]
    p: Number
    pointing_p: Number
    outlier_2_sigma: Annotated[bool, Doc("the paper's first criterion")]
    model_changes: Annotated[bool, Doc("the second")]
    followed_by_more: Annotated[bool, Doc("the third")]
    largest_change_in_sigmas: Number
    changed: Annotated[str, Doc("the model's most moved parameter")]
    cusum_low: Annotated[Number, Doc("towards underburns")]
    cusum_high: Annotated[Number, Doc("towards overburns")]
    detectable_underburn_mps: Annotated[Number, Doc("raises the alarm by itself in 8 of 10 cases")]
    detectable_underburn: Annotated[Number, Doc("the same, as a share of the dV")]
    alarms: Annotated[list[str], Doc("one burn, cumulated sum, pointing")]


class GatesWatchRecord(TypedDict):
    """JSON of `asflown gates watch`."""

    engine: str | None
    verdict: Annotated[str, Doc("alarm, watch or pass")]
    first_alarm: str | None
    burns_before: int
    against: Annotated[str | None, Doc("model to judge by; null: the burns before")]
    false_alarm: Annotated[Number, Doc("share of watches as long that raise a false alarm")]
    limit_p: Annotated[Number, Doc("of one burn")]
    limit_cusum: Number
    burns: list[WatchedRecord]
    shift: Annotated[ShiftRecord | None, Doc("the likeliest change point; null with fewer than three burns")]


@dataclass(frozen=True)
class Watched:
    """One burn against the model before it.  ``z``, ``p`` of the magnitude; ``pointing_p`` None where pointing is not known.

    ``cusum_low``, ``cusum_high``: cumulated sums towards underburn and overburn after this burn.  ``detectable_mps``: underburn
    of a burn of this size that alone would have raised the alarm in 8 of 10 cases.  ``change``: by how many of its sigmas the
    model's most moved parameter changes when the burn is taken in.  ``model``: the one before this burn."""

    id: str
    dv_mps: float
    error_mps: float
    z: float
    p: float
    pointing_p: float | None
    cusum_low: float
    cusum_high: float
    detectable_mps: float
    change: float
    changed: str
    alarms: tuple[Alarm, ...]
    foreseen: Foreseen = field(repr=False)
    model: Gates = field(repr=False)
    follows: bool = False  # a later burn is an outlier too and changes the model: the paper's third criterion

    @property
    def outlier(self) -> bool:
        return abs(self.z) > _SIGMAS

    @property
    def stands_out(self) -> bool:
        return self.outlier or bool(self.alarms)

    @property
    def criteria(self) -> tuple[bool, bool, bool]:
        """The paper's three: outlier of the model before it; the model changes; following ones do likewise."""
        first, second = self.outlier, self.outlier and self.change > _CHANGED
        return first, second, second and self.follows

    def record(self) -> dict:
        return {
            "id": self.id, "dv_mps": self.dv_mps, "magnitude_error_mps": self.error_mps, "z": self.z, "p": self.p,
            "pointing_p": self.pointing_p, "outlier_2_sigma": self.criteria[0], "model_changes": self.criteria[1],
            "followed_by_more": self.criteria[2], "largest_change_in_sigmas": self.change, "changed": self.changed,
            "cusum_low": self.cusum_low, "cusum_high": self.cusum_high, "detectable_underburn_mps": self.detectable_mps,
            "detectable_underburn": self.detectable_mps / self.dv_mps, "alarms": list(self.alarms),
        }  # fmt: skip

    def row(self) -> tuple[str, ...]:
        met = " ".join(w for w, said in zip(("outlier", "changes", "followed"), self.criteria, strict=True) if said)
        seen = f"{1e3 * self.detectable_mps:.2f} mm/s {100 * self.detectable_mps / self.dv_mps:4.1f} %"
        return (
            self.id, f"{self.dv_mps:.3g}", f"{1e3 * self.error_mps:.2f}", f"{self.z:.1f}", f"{self.p:.2g}", f"{self.cusum_low:.1f}",
            f"{self.cusum_high:.1f}", seen, met, f"ALARM ({', '.join(self.alarms)})" if self.alarms else "",
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, repr=False)
class GatesWatchResult(Estimate):
    """A sequence of burns watched; ``limit_p`` of one burn's magnitude or pointing, ``limit_cusum`` of the cumulated sums.

    ``before``: how many burns come before the first that is watched; ``against``: the model to judge by, None for the burns
    before; ``shift``: the likeliest change point, None with fewer than three burns."""

    RECORD: ClassVar[type] = GatesWatchRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {"shift.ci95": "shift.share_ci95"}  # which the shift sets itself

    engine: str | None
    maneuvers: Maneuvers
    before: int
    burns: tuple[Watched, ...]
    false_alarm: float
    limit_p: float
    limit_cusum: float
    shift: Shift | None
    against: str | None

    @property
    def verdict(self) -> str:
        """alarm, watch (an outlier that changes the model, as the paper's criteria say) or pass."""
        if any(b.alarms for b in self.burns):
            return "alarm"
        return "watch" if any(b.criteria[1] for b in self.burns) else "pass"

    @property
    def first_alarm(self) -> str | None:
        return next((b.id for b in self.burns if b.alarms), None)

    def _record(self) -> dict:
        return {
            "engine": self.engine, "verdict": self.verdict, "first_alarm": self.first_alarm, "burns_before": self.before,
            "against": self.against, "false_alarm": self.false_alarm, "limit_p": self.limit_p, "limit_cusum": self.limit_cusum,
            "burns": [b.record() for b in self.burns], "shift": None if self.shift is None else self.shift.record(),
        }  # fmt: skip

    def _tables(self) -> tuple[Table, ...]:
        title = f"{self.verdict.upper()}: {self.maneuvers.engine_label}, {len(self.burns)} burns watched after {self.before}"
        title += f", by {self.against}" if self.against else ""
        title += f", first alarm {self.first_alarm}" if self.first_alarm else ""
        head = (
            "burn",
            "dV [m/s]",
            "error [mm/s]",
            "z",
            "p",
            "sum low",
            "sum high",
            "seen if short by",
            "paper's criteria",
        )
        return (Table(title, tuple(b.row() for b in self.burns), head, (str(self.shift),) if self.shift else ()),)


class _Limits(NamedTuple):
    p: float  # of one burn's magnitude or pointing
    cusum: float


@recorded
def gates_watch(
    maneuvers: Maneuvers, *, first: str | None = None, against: PastModel | None = None, false_alarm: float = 0.05
) -> GatesWatchResult:
    """Watch each new burn of an engine for degradation.

    Parameters
    ----------
    maneuvers : Maneuvers
        Burns of one engine, in order.
    first : str, optional
        Id of the first burn to be watched; the sixteenth unless given, or the first where ``against`` is.
    against : PastModel, optional
        A model to judge by, about the biases that it left, in place of the burns before.
    false_alarm : float
        Share of watches as long that raise a false alarm.

    Returns
    -------
    GatesWatchResult

    Raises
    ------
    BadInput
        Where fewer than 15 burns come before the first one watched, or the rate is none.
    """
    m = maneuvers
    if not 0 < false_alarm < 1:
        raise BadInput(
            f"the false-alarm rate {false_alarm:g} does not lie between 0 and 1", remedy="Give a share, as in 0.05."
        )
    start = _start(m, first, against)
    share = false_alarm / (2 if m.pointing_error_mps is None else 3)
    limits = _Limits(float(-np.expm1(np.log1p(-share) / (len(m) - start))), cusum_limit(len(m) - start, share / 2))
    burns = _followed(_watched(m, start, against, limits))
    errors = m.magnitude_error_mps[start:]
    return GatesWatchResult(
        method="burns before" if against is None else "model",
        engine=m.engine_name,
        maneuvers=m,
        before=start,
        burns=tuple(burns),
        false_alarm=false_alarm,
        limit_p=limits.p,
        limit_cusum=limits.cusum,
        shift=find_shift([b.id for b in burns], m.dv_mps[start:], errors, [b.foreseen for b in burns]),
        against=None if against is None else against.model.name,
        doubts=Doubts(_doubts(m, burns, against)),
    )


def _start(m: Maneuvers, first: str | None, against: PastModel | None) -> int:
    """The first burn to be watched."""
    start = m.place(first) if first is not None else 0 if against is not None else FEWEST_BEFORE
    if against is None and (start < FEWEST_BEFORE or start >= len(m)):
        raise BadInput(
            f"{min(start, len(m))} burns come before the first to be watched; a model takes {FEWEST_BEFORE}, and one burn to judge by it",
            file=m.source or None, remedy="Watch from a later burn on (--from), or judge by a model (--against).",
        )  # fmt: skip
    return start


def _watched(m: Maneuvers, start: int, against: PastModel | None, limits: _Limits) -> list[Watched]:
    """Every burn from ``start`` on; those that raise the alarm do not enter the next ones' model, and the sums begin anew."""
    kept = np.ones(len(m), bool)
    low = high = 0.0
    burns = []
    for k in range(start, len(m)):
        told, across, (change, changed), model = _foretold(m, np.flatnonzero(kept[:k]), k, against)
        error = float(m.magnitude_error_mps[k])
        score, p = told.score(error), told.p_value(error)
        low, high = max(0.0, low - score - _REFERENCE), max(0.0, high + score - _REFERENCE)
        pointing_p = None if across is None else across.p_value(m.across[0][k])
        alarms = tuple(a for a, raised in (
            (Alarm.ONE_BURN, p < limits.p), (Alarm.CUSUM, max(low, high) > limits.cusum),
            (Alarm.POINTING, pointing_p is not None and pointing_p < limits.p),
        ) if raised)  # fmt: skip
        burns.append(Watched(
            m.id[k], float(m.dv_mps[k]), error, told.z(error), p, pointing_p, low, high, detectable(told, limits.p), change, changed,
            alarms, told, model,
        ))  # fmt: skip
        if alarms:
            low = high = 0.0
            kept[k] = False
    return burns


def _foretold(m: Maneuvers, rows, k: int, against: PastModel | None):
    """What is foreseen of burn k in magnitude and pointing, what taking it in changes (sigmas, which parameter), and the model."""
    od, across_od = m.sigma_magnitude_mps[k] ** 2, None if m.pointing_covariance is None else m.pointing_covariance[k]
    v = float(m.dv_mps[k])
    if against is not None:
        across = None if across_od is None else foresee_by(against.left, v, across_od)
        return foresee_by(against.left, v, od), across, (0.0, ""), against.left
    prior = problems(m.take(rows))
    points = {quantity: p.minimum() for quantity, p in prior.items()}
    before, after = points[MAGNITUDE], problems(m.take([*rows, k]))[MAGNITUDE].minimum()
    told = foresee(prior[MAGNITUDE], before, v, od)
    across = foresee(prior[POINTING], points[POINTING], v, across_od) if POINTING in prior else None
    moved = np.abs(after.values - before.values) / _sigmas(prior[MAGNITUDE], before)
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
        moves = np.diff(scipy.stats.norm.cdf(edge[None, :] - centre[:, None] + _REFERENCE), axis=1)
        chance = np.zeros(n)
        chance[0] = 1.0
        for _ in range(steps):
            chance = chance @ moves
        return 1 - float(chance.sum())

    return float(scipy.optimize.brentq(lambda h: passed(h) - share, 0.3, 30.0, xtol=1e-4))


def _doubts(m: Maneuvers, burns: list[Watched], against: PastModel | None) -> Iterator[Doubt]:
    yield from m.doubts.passed_on_by("maneuvers")
    blind = [b.id for b in burns if b.detectable_mps > _SHOULD_SHOW * b.dv_mps]
    if blind:
        yield TOO_SMALL(percent=100 * _SHOULD_SHOW, burns=blind)
    if against is not None:
        yield from against.doubts.passed_on_by("model")
        yield JUDGED_BY_MODEL(model=against.model.name)
    if m.tai_ns is None:
        yield NO_TIMES()
