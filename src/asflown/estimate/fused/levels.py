"""Levels of largest posterior on one axis: sizes, times and noises, outliers, and clocks that disagree.

Marginal likelihood of all samples under the smooth (Matern) torque, with weak log-normal priors that keep
what the data say nothing about near where the channels themselves put it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.smoother import log_likelihood, score, smooth
from .body import AxisData, Body, Known, Levels
from .series import ROWS, Series, step_of

#: A sample that all the others contradict by more than this is left out; the most that may be. [sigma]
OUTLYING, _MOST_OUTLYING = 5.0, 0.1
#: A bad sample makes its neighbours look bad: of those this close only the worst is left out at a time. [s]
_NEIGHBOURS_S = 20.0
#: Where a larger share of a channel's samples this close is contradicted they are good: the torque has an edge there.
_STRETCH = 0.5
#: An offset between channels is corrected when it is this sure, and this large. [sigma], [s]
_SURE, _WORTH_S = 4.0, 0.2
#: Furthest offset looked for. [s]
_REACH_S = 3.0
#: Samples of a long record that the levels are fitted to, in blocks spread evenly over it.
_MOST_FITTED, _BLOCKS = 9000, 3
#: Steps of a level's logarithm: of the model's matrices, where rounding is the only limit, and of the likelihood itself.
_STEP, _WIDE_STEP = 1e-6, 1e-3
#: Where the search of levels ends: a slope at which they are within some thousandths of their sigma; or, within bounds of so many
#: sigmas of the prior, a gain below a share of the likelihood that is no thousandth of one in a usual record.
_ENDS = {"maxiter": 100, "gtol": 1e-2}
_FURTHEST, _BOUNDED_ENDS = 6.0, {"maxiter": 100, "ftol": 1e-8, "gtol": 1e-2}
#: The cost of levels under which the record cannot be.
_IMPOSSIBLE = 1e10

TIMES_SHIFTED = Kind(
    "fused.times-shifted", Severity.CAUTION,
    "{channel} about {axis} is {shift_s:.2f} ± {sigma_s:.2f} s {side} against the actuators' telemetry: its times are shifted "
    "by that", "Check the time stamps of the channel.",
)  # fmt: skip
OUTLIERS = Kind(
    "fused.outliers", Severity.CAUTION, "{samples} samples about {axis} lie beyond {limit:g} sigma and are left out",
    "Run asflown telemetry check on the file.",
)  # fmt: skip


@dataclass(frozen=True)
class Offset:
    """By how much a channel's times are late against the actuators', from the likelihood's profile."""

    seconds: float
    sigma: float
    corrected: bool


@dataclass(frozen=True)
class AxisFit:
    """What was fitted on one axis."""

    levels: Levels
    series: tuple[Series, ...]  # without outliers, offsets corrected
    left_out: int
    offsets: dict[str, Offset]


def fit_levels(body: Body, series: list[Series], known: Known | None = None) -> AxisFit:
    """Fit one axis; outliers are left out, clocks with a significant offset are corrected, and the fit is repeated.

    ``known``: a torque to take off first."""
    centre = body.starting_levels(series)
    count = sum(len(s.values) for s in series)
    # the levels are not fitted yet: only samples that no levels would explain are left out here
    cleaned = _without_outliers(body, centre, series, known, 2 * OUTLYING)
    if cleaned is not series:
        series, centre = cleaned, body.starting_levels(cleaned)
    levels = _most_probable(body, centre, centre, series, known)
    cleaned = _without_outliers(body, levels, series, known, OUTLYING)
    offsets = _offsets(body, levels, cleaned, known)
    late = {row: offsets[n].seconds for row, n in enumerate(ROWS) if n in offsets and offsets[n].corrected}
    if late or cleaned is not series:
        series = [s.later(-late.get(s.row, 0.0)) for s in cleaned]
        levels = _most_probable(body, centre, levels, series, known)
        series = _without_outliers(body, levels, series, known, OUTLYING)
    return AxisFit(levels, tuple(series), count - sum(len(s.values) for s in series), offsets)


def unfitted(body: Body, series: list[Series]) -> AxisFit:
    """At levels from the series alone."""
    return AxisFit(body.starting_levels(series), tuple(series), 0, {})


def _without_outliers(body: Body, levels: Levels, series, known: Known | None, limit: float):
    """The series less what lies beyond ``limit``, worst first; as they are where there is nothing, or too much."""
    kept, most = series, _MOST_OUTLYING * sum(len(s.values) for s in series)
    left_out = 0
    while True:
        axis = AxisData.of(body, levels, kept).without_known(known)
        alone = np.abs(np.nan_to_num(smooth(axis.model, axis.data).alone))
        worst = _worst(alone, axis.time_s[step_of(axis.data)], limit)
        left_out += len(worst)
        if left_out > most:
            return series
        if not len(worst):
            return (
                [_with_stretches(before, after) for before, after in zip(series, kept, strict=True)]
                if left_out
                else series
            )
        kept = _without(kept, axis, worst)


def _with_stretches(before: Series, after: Series) -> Series:
    """A series less its outliers, but with those of whole stretches."""
    gone = ~np.isin(before.seconds, after.seconds)
    sums, at = np.append(0, np.cumsum(gone)), before.seconds
    first, last = np.searchsorted(at, at - _NEIGHBOURS_S), np.searchsorted(at, at + _NEIGHBOURS_S, "right")
    return before.where(~gone | (sums[last] - sums[first] > _STRETCH * (last - first)))


