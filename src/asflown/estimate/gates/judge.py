"""Is the model fit to judge by: counts, distribution, outliers, influence, directions (Wagner 2014 Figures 1 to 11)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.result import recorded
from ...maneuvers.model import Quantity
from .checks import Shape, Spread, directions_of, spread_of
from .fit_doubts import FEWEST
from .foreseen import foresee, foresee_by
from .judgement import SIGMAS, Against, GatesJudgement, Influence, Outlier

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...maneuvers.history import PastModel
    from ...maneuvers.model import Gates
    from ...maneuvers.table import Maneuvers
    from .intervals import Ends
    from .result import GatesResult, Part
    from .terms import Term

#: Removal of one burn moves a parameter by more of its sigmas: the set is not sufficient.  Of 60 clean simulated sets of 69
#: RCS burns none is found so, of 49 burns 7 %, of 20 burns 25 %.
_MOVED = 1.5
#: p-values below which a distribution, and the errors under a model of the history, are doubted.
_SHAPE_P, _CHI2_P = 0.01, 0.02

OUTLIER = Kind(
    "gates.outlier", Severity.SUSPECT,
    "{burn} is an outlier in {quantity} (z {z:+.1f}; of outliers as clear, {false_percent:.2g} % are false)",
    "Find its cause before it counts; leave it out with --without, or use --likelihood robust.",
)  # fmt: skip
INSIDE_1_SIGMA = Kind(
    "gates.inside-1-sigma", Severity.SUSPECT,
    "{component}: {inside} of {burns} burns lie inside 1 sigma; {low} to {high} are expected", "Look at the figures: --plot-dir.",
)  # fmt: skip
DISTRIBUTION = Kind(
    "gates.distribution", Severity.SUSPECT,
    "{quantity} errors do not have the distribution that the model says (p = {p:.2g})", "Use --likelihood robust.",
)  # fmt: skip
NOT_SUFFICIENT = Kind(
    "gates.not-sufficient", Severity.SUSPECT,
    "a single burn decides the model: without {burn} {term} moves by {sigmas:.1f} of its sigma", "Add burns, or check that one.",
)  # fmt: skip
SIGN_TURNS = Kind("gates.sign-turns", Severity.SUSPECT, "without {burn} the sign of {terms} turns", "Check that burn.")
AGAINST_SIGMAS = Kind(
    "gates.against-sigmas", Severity.SUSPECT,
    "magnitude errors about the biases that {model} left are {way} than its sigmas (chi-square {chi2:.0f} of {freedom}, p = {p:.2g})",
    "Fit a model of these burns.",
)  # fmt: skip


@recorded
def gates_judgement(
    fit: GatesResult, *, against: PastModel | None = None, draws: int = 499, seed: int = 0
) -> GatesJudgement:
    """Judge a fit by its own burns, and the burns by a model of the history.

    Parameters
    ----------
    fit : GatesResult
        The fit.  With too few burns for a model, only underburns are counted and directions tested.
    against : PastModel, optional
        A model to judge the burns by, about the biases that it left.
    draws : int
        Number of sets simulated from the fit and fitted anew, for the envelopes and the test of the distribution.
    seed : int
        Seed of those sets.

    Returns
    -------
    GatesJudgement
        Counts, outliers (Benjamini and Hochberg's false discovery rate), influence of each burn, directions of pointing errors.

    Raises
    ------
    BadInput
        For fewer than one draw.
    """
    if draws < 1:
        raise BadInput(f"{draws} sets give no envelope", remedy="Draw at least one; 499 are usual.")
    m = fit.maneuvers
    rng = np.random.default_rng(seed)
    spreads = tuple(s for part in fit.parts for s in _spreads(fit, part, draws, rng))
    outliers, influence = _left_out(fit) if fit.known and len(m) > FEWEST else ((), ())
    worst = max(influence, key=lambda i: i.in_sigmas, default=None)
    compared = None if against is None else _against(fit, against)
    doubts = [
        *_of_outliers(outliers), *_of_spreads(spreads), *_of_influence(worst), _of_comparison(compared),
        *(() if against is None else against.doubts.passed_on_by("model")),
    ]  # fmt: skip
    return GatesJudgement(
        craft=fit.craft,
        method=fit.method,
        variant=fit.variant,
        spreads=spreads,
        outliers=outliers,
        expected_beyond_2_sigma=2 * float(scipy.stats.norm.sf(SIGMAS)) * len(m) * len(fit.parts) if influence else 0.0,
        influence=influence,
        sufficient=None if worst is None or worst.largest is None else worst.in_sigmas <= _MOVED,
        directions=directions_of(m.across[0]) if m.pointing_error_mps is not None else None,
        against=compared,
        seed=seed,
        doubts=Doubts(doubts),
    )


def _spreads(fit: GatesResult, part: Part, draws: int, rng) -> Iterator[Spread]:
    """Of magnitude, or of pointing X and Y; the distribution is judged on all rows of a part together."""
    m, model = fit.maneuvers, fit.gates
    drawn = part.problem.refits(part.point, draws, rng) if part.known else None
    shape = _shape(part, drawn, rng) if drawn is not None else None
    if part.quantity is Quantity.MAGNITUDE:
        mean = model.mean_magnitude(m.dv_mps) if part.known else None
        sigma, od = model.sigma_magnitude(m.dv_mps), m.sigma_magnitude_mps
        yield spread_of(part.quantity, "", m.magnitude_error_mps, mean, sigma, od, shape)
        return
    od, means = _pointing_od(m), model.mean_pointing(m.dv_mps)
    for j, axis in enumerate(part.quantity.axes):
        mean = means[:, j] if part.known else None
        yield spread_of(part.quantity, axis, m.across[0][:, j], mean, model.sigma_pointing(m.dv_mps), od[:, j], shape)


def _pointing_od(m: Maneuvers) -> np.ndarray:
    """One sigma of each pointing error by orbit determination, (N, 2)."""
    return np.sqrt(np.einsum("nii->ni", m.across[1]))


def _shape(part: Part, drawn, rng) -> Shape:
    """Standardised residuals of the fit, the envelope of those of refitted draws, and the p-value of the largest distance of
    their distribution from the normal one."""
    problem = part.problem

    def standardised(y, fixed, proportional, beta):
        s = problem.d + (fixed / problem.units[0]) ** 2 + (proportional / problem.units[1] * problem.v) ** 2
        return np.sort((y - problem.X @ (beta / problem.bias_units)) / np.sqrt(np.maximum(s, 1e-12)))

    ours = standardised(problem.y, part.point.fixed, part.point.proportional, part.point.beta)
    mean = problem.X @ (part.point.beta / problem.bias_units)
    sets = mean + np.sqrt(problem.variances(part.point)) * rng.standard_normal((len(drawn), len(problem.y)))
    refitted = problem.refit_all(sets, part.point)
    theirs = np.array([standardised(y, r[0], r[1], r[2:]) for y, r in zip(sets, refitted, strict=True)])
    n = len(ours)
    steps = np.arange(n + 1) / n

    def farthest(z):
        u = scipy.stats.norm.cdf(z)
        return np.maximum(steps[1:] - u, u - steps[:-1]).max(axis=-1)

    p = (1 + np.sum(farthest(theirs) >= farthest(ours))) / (1 + len(theirs))
    return Shape(ours, np.quantile(theirs, [0.025, 0.975], axis=0), float(p))


def _left_out(fit: GatesResult) -> tuple[tuple[Outlier, ...], tuple[Influence, ...]]:
    """Every burn under the model that is fitted without it: is it an outlier, and what did it do to the model?"""
    m = fit.maneuvers
    seen, moved = [], []
    for k, name in enumerate(m.id):
        changes: dict[Quantity, dict] = {}
        largest: tuple[Term | None, float] = (None, 0.0)
        flips: list[Term] = []
        for part in fit.parts:
            rest = part.problem.without(k)
            point = rest.minimum(near=part.point)
            error, od = (
                (m.magnitude_error_mps[k], m.sigma_magnitude_mps[k] ** 2) if part.quantity is Quantity.MAGNITUDE
                else (m.across[0][k], m.across[1][k])
            )  # fmt: skip
            told = foresee(rest, point, float(m.dv_mps[k]), od)
            seen.append((name, part.quantity, told.z(error), told.p_value(error)))
            change = (point.values - part.point.values).tolist()
            changes[part.quantity] = part.gathered(change)
            for term, d, sigma in zip(part.terms, change, part.standard_errors, strict=True):
                if sigma and abs(d) / sigma > largest[1]:
                    largest = (term, abs(d) / sigma)
            turned = part.point.beta * point.beta < 0
            flips += [t for t, flipped in zip(part.terms[2:], turned, strict=True) if flipped]
        moved.append(Influence(name, changes, largest[0], float(largest[1]), tuple(flips)))
    q = scipy.stats.false_discovery_control([p for *_, p in seen])
    beyond = [Outlier(*s, float(adjusted)) for s, adjusted in zip(seen, q, strict=True)]
    return tuple(sorted((o for o in beyond if abs(o.z) > SIGMAS or o.discovered), key=lambda o: o.p)), tuple(moved)


def _against(fit: GatesResult, past: PastModel) -> Against:
    m, left = fit.maneuvers, past.left
    told = [foresee_by(left, float(v), s * s) for v, s in zip(m.dv_mps, m.sigma_magnitude_mps, strict=True)]
    chi2, freedom = sum(t.distance2(e) for t, e in zip(told, m.magnitude_error_mps, strict=True)), len(m)
    consistent, gain = {}, 0.0
    for part in fit.parts:
        theirs = past.model.parameters(part.quantity)
        inside = [_within(x, ends) for x, ends in zip(theirs, part.ci95, strict=False)]
        if not past.bias_known:
            inside[2:] = [None] * len(inside[2:])
        consistent[part.quantity] = part.gathered(inside)
        gain += part.log_likelihood - part.problem.log_likelihood(part.problem.at(theirs[0], theirs[1], theirs[2:]))
    tail = min(scipy.stats.chi2.sf(chi2, freedom), scipy.stats.chi2.cdf(chi2, freedom))
    spreads = tuple(_spreads_under(left, fit))
    return Against(past.model.name, spreads, consistent, float(gain), float(chi2), float(2 * tail), freedom)


def _spreads_under(left: Gates, fit: GatesResult) -> Iterator[Spread]:
    """Errors about the biases that a model left, of pointing about zero."""
    m = fit.maneuvers
    mean, sigma = left.mean_magnitude(m.dv_mps), left.sigma_magnitude(m.dv_mps)
    yield spread_of(Quantity.MAGNITUDE, "", m.magnitude_error_mps, mean, sigma, m.sigma_magnitude_mps)
    if fit.pointing is not None:
        od, sigma = _pointing_od(m), left.sigma_pointing(m.dv_mps)
        for j, axis in enumerate(Quantity.POINTING.axes):
            yield spread_of(Quantity.POINTING, axis, m.across[0][:, j], 0 * m.dv_mps, sigma, od[:, j])


def _within(value: float, ends: Ends) -> bool | None:
    low, high = ends
    if low is None and high is None:
        return None
    return (low is None or low <= value) and (high is None or value <= high)


def _of_outliers(outliers) -> Iterator[Doubt]:
    for o in outliers:
        if o.discovered:
            yield OUTLIER(burn=o.id, quantity=o.component, z=o.z, false_percent=100 * o.q)


def _of_spreads(spreads) -> Iterator[Doubt]:
    for s in spreads:
        if s.band is not None and not s.band[0] <= s.inside <= s.band[1]:
            yield INSIDE_1_SIGMA(component=s.name, inside=s.inside, burns=s.count, low=s.band[0], high=s.band[1])
        if s.shape is not None and s.shape.p < _SHAPE_P:  # of pointing X and Y it is one, and one doubt
            yield DISTRIBUTION(quantity=s.quantity, p=s.shape.p)


def _of_influence(worst: Influence | None) -> Iterator[Doubt]:
    if worst is not None and worst.in_sigmas > _MOVED:
        yield NOT_SUFFICIENT(burn=worst.id, term=worst.largest, sigmas=worst.in_sigmas)
        if worst.flips:
            yield SIGN_TURNS(burn=worst.id, terms=worst.flips)


def _of_comparison(c: Against | None) -> Doubt | None:
    if c is None or c.chi2_p >= _CHI2_P:
        return None
    way = "larger" if c.chi2 > c.freedom else "smaller"
    return AGAINST_SIGMAS(model=c.name, way=way, chi2=c.chi2, freedom=c.freedom, p=c.chi2_p)
