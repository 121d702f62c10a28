"""What is to be doubted of a fitted Gates model."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from .course import course_doubts
from .robust import FREEDOM
from .terms import sigmas_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...maneuvers.model import Gates
    from ...maneuvers.table import Maneuvers
    from .result import Part

#: Below so many burns no sigma is given.  Of 200 simulated sets of five, the fixed magnitude sigma sits on its bound in 18
#: (main engine) and 27 (RCS) of 100 and is 25 to 30 % low in the median; of eight, in 6 and 15, and 15 to 17 % low.
FEWEST = 8
#: Below so many burns sigmas are known to a third or worse.
_FEW = 20
#: Largest over smallest dV below which fixed and proportional parts are not told apart.
_NARROW = 3.0

TOO_FEW_BURNS = Kind(
    "gates.too-few-burns", Severity.VOID,
    "{burns} burns cannot carry a Gates model of four sigmas and their biases: at least {fewest} are needed, and 20 to know the sigmas "
    "to a third. No values are given, only intervals",
    "Add burns, or take an earlier model as a prior: --prior.",
)  # fmt: skip
FEW_BURNS = Kind("gates.few-burns", Severity.CAUTION, "{burns} burns are few: the sigmas are known to a third or worse")
ONE_SIZE = Kind(
    "gates.one-size", Severity.CAUTION,
    "all burns are of about one size (largest over smallest dV {ratio:.1f}): fixed and proportional parts cannot be told apart, "
    "only their sum near {dv_mps:.3g} m/s is known",
    "Hold one of them: --hold.",
)  # fmt: skip
AT_BOUND = Kind(
    "gates.at-bound", Severity.CAUTION,
    "the {term} sigma is estimated as zero, its bound: it is a limit, below {limit:.3g} {unit} with 95 % confidence, not an estimate",
)  # fmt: skip
AT_BOUND_UNLIMITED = Kind(
    "gates.at-bound-unlimited", Severity.CAUTION,
    "the {term} sigma is estimated as zero, its bound, and the burns set no upper limit to it",
)  # fmt: skip
TRACKING_DOMINATES = Kind(
    "gates.tracking-dominates", Severity.CAUTION,
    "for the median burn the orbit determination adds more variance to the {quantity} error than the execution does: "
    "the sigmas depend on the orbit determination's sigmas being right",
    "Check the orbit determination's sigmas.",
)  # fmt: skip
BIASES_IN_SIGMAS = Kind(
    "gates.biases-in-sigmas", Severity.NOTE, "the {quantity} sigmas are about zero: they include the biases",
    "Use --model estimated-bias.",
)  # fmt: skip
BIASES_UNSUPPORTED = Kind(
    "gates.biases-unsupported", Severity.NOTE,
    "biases of {quantity} are not supported by the data (AICc {aicc_with:.1f} with them, {aicc_without:.1f} without)",
    "Compare with --model zero-mean.",
)  # fmt: skip
VARIANCES = Kind(
    "gates.variances-as-sigmas", Severity.SUSPECT,
    "the errors are e^{ratio:.1f} times likelier if the orbit determination's sigmas are variances, in {unit} squared: are they?",
    "Give standard deviations: the square roots.",
)  # fmt: skip
EXPONENT_WEIGHTS = Kind(
    "gates.exponent-weights", Severity.CAUTION,
    "densities to the power of a weight are no likelihood: there are no intervals, and the value has no meaning (as printed, Wagner 2014 Appendix B)",
    "Use --likelihood additive.",
)  # fmt: skip
UNWEIGHTED = Kind(
    "gates.unweighted", Severity.CAUTION,
    "unweighted: errors of the orbit determination count as execution errors", "Use --likelihood additive.",
)  # fmt: skip
HEAVY_TAILS = Kind(
    "gates.heavy-tails", Severity.NOTE,
    "errors are taken to have the tails of Student's t with {freedom:g} degrees of freedom",
)  # fmt: skip
DOWN_WEIGHTED = Kind(
    "gates.down-weighted", Severity.NOTE,
    "outliers count less: {burns} have less than half the weight of a usual burn", "Find out what was different in them.",
)  # fmt: skip
PRIOR_USED = Kind(
    "gates.prior-used", Severity.NOTE,
    "the sigmas use {prior} as a prior: the intervals are calibrated only if it holds for these burns",
)  # fmt: skip
PRIOR_SAYS_NOTHING = Kind(
    "gates.prior-says-nothing", Severity.NOTE, "{prior} has zero for {terms}: there it is no prior",
)  # fmt: skip


def doubts_of(
    m: Maneuvers, model: str, likelihood: str, parts: list[Part], prior: Gates | None
) -> Iterator[Doubt | None]:
    """All doubts of a fit to these burns."""
    yield from m.doubts.passed_on_by("maneuvers")
    yield from _of_burns(m, prior)
    for part in parts:
        if part.known:
            yield from _of_sigmas(part, likelihood)
            yield _of_biases(part, model)
    yield from course_doubts(m, parts)
    if likelihood == "additive":
        yield _of_variances([p for p in parts if p.known])
    yield from _of_likelihood(m, likelihood, parts)
    if prior is not None:
        yield from _of_prior(prior.name or "an earlier model", parts)


def _of_burns(m: Maneuvers, prior: Gates | None) -> Iterator[Doubt]:
    if len(m) < FEWEST and prior is None:
        yield TOO_FEW_BURNS(burns=len(m), fewest=FEWEST)
    elif len(m) < _FEW:
        yield FEW_BURNS(burns=len(m))
    ratio = float(m.dv_mps.max() / m.dv_mps.min())
    if len(m) > 1 and ratio < _NARROW:
        yield ONE_SIZE(ratio=ratio, dv_mps=float(m.dv_mps.mean()))


def _of_sigmas(part: Part, likelihood: str) -> Iterator[Doubt]:
    for term in sigmas_of(part.quantity):
        if term.law in part.at_bound:
            high, (scale, unit) = part.interval(term.law)[1], term.read_in
            yield AT_BOUND_UNLIMITED(term=term) if high is None else AT_BOUND(term=term, limit=scale * high, unit=unit)
    if likelihood in ("additive", "robust"):
        tracking, whole = np.median(part.problem.d), np.median(part.problem.variances(part.point))
        if tracking > whole / 2:
            yield TRACKING_DOMINATES(quantity=part.quantity)


def _of_biases(part: Part, model: str) -> Doubt | None:
    if model == "zero-mean":
        return BIASES_IN_SIGMAS(quantity=part.quantity)
    aicc = {s.model: s.aicc for s in part.scores}
    biased, flat = aicc.get("estimated-bias"), aicc.get("zero-mean")
    if biased is None or flat is None or flat >= biased - 2:
        return None
    return BIASES_UNSUPPORTED(quantity=part.quantity, aicc_with=biased, aicc_without=flat)


#: Units that variances may be squares of. [m/s]
_SQUARED = {"mm/s": 1e-3, "m/s": 1.0}
#: Log likelihood ratio from which they are taken for it; less often than once in 20 sets of true sigmas, by Markov's inequality.
_LIKELIER = float(np.log(20 * len(_SQUARED)))


def _of_variances(parts: list[Part]) -> Doubt | None:
    """Whether the burns' errors scatter as if the sigmas of the orbit determination were variances."""
    gain = dict.fromkeys(_SQUARED, 0.0)
    for part in parts:
        told = part.problem.log_likelihood(part.point)
        for unit, size in _SQUARED.items():
            other = replace(part.problem, d=np.sqrt(part.problem.d) * size / part.problem.size)
            gain[unit] += other.log_likelihood(other.minimum()) - told
    unit = max(gain, key=lambda u: gain[u])
    return VARIANCES(ratio=gain[unit], unit=unit) if parts and gain[unit] > _LIKELIER else None


def _of_likelihood(m: Maneuvers, likelihood: str, parts: list[Part]) -> Iterator[Doubt]:
    if likelihood == "printed":
        yield EXPONENT_WEIGHTS()
    if likelihood == "unweighted":
        yield UNWEIGHTED()
    if likelihood == "robust":
        yield HEAVY_TAILS(freedom=FREEDOM)
        less = list(dict.fromkeys(m.id[k] for p in parts for k in p.down_weighted))
        if less:
            yield DOWN_WEIGHTED(burns=less)


def _of_prior(name: str, parts: list[Part]) -> Iterator[Doubt]:
    yield PRIOR_USED(prior=name)
    zero = [
        t for p in parts for t, width in zip(sigmas_of(p.quantity), p.problem.prior[1::2], strict=True) if width == 0
    ]
    if zero:
        yield PRIOR_SAYS_NOTHING(prior=name, terms=zero)
