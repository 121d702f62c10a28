"""A Gates model from executed maneuvers, by maximum likelihood (002 Appendix B, done properly and as printed).

``additive`` (default, the corrected one): the orbit determination's variance is added to the model's, sigmas are
restricted maximum likelihood.  ``printed``: every burn's density to the power of one over its orbit determination's sigma,
which is no likelihood (the power has a unit), so that its intervals mean nothing.  ``unweighted``: all burns alike, what the
orbit determination was wrong by counted as execution error, which is what the papers chose for RCS pointing.  ``robust``:
additive with the tails of Student's t, so that single burns far out count little."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...kit.errors import BadInput, some_of
from .intervals import bias_intervals, sigma_interval
from .likelihood import NOWHERE, Problem
from .result import GatesFit, ModelScore, Part
from .robust import FREEDOM, RobustProblem

if TYPE_CHECKING:
    from ...maneuvers.model import Gates
    from ...maneuvers.table import Maneuvers

MODELS = ("estimated-bias", "zero-mean", "mean-aware")
LIKELIHOODS = ("additive", "robust", "printed", "unweighted")
#: Terms that can be held, by the names of the result.
TERMS = ("magnitude_fixed", "magnitude_proportional", "pointing_fixed", "pointing_proportional")

#: Below so many burns no sigma is given.  Of 200 simulated sets of five, the fixed magnitude sigma sits on its bound in 18
#: (main engine) and 27 (RCS) of 100 and is 25 to 30 % low in the median; of eight, in 6 and 15, and 15 to 17 % low.
FEWEST = 8
#: Largest over smallest dV below which fixed and proportional parts are not told apart.
_NARROW = 3.0
#: A sigma of the prior is this wide, in parts of itself: so much did sigmas change from one of Cassini's models to the next.
PRIOR_WIDTH = 0.5


def fit_gates(
    maneuvers: Maneuvers,
    *,
    model: str = "estimated-bias",
    likelihood: str = "additive",
    hold: dict[str, float] | None = None,
    prior: Gates | None = None,
    prior_width: float = PRIOR_WIDTH,
    bootstrap: int = 0,
    seed: int = 0,
) -> GatesFit:
    """Sigmas and biases of one engine's burns.

    ``model``: ``estimated-bias`` (sigmas about biases that are estimated, and taken to be removed from further burns),
    ``zero-mean`` (about zero: the sigmas take the biases up), ``mean-aware`` (as the first, biases kept for further burns).
    ``hold``: terms (``TERMS``) kept at a value [m/s, fraction, rad].  ``prior``: an earlier model, whose sigmas are taken as
    Gaussian, ``prior_width`` of themselves wide.  ``bootstrap``: parametric refits.

    Raises BadInput for an unknown name, a hold that is no sigma, or exponent weights without orbit-determination sigmas."""
    _known("model", model, MODELS)
    _known("likelihood", likelihood, LIKELIHOODS)
    hold = dict(hold or {})
    for term, value in hold.items():
        _known("term to hold", term, TERMS)
        if not (np.isfinite(value) and value >= 0):
            raise BadInput(f"{term} cannot be held at {value:g}", remedy="A sigma is zero or positive.")
    if not prior_width > 0:
        raise BadInput(
            f"a prior of width {prior_width:g} is none", remedy="Give a positive width, in parts of each sigma."
        )
    rng = np.random.default_rng(seed)
    parts = {
        name: _part(name, problem, likelihood, len(maneuvers), bootstrap, rng)
        for name, problem in problems(maneuvers, model, likelihood, hold, prior, prior_width).items()
    }
    magnitude, pointing = parts["magnitude"], parts.get("pointing")
    doubts = _doubts(maneuvers, model, likelihood, [p for p in parts.values()], prior)
    engine = maneuvers.engine[0] if maneuvers.engines != [""] else None
    return GatesFit(engine, maneuvers, model, likelihood, magnitude, pointing, tuple(doubts))


def problems(
    m: Maneuvers,
    model="estimated-bias",
    likelihood="additive",
    hold=None,
    prior: Gates | None = None,
    prior_width=PRIOR_WIDTH,
) -> dict[str, Problem]:
    """The likelihoods to be maximised: of magnitude, and of pointing where it is known."""
    hold = hold or {}
    found: dict[str, Any] = {
        "magnitude": (m.magnitude_error_mps[:, None], (m.sigma_magnitude_mps**2)[:, None, None], m.sigma_magnitude_mps)
    }
    if m.pointing_error_mps is not None:
        # the papers name two weights for pointing, the ellipse's semi-major axis and the sigma along the error; the
        # first is what they drew and does not depend on the error it weighs
        found["pointing"] = (m.pointing_error_mps, m.pointing_covariance, m.sigma_pointing_mps)
    out = {}
    for name, (error, covariance, sigma) in found.items():
        weight = None
        if likelihood == "unweighted":
            weight = np.ones(len(m))
        elif likelihood == "printed":
            if not (sigma > 0).all():
                raise BadInput(
                    f"the orbit determination's sigma of {name} is zero (maneuver {m.id[int(np.argmin(sigma))]})",
                    file=m.source or None, remedy="Weights of one over sigma need sigmas: use the additive likelihood.",
                )  # fmt: skip
            weight = 1 / sigma
        means = (
            [] if prior is None
            else [prior.magnitude_fixed_mps, prior.magnitude_proportional] if name == "magnitude"
            else [prior.pointing_fixed_mps, prior.pointing_proportional_rad]
        )  # fmt: skip
        out[name] = (RobustProblem if likelihood == "robust" else Problem).of(
            error, covariance, m.dv_mps, biased=model != "zero-mean", weight=weight, reml=likelihood in ("additive", "robust"),
            prior=[x for mean in means for x in (mean, prior_width * mean)] or (0, 0, 0, 0),
            held=(hold.get(f"{name}_fixed"), hold.get(f"{name}_proportional")),
        )  # fmt: skip
    return out


def _part(name: str, problem: Problem, likelihood: str, count: int, bootstrap: int, rng) -> Part:
    components = 1 if name == "magnitude" else 2
    p = problem.X.shape[1]
    if len(problem.y) <= p:  # the likelihood has no maximum
        nowhere = replace(NOWHERE, beta=np.full(p, np.nan))
        return Part(name, problem, nowhere, False, ((None, None),) * 2, ((None, None),) * p, np.nan, ())
    best = problem.minimum()
    enough = len(problem.y) > p + components  # else there is nothing to say how sharp it is
    sigmas: list = [(None, None)] * 2
    biases: list = [(None, None)] * p
    if enough and likelihood != "printed":
        sigmas = [
            (None, None) if h is not None else sigma_interval(problem, best, j) for j, h in enumerate(problem.held)
        ]
        biases = bias_intervals(problem, best)
    drawn = problem.refits(best, bootstrap, rng) if bootstrap and enough else None
    known = count >= FEWEST or (enough and any(width > 0 for width in problem.prior[1::2]))
    return Part(
        name, problem, best, known, tuple(sigmas), tuple(biases), problem.log_likelihood(best), _scores(problem), drawn
    )


def _scores(problem: Problem) -> tuple[ModelScore, ...]:
    """How well the burns are described with and without biases: maximum likelihood with Akaike's correction for few."""
    scores = []
    for model in ("estimated-bias", "zero-mean"):
        if model == "estimated-bias" and problem.X.shape[1] == 0:
            continue
        X = problem.X if model == "estimated-bias" else problem.X[:, :0]
        full = replace(
            problem,
            X=np.ascontiguousarray(X),
            bias_units=problem.bias_units[: X.shape[1]],
            reml=False,
            prior=(0.0,) * 4,
        )
        value = full.log_likelihood(full.minimum())
        free = X.shape[1] + problem.held.count(None)
        spare = len(problem.y) - free - 1
        scores.append(
            ModelScore(model, value, 2 * free - 2 * value + 2 * free * (free + 1) / spare if spare > 0 else None)
        )
    return tuple(scores)


