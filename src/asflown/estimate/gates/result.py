"""A fitted Gates model: what it says, how well it is known, and what to doubt."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...kit import digits
from ...kit.plain import finite
from ...kit.result import Estimate
from ...kit.schema import Annotated, Doc, Interval, Intervals, NotRequired, Number, Numbers, TypedDict
from ...kit.table import Table
from ...maneuvers.model import Gates, Quantity
from .judgement import AgainstRecord, InfluenceRecord, JudgementRecord, OutlierRecord
from .likelihood import LOG_2PI, Point, Problem
from .patch import PatchRecord
from .terms import Law, Term, biases_of, sigmas_of

if TYPE_CHECKING:
    from ...maneuvers.table import Maneuvers
    from .intervals import Ends
    from .judgement import GatesJudgement
    from .patch import GatesPatch


class ScoreRecord(TypedDict):
    model: Annotated[str, Doc("estimated-bias or zero-mean")]
    log_likelihood: Number
    aicc: Annotated[Number, Doc("Akaike's criterion corrected for few burns; null with too few")]


class MagnitudeRecord(TypedDict):
    """Magnitude of a fit.  Values are null with too few burns; an interval from zero is a limit."""

    fixed_mps: Annotated[Number, Doc("sigma")]
    fixed_ci95_mps: Interval | None
    proportional: Annotated[Number, Doc("sigma, as a share of the dV")]
    proportional_ci95: Interval | None
    bias_fixed_mps: Number
    bias_fixed_ci95_mps: Interval | None
    bias_proportional: Number
    bias_proportional_ci95: Interval | None
    ci95: Annotated[dict[str, Any], Doc("kept for this version; see the keys with _ci95")]
    held: Annotated[list[str], Doc("sigmas kept at a given value: fixed, proportional")]
    log_likelihood: Number
    log_likelihood_printed_normaliser: Annotated[Number, Doc("with the paper's normaliser of a pointing density")]
    models: list[ScoreRecord]
    bootstrap: NotRequired[
        Annotated[dict[str, Any], Doc("refits, at_bound_share, and sigma and 95 % interval by term")]
    ]


class PointingRecord(TypedDict):
    """Pointing of a fit, sigmas per axis; lists hold TVC X and Y."""

    fixed_mps: Annotated[Number, Doc("sigma")]
    fixed_ci95_mps: Interval | None
    proportional_rad: Annotated[Number, Doc("sigma, per dV")]
    proportional_ci95_rad: Interval | None
    bias_fixed_mps: Numbers
    bias_fixed_ci95_mps: Intervals | list[None] | None
    bias_proportional_rad: Numbers
    bias_proportional_ci95_rad: Intervals | list[None] | None
    ci95: Annotated[dict[str, Any], Doc("kept for this version; see the keys with _ci95")]
    held: list[str]
    log_likelihood: Number
    log_likelihood_printed_normaliser: Number
    models: list[ScoreRecord]
    bootstrap: NotRequired[dict[str, Any]]


class DownWeightedRecord(TypedDict):
    id: str
    part: Annotated[str, Doc("magnitude or pointing")]
    weight: Annotated[Number, Doc("beside a usual burn's 1")]


class ExcludedRecord(TypedDict):
    id: str
    reason: str


class GatesRecord(TypedDict):
    """JSON of `asflown gates`.  Sigmas are about the biases, but for the model zero-mean."""

    engine: str | None
    count: int
    model: Annotated[str, Doc("estimated-bias, zero-mean or mean-aware")]
    likelihood: Annotated[str, Doc("additive, robust, printed or unweighted")]
    magnitude: MagnitudeRecord
    pointing: PointingRecord
    at_bound: Annotated[list[str], Doc("sigmas that are limits and no estimates, as pointing.fixed")]
    log_likelihood: Number
    down_weighted: list[DownWeightedRecord]
    dv_mps: Annotated[Numbers, Doc("smallest and largest")]
    excluded: list[ExcludedRecord]
    adjusted: Annotated[dict[str, list[str]], Doc("burn -> adjustments of its expected dV")]
    judgement: NotRequired[JudgementRecord]
    outliers: NotRequired[list[OutlierRecord]]
    influence: NotRequired[list[InfluenceRecord]]
    against: NotRequired[AgainstRecord | None]
    patch: NotRequired[PatchRecord | None]


@dataclass(frozen=True)
class ModelScore:
    """Log likelihood of one model, and Akaike's criterion corrected for few burns (None with too few)."""

    model: str
    log_likelihood: float
    aicc: float | None


