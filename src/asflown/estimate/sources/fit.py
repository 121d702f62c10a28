"""The torque of a craft taken apart into its sources, from the momentum of body and wheels over an arc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Doubt, Doubts
from ...kit.errors import BadInput, check_choice
from ...kit.result import recorded
from ..subject import PER_SPIN_INERTIA, subject_of
from .compare import Model, compare
from .doubts import NO_CONSTANT, NO_SOURCE, fit_doubts
from .gather import ALONE, DENSITY, Arc, gather, with_harmonics
from .residual import residual_of
from .result import Fitted, SourcesResult
from .swing import Posterior, posterior
from .untold import Told, untold_in, words
from .whitened import Whitened, whitened

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from ..environment import Air
    from ..subject import Subject

SOURCES = ("dipole", "sunlight", "drag", "constant")
#: A constant torque is in the model where it explains more than chance would in one record of twenty (likelihood ratio).
_BY_CHANCE = 0.05
#: Rounds in which the density's harmonics follow the lever, and cells of the swing's grid in them.
_ROUNDS, _CELLS = 3, 16
#: A component is told where the data leave less than this share of what was open before.
_TOLD = 0.7


@recorded
def sources(
    telemetry: Telemetry,
    craft: Craft,
    *,
    which: Sequence[str] | None = None,
    without: Sequence[str] = (),
    air: Air | None = None,
) -> SourcesResult:
    """What the torque of the surroundings on a craft is made of.

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates (or wheel momentum, or control torque), body rates, quaternion; orbit, magnetic field, Sun and torque rods
        where there are.
    craft : Craft
        Inertia, wheels; ``orbit`` where the telemetry has no positions.
    which : sequence of str, optional
        Sources looked for, of 'dipole', 'sunlight', 'drag', 'constant'; by default all whose vectors are known, the constant torque
        only where the record asks for it (likelihood ratio, p < 0.05).
    without : sequence of str
        Sources left out.
    air : Air, optional
        Solar flux and Ap of the day, for NRLMSIS; without it the density falls exponentially with height.  Either way it swings
        over the orbit by an amplitude and a phase that are fitted.

    Returns
    -------
    SourcesResult
        Residual dipole [A m2], levers of sunlight and drag and constant torque [N m], body axes, with intervals that hold what
        the arc cannot tell; sunlight = lit (lever x s), drag = rho / rho_0 lever x (-v/|v|).

    Raises
    ------
    BadInput
        Where momentum or inertia are not known, thrusters fire, or no source can be looked for.
    """
    for name in (*(which or ()), *without):
        check_choice(name, SOURCES, "source")
    subject = subject_of(telemetry, craft)
    asked = tuple(n for n in SOURCES if n in (which or SOURCES) and n not in without)
    try:
        arc = gather(subject, asked, air)
    except BadInput as why:
        raise why.within(telemetry.source) from why.__cause__
    fitted = tuple(n for n in asked if arc.of(n).any())
    if not fitted:
        raise BadInput(
            "none of the sources asked for can be looked for: "
            + "; ".join(f"{n} needs {w}" for n, w in arc.environment.left_out.items()),
            file=telemetry.source or None,
            remedy="Add these channels.",
        )
    white = _whitened(arc, fitted, modelled=air is not None)
    models = compare(white, fitted)
    chosen: list[Doubt] = []
    if which is None and "constant" in fitted:
        fitted, chosen = _needed(white, models, fitted)
    return _result(subject, white, fitted, models, asked, chosen)


def _whitened(arc: Arc, fitted: tuple[str, ...], *, modelled: bool) -> Whitened:
    """With higher harmonics of drag, whichever are likelier: the density's, common to the axes and following the lever found, or such
    of each axis' own, where what swings with the orbit is not the density alone (arrays that turn)."""
    if "drag" not in fitted:
        return whitened(arc)
    drag = arc.of("drag")
    per_lever = arc.torque[:, :, drag]
    # a lever as large as the torque that is seen, until one is known
    white = best = whitened(with_harmonics(arc, per_lever / ALONE, modelled=modelled))
    least = tuple(n for n in fitted if n != "constant")
    for _ in range(_ROUNDS):
        lever = posterior(white, least, _CELLS).whole(white)[: len(drag)][drag]
        white = whitened(with_harmonics(arc, (per_lever @ lever)[:, :, None], modelled=modelled), white.levels)
        best = min(best, white, key=lambda w: w.cost)
    return best


def _result(
    subject: Subject, white: Whitened, fitted: tuple[str, ...], models: tuple[Model, ...], asked: tuple[str, ...],
    chosen: list[Doubt],
) -> SourcesResult:  # fmt: skip
    arc, around = white.arc, white.arc.environment
    found = posterior(white, fitted)
    told = _told(arc, found)
    theta = found.whole(white)
    residual = residual_of(white, theta)
    left_out = {n: w for n, w in around.left_out.items() if n in asked or n == "gravity-gradient"}
    doubts = [
        *subject.doubts, *arc.doubts, *(NO_SOURCE(source=n, needs=w) for n, w in left_out.items()), *chosen,
        *fit_doubts(white, theta, residual, models, fitted, relative=subject.relative),
        PER_SPIN_INERTIA(what="the torque is") if subject.relative else None,
    ]  # fmt: skip
    return SourcesResult(
        craft=subject.craft.craft.name,
        epoch=subject.telemetry.epoch_label,
        method="momentum",
        found={n: _fitted(arc, found, told, n) for n in fitted},
        inertia=_fitted(arc, found, told, "inertia") if arc.of("inertia").any() else None,
        swing=_swing(found) if "drag" in fitted else None,
        correlations=_correlations(arc, found),
        time_s=subject.telemetry.seconds(arc.tai_ns),
        contributions=_contributions(arc, theta, fitted),
        lit=None if around.lit is None else np.interp(arc.tai_ns, around.tai_ns, around.lit),
        phase_rad=arc.phase,
        residual=residual,
        size_Nm=arc.size_Nm,
        untold=untold_in(arc, found, told, fitted),
        models=models,
        relative=subject.relative,
        where_from={t.name: t.source for t in around.terms},
        left_out=left_out,
        settings=_settings(white),
        doubts=Doubts(doubts),
    )