def _worst(alone: np.ndarray, at_s: np.ndarray, limit: float) -> np.ndarray:
    """Measurements beyond the limit, none near a worse one."""
    left, chosen = np.flatnonzero(alone > limit), []
    while len(left):
        worst = left[np.argmax(alone[left])]
        chosen.append(worst)
        left = left[np.abs(at_s[left] - at_s[worst]) > _NEIGHBOURS_S]
    return np.array(chosen, int)


def _most_probable(body: Body, centre: Levels, start: Levels, series, known: Known | None) -> Levels:
    kind, middle, spread = type(centre), centre.logs(), np.array(body.SPREAD)
    blocks = [AxisData.of(body, start, part).without_known(known) for part in _blocks(series)]

    def cost(z):
        """Of levels z prior sigmas from the middle, with its gradient."""
        p = middle + spread * z
        values, slopes = zip(*(_likelihood(body, kind, p, block) for block in blocks), strict=True)
        value, slope = sum(values), np.sum(slopes, axis=0)
        if not (np.isfinite(value) and np.isfinite(slope).all()):
            return _IMPOSSIBLE, np.zeros_like(z)
        return -value + 0.5 * z @ z, z - spread * slope

    z = (start.logs() - middle) / spread
    found = scipy.optimize.minimize(cost, z, method="BFGS", jac=True, options=_ENDS)
    if not found.success or np.max(np.abs(found.x)) > _FURTHEST:  # as where a channel has no noise at all
        bounds = [(-_FURTHEST, _FURTHEST)] * len(z)
        found = scipy.optimize.minimize(cost, z, method="L-BFGS-B", jac=True, bounds=bounds, options=_BOUNDED_ENDS)
    return kind.from_logs(middle + spread * found.x)


def _likelihood(body: Body, kind: type[Levels], p: np.ndarray, block: AxisData) -> tuple[float, np.ndarray]:
    """Log likelihood of a block and its derivative by the levels' logarithms."""

    def model(q):
        return body.smooth_model(kind.from_logs(q), block.times)

    here, used = model(p), np.unique(block.data.row)
    found, slope = score(here, block.data), np.empty(len(p))
    for k in range(len(p)):
        step = np.zeros(len(p))
        step[k] = _STEP
        there = model(p + step)
        if np.array_equal(there.H[used], here.H[used]):
            slope[k] = found.along(here, there) / _STEP
        else:  # the score is not taken by H
            wide = step * (_WIDE_STEP / _STEP)
            sides = [log_likelihood(model(p + s), block.data) for s in (wide, -wide)]
            slope[k] = (sides[0] - sides[1]) / (2 * _WIDE_STEP)
    return found.log_likelihood, slope


def _blocks(series) -> list[list[Series]]:
    """The whole record, or stretches of equal length spread over a long one."""
    count = sum(len(s.values) for s in series)
    if count <= _MOST_FITTED:
        return [list(series)]
    first, last = min(s.seconds[0] for s in series), max(s.seconds[-1] for s in series)
    length = (last - first) * _MOST_FITTED / _BLOCKS / count
    starts = np.linspace(first, last - length, _BLOCKS)
    parts = [[s.between(a, a + length) for s in series] for a in starts]
    return [p for p in parts if all(len(s.values) > 2 for s in p)] or [list(series)]


def _offsets(body: Body, levels: Levels, series, known: Known | None) -> dict[str, Offset]:
    """Each channel against the actuators', by the curvature of the likelihood along the shift; two rounds."""
    series = _blocks(series)[0]
    lead = max(series, key=lambda s: s.row)
    shifts = {s.row: 0.0 for s in series if s is not lead}
    sigmas: dict[int, float] = {}

    def cost(row: int, shift: float) -> float:
        moved = [s.later(-(shift if s.row == row else shifts.get(s.row, 0.0))) for s in series]
        axis = AxisData.of(body, levels, moved).without_known(known)
        return -log_likelihood(axis.model, axis.data)

    for _ in range(2):
        for row in shifts:
            h = 0.1
            centre = shifts[row]
            for _ in range(4):  # Newton's steps on a parabola through three points
                left, here, right = (cost(row, centre + d) for d in (-h, 0.0, h))
                bend = (left - 2 * here + right) / h**2
                if not bend > 0:
                    break
                step = float(np.clip((left - right) / (2 * h * bend), -0.5, 0.5))
                centre = float(np.clip(centre + step, -_REACH_S, _REACH_S))
                sigmas[row] = float(1 / np.sqrt(bend))
                if abs(step) < 0.02:
                    break
            shifts[row] = centre
    found = {}
    for row, sigma in sigmas.items():
        t = shifts[row]
        sure = abs(t) > _SURE * sigma and abs(t) > _WORTH_S and abs(t) < _REACH_S
        found[ROWS[row]] = Offset(t, sigma, bool(sure))
    return found


def _without(series, axis: AxisData, bad: np.ndarray) -> list[Series]:
    step, row = step_of(axis.data), axis.channel
    kept = []
    for s in series:
        drop = axis.time_s[step[bad[row[bad] == s.row]]]
        keep = ~np.isin(np.round(s.seconds * 1e3), np.round(drop * 1e3))
        kept.append(s.where(keep))
    return kept


def fit_doubts(axis: str, fit: AxisFit) -> list[Doubt]:
    """What one axis's fit leaves to doubt."""
    doubts = [
        TIMES_SHIFTED(channel=channel, axis=axis, shift_s=abs(o.seconds), sigma_s=o.sigma,
                      side="late" if o.seconds > 0 else "early")
        for channel, o in fit.offsets.items() if o.corrected
    ]  # fmt: skip
    if fit.left_out:
        doubts.append(OUTLIERS(samples=fit.left_out, axis=axis, limit=OUTLYING))
    return doubts
