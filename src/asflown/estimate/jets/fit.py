"""Jets of a plume fitted to the telemetry of a craft that flew through them (004 section VII, eqs 23, 26 to 28).

004 fits its six parameters to a reconstructed density, after smoothing and a loop's lag (``printed``).  Neither is needed: momentum that
wheels and body hold is the integral of the torque, sample by sample (``momentum``), and through the loop everything that is
telemetered answers to it (``forward``).  Both are linear in the density along the flyby (``jets_data``), so

    y = A rho,    rho = sum_j K_j (R_E/r_j)^1.5 exp(-(theta_j/K_theta_j)^n)

Likelihood of all widths at once (``jets_surface``), intervals by its profiles, and models of fewer jets and of one common width
beside, by Schwarz's criterion.  Noise that has a memory counts by how many independent samples it is worth.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import f as fisher

from ...dynamics.flyby import Flyby, flyby_called
from ...dynamics.plume import Jet, jet_density, model_error, plume_density, sources_passed
from ...kit.errors import BadInput, some_of
from ...kit.regression import memory
from ..density import density
from ..subject import check_on_times, slews, thrusters_firing
from .data import JetData, by_momentum, through_loop
from .printed import simplex
from .result import JetsResult, Score, Source
from .surface import WIDTHS_RAD, Surface

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

WIDTHS, FITS = ("own", "common"), ("momentum", "forward", "printed")
#: Combinations of widths grow as 44 to the power of the sources; densities not negative as 2 to it.
_MOST_OWN, _MOST_COMMON = 3, 8
#: Widths of the second lattice, over what lies within this much of the least misfit in units of sigma squared: beyond any 95 %.
_FINER, _REACH = 30, 12.0


def jets(
    telemetry: Telemetry, craft: Craft, flyby: Flyby | str, closest_approach: str | float, *, names=None, sources=None,
    widths: str = "own", fit: str = "momentum", power: float = 1, angle: str = "plane", **drag,
) -> JetsResult:  # fmt: skip
    """Densities and widths of sources that explain what a craft went through in a flyby.

    ``names``: of the published sources (Alexandria, Cairo, Damascus; all).  ``sources``: others in their place, as the flyby
    passes them.  ``widths``: each jet its own, or one common.  ``fit``: to momentum, through the loop (forward), or as 004
    (printed).  ``power`` n, ``angle``: see ``dynamics.plume.jet_density``.  ``drag``: axis, area, arm, table and directions, and the method of
    the density set beside, as in ``density``.

    Raises BadInput where ``density`` does, for unknown or too many sources, in a slew, and where the record ends before the plume."""
    for what, value, allowed in (("widths", widths, WIDTHS), ("fit", fit, FITS)):
        if value not in allowed:
            raise BadInput(f"{what} {value!r} is not known", remedy=f"Choose one of: {some_of(allowed)}.")
    if not 0.5 <= power <= 4:
        raise BadInput(f"a power of {power:g} is no jet's", remedy="004's is 1, or 2 as in its eq 24.")
    if slews(telemetry):
        raise BadInput("the craft slews in this record", remedy="Narrow the span to the flyby with --start and --stop.")
    if thrusters_firing(telemetry):
        raise BadInput(
            "thrusters fire in this record, and jets are fitted to the momentum of wheels",
            remedy="Use asflown density, which balances on-times.",
        )
    check_on_times(telemetry, craft)
    where = flyby_called(flyby) if isinstance(flyby, str) else flyby
    sources = _wanted(where, names, sources)
    most = _MOST_OWN if widths == "own" else _MOST_COMMON
    if len(sources) > most:
        raise BadInput(
            f"{len(sources)} sources with {widths} widths are more than the {most} that can be told apart here",
            remedy="Use --widths common, or fewer sources.",
        )
    met = density(telemetry, craft, where, closest_approach, cusps=False, **drag)
    for a in met.axis:
        if fit != "forward" and f"body_rate_{a}" not in telemetry:
            raise BadInput(
                "jets are fitted to the momentum of wheels and body, and the body's is not known",
                file=telemetry.source or None,
                channel=f"body_rate_{a}",
                remedy="Add the body rates.",
            )
    closest_s = float(telemetry.seconds(telemetry.moment(closest_approach)))
    data = (
        through_loop(met, sources, closest_s)
        if fit == "forward"
        else by_momentum(telemetry, craft, met, sources, closest_s)
    )
    columns = _columns(sources, where, data, power, angle, np.tile(WIDTHS_RAD, (len(sources), 1)))
    surface = Surface(data.y, columns, widths == "common")
    finer = surface.finer(surface.least * (1 + _REACH / len(data.y)), _FINER)
    surface = Surface(data.y, _columns(sources, where, data, power, angle, finer), widths == "common", finer)
    doubts: list[str] = []
    if fit == "printed":
        sources, doubts = simplex(met, sources, widths == "common", data.last_s, power=power, angle=angle)
    else:
        sources = _fitted(surface, sources)
    left = data.y - data.A @ plume_density(sources, where, data.nodes_s, power=power, angle=angle)
    alike = memory(left)
    worth = len(data.y) / alike
    free = len(sources) + (1 if widths == "common" else len(sources)) + 1
    if worth < free + 3:
        raise BadInput(
            f"{len(data.y)} samples worth {worth:.0f} independent ones do not carry {free} parameters",
            remedy="Take a longer record, fewer sources (--sources), or --widths common.",
        )
    # a profile's limit where sigma is unknown too: Fisher's in place of chi squared
    limit = surface.least * (1 + fisher.ppf(0.95, 1, worth - free) / (worth - free))
    misfit = _misfit_doubts(data, left, free)
    found = tuple(
        Source(j, (None, None), (None, None))
        if fit == "printed"
        else replace(_source(surface, i, j, limit), explained=not misfit)
        for i, j in enumerate(sources)
    )
    inside = (met.time_s >= data.nodes_s[0]) & (met.time_s <= data.last_s) & np.isfinite(met.density_kgm3)
    model = plume_density(sources, where, met.time_s, power=power, angle=angle)
    scores = () if fit == "printed" else _scores(sources, columns, data.y, worth)
    doubts += [
        *(() if fit == "printed" else _doubts(found, scores, widths, alike)),
        *misfit,
        *met.doubts,
    ]
    return JetsResult(
        density=met, sources=found, correlation=_correlation(sources, where, data, power, angle, widths),
        rms_kgm3=model_error(met.time_s[inside], model[inside], met.density_kgm3[inside]), scores=scores, widths=widths, fit=fit,
        power=power, angle=angle, model_kgm3=model, rms=float(np.sqrt(np.mean(left**2))), unit=data.unit, samples=len(data.y), worth=worth,
        doubts=tuple(dict.fromkeys(doubts)),
    )  # fmt: skip


def _wanted(flyby: Flyby, names, sources) -> list[Jet]:
    """The sources to fit, as the flyby passes them."""
    every = sources_passed(flyby, sources)
    called = {j.name.casefold(): j.name for j in every}
    wanted = [j.name for j in every] if names is None else [called.get(n.casefold(), n) for n in names]
    if not wanted or len(set(wanted)) != len(wanted) or not set(wanted) <= {j.name for j in every}:
        raise BadInput(
            f"the sources {some_of(wanted)} are not each one of those {'published' if sources is None else 'given'}",
            remedy=f"Choose of: {some_of(j.name for j in every)}.",
        )
    return [j for j in every if j.name in wanted]


def _columns(sources, flyby: Flyby, data: JetData, power: float, angle: str, widths_rad: np.ndarray) -> np.ndarray:
    """What each jet of unit density gives, for every one of its widths (J, W). (J, W, N)"""
    shapes = [
        [
            jet_density(replace(j, density_kgm3=1.0, width_rad=w), flyby, data.nodes_s, power=power, angle=angle)
            for w in widths
        ]
        for j, widths in zip(sources, widths_rad, strict=True)
    ]
    return np.array(shapes) @ data.A.T


def _fitted(surface: Surface, sources) -> list[Jet]:
    """The best jets of a surface."""
    return [
        replace(j, density_kgm3=float(K), width_rad=float(w))
        for j, K, w in zip(sources, surface.densities[surface.best], surface.widths(), strict=True)
    ]


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


def _correlation(sources, flyby, data: JetData, power, angle, widths) -> np.ndarray:
    """Of densities, then widths, by the curvature at the fit; NaN for the width of a jet that is not there."""
    n = len(sources)

    def seen(x):
        w = x[n:] if widths == "own" else np.repeat(x[n:], n)
        jets = [replace(j, density_kgm3=K, width_rad=v) for j, K, v in zip(sources, x[:n], w, strict=True)]
        return data.A @ plume_density(jets, flyby, data.nodes_s, power=power, angle=angle)

    K = np.array([j.density_kgm3 for j in sources])
    w = np.array([j.width_rad for j in sources]) if widths == "own" else np.array([sources[0].width_rad])
    x, steps = np.r_[K, w], np.r_[np.full(n, 1e-3 * max(K.max(), 1e-15)), 1e-3 * w]
    J = np.stack([(seen(x + h * e) - seen(x - h * e)) / 2 for h, e in zip(steps, np.eye(len(x)), strict=True)], axis=1)
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
            for widths in WIDTHS if 1 < n <= _MOST_OWN else WIDTHS[1:] if n > _MOST_OWN else WIDTHS[:1]:
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
        if not s.explained:
            continue
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


def _misfit_doubts(data: JetData, left: np.ndarray, free: int) -> list[str]:
    """Rows of unit noise say by themselves whether jets explain them."""
    if data.unit != "sigma":
        return []
    square, freedom = float(left @ left), len(left) - free
    if square < freedom + 5 * np.sqrt(2 * freedom):
        return []
    return [
        f"these jets do not explain the telemetry (chi-square {square:.0f} for {freedom}), so none is identified and intervals mean nothing: "
        "their form, the loop's gains, or another torque?"
    ]