def _needed(white: Whitened, models: tuple[Model, ...], fitted: tuple[str, ...]) -> tuple[tuple[str, ...], list[Doubt]]:
    """The sources without the constant torque where it explains no more than chance would, and what that hides."""
    without = tuple(n for n in fitted if n != "constant")
    bic = {frozenset(m.sources): m.bic_above_best for m in models}
    if not without:
        return fitted, []
    free = int(white.arc.of("constant").sum())
    gain = bic[frozenset(without)] - bic[frozenset(fitted)] + free * np.log(white.kept.sum())
    chance = float(scipy.special.chdtrc(free, gain))
    if chance < _BY_CHANCE:
        return fitted, []
    names = white.arc.columns
    kept = [
        (int(c), k) for k, c in enumerate(np.flatnonzero(posterior(white, without).kept)) if names[c].source in without
    ]
    one, other = posterior(white, without), posterior(white, fitted)
    place = {int(c): k for k, c in enumerate(np.flatnonzero(other.kept))}
    with_it, without_it = np.diag(other.spread), np.diag(one.spread)
    wider = [(np.sqrt(with_it[place[c]] / without_it[k]), names[c]) for c, k in kept]
    factor, column = max(wider, key=lambda w: w[0])
    return without, [NO_CONSTANT(p_value=chance, factor=float(factor), what=words(column))]


def _told(arc: Arc, found: Posterior) -> dict[int, Told]:
    """Every unknown that is looked for, by its column in the arc: place in the posterior, and whether the data tell it."""
    left = np.sqrt(np.diag(found.spread))
    place = {int(c): k for k, c in enumerate(np.flatnonzero(found.kept))}
    return {c: Told(k, left[k] < _TOLD) for c, k in place.items() if arc.columns[c].source}


def _fitted(arc: Arc, found: Posterior, told: dict[int, Told], source: str) -> Fitted:
    at = np.flatnonzero(arc.of(source))
    sigma = np.array([arc.columns[c].sigma for c in at])
    places = [told[int(c)].place for c in at]
    intervals = np.array([found.interval(k) for k in places]) * sigma[:, None]
    return Fitted(
        names=tuple(arc.columns[c].name for c in at),
        unit=arc.columns[at[0]].unit,
        value=found.at[places] * sigma,
        sigma=np.sqrt(np.diag(found.spread)[places]) * sigma,
        ci95=intervals,
        told=np.array([told[int(c)].told for c in at]),
    )


def _swing(found: Posterior) -> dict[str, float]:
    """Amplitude of the density's swing, its mean and spread, and the place in the orbit where it is largest. [rad]"""
    size = np.hypot(*found.swing.T)
    mean = float(found.weight @ size)
    a, b = found.weight @ found.swing
    return {
        "amplitude": mean,
        "amplitude_sigma": float(np.sqrt(max(found.weight @ size**2 - mean**2, 0.0))),
        "phase_rad": float(np.arctan2(b, a)),
    }


def _correlations(arc: Arc, found: Posterior) -> dict[str, dict[str, float]]:
    """Between all unknowns that are looked for, by names such as 'dipole x'."""
    kept = np.flatnonzero(found.kept)
    places = [k for k, c in enumerate(kept) if arc.columns[c].source]
    names = [f"{arc.columns[kept[k]].source} {arc.columns[kept[k]].name}" for k in places]
    C = found.spread[np.ix_(places, places)]
    C = C / np.sqrt(np.outer(np.diag(C), np.diag(C)))
    return {a: {b: float(v) for b, v in zip(names, row, strict=True)} for a, row in zip(names, C, strict=True)}


def _contributions(arc: Arc, theta: np.ndarray, fitted: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Torque of every source at the blocks' middles, (K, 3) each; the known ones too."""
    made = {n: v.copy() for n, v in arc.known.items()}
    for name in fitted:
        use = arc.of(name) | arc.of(f"{name} cos") | arc.of(f"{name} sin")
        if name == "drag":
            use |= np.array([c.name.startswith(DENSITY) for c in arc.columns])
        made[name] = arc.torque[:, :, use] @ theta[use]
    for name, columns in (
        ("gravity-gradient", arc.of("inertia")),
        ("rods", np.array([c.name == "rods" for c in arc.columns])),
    ):
        if name in made:
            made[name] = made[name] + arc.torque[:, :, columns] @ theta[columns]
    return made


def _settings(white: Whitened) -> dict:
    levels, arc = white.levels, white.arc
    return {
        "block_s": arc.step_s,
        "blocks": len(arc.time_s),
        "noise_Nms": levels.white * arc.white,
        "slow_torque_Nm": levels.slow_Nm,
        "slow_torque_s": levels.slow_s,
        "left_out_readings": int((~white.kept).sum()),
    }
