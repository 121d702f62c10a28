"""A Gates model from executed maneuvers, by maximum likelihood (Wagner 2014 Appendix B, corrected and as printed)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubts
from ...kit.errors import BadInput, check_choice
from ...kit.result import recorded
from ...maneuvers.model import Quantity
from .fit_doubts import FEWEST, doubts_of
from .intervals import bias_intervals, sigma_interval
from .likelihood import NOWHERE, Problem
from .likelihoods import LIKELIHOODS, MODELS, PRIOR_WIDTH, problems
from .result import GatesResult, ModelScore, Part
from .terms import SIGMAS

if TYPE_CHECKING:
    from ...maneuvers.model import Gates
    from ...maneuvers.table import Maneuvers
    from .intervals import Ends


@recorded
def gates(
    maneuvers: Maneuvers,
    *,
    model: str = "estimated-bias",
    likelihood: str = "additive",
    hold: dict[str, float] | None = None,
    prior: Gates | None = None,
    prior_width: float = PRIOR_WIDTH,
    bootstrap: int = 0,
    seed: int = 0,
    craft: str = "",
) -> GatesResult:
    """Sigmas and biases of the execution errors of one engine.

    A burn of size v has a magnitude error N(b1 + b2 v, s1^2 + s2^2 v^2), and likewise a pointing error along each TVC axis
    (Wagner 2014 eq 1).  A positive magnitude error is an overburn.

    Parameters
    ----------
    maneuvers : Maneuvers
        N burns of one engine, with the covariance of their orbit determination; m/s, TVC frame.
    model : {'estimated-bias', 'zero-mean', 'mean-aware'}
        Sigmas about estimated biases, which are taken to be removed from later burns; about zero, so that the sigmas include the
        biases; or about estimated biases that later burns keep.
    likelihood : {'additive', 'robust', 'printed', 'unweighted'}
        How the orbit determination's errors count.  'printed' is the paper's, with its errors.
    hold : dict, optional
        Sigmas kept at a value: 'magnitude_fixed' and 'pointing_fixed' [m/s], 'magnitude_proportional' [-],
        'pointing_proportional' [rad].
    prior : Gates, optional
        An earlier model, whose sigmas are taken as Gaussian priors.
    prior_width : float
        One sigma of each prior, in parts of its value.
    bootstrap : int
        Number of parametric refits.
    seed : int
        Seed of the bootstrap.
    craft : str
        Name of the craft, for the record.

    Returns
    -------
    GatesResult
        With fewer than 8 burns and no prior it gives intervals, and no values.

    Raises
    ------
    BadInput
        For an unknown choice, a held value that is no sigma, or printed weights where the orbit determination has no sigma.
    """
    hold = hold or {}
    _check(model, likelihood, hold, prior_width)
    rng = np.random.default_rng(seed)
    parts = {
        quantity: _part(quantity, problem, likelihood, len(maneuvers), bootstrap, rng)
        for quantity, problem in problems(maneuvers, model, likelihood, hold, prior, prior_width).items()
    }
    return GatesResult(
        craft=craft,
        method=f"{model}, {likelihood}",
        variant="printed" if likelihood == "printed" else "corrected",
        engine=maneuvers.engine_name,
        maneuvers=maneuvers,
        model=model,
        likelihood=likelihood,
        magnitude=parts[Quantity.MAGNITUDE],
        pointing=parts.get(Quantity.POINTING),
        seed=seed,
        doubts=Doubts(doubts_of(maneuvers, model, likelihood, list(parts.values()), prior)),
    )


def _check(model: str, likelihood: str, hold: dict[str, float], prior_width: float) -> None:
    check_choice(model, MODELS, "model")
    check_choice(likelihood, LIKELIHOODS, "likelihood")
    for term, value in hold.items():
        check_choice(term, SIGMAS, "term to hold")
        if not (np.isfinite(value) and value >= 0):
            raise BadInput(f"{term} cannot be held at {value:g}", remedy="A sigma is zero or positive.")
    if not prior_width > 0:
        raise BadInput(
            f"the prior width {prior_width:g} is not positive", remedy="Give a positive width, in parts of each sigma."
        )


def _part(quantity: Quantity, problem: Problem, likelihood: str, count: int, bootstrap: int, rng) -> Part:
    components = len(quantity.axes)
    p = problem.X.shape[1]
    if len(problem.y) <= p:  # the likelihood has no maximum
        nowhere = replace(NOWHERE, beta=np.full(p, np.nan))
        return Part(quantity, problem, nowhere, False, ((None, None),) * 2, ((None, None),) * p, np.nan, ())
    best = problem.minimum()
    enough = len(problem.y) > p + components  # else there is nothing to say how sharp it is
    fixed: Ends = (None, None)
    proportional: Ends = (None, None)
    biases: list[Ends] = [(None, None)] * p
    if enough and likelihood != "printed":
        fixed, proportional = (
            (None, None) if h is not None else sigma_interval(problem, best, j) for j, h in enumerate(problem.held)
        )
        biases = bias_intervals(problem, best)
    drawn = problem.refits(best, bootstrap, rng) if bootstrap and enough else None
    known = count >= FEWEST or (enough and any(width > 0 for width in problem.prior[1::2]))
    return Part(
        quantity, problem, best, known, (fixed, proportional), tuple(biases), problem.log_likelihood(best), _scores(problem), drawn
    )  # fmt: skip


def _scores(problem: Problem) -> tuple[ModelScore, ...]:
    """How well the burns are described with and without biases: maximum likelihood with Akaike's correction for few."""
    scores = []
    for model, columns in (("estimated-bias", problem.X.shape[1]), ("zero-mean", 0)):
        if model == "estimated-bias" and columns == 0:
            continue
        full = replace(
            problem, X=np.ascontiguousarray(problem.X[:, :columns]), bias_units=problem.bias_units[:columns], reml=False, prior=(0.0,) * 4
        )  # fmt: skip
        value = full.log_likelihood(full.minimum())
        free = columns + problem.held.count(None)
        spare = len(problem.y) - free - 1
        aicc = 2 * free - 2 * value + 2 * free * (free + 1) / spare if spare > 0 else None
        scores.append(ModelScore(model, value, aicc))
    return tuple(scores)
