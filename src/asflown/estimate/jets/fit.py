"""Jets of a plume fitted to the telemetry of a craft that flew through them (plume paper section VII, eqs 23, 26 to 28).

The plume paper fits its six parameters to a reconstructed density, after smoothing and a loop's lag (``printed``).  Neither is
needed: the momentum that wheels and body hold is the integral of the torque, sample by sample (``momentum``), and through the
loop every telemetered channel responds to it (``forward``).  Both are linear in the density along the flyby (``data``), so

    y = A rho,    rho = sum_j K_j (R_E/r_j)^1.5 exp(-(theta_j/K_theta_j)^n)

The likelihood of all widths is computed at once (``surface``), with intervals by its profiles; models of fewer jets and of one
common width are compared by Schwarz's criterion.  Correlated noise counts by its effective sample size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.flyby import Flyby, flyby_called
from ...dynamics.plume import Jet, model_error, sources_passed
from ...kit.doubts import Doubt, Doubts
from ...kit.errors import BadInput, check_choice, some_of
from ...kit.regression import memory
from ...kit.result import recorded
from ..density import Asked, DragGiven, density_along
from ..subject import check_on_times, subject_of
from .data import by_momentum, through_loop
from .doubts import identified_doubts, memory_doubts, misfit_doubts, score_doubts
from .form import WIDTHS, JetForm, JetRegression
from .printed import simplex
from .result import JetsResult, Score, Source
from .surface import WIDTHS_RAD, Surface

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from ..density import DensityResult
    from ..subject import Subject

FITS = ("momentum", "forward", "printed")
#: Widths of the second lattice, over what lies within this much of the least misfit in units of sigma squared: beyond any 95 %.
_FINER, _REACH = 30, 12.0


@recorded
def jets(
    telemetry: Telemetry,
    craft: Craft,
    flyby: Flyby | str,
    closest_approach: str | float,
    *,
    names=None,
    sources: tuple[Jet, ...] | None = None,
    widths: str = "own",
    fit: str = "momentum",
    power: float = 1,
    angle: str = "plane",
    axis: str | None = None,
    method: str | None = None,
    area_m2: float | None = None,
    arm_m: float | None = None,
    drag_table=None,
    velocity_B=None,
    up_B=None,
) -> JetsResult:
    """Densities and widths of the jets that explain what a craft met in a flyby (plume paper eqs 26 to 28).

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates (or momentum) and body rates, from two minutes before closest approach to two minutes after, in a hold.
    craft : Craft
        Its inertia, and under [aerodynamics] its drag.
    flyby : Flyby or str
        The path past the moon, or the name of a known one: 'E3', 'E4', 'E9'.
    closest_approach : str or float
        UTC, or seconds from the telemetry's epoch.
    names : sequence of str, optional
        Which sources are fitted; all unless given.
    sources : tuple of Jet, optional
        As the flyby passes them; the published ones (Alexandria, Cairo, Damascus) unless given.
    widths : {'own', 'common'}
        One width for each jet, at most three jets, or one for all of at most eight.
    fit : {'momentum', 'forward', 'printed'}
        To momentum; through the loop to all channels, which needs the fused torque; or the plume paper's simplex on the density.
    power : float
        n of exp(-(angle / width)^n), 0.5 to 4.
    angle : {'plane', 'space'}
        The angle from a jet's axis is taken in the flyby's plane, as in the plume paper, or in space.
    axis, method, area_m2, arm_m, drag_table, velocity_B, up_B
        Of the density reconstructed without jets: see ``density``.

    Returns
    -------
    JetsResult
        Densities [kg/m3] and widths [rad] with 95 % intervals; the scale's sigma is not in the intervals.

    Raises
    ------
    BadInput
        Where ``density`` does, for unknown or too many sources, in a slew, where thrusters fire, and for a record that ends
        before the plume.
    """
    check_choice(fit, FITS, "fit")
    form = JetForm(widths, power, angle)
    where = flyby_called(flyby) if isinstance(flyby, str) else flyby
    subject = subject_of(telemetry, craft)
    _check_held(subject)
    wanted = _wanted(where, names, sources)
    if len(wanted) > form.most:
        raise BadInput(
            f"{len(wanted)} sources with {widths} widths are more than the {form.most} that can be fitted",
            remedy="Use --widths common, or fewer sources.",
        )
    drag = DragGiven(axis, area_m2, arm_m, drag_table)
    asked = Asked(where, closest_approach, drag, method, velocity_B=velocity_B, up_B=up_B, cusps=False)
    met = density_along(subject, asked)
    if fit != "forward":
        _check_rates(subject, met)
    data = through_loop(met, wanted) if fit == "forward" else by_momentum(met, wanted)
    problem = JetRegression(data, where, wanted, form)
    return _printed(met, problem) if fit == "printed" else _result(met, problem, fit)


def _check_held(subject: Subject) -> None:
    """Raises BadInput where the craft slews or thrusters hold it."""
    if subject.slewing:
        raise BadInput("the craft slews in this record", remedy="Narrow the span to the flyby with --start and --stop.")
    if subject.firing:
        raise BadInput(
            "thrusters fire in this record, and jets are fitted to the momentum of wheels",
            remedy="Use asflown density, which takes on-times.",
        )
    check_on_times(subject.telemetry, subject.craft.craft)


def _check_rates(subject: Subject, met: DensityResult) -> None:
    for a in met.axis:
        if f"body_rate_{a}" not in subject.telemetry:
            raise BadInput(
                "jets are fitted to the momentum of wheels and body, and the body's is not known",
                file=subject.telemetry.source or None,
                channel=f"body_rate_{a}",
                remedy="Add the body rates.",
            )


@dataclass(frozen=True)
class _Residual:
    """What jets leave of the telemetry: (N,), how many samples count as one, and the effective sample size."""

    left: np.ndarray
    alike: float
    worth: float


def _residual(problem: JetRegression, jets: tuple[Jet, ...]) -> _Residual:
    """Raises BadInput where too few independent samples are left for the parameters."""
    data = problem.data
    left = data.y - problem.answer(jets)
    alike = memory(left)
    worth, free = len(data.y) / alike, problem.form.free(len(jets))
    if worth < free + 3:
        raise BadInput(
            f"{free} parameters need more than the effective sample size of {worth:.0f} ({len(data.y)} samples)",
            remedy="Take a longer record, fewer sources (--sources), or --widths common.",
        )
    return _Residual(left, alike, worth)


def _result(met: DensityResult, problem: JetRegression, fit: str) -> JetsResult:
    """By the likelihood of all widths, with intervals."""
    form, data, count = problem.form, problem.data, len(problem.sources)
    columns = problem.columns(np.tile(WIDTHS_RAD, (count, 1)))
    surface = problem.surface(columns)
    finer = surface.finer(surface.least * (1 + _REACH / len(data.y)), _FINER)
    surface = problem.surface(problem.columns(finer), finer)
    fitted = _fitted(surface, problem.sources)
    residual = _residual(problem, fitted)
    free = form.free(count)
    # the limit of a profile whose sigma is unknown too: Fisher's in place of chi-squared
    limit = surface.least * (1 + scipy.special.fdtri(1, residual.worth - free, 0.95) / (residual.worth - free))
    misfit = misfit_doubts(data, residual.left, free)
    found = tuple(replace(_source(surface, i, j, limit), explained=not misfit) for i, j in enumerate(fitted))
    scores = _scores(problem, columns, residual.worth)
    doubts = [
        *misfit,
        *memory_doubts(residual.alike),
        *identified_doubts(found, form),
        *score_doubts(scores, count, form),
    ]
    return _assembled(met, problem, fit, found, residual, scores, doubts)


def _printed(met: DensityResult, problem: JetRegression) -> JetsResult:
    """The plume paper's simplex, without intervals."""
    fitted, doubts = simplex(met, problem.sources, problem.form, problem.data.last_s)
    found = tuple(Source(j) for j in fitted)
    residual = _residual(problem, fitted)
    misfit = misfit_doubts(problem.data, residual.left, problem.form.free(len(fitted)))
    return _assembled(met, problem, "printed", found, residual, (), [*misfit, *doubts])


