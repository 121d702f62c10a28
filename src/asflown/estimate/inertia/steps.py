"""What else would explain a fitted record: a step of momentum (a thruster that no channel reports), or another vector of one wheel.

Each is let in with motion and levels held, as more columns of one filter pass: a score test, in the fit's own covariance."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...kit.regressed import run
from .likelihood import Around, solved
from .linear import WHEEL
from .misread import per_vector
from .motion import Layout
from .whole_motion import cadence_s, prior_of_all

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .prior import Prior
    from .whole_motion import SlewFit

#: Steps of momentum: tried at so many readings, then between the best one's neighbours, so many in one pass; not nearer to an
#: arc's ends than so many readings.
_STEPS_TRIED, _STEPS_BETWEEN, _STEPS_AT_ONCE, _FEWEST_BESIDE = 120, 11, 20, 10


def momentum_step(fit: SlewFit, prior: Prior | None = None) -> tuple[float, float]:
    """Where the total momentum most likely stepped, and that step's square in its own covariance (chi square of 3).

    As if a step were let in at each of many instants in turn, motion and levels held: all in one filter pass, then again
    between the neighbours of the best, down to the wheels' cadence.  Residuals would not show it: rates and coloured
    attitude error give way first."""
    around = fit.around
    if not fit.record.slow:
        information, centre = prior_of_all(fit.layout, prior)
        around = Around(information, centre - fit.weighted.model.about.beta)
    momentum, cadence = fit.record.momentum, cadence_s(fit.record)
    best = 0.0, 0.0
    for arc, (_, stop) in enumerate(fit.record.arcs):
        times = np.unique(momentum.time_s[momentum.arc == arc])
        if len(times) <= 2 * _FEWEST_BESIDE:
            continue
        inside = times[_FEWEST_BESIDE : len(times) - _FEWEST_BESIDE]
        low, high = inside[0], min(inside[-1], stop)
        # denser where readings are
        tried = np.unique(inside[np.linspace(0, len(inside) - 1, _STEPS_TRIED).astype(int)])
        while True:
            squares = _steps_told(fit, arc, tried, around)
            k = int(np.argmax(squares))
            best = max(best, (float(squares[k]), float(tried[k])))
            near = tried[max(k - 1, 0)], tried[min(k + 1, len(tried) - 1)]
            if near[1] - near[0] <= 2 * cadence:
                break
            tried = np.linspace(max(near[0], low), min(near[1], high), _STEPS_BETWEEN)
    return best[1], best[0]


def _steps_told(fit: SlewFit, arc: int, at_s: np.ndarray, around: Around) -> np.ndarray:
    """Chi square of a step of an arc's momentum at each instant (K,), each alone."""
    z, momentum = fit.weighted.model, fit.record.momentum
    wheels = np.flatnonzero(z.kind == WHEEL)
    when = np.where(momentum.arc == arc, momentum.time_s, -np.inf)[z.source[wheels]]
    columns = z.Z[wheels, fit.layout.momentum(arc)]
    squares = []
    for group in np.array_split(at_s, np.ceil(len(at_s) / _STEPS_AT_ONCE)):
        after = when[:, None] >= group
        squares += [told.square for told in _told(fit, columns[:, None] * after[:, :, None], around)]
    return np.array(squares)


class Told(NamedTuple):
    """Three more constants: their likeliest values, the square of these in their own covariance, and what they move the tensor's
    elements by (6,)."""

    value: np.ndarray
    square: float
    moved: np.ndarray


def _told(fit: SlewFit, columns: np.ndarray, around: Around) -> Iterator[Told]:
    """Of each group of three columns of the wheels' readings (M, K, 3), each group alone."""
    z, p = fit.weighted.model, fit.layout.size
    M, K = columns.shape[:2]
    extra = np.zeros((len(z.y), 3 * K))
    extra[z.kind == WHEEL] = columns.reshape(M, 3 * K)
    f = run(replace(fit.weighted.steps(fit.levels), Z=np.column_stack([z.Z[:, :p], extra])))
    told = f.information
    delta, _, slope = solved(f, fit.layout, around)
    score = told[p + 1 :, 0] - told[p + 1 :, 1 : p + 1] @ delta
    information = told[p + 1 :, p + 1 :] - told[p + 1 :, 1 : p + 1] @ slope
    for k in range(K):
        own = slice(3 * k, 3 * k + 3)
        value = np.linalg.solve(information[own, own], score[own])
        yield Told(value, float(score[own] @ value), -slope[Layout.TENSOR, own] @ value)


def other_vectors(fit: SlewFit) -> list[Told]:
    """Of each wheel by how much its vector (axis times spin inertia) fits differently; none where wheels are not known one by one."""
    columns = per_vector(fit.record)
    if columns is None or fit.record.wanders:
        return []
    z = fit.weighted.model
    return list(_told(fit, -columns[z.source[z.kind == WHEEL]], fit.around))
