"""The torque of a craft taken apart into its sources, from the momentum of body and wheels over an arc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts
from ...kit.errors import BadInput, check_choice
from ...kit.result import recorded
from ..environment import misread_wheels
from ..subject import PER_SPIN_INERTIA, actuators, subject_of
from .compare import Model, compare
from .doubts import FACETS, NO_CONSTANT, NO_SOURCE, fit_doubts
from .gather import ALONE, DENSITY, FIELD_BIAS, Arc, gather, with_field_bias, with_harmonics
from .residual import residual_of
from .result import Fitted, SourcesResult
from .swing import Averaged, Posterior, averaged, posterior
from .untold import Told, untold_in, words
from .whitened import Whitened, whitened

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from ..environment import Air
    from ..subject import Subject

SOURCES = ("dipole", "sunlight", "drag", "constant")
#: A constant torque shows from this chance on; one that does not is spoken of where it would make something known so many times worse.
_SHOWS, _WORSE = 0.5, 2.0
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
        Sources looked for, of 'dipole', 'sunlight', 'drag', 'constant'; by default all whose vectors are known, with a constant
        torque of unknown size, which may be next to none; where 'constant' is named, one acts.
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
    average = averaged(white, fitted) if which is None and "constant" in fitted else None
    return _result(subject, white, average, fitted, models, asked)


def _whitened(arc: Arc, fitted: tuple[str, ...], *, modelled: bool) -> Whitened:
    """With higher harmonics of drag, whichever are likelier: the density's, common to the axes and following the lever found, or such
    of each axis' own, where what swings with the orbit is not the density alone (arrays that turn).  With the bias of a magnetometer."""
    least = tuple(n for n in fitted if n != "constant")
    if "drag" not in fitted:
        white = whitened(arc)
        biased = _with_bias(white, arc, least)
        return white if biased is arc else whitened(biased, white.levels)
    drag = arc.of("drag")
    per_lever = arc.torque[:, :, drag]
    # a lever as large as the torque that is seen, until one is known
    white = best = whitened(with_harmonics(arc, per_lever / ALONE, modelled=modelled))
    arc = _with_bias(white, arc, least)
    for _ in range(_ROUNDS):
        lever = posterior(white, least, _CELLS).whole(white)[np.flatnonzero(drag)]
        white = whitened(with_harmonics(arc, (per_lever @ lever)[:, :, None], modelled=modelled), white.levels)
        best = min(best, white, key=lambda w: w.cost)
    return best


def _with_bias(white: Whitened, arc: Arc, sources: tuple[str, ...]) -> Arc:
    """The arc with the bias of its magnetometer, where one is used, by the dipole that is found without."""
    term = arc.environment.term("dipole")
    if "dipole" not in sources or term is None or not term.measured:
        return arc
    at = np.flatnonzero(arc.of("dipole"))
    dipole = posterior(white, sources, _CELLS).whole(white)[at] * [arc.columns[c].sigma for c in at]
    return with_field_bias(arc, dipole)


def _result(
    subject: Subject, white: Whitened, average: Averaged | None, fitted: tuple[str, ...], models: tuple[Model, ...],
    asked: tuple[str, ...],
) -> SourcesResult:  # fmt: skip
    arc, around = white.arc, white.arc.environment
    found = posterior(white, fitted) if average is None else average.whole
    shown = fitted
    if average is not None and average.chance < _SHOWS:
        shown = tuple(n for n in fitted if n != "constant")
    told = _told(arc, found)
    theta = found.whole(white)
    residual = residual_of(white, theta)
    left_out = {n: w for n, w in around.left_out.items() if n in asked or n == "gravity-gradient"}
    doubts = [
        *subject.doubts, *arc.doubts, *(NO_SOURCE(source=n, needs=w) for n, w in left_out.items()), *_constant(average, arc),
        _misread(subject, arc), _of_facets(subject, fitted),
        *fit_doubts(white, theta, residual, models, shown, relative=subject.relative),
        PER_SPIN_INERTIA(what="the torque is") if subject.relative else None,
    ]  # fmt: skip
    return SourcesResult(
        craft=subject.craft.craft.name,
        epoch=subject.telemetry.epoch_label,
        method="momentum",
        found={n: _fitted(arc, found, told, n) for n in fitted},
        inertia=_fitted(arc, found, told, "inertia") if arc.of("inertia").any() else None,
        constant_chance=None if average is None else average.chance,
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


def _constant(found: Averaged | None, arc: Arc) -> list[Doubt]:
    """A doubt about a constant torque that does not show, and what it would hide."""
    if found is None or found.chance > _SHOWS:
        return []
    names = [arc.columns[c] for c in np.flatnonzero(found.none.kept)]
    worse = np.sqrt(np.diag(found.widest.spread) / np.diag(found.none.spread))
    factor, column = max(
        ((w, c) for w, c in zip(worse, names, strict=True) if c.source not in ("constant", "inertia")),
        key=lambda of: of[0],
        default=(1.0, None),
    )
    if column is None or factor < _WORSE:
        return []
    return [NO_CONSTANT(percent=100 * found.chance, factor=float(factor), what=words(column))]


def _misread(subject: Subject, arc: Arc) -> Doubt | None:
    """A doubt about wheels whose axes or channels are not what they are taken for."""
    each = arc.each
    if not each.shape[1]:
        return None
    stored = actuators(subject)[0]
    names = [c.member if c.kind.stem == "wheel_rate" else c.name for c, _ in stored]
    return misread_wheels(arc.momentum, arc.Z, each, np.array([d for _, d in stored]), names)


def _of_facets(subject: Subject, fitted: tuple[str, ...]) -> Doubt | None:
    craft = subject.craft.craft
    given = {"sunlight": craft.sunlight, "drag": craft.aerodynamics}
    on = [n for n in fitted if getattr(given.get(n), "facets", ())]
    return FACETS(source=on) if on else None


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
        if name == "dipole":
            use |= np.array([c.name.startswith(FIELD_BIAS) for c in arc.columns])
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