def _assembled(
    met: DensityResult, problem: JetRegression, fit: str, found: tuple[Source, ...], residual: _Residual,
    scores: tuple[Score, ...], doubts: list[Doubt],
) -> JetsResult:  # fmt: skip
    form, data, t = problem.form, problem.data, met.time_s
    jets = tuple(s.jet for s in found)
    model = form.together(jets, problem.flyby, t)
    inside = (t >= data.nodes_s[0]) & (t <= data.last_s) & np.isfinite(met.density_kgm3)
    of_momentum = met.momentum.doubts if fit != "forward" and met.momentum is not None else ()
    return JetsResult(
        craft=met.craft,
        epoch=met.epoch,
        method=fit,
        variant="printed" if fit == "printed" else "corrected",
        density=met,
        sources=found,
        form=form,
        correlation=_correlation(problem, jets),
        rms_kgm3=model_error(t[inside], model[inside], met.density_kgm3[inside]),
        scores=scores,
        model_kgm3=model,
        each_kgm3=np.array([form.of(j, problem.flyby, t) for j in jets]),
        rms=float(np.sqrt(np.mean(residual.left**2))),
        unit=data.unit,
        samples=len(data.y),
        effective_samples=residual.worth,
        inputs=met.inputs,
        doubts=Doubts([*doubts, *met.doubts.passed_on_by("density"), *of_momentum]),
    )


