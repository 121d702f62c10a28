"""Jets of a plume fitted to the momentum that they gave a craft (004 section VII, eqs 23, 26 to 28).

004 fits its six parameters to a reconstructed density, after smoothing and a loop's lag.  Momentum needs neither: what a jet has
given by an instant is the integral of its torque, wheels and body together hold it, and its noise is that of the sensors.

    H(t) = H(0) + T/rho  sum_j K_j int (R_E/r_j)^1.5 exp(-(theta_j/K_theta_j)^n) dt

Likelihood of all widths at once (``jets_surface``), intervals by its profiles, and models of fewer jets and of one common width
beside, by Schwarz's criterion.  Noise that has a memory counts by how many independent samples it is worth.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.stats import f as fisher

from ..craft.model import Craft
from ..dynamics.flyby import Flyby
from ..dynamics.plume import (
    FARTHEST_M,
    Jet,
    as_passed,
    jet_density,
    model_error,
    plume_density,
    published_jets,
    seen_from,
)
from ..kit.errors import BadInput, some_of
from ..kit.regression import memory
from ..telemetry.telemetry import Telemetry
from .density import density
from .external_samples import samples_of
from .jets_result import JetsResult, Score, Source
from .jets_surface import WIDTHS_RAD, Surface
from .result import AXES
from .subject import slews, subject_of, thrusters_firing

WIDTHS = ("own", "common")
_STEP_S = 0.25  # of the integral: a jet's cusp is seen
_BEFORE_S = 120.0  # of quiet before closest approach, to know the momentum that craft and wheels had


def jets(
    telemetry: Telemetry, craft: Craft, flyby: Flyby | str, closest_approach: str | float, *, names=None, widths: str = "own",
    power: float = 1, angle: str = "plane", **drag,
) -> JetsResult:  # fmt: skip
    """Densities and widths of the published sources that explain the momentum gained in a flyby.

    ``names``: sources (Alexandria, Cairo, Damascus; all).  ``widths``: each jet its own, or one common.  ``power`` n, ``angle``:
    see ``dynamics.plume.jet_density``.  ``drag``: axis, area, arm and directions, and the method of the density set beside, as in ``density``.

    Raises BadInput where ``density`` does, for unknown sources, in a slew, and where the record ends before the plume."""
    if widths not in WIDTHS:
        raise BadInput(f"widths {widths!r} is not known", remedy=f"Choose one of: {some_of(WIDTHS)}.")
    if not 0.5 <= power <= 4:
        raise BadInput(f"a power of {power:g} is no jet's", remedy="004's is 1, or 2 as in its eq 24.")
    if slews(telemetry):
        raise BadInput("the craft slews in this record", remedy="Narrow the span to the flyby with --start and --stop.")
    if thrusters_firing(telemetry):
        raise BadInput(
            "thrusters fire in this record, and jets are fitted to the momentum of wheels",
            remedy="Use asflown density, which balances on-times.",
        )
    met = density(telemetry, craft, flyby, closest_approach, **drag)
    where = met.flyby
    every = [as_passed(j, where) for j in published_jets()]
    wanted = [j.name for j in every] if names is None else list(names)
    if not wanted or len(set(wanted)) != len(wanted) or not set(wanted) <= {j.name for j in every}:
        raise BadInput(
            f"the sources {some_of(wanted)} are not each one of those published",
            remedy=f"Choose of: {some_of(j.name for j in every)}.",
        )
    sources = [j for j in every if j.name in wanted]
    t, y = _gained(telemetry, craft, met, sources, float(telemetry.seconds(telemetry.moment(closest_approach))))
    columns = _impulses(sources, where, t, met.torque_per_density, power, angle)
    surface = Surface(y, columns, widths == "common")
    sources, left = _fitted(surface, sources, columns, y)
    alike = memory(left)
    worth = len(y) / alike
    free = len(sources) + (1 if widths == "common" else len(sources)) + 1
    if worth < free + 3:
        raise BadInput(
            f"{len(y)} samples worth {worth:.0f} independent ones do not carry {free} parameters",
            remedy="Take a longer record, fewer sources (--sources), or --widths common.",
        )
    # a profile's limit where sigma is unknown too: Fisher's in place of chi squared
    limit = surface.least * (1 + fisher.ppf(0.95, 1, worth - free) / (worth - free))
    found = tuple(_source(surface, i, jet, limit) for i, jet in enumerate(sources))
    inside = (met.time_s >= t[0]) & (met.time_s <= t[-1]) & np.isfinite(met.density_kgm3)
    model = plume_density(sources, where, met.time_s, power=power, angle=angle)
    scores = _scores(sources, columns, y, worth)
    doubts = [*_doubts(found, scores, widths, alike), *met.doubts]
    return JetsResult(
        density=met, sources=found, correlation=_correlation(sources, where, t, met.torque_per_density, power, angle, widths),
        rms_kgm3=model_error(met.time_s[inside], model[inside], met.density_kgm3[inside]), scores=scores, widths=widths,
        power=power, angle=angle, model_kgm3=model, momentum_rms_Nms=float(np.sqrt(np.mean(left**2))), samples=len(y), worth=worth,
        doubts=tuple(dict.fromkeys(doubts)),
    )  # fmt: skip


def _gained(telemetry: Telemetry, craft: Craft, met, sources, closest_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants from closest approach and momentum about the axis, less what gravity gradient gave, centred. (N,), (N,)"""
    s = samples_of(subject_of(telemetry, craft))
    t = telemetry.seconds(s.tai_ns) - closest_s
    reach = np.max([seen_from(j, met.flyby, t)[0] for j in sources], axis=0)
    used = (t >= -_BEFORE_S) & (reach <= FARTHEST_M)
    if used.sum() < 8 or t[used][-1] < 20:
        raise BadInput(
            f"{used.sum()} instants of the plume are in this record: too few for jets",
            remedy="Take the record from two minutes before closest approach to two minutes after.",
        )
    H = s.momentum[:, AXES.index(met.axis)]
    if met.gravity_gradient_Nm is not None:
        given = cumulative_trapezoid(met.gravity_gradient_Nm, met.time_s, initial=0)
        H = H - np.interp(t, met.time_s, given)
    return t[used], H[used] - H[used].mean()