@dataclass(frozen=True)
class Part:
    """Magnitude or pointing of a fit.  ``known``: whether there are burns enough to give its sigmas and biases.

    Intervals stand in the order of ``terms``: fixed and proportional sigma, then both biases of each axis."""

    quantity: Quantity
    problem: Problem
    point: Point
    known: bool
    sigma_ci95: tuple[Ends, Ends]
    bias_ci95: tuple[Ends, ...]
    log_likelihood: float
    scores: tuple[ModelScore, ...]
    drawn: np.ndarray | None = None  # (B, 2 + p), refits of the parametric bootstrap

    @property
    def terms(self) -> tuple[Term, ...]:
        """All parameters, in the problem's order."""
        return (*sigmas_of(self.quantity), *biases_of(self.quantity)[: len(self.point.beta)])

    @property
    def ci95(self) -> tuple[Ends, ...]:
        """95 % intervals of all parameters."""
        return (*self.sigma_ci95, *self.bias_ci95)

    @property
    def drawn_ci95(self) -> np.ndarray | None:
        """95 % intervals of all parameters by the bootstrap, (2 + p, 2)."""
        return None if self.drawn is None else np.quantile(self.drawn, [0.025, 0.975], axis=0).T

    @property
    def held(self) -> list[Law]:
        """Sigmas that were held."""
        return [law for law, value in zip(Law, self.problem.held, strict=True) if value is not None]

    @property
    def at_bound(self) -> list[Law]:
        """Sigmas estimated as zero."""
        values = zip(Law, (self.point.fixed, self.point.proportional), strict=True)
        return [law for law, value in values if value == 0 and law not in self.held]

    @property
    def down_weighted(self) -> dict[int, float]:
        """Rows of the burns that count less than half, and their weights; of normal errors none."""
        if not np.isfinite(self.point.objective):
            return {}
        weights = self.problem.weights(self.point)
        return {int(k): float(weights[k]) for k in np.flatnonzero(weights < 0.5)}

    def interval(self, law: Law) -> Ends:
        """95 % interval of a sigma."""
        return dict(zip(Law, self.sigma_ci95, strict=True))[law]

    @property
    def standard_errors(self) -> list[float | None]:
        """One sigma of every parameter, from the widths of the intervals; None for what is held, open, or a limit (from zero)."""
        return [_width(i) if i[0] else None for i in self.sigma_ci95] + [_width(i) for i in self.bias_ci95]

    def gathered(self, values, what: str = "") -> dict:
        """Values in the problem's order under the keys of the record; one number a key for magnitude, two for pointing.

        ``what``: '_ci95' or '_sigma' of each, which stands before the unit."""
        return _gathered(self.quantity, values, what)

    def record(self) -> dict:
        values = list(map(float, self.point.values)) if self.known else [None] * len(self.terms)
        intervals = [None if i == (None, None) else list(i) for i in self.ci95]
        found = _with_intervals(self.quantity, values, intervals) | {
            "held": self.held,
            "log_likelihood": finite(self.log_likelihood),
            "log_likelihood_printed_normaliser": finite(self.log_likelihood_printed),
            "models": [{"model": s.model, "log_likelihood": s.log_likelihood, "aicc": s.aicc} for s in self.scores],
        }
        if self.drawn is not None and self.drawn_ci95 is not None:
            spread, intervals = np.std(self.drawn, axis=0, ddof=1).tolist(), self.drawn_ci95.tolist()
            found["bootstrap"] = {
                "refits": len(self.drawn), "sd": self.gathered(spread), "ci95": self.gathered(intervals),
                **self.gathered(spread, "_sigma"), **self.gathered(intervals, "_ci95"),
                "at_bound_share": dict(zip(Law, np.mean(self.drawn[:, :2] == 0, axis=0).tolist(), strict=True)),
            }  # fmt: skip
        return found

    @property
    def log_likelihood_printed(self) -> float:
        """With the paper's normaliser of a pointing density, sqrt(2 pi) s^2 in place of 2 pi s^2 (Wagner 2014 eq 4); NaN where it is no normal one."""
        if not self.problem.normal:
            return float("nan")
        extra = 0.25 * LOG_2PI * float(np.sum(self.problem.k)) if self.quantity is Quantity.POINTING else 0.0
        return self.log_likelihood + extra

    def table(self, title: str) -> Table:
        """A row a parameter."""
        drawn = [None] * len(self.terms) if self.drawn_ci95 is None else self.drawn_ci95
        rows = tuple(map(self._row, self.terms, self.point.values, self.ci95, drawn))
        head = (str(self.quantity), "estimate", "95 % interval", *(() if self.drawn is None else ("bootstrap 95 %",)))
        return Table(title, rows, head)

    def _row(self, term: Term, value: float, ends: Ends, drawn) -> tuple[str, ...]:
        scale, unit = term.read_in
        low, high = (None if e is None else scale * e for e in ends)
        within = "" if low is None and high is None else digits.interval(low, high)
        said = f"{scale * value:.3g} {unit}"
        is_sigma = term.bias_axis is None
        if is_sigma and term.law in self.held:
            within = "held"
        elif not self.known:
            said = "not known"
        elif is_sigma and term.law in self.at_bound:
            said = "no limit" if high is None else f"< {high:.3g} {unit}"
            within = "a limit: the estimate is zero"
        return (term.name, said, within, *(() if drawn is None else (digits.interval(*(scale * drawn)),)))