def _doubts(m: Maneuvers, model: str, likelihood: str, parts: list[Part], prior: Gates | None):
    yield from m.doubts
    n = len(m)
    if n < FEWEST and prior is None:
        yield (
            f"{n} burn{'s' if n > 1 else ''} cannot carry a Gates model of four sigmas and their biases (it takes {FEWEST}, and 20 before sigmas are known "
            "to a third): none is given, and the intervals say what can be said"
        )
    elif n < 20:
        yield f"{n} burns are few: sigmas are known to a third or worse"
    spread = float(m.dv_mps.max() / m.dv_mps.min())
    if n > 1 and spread < _NARROW:
        yield (
            f"all burns are of one size (largest over smallest {spread:.1f}): fixed and proportional parts are not told apart, "
            f"only their sum near {m.dv_mps.mean():.3g} m/s is known"
        )
    for part in parts:
        if not part.known:
            continue
        for term in part.at_bound:
            high = part.interval(term)[1]
            limit = "without an upper limit" if high is None else f"below {part.shown(term, high)} with 95 % confidence"
            yield f"{part.name} {term} sigma rests on its bound: a limit ({limit}), not an estimate"
        if (
            likelihood in ("additive", "robust")
            and np.median(part.problem.d) > np.median(part.problem.variances(part.point)) / 2
        ):
            yield f"the orbit determination is less certain of {part.name} errors than they are large: the sigmas hang on its sigmas being right"
        biased, flat = (next((s for s in part.scores if s.model == w), None) for w in ("estimated-bias", "zero-mean"))
        if model == "zero-mean":
            yield f"{part.name} is read about zero: what biases there are counts into the sigmas"
        elif biased and flat and biased.aicc is not None and flat.aicc is not None and flat.aicc < biased.aicc - 2:
            yield f"biases of {part.name} do not pay for themselves (AICc {biased.aicc:.1f} with, {flat.aicc:.1f} without)"
    if likelihood == "printed":
        yield "exponent weights make no likelihood: there are no intervals, and its value means nothing (printed, 002 Appendix B)"
    if likelihood == "unweighted":
        yield "unweighted: what the orbit determination was wrong by is counted as execution error"
    if likelihood == "robust":
        less = list(dict.fromkeys(m.id[k] for p in parts for k in p.down_weighted))
        some = ", ".join(less[:8]) + (" and more" if len(less) > 8 else "")
        yield f"tails of a t of {FREEDOM:g} degrees of freedom: {f'{some} counted less than half' if less else 'every burn counted half or more'}"
    if prior is not None:
        zero = [
            f"{p.name} {t}"
            for p in parts
            for t, width in zip(("fixed", "proportional"), p.problem.prior[1::2], strict=True)
            if width == 0
        ]
        free = f"; not {' and '.join(zero)}, which is zero there and tells nothing" if zero else ""
        yield f"the sigmas lean on {prior.name or 'an earlier model'} as a prior{free}: intervals hold where it does"


def _known(what: str, name: str, names) -> None:
    if name not in names:
        raise BadInput(f"there is no {what} {name!r}", remedy=f"One of: {some_of(names)}.")