def _impulses(sources, flyby: Flyby, t, per_density: float, power: float, angle: str) -> np.ndarray:
    """Momentum that each jet of unit density has given by each instant, for every width, centred. (J, W, N)"""
    fine = np.arange(t[0], t[-1] + _STEP_S, _STEP_S)
    columns = np.empty((len(sources), len(WIDTHS_RAD), len(t)))
    for i, jet in enumerate(sources):
        for k, width in enumerate(WIDTHS_RAD):
            rho = jet_density(replace(jet, density_kgm3=1.0, width_rad=width), flyby, fine, power=power, angle=angle)
            columns[i, k] = per_density * np.interp(t, fine, cumulative_trapezoid(rho, fine, initial=0))
    return columns - columns.mean(axis=2, keepdims=True)


def _fitted(surface: Surface, sources, columns, y) -> tuple[list[Jet], np.ndarray]:
    """The best jets of a surface, and what they leave of the momentum."""
    widths, densities = surface.widths(), surface.densities[surface.best]
    at = np.searchsorted(WIDTHS_RAD, widths * (1 - 1e-9))
    left = y - sum(K * columns[i, k] for i, (K, k) in enumerate(zip(densities, at, strict=True)))
    return [
        replace(j, density_kgm3=float(K), width_rad=float(w))
        for j, K, w in zip(sources, densities, widths, strict=True)
    ], left