def _gathered(quantity: Quantity, values, what: str = "") -> dict:
    values = list(values)
    share = f"proportional{what}" + ("_rad" if quantity is Quantity.POINTING else "")
    fixed, proportional = values[2::2], values[3::2]
    if quantity is Quantity.MAGNITUDE:
        fixed, proportional = (x[0] if x else None for x in (fixed, proportional))
    elif not fixed:
        fixed = proportional = [None, None]
    keys = (f"fixed{what}_mps", share, f"bias_fixed{what}_mps", f"bias_{share}")
    return dict(zip(keys, [*values[:2], fixed, proportional], strict=True))


def _with_intervals(quantity: Quantity, values, intervals) -> dict:
    """Values beside their intervals, and the intervals once more under the key of earlier versions."""
    value, interval = _gathered(quantity, values), _gathered(quantity, intervals, "_ci95")
    beside = {k: v for both in zip(value.items(), interval.items(), strict=True) for k, v in both}
    return beside | {"ci95": _gathered(quantity, intervals)}


def _no_pointing() -> dict:
    """The record of pointing where there are no pointing errors."""
    nothing: dict = {"held": [], "log_likelihood": None, "log_likelihood_printed_normaliser": None, "models": []}
    return _with_intervals(Quantity.POINTING, [None, None], [None, None]) | nothing