def _wanted(flyby: Flyby, names, sources) -> tuple[Jet, ...]:
    """The sources to fit, as the flyby passes them."""
    every = sources_passed(flyby, sources)
    called = {j.name.casefold(): j.name for j in every}
    wanted = [j.name for j in every] if names is None else [called.get(n.casefold(), n) for n in names]
    if not wanted or len(set(wanted)) != len(wanted) or not set(wanted) <= {j.name for j in every}:
        raise BadInput(
            f"the sources {some_of(wanted)} are not each one of those {'published' if sources is None else 'given'}",
            remedy=f"Choose from: {some_of(j.name for j in every)}.",
        )
    return tuple(j for j in every if j.name in wanted)


def _fitted(surface: Surface, sources: tuple[Jet, ...]) -> tuple[Jet, ...]:
    """The best jets of a surface."""
    return tuple(
        replace(j, density_kgm3=float(K), width_rad=float(w))
        for j, K, w in zip(sources, surface.densities[surface.best], surface.widths(), strict=True)
    )


def _source(surface: Surface, jet_number: int, jet: Jet, limit: float) -> Source:
    """A jet with the intervals of its profiles; None at an end that the data leave open."""
    lattice = surface.widths_rad[jet_number]
    inside = lattice[surface.width_profile(jet_number) <= limit]
    step = np.sqrt(lattice[1] / lattice[0])  # the lattice's own
    widths = (
        None if inside[0] <= WIDTHS_RAD[0] * (1 + 1e-9) else float(inside[0] / step),
        None if inside[-1] >= WIDTHS_RAD[-1] * (1 - 1e-9) else float(inside[-1] * step),
    )
    largest = max(surface.densities[surface.misfit <= limit, jet_number].max(), jet.density_kgm3)
    low = _crossing(surface, jet_number, jet.density_kgm3, 0.0, limit)
    high = _crossing(surface, jet_number, jet.density_kgm3, 2.0 * largest + 1e-15, limit)
    return Source(jet, (low or 0.0, high), widths)


def _crossing(surface: Surface, jet_number: int, best: float, end: float, limit: float) -> float | None:
    """Where the density's profile crosses the limit between its best and an end; None where it does not."""
    if surface.density_profile(jet_number, end) <= limit:
        return None
    inner, outer = best, end
    while abs(outer - inner) > 0.005 * max(abs(best), abs(end)):
        middle = 0.5 * (inner + outer)
        if surface.density_profile(jet_number, middle) <= limit:
            inner = middle
        else:
            outer = middle
    return 0.5 * (inner + outer)


def _correlation(problem: JetRegression, jets: tuple[Jet, ...]) -> np.ndarray:
    """Of densities, then widths, by the curvature at the fit; NaN for the width of a jet that is not there."""
    n, common = len(jets), problem.form.common

    def seen(x):
        w = np.repeat(x[n:], n) if common else x[n:]
        return problem.answer([replace(j, density_kgm3=K, width_rad=v) for j, K, v in zip(jets, x[:n], w, strict=True)])

    K = np.array([j.density_kgm3 for j in jets])
    w = np.array([j.width_rad for j in (jets[:1] if common else jets)])
    x, steps = np.r_[K, w], np.r_[np.full(n, 1e-3 * max(K.max(), 1e-15)), 1e-3 * w]
    J = np.stack([(seen(x + h * e) - seen(x - h * e)) / 2 for h, e in zip(steps, np.eye(len(x)), strict=True)], axis=1)
    known = np.linalg.norm(J, axis=0) > 0
    found = np.full((len(x), len(x)), np.nan)
    J = J[:, known] / np.linalg.norm(J[:, known], axis=0)
    C = np.linalg.inv(J.T @ J + 1e-12 * np.eye(J.shape[1]))
    s = np.sqrt(np.diag(C))
    found[np.ix_(known, known)] = C / np.outer(s, s)
    return found


def _scores(problem: JetRegression, columns, worth: float) -> tuple[Score, ...]:
    """Every choice of these sources, widths common and own, by Schwarz's criterion; the least is the best."""
    sources, y = problem.sources, problem.data.y
    found = []
    for n in range(1, len(sources) + 1):
        forms = [JetForm(w) for w in WIDTHS if n <= JetForm(w).most and (n > 1 or w == "own")]
        for some in combinations(range(len(sources)), n):
            for form in forms:
                least, free = Surface(y, columns[list(some)], common=form.common).least, form.free(n)
                names = tuple(sources[i].name for i in some)
                bic = float(worth * np.log(least / len(y)) + free * np.log(worth))
                found.append(Score(names, form.widths, free, bic))
    best = min(s.bic for s in found)
    return tuple(sorted((replace(s, bic=s.bic - best) for s in found), key=lambda s: s.bic))
