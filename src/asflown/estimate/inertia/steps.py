"""What else would explain a fitted record: a step of momentum (a thruster that no channel reports), something that swings, or another
vector of one wheel.

Each is let in with motion and levels held, as more columns of one filter pass: a score test, in the fit's own covariance."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...dynamics.rigid_body import tensor_of
from ...kit.regressed import run
from .likelihood import Around, solved
from .linear import WHEEL
from .misread import per_vector
from .motion import Layout
from .swings import FoundSwing
from .whole_motion import cadence_s, prior_of_all

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .prior import Prior
    from .whole_motion import SlewFit

#: Steps of momentum: tried at so many readings, then between the best one's neighbours, so many in one pass; not nearer to an
#: arc's ends than so many readings.
_STEPS_TRIED, _STEPS_BETWEEN, _STEPS_AT_ONCE, _FEWEST_BESIDE = 120, 11, 20, 10

#: What swings is looked for between these frequencies [Hz]: slower ones answer a turn hardly once, quicker ones follow it; so many
#: periods in the record, and so much of one in a reading, between which the corners of a ramp are not known.
_SLOWEST_HZ, _QUICKEST_HZ, _FEWEST_SWINGS, _PER_READING = 0.003, 0.25, 5, 0.1
#: Frequencies tried at first, with so much damping that none is missed between two of them; then so many near the best, with its
#: damping and others apart by a factor, nearer every time.
_FREQUENCIES, _DAMPED, _NEAR, _DAMPINGS_APART, _ZOOMS, _SWINGS_AT_ONCE = 24, 0.1, 5, 3.0, 6, 15
#: What swings is let in where it is this large, squared, in its own covariance: of 6 degrees of freedom, chance gives it once in 1e10.
SWING_KEPT = 60.0
#: Constants that the readings tell apart from the others by less than this share do not count.
_RANK = 1e-9


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
    """A few more constants: their likeliest values, the square of these in their own covariance, and what they move the tensor's
    elements by (6,)."""

    value: np.ndarray
    square: float
    moved: np.ndarray


def _told(fit: SlewFit, columns: np.ndarray, around: Around) -> Iterator[Told]:
    """Of each group of columns of the wheels' readings (M, K, few), each group alone."""
    z, p = fit.weighted.model, fit.layout.size
    M, K, few = columns.shape
    extra = np.zeros((len(z.y), few * K))
    extra[z.kind == WHEEL] = columns.reshape(M, few * K)
    f = run(replace(fit.weighted.steps(fit.levels), Z=np.column_stack([z.Z[:, :p], extra])))
    told = f.information
    delta, _, slope = solved(f, fit.layout, around)
    score = told[p + 1 :, 0] - told[p + 1 :, 1 : p + 1] @ delta
    information = told[p + 1 :, p + 1 :] - told[p + 1 :, 1 : p + 1] @ slope
    for k in range(K):
        own = slice(few * k, few * k + few)
        value = np.linalg.lstsq(information[own, own], score[own], rcond=_RANK)[0]
        yield Told(value, float(score[own] @ value), -slope[Layout.TENSOR, own] @ value)


def swing_found(fit: SlewFit) -> tuple[FoundSwing, float]:
    """The frequency and damping at which an undescribed swing would explain most, and that swing's square in its own covariance (chi
    square of 6)."""
    size = float(np.trace(tensor_of(fit.beta[Layout.TENSOR]))) / 3
    span = float(np.ptp(fit.record.momentum.time_s))
    low, high = max(_SLOWEST_HZ, _FEWEST_SWINGS / span), min(_QUICKEST_HZ, _PER_READING / cadence_s(fit.record))
    tried = [FoundSwing(size, 2 * np.pi * f, _DAMPED) for f in np.geomspace(low, max(high, 1.01 * low), _FREQUENCIES)]
    best, square = _best(fit, tried)
    if square < SWING_KEPT:
        return best, square
    apart = np.log(max(high, 1.01 * low) / low) / (_FREQUENCIES - 1)
    for k in range(_ZOOMS):
        near = best.frequency * np.exp(apart * np.linspace(-1, 1, _NEAR))
        dampings = best.damping * _DAMPINGS_APART ** (np.array([-1.0, 0.0, 1.0]) * 0.7**k)
        found, larger = _best(fit, [FoundSwing(size, f, d) for f in near for d in dampings])
        best, square = (found, larger) if larger > square else (best, square)
        apart *= 2 / (_NEAR - 1)
    return best, square


def _best(fit: SlewFit, tried: list[FoundSwing]) -> tuple[FoundSwing, float]:
    z, m, motion = fit.weighted.model, fit.record.momentum, fit.motion
    k = z.about.step_of(m.time_s + z.about.shifts[0])
    source = z.source[z.kind == WHEEL]
    squares: list[float] = []
    for group in (tried[i : i + _SWINGS_AT_ONCE] for i in range(0, len(tried), _SWINGS_AT_ONCE)):
        held = np.stack([swing.columns(motion.time_s, motion.alpha_B)[k] for swing in group], axis=1)  # (M, K, 3, 6)
        columns = -np.einsum("mi,mkij->mkj", m.direction, held)[source]
        squares += [told.square for told in _told(fit, columns, fit.around)]
    best = int(np.argmax(squares))
    return tried[best], squares[best]


def other_vectors(fit: SlewFit) -> list[Told]:
    """Of each wheel by how much its vector (axis times spin inertia) fits differently; none where wheels are not known one by one."""
    columns = per_vector(fit.record)
    if columns is None or fit.record.wanders:
        return []
    z = fit.weighted.model
    return list(_told(fit, -columns[z.source[z.kind == WHEEL]], fit.around))