@dataclass(frozen=True, kw_only=True, repr=False)
class GatesResult(Estimate):
    """Sigmas and biases of one engine.  ``engine``: None where the table names none.

    ``judgement`` and ``patch``: further results about the same burns, which its record and tables then hold too."""

    RECORD: ClassVar[type] = GatesRecord
    #: All stand within objects, which set them themselves.
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "magnitude.ci95.x_unit": "magnitude.x_ci95_unit",
        "magnitude.bootstrap.sd.x_unit": "magnitude.bootstrap.x_sigma_unit",
        "magnitude.bootstrap.ci95.x_unit": "magnitude.bootstrap.x_ci95_unit",
        "pointing.ci95.x_unit": "pointing.x_ci95_unit",
        "pointing.bootstrap.sd.x_unit": "pointing.bootstrap.x_sigma_unit",
        "pointing.bootstrap.ci95.x_unit": "pointing.bootstrap.x_ci95_unit",
        "patch.epochs[].sigma_bias_fixed_mps": "patch.epochs[].bias_fixed_sigma_mps",
        "patch.epochs[].sigma_bias_proportional": "patch.epochs[].bias_proportional_sigma",
    }

    engine: str | None
    maneuvers: Maneuvers
    model: str
    likelihood: str
    magnitude: Part
    pointing: Part | None = None
    judgement: GatesJudgement | None = None
    patch: GatesPatch | None = None

    def with_judgement(self, judgement: GatesJudgement, patch: GatesPatch | None = None) -> GatesResult:
        """The same fit with what was judged of it and its burns; their doubts are its own."""
        doubts = self.doubts + judgement.doubts + (() if patch is None else patch.doubts)
        return replace(self, judgement=judgement, patch=patch, doubts=doubts)

    @property
    def parts(self) -> list[Part]:
        return [self.magnitude] if self.pointing is None else [self.magnitude, self.pointing]

    @property
    def at_bound(self) -> list[str]:
        """Sigmas that are limits and no estimates, as ``magnitude.proportional``."""
        return [f"{p.quantity}.{law}" for p in self.parts if p.known for law in p.at_bound]

    @property
    def known(self) -> bool:
        """Whether there are burns enough for a model."""
        return self.magnitude.known

    @property
    def gates(self) -> Gates:
        """The most likely model, however badly known; of pointing NaN where there is none."""
        m, nan = self.magnitude.point, float("nan")
        biases = m.beta if len(m.beta) else (0.0, 0.0)
        p = None if self.pointing is None else self.pointing.point
        across = (p.fixed, p.proportional) if p else (nan, nan)
        turned = (0.0,) * 4 if p and not len(p.beta) else tuple(p.beta) if p else (nan,) * 4
        return Gates(
            m.fixed, m.proportional, *across, float(biases[0]), float(biases[1]), (float(turned[0]), float(turned[2])),
            (float(turned[1]), float(turned[3])), float(self.maneuvers.dv_mps.max()), f"{self.engine or 'engine'}, {self.model}",
        )  # fmt: skip

    @property
    def known_gates(self) -> Gates | None:
        """The model where there are burns enough for one."""
        return self.gates if self.known else None

    @property
    def log_likelihood(self) -> float:
        """Full log likelihood at the estimates, magnitude and pointing together."""
        return sum(p.log_likelihood for p in self.parts)

    def _record(self) -> dict:
        m = self.maneuvers
        record = {
            "engine": self.engine, "count": len(m), "model": self.model, "likelihood": self.likelihood,
            "magnitude": self.magnitude.record(), "pointing": _no_pointing() if self.pointing is None else self.pointing.record(),
            "at_bound": self.at_bound, "log_likelihood": finite(self.log_likelihood) if self.known else None,
            "down_weighted": [{"id": m.id[k], "part": p.quantity, "weight": w} for p in self.parts for k, w in p.down_weighted.items()],
            "dv_mps": [float(m.dv_mps.min()), float(m.dv_mps.max())],
            "excluded": [{"id": i, "reason": r} for i, r in m.excluded],
            "adjusted": {i: [a.name for a in book] for i, book in zip(m.id, m.ledger, strict=True) if book},
        }  # fmt: skip
        if self.judgement is not None:
            record |= self.judgement._record() | {"patch": None if self.patch is None else self.patch._record()}
        return record

    def _tables(self) -> tuple[Table, ...]:
        m = self.maneuvers
        title = (
            f"Gates model · {m.engine_label} · {len(m)} maneuvers of {m.dv_mps.min():.3g} to {m.dv_mps.max():.3g} m/s · "
            f"{self.model}, {self.likelihood}"
        )
        tables = [self.magnitude.table(title)]
        if self.pointing is not None:
            tables.append(self.pointing.table("Pointing, per axis"))
        for further in (self.judgement, self.patch):
            tables += [] if further is None else further._tables()
        return tuple(tables)


def _width(ends: Ends) -> float | None:
    """One sigma of what lies in a 95 % interval; None where an end is open."""
    low, high = ends
    return None if low is None or high is None else (high - low) / 3.92