def _source(surface: Surface, jet_number: int, jet: Jet, limit: float) -> Source:
    """A jet with the intervals of its profiles; None at an end that the data leave open."""
    inside = WIDTHS_RAD[surface.width_profile(jet_number) <= limit]
    step = np.sqrt(WIDTHS_RAD[1] / WIDTHS_RAD[0])  # the lattice's own
    widths = (
        None if inside[0] == WIDTHS_RAD[0] else float(inside[0] / step),
        None if inside[-1] == WIDTHS_RAD[-1] else float(inside[-1] * step),
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


def _correlation(sources, flyby, t, per_density, power, angle, widths) -> np.ndarray:
    """Of densities, then widths, by the curvature at the fit; NaN for the width of a jet that is not there."""
    n = len(sources)

    def momentum(x):
        w = x[n:] if widths == "own" else np.repeat(x[n:], n)
        rho = plume_density(
            [replace(j, density_kgm3=K, width_rad=v) for j, K, v in zip(sources, x[:n], w, strict=True)],
            flyby, fine, power=power, angle=angle,
        )  # fmt: skip
        H = np.interp(t, fine, cumulative_trapezoid(per_density * rho, fine, initial=0))
        return H - H.mean()

    fine = np.arange(t[0], t[-1] + _STEP_S, _STEP_S)
    K = np.array([j.density_kgm3 for j in sources])
    w = np.array([j.width_rad for j in sources]) if widths == "own" else np.array([sources[0].width_rad])
    x, steps = np.r_[K, w], np.r_[np.full(n, 1e-3 * max(K.max(), 1e-15)), 1e-3 * w]
    J = np.stack(
        [(momentum(x + h * e) - momentum(x - h * e)) / 2 for h, e in zip(steps, np.eye(len(x)), strict=True)], axis=1
    )
    known = np.linalg.norm(J, axis=0) > 0
    found = np.full((len(x), len(x)), np.nan)
    J = J[:, known] / np.linalg.norm(J[:, known], axis=0)
    C = np.linalg.inv(J.T @ J + 1e-12 * np.eye(J.shape[1]))
    s = np.sqrt(np.diag(C))
    found[np.ix_(known, known)] = C / np.outer(s, s)
    return found


def _scores(sources, columns, y, worth: float) -> tuple[Score, ...]:
    """Every choice of these sources, widths common and own, by Schwarz's criterion; the least is the best."""
    found = []
    for n in range(1, len(sources) + 1):
        for some in combinations(range(len(sources)), n):
            for widths in WIDTHS if n > 1 else WIDTHS[:1]:
                least = Surface(y, columns[list(some)], widths == "common").least
                free = n + (n if widths == "own" else 1) + 1
                names = tuple(sources[i].name for i in some)
                found.append(Score(names, widths, free, float(worth * np.log(least / len(y)) + free * np.log(worth))))
    best = min(s.bic for s in found)
    return tuple(sorted((replace(s, bic=s.bic - best) for s in found), key=lambda s: s.bic))


def _doubts(found, scores, widths: str, alike: float) -> list[str]:
    doubts = []
    width = "; its width means nothing" if widths == "own" else ""
    for s in found:
        if not s.density_known:
            doubts.append(
                f"{s.jet.name} is not identified: its density may be zero, and an upper limit is all there is{width}"
            )
        elif not s.width_known:
            doubts.append(f"{s.jet.name}'s width is not identified: its interval is open, a limit is all there is")
    best = scores[0]
    own = next(s for s in scores if len(s.names) == len(found) and s.widths == (widths if len(found) > 1 else "own"))
    if own.bic > 2:
        doubts.append(
            f"fewer parameters say as much: {' and '.join(best.names)} with {best.widths} width{'s' if best.widths == 'own' and len(best.names) > 1 else ''} "
            f"({best.free} parameters) is better by {own.bic:.1f} of Schwarz's criterion"
        )
    if alike > 2:
        doubts.append(
            f"residuals follow each other ({alike:.1f} are worth one): these jets do not explain all of the momentum"
        )
    return doubts
