"""The likelihoods that are maximised: of magnitude, and of pointing where it is known.

``additive`` (default, the corrected one): the orbit determination's variance is added to the model's, sigmas are restricted
maximum likelihood.  ``robust``: additive with the tails of Student's t, so that outliers count little.  ``printed``: every
burn's density to the power of one over its orbit determination's sigma (Wagner 2014 Appendix B), which is no likelihood: the
power has a unit, so that intervals have no meaning.  ``unweighted``: all burns count alike, and errors of the orbit
determination count as execution errors, which is what the paper chose for RCS pointing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ...maneuvers.model import Quantity
from .likelihood import Problem
from .robust import RobustProblem
from .terms import sigmas_of

if TYPE_CHECKING:
    from ...maneuvers.model import Gates
    from ...maneuvers.table import Maneuvers

MODELS = ("estimated-bias", "zero-mean", "mean-aware")
LIKELIHOODS = ("additive", "robust", "printed", "unweighted")
#: A sigma of the prior is this wide, in parts of itself: so much did sigmas change from one of Cassini's models to the next.
PRIOR_WIDTH = 0.5


def problems(
    m: Maneuvers,
    model="estimated-bias",
    likelihood="additive",
    hold: dict[str, float] | None = None,
    prior: Gates | None = None,
    prior_width=PRIOR_WIDTH,
) -> dict[Quantity, Problem]:
    """A likelihood by quantity; of pointing none where there are no pointing errors."""
    hold = hold or {}
    kind = RobustProblem if likelihood == "robust" else Problem
    found = {}
    for quantity, (error, covariance, sigma) in _errors(m).items():
        means = () if prior is None else prior.parameters(quantity)[:2]
        found[quantity] = kind.of(
            error, covariance, m.dv_mps, biased=model != "zero-mean", weight=_weight(m, quantity, sigma, likelihood),
            reml=likelihood in ("additive", "robust"), prior=[x for mean in means for x in (mean, prior_width * mean)] or (0, 0, 0, 0),
            held=tuple(hold.get(t.key) for t in sigmas_of(quantity)),
        )  # fmt: skip
    return found


def _errors(m: Maneuvers) -> dict[Quantity, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Errors (N, c), their covariance by orbit determination (N, c, c), and the sigma that weights them as printed (N,)."""
    sigma = m.sigma_magnitude_mps
    found = {Quantity.MAGNITUDE: (m.magnitude_error_mps[:, None], (sigma**2)[:, None, None], sigma)}
    if m.pointing_error_mps is not None:
        # the paper names two weights for pointing, the ellipse's semi-major axis and the sigma along the error; the
        # first is what it drew, and does not depend on the error that it weights
        found[Quantity.POINTING] = (*m.across, m.sigma_pointing_mps)
    return found


def _weight(m: Maneuvers, quantity: Quantity, sigma, likelihood: str) -> np.ndarray | None:
    """Exponents of the burns' densities, (N,); None for a likelihood that has none."""
    if likelihood == "unweighted":
        return np.ones(len(m))
    if likelihood != "printed":
        return None
    if not (sigma > 0).all():
        raise BadInput(
            f"the orbit determination's sigma of {quantity} is zero (maneuver {m.id[int(np.argmin(sigma))]})",
            file=m.source or None, remedy="Weights of one over sigma need sigmas: use the additive likelihood.",
        )  # fmt: skip
    return 1 / sigma
