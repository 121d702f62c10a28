"""What there is to doubt of fitted jets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity

if TYPE_CHECKING:
    from .data import JetData
    from .form import JetForm
    from .result import Score, Source

#: A criterion better by this says that fewer parameters do (Kass and Raftery 1995: 2 is positive evidence).
_BETTER = 2.0
#: Residuals of which more than this count as one are correlated.  Assumed.
_CORRELATED = 2.0
#: Chi-square beyond its mean by so many of its standard deviations is a misfit.  Assumed.
_MISFIT = 5.0

NOT_EXPLAINED = Kind(
    "jets.not-explained", Severity.VOID,
    "these jets do not explain the telemetry (chi-square {chi_square:.0f} for {freedom:.0f} degrees of freedom): none is "
    "identified, and the intervals mean nothing",
    "Check the form of the jets (--power, --widths, --source), the loop's gains, and whether another torque acts.",
)  # fmt: skip
RESIDUALS_CORRELATED = Kind(
    "jets.residuals-correlated", Severity.SUSPECT,
    "the residuals are correlated, {alike:.1f} samples count as 1: these jets do not explain all of the momentum",
    "Check the form of the jets: --power, --widths, --source.",
)  # fmt: skip
DENSITY_NOT_IDENTIFIED = Kind(
    "jets.density-not-identified", Severity.CAUTION,
    "{source} is not identified: its density may be zero, and its interval is an upper limit at best{width}",
    "Fit fewer sources (--sources), or through the loop (--fit forward).",
)  # fmt: skip
WIDTH_NOT_IDENTIFIED = Kind(
    "jets.width-not-identified", Severity.CAUTION,
    "the width of {source} is not identified: its interval is open, and only the closed end holds",
    "Use --widths common.",
)  # fmt: skip
FEWER_PARAMETERS = Kind(
    "jets.fewer-parameters", Severity.CAUTION,
    "fewer parameters suffice: {sources} with {widths} width ({free} parameters) is better by {bic:.1f} of Schwarz's criterion",
    "Use --sources and --widths as named.",
)  # fmt: skip
PRINTED_STARTS = Kind(
    "jets.printed-starts", Severity.CAUTION,
    "the printed fit has no intervals: {alike} of {starts} starts end within {share_percent:.0f} % of the best misfit, with densities of {source} "
    "from {lowest_kgm3:.2g} to {highest_kgm3:.2g} kg/m3",
    "Use --fit momentum or --fit forward.",
)  # fmt: skip


def identified_doubts(found: tuple[Source, ...], form: JetForm) -> list[Doubt]:
    """Densities and widths that the data leave open."""
    doubts = []
    for s in found:
        if not s.explained:
            continue
        if not s.density_known:
            width = "" if form.common else "; its width is not identified either"
            doubts.append(DENSITY_NOT_IDENTIFIED(source=s.jet.name, width=width))
        elif not s.width_known:
            doubts.append(WIDTH_NOT_IDENTIFIED(source=s.jet.name))
    return doubts


def score_doubts(scores: tuple[Score, ...], sources: int, form: JetForm) -> list[Doubt]:
    """Whether a choice with fewer parameters is better."""
    widths = form.widths if sources > 1 else "own"
    own = next(s for s in scores if len(s.names) == sources and s.widths == widths)
    if own.bic <= _BETTER:
        return []
    best = scores[0]
    return [FEWER_PARAMETERS(sources=list(best.names), widths=best.widths, free=best.free, bic=own.bic)]


def memory_doubts(alike: float) -> list[Doubt]:
    return [RESIDUALS_CORRELATED(alike=alike)] if alike > _CORRELATED else []


def misfit_doubts(data: JetData, left: np.ndarray, free: int) -> list[Doubt]:
    """Rows of unit noise say by themselves whether jets explain them."""
    if data.unit != "sigma":
        return []
    square, freedom = float(left @ left), len(left) - free
    if square < freedom + _MISFIT * np.sqrt(2 * freedom):
        return []
    return [NOT_EXPLAINED(chi_square=square, freedom=freedom)]
