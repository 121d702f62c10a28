"""What a user should know before trusting the sources of a torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from .compare import Model
    from .gather import Arc
    from .residual import Residual
    from .whitened import Whitened

#: A slow torque that no source explains is spoken of from this share of the torque seen, and contradicts the model from the second.
_LEFT, _MUCH = 0.05, 0.3
#: Whitened readings are no noise below this chance, and where their noise is beyond this factor of the readings' own.
_CHANCE, _NOISIER = 1e-4, 3.0
#: A set of sources is better where its BIC is lower by this.
_BETTER = 10.0

LEFT_OVER = Kind(
    "sources.left-over", Severity.CAUTION,
    "a torque of {left:.2g} {unit} (rms, {percent:.0f} % of what is seen) that changes over {lasts_s:.0f} s is explained by no source; the intervals hold it",
    "Look at the residual: --plot.",
)  # fmt: skip
NOT_EXPLAINED = Kind(
    "sources.not-explained", Severity.SUSPECT,
    "no source explains {percent:.0f} % of the torque that is seen ({left:.2g} {unit} rms, over {lasts_s:.0f} s): something else acts, or a "
    "known quantity is wrong (inertia, wheel axes, frames)",
    "Look at the residual: --plot.  Add channels of what is missing, or take a span without it.",
)  # fmt: skip
NOT_NOISE = Kind(
    "sources.not-noise", Severity.CAUTION,
    "what is left about {axes} is not noise: neighbouring readings err alike (p = {p_value:.1g}), and the intervals are rough",
    "Look at the residual: --plot.",
)  # fmt: skip
NOISIER = Kind(
    "sources.noisier", Severity.CAUTION,
    "the momentum about {axes} scatters {ratio:.0f} times more from block to block than its samples do: its noise is not white",
    "Check the body rates and the wheels' rates.",
)  # fmt: skip
STEPS = Kind(
    "sources.momentum-steps", Severity.SUSPECT,
    "{count} blocks miss the fit by more than 6 sigma, the first {first_s:.0f} s from the start, and are left out: a thruster, a docking, a mechanism?",
    "Narrow the span (--start, --stop), or exclude it (--exclude).",
)  # fmt: skip
NO_CONSTANT = Kind(
    "sources.no-constant", Severity.CAUTION,
    "no constant torque shows; one has a chance of {percent:.0f} %, which the intervals hold. Where one acts all the same, {what} is known "
    "{factor:.0f} times worse",
    "Where a constant torque is known to act (outgassing, a leak), give --sources with constant.",
)  # fmt: skip
SIMPLER = Kind(
    "sources.simpler", Severity.NOTE,
    "the record asks for {better} only: the BIC of that is lower by {bic:.0f}", "Try --sources with these.",
)  # fmt: skip
NO_SOURCE = Kind(
    "sources.left-out", Severity.NOTE, "{source} is not looked for: it needs {needs}", "Add these.",
)  # fmt: skip
FACETS = Kind(
    "sources.facets", Severity.NOTE,
    "the craft file has facets for {source}: they are not fitted, one lever stands for them, which serves while the direction in the body "
    "changes little",
    "asflown torque --with takes the facets as they are described.",
)  # fmt: skip
OWN_HARMONICS = Kind(
    "sources.own-harmonics", Severity.CAUTION,
    "what swings with two and more times the orbit's rate does so about each axis by itself: that is no density alone (arrays that turn, "
    "with the inertia and the drag), and stands under drag, whose levers are rough",
    "Look at drag's part: --plot.",
)  # fmt: skip
SHORT = Kind(
    "sources.short", Severity.CAUTION,
    "the arc is {percent:.0f} % of an orbit: sources that change over the orbit look alike",
    "Take an orbit or more.",
)  # fmt: skip


def fit_doubts(
    white: Whitened,
    theta: np.ndarray,
    residual: Residual,
    models: tuple[Model, ...],
    fitted: tuple[str, ...],
    *,
    relative: bool,
) -> list[Doubt]:
    return [
        *_left(white, theta, relative=relative), *_noise(white, residual), *_choice(models, fitted), *_of_drag(white.arc),
        *_span(white.arc),
    ]  # fmt: skip


def _left(white: Whitened, theta: np.ndarray, *, relative: bool) -> list[Doubt]:
    """The slow torque, as smoothed: a size that the fit allows but does not need is none."""
    slow = float(np.sqrt(np.mean(np.sum(white.slow_torque(theta) ** 2, axis=1))))
    seen = max(white.arc.size_Nm, slow)
    told = {
        "left": slow,
        "unit": "rad/s2 per unit spin inertia" if relative else "N m",
        "percent": 100 * slow / seen,
        "lasts_s": white.levels.slow_s,
    }
    if slow > _MUCH * seen:
        return [NOT_EXPLAINED(**told)]
    return [LEFT_OVER(**told)] if slow > _LEFT * seen else []


def _noise(white: Whitened, residual: Residual) -> list[Doubt]:
    doubts: list[Doubt] = []
    coloured = residual.white_p < _CHANCE
    if coloured.any():
        axes = [a for a, c in zip(AXES, coloured, strict=True) if c]
        doubts.append(NOT_NOISE(axes=axes, p_value=float(residual.white_p.min())))
    ratio = white.levels.white
    if (ratio > _NOISIER).any():
        doubts.append(
            NOISIER(axes=[a for a, r in zip(AXES, ratio, strict=True) if r > _NOISIER], ratio=float(ratio.max()))
        )
    if len(residual.jumps_s):
        doubts.append(STEPS(count=len(residual.jumps_s), first_s=float(residual.jumps_s[0])))
    return doubts


def _choice(models: tuple[Model, ...], fitted: tuple[str, ...]) -> list[Doubt]:
    whole = next(m for m in models if set(m.sources) == set(fitted))
    if whole.bic_above_best < _BETTER or models[0].sources == fitted:
        return []
    return [SIMPLER(better=list(models[0].sources) or "no source", bic=whole.bic_above_best)]


def _of_drag(arc: Arc) -> list[Doubt]:
    return [OWN_HARMONICS()] if arc.own_harmonics else []


def _span(arc: Arc) -> list[Doubt]:
    phase = arc.environment.phase_rad
    if phase is None or phase[-1] > np.pi:
        return []
    return [SHORT(percent=100 * float(phase[-1]) / (2 * np.pi))]
