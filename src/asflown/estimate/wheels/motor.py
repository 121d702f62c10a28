"""Drag from the motor's torque, measured by its current or commanded: J dw/dt = torque - drag.

From sample to sample, with the way of turning s = sign(w):

    s (integral of torque - J change of w) = coulomb dt + viscous (integral of |w|) + s (zero dt + delay (change of torque)) + error

What the motor does between samples of its torque makes errors that are independent from step to step; noise of the rate, and
of a torque whose integral takes two samples, correlates neighbours.  Both are fitted, and the law by generalised least squares.

zero is what the torque reads where there is none.  Of a wheel that turns one way it cannot be told from Coulomb drag: what is
known of it beforehand, from coasts (where the motor is off, and the current reads its zero) or else assumed, is a prior.
delay is how much later the torque acts than it is read, half a control cycle or so: it is nothing over a whole record, but without
it the steps in which the torque jumps would be left out, and what the others are off with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.scatter import robust_sigma
from .run_downs import STICTION_RATE

if TYPE_CHECKING:
    from .run_downs import Finder

#: Most steps that are fitted, and fewest; longer records take longer steps.
_MOST, _FEWEST = 4000, 120
#: Torque further apart than this many of its usual steps has a gap.
_GAP = 3.5
#: Steps this many sigma off the law are left out.
_FAR = 6.0
#: Blocks of steps from which the scatter of the values is seen.
_BLOCKS = 100
#: Samples in a coast from which the torque's zero is seen, at least, and blocks of them that show its error.
_FEWEST_OFF, _BLOCKS_OFF = 24, 8
#: Blocks that compare the torque with the momentum gained, and by how many times the errors they must move.
_SCALE_BLOCKS, _MOVED = 40, 5.0
#: One sigma of the torque's zero beforehand, as a share of the largest torque seen: assumed, as of a sensor of the 1 % class.
ZERO_SHARE = 0.01


@dataclass(frozen=True)
class Steps:
    """Steps of a wheel in which it turns one way, clear of stiction, and its motor's torque is known; all (N,).

    ``way``: sign of the rate; ``turned``: integral of |rate|; ``lost``: torque's integral less momentum gained, in the way of
    turning; ``gained``: momentum gained, in the way of turning; ``jump``: change of the torque, in the way of turning; ``joined``: whether the next step begins where this one ends."""

    dt: np.ndarray
    way: np.ndarray
    turned: np.ndarray
    lost: np.ndarray
    gained: np.ndarray
    jump: np.ndarray
    joined: np.ndarray


@dataclass(frozen=True)
class MotorLaw:
    """Coulomb [N m] and viscous drag [N m s], their covariance, and the mean |rate| of the samples used [rad/s].

    ``zero``: of the torque and its sigma [N m], which the covariance holds; ``scale``: torque's integral over momentum gained
    and its sigma, None where the wheel's rate changes too little."""

    values: np.ndarray
    covariance: np.ndarray
    rate: float
    zero: tuple[float, float]
    scale: tuple[float, float] | None


def assumed_zero(torque) -> float:
    """One sigma of the zero of a motor's torque of which nothing is known. [N m]"""
    return max(ZERO_SHARE * float(np.quantile(np.abs(torque), 0.999)), 1e-12) if len(torque) else 1e-12


def zero_beforehand(t, torque, coasts: list[tuple[float, float]]) -> tuple[float, float]:
    """Zero of a motor's torque and its sigma [N m], before the law is fitted.

    ``coasts``: spans [s] in which the motor is off, none where the torque is a command."""
    means, weights = [0.0], [assumed_zero(torque) ** -2]
    for start, stop in coasts:
        inside = torque[(t > start) & (t < stop)]
        if len(inside) >= _FEWEST_OFF:
            blocks = np.array([float(np.mean(b)) for b in np.array_split(inside, _BLOCKS_OFF)])
            means.append(float(np.mean(inside)))
            weights.append(_BLOCKS_OFF / max(float(np.var(blocks, ddof=1)), 1e-24))
    return float(np.average(means, weights=weights)), float(1 / np.sqrt(np.sum(weights)))


def steps_of(finder: Finder, t, torque, J: float, coasts: list[tuple[float, float]]) -> Steps | None:
    """The steps of a record outside ``coasts`` [s]; None for too few."""
    if len(t) < _FEWEST:
        return None
    whole = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (torque[1:] + torque[:-1]))])
    holes = np.flatnonzero(np.diff(t) > _GAP * float(np.median(np.diff(t))))
    shut = [*coasts, *((float(t[k]), float(t[k + 1])) for k in holes)]
    stride = max(1, int(np.ceil(len(finder.t) / _MOST)))
    parts = []
    for s in finder.gapless:
        at = np.arange(s.start, s.stop, stride)
        if len(at) < 2:
            continue
        ts, ws = finder.t[at], finder.rate[at]
        a, b = ts[:-1], ts[1:]
        open_ = (a >= t[0]) & (b <= t[-1])
        for start, stop in shut:
            open_ &= (b <= start) | (a >= stop)
        way = np.sign(ws[:-1])
        slow = np.minimum.reduceat(np.abs(finder.rate[s]), at - s.start)[:-1]  # of the samples within each step too
        open_ &= (way == np.sign(ws[1:])) & (np.minimum(slow, np.abs(ws[1:])) >= STICTION_RATE)
        k = np.flatnonzero(open_)
        gained = J * np.diff(ws)
        integral = np.interp(b, t, whole) - np.interp(a, t, whole)
        turned = np.interp(b, finder.t[s], _turned(finder, s)) - np.interp(a, finder.t[s], _turned(finder, s))
        joined = np.append(np.diff(k) == 1, False)[: len(k)]
        jump = np.interp(b, t, torque) - np.interp(a, t, torque)
        parts.append(
            [x[k] for x in (b - a, way, turned, way * (integral - gained), way * gained, way * jump)] + [joined]
        )
    if not parts:
        return None
    columns = [np.concatenate(c) for c in zip(*parts, strict=True)]
    return Steps(*columns) if len(columns[0]) >= _FEWEST else None


def _turned(finder: Finder, s: slice) -> np.ndarray:
    """Integral of |rate| over one gap-free stretch."""
    t, u = finder.t[s], np.abs(finder.rate[s])
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (u[1:] + u[:-1]))])


def motor_law(steps: Steps, zero: tuple[float, float]) -> MotorLaw | None:
    """The law of drag; None where the steps do not tell it.  ``zero``: of the torque and its sigma, known beforehand [N m]."""
    X = np.column_stack([steps.dt, steps.turned, steps.way * steps.dt, steps.jump])
    size = np.linalg.norm(X, axis=0)
    if size[3] == 0:  # a torque that never changes has no delay
        X, size = X[:, :3], size[:3]
    kept = np.ones(len(X), bool)
    for _ in range(4):
        A, y, errors = _generalised(X / size, steps, kept)
        sigma = robust_sigma(errors[kept])
        again = np.abs(errors) <= _FAR * sigma if sigma > 0 else kept
        if np.array_equal(again, kept) or again.sum() < _FEWEST:
            break
        kept = again
    variance = _variance(A[kept, :2], errors[kept])
    information = A[kept].T @ A[kept] / variance
    told = A[kept].T @ y[kept] / variance
    own = (zero[1] * size[2]) ** -2
    information[2, 2] += own
    told[2] += own * zero[0] * size[2]
    try:
        covariance = np.linalg.inv(information)
    except np.linalg.LinAlgError:
        return None
    x, covariance = covariance @ told / size, covariance / np.outer(size, size)
    if not (np.isfinite(covariance).all() and np.isfinite(x).all() and np.all(np.diag(covariance) > 0)):
        return None
    rate = float(np.sum(steps.turned[kept]) / np.sum(steps.dt[kept]))
    found = (float(x[2]), float(np.sqrt(covariance[2, 2])))
    return MotorLaw(x[:2], covariance[:2, :2], rate, found, _scale(steps, kept))


def _generalised(X, steps: Steps, kept):
    """Whitened columns, values and errors, at the correlation that is likeliest."""

    def whitened(u: float):
        share = np.tan(0.5 * np.pi * u)  # of the correlated part, either sign
        main = steps.dt / float(np.mean(steps.dt)) + 2 * abs(share)
        banded = np.zeros((2, len(main)))
        banded[0], banded[1] = np.where(kept, main, 1e8 * main), np.where(steps.joined, share, 0.0)
        factor = scipy.linalg.cholesky_banded(banded, lower=True)
        both = scipy.linalg.solve_banded((1, 0), factor, np.column_stack([X, steps.lost]))
        A, y = both[:, :-1], both[:, -1]
        x, *_ = np.linalg.lstsq(A, y, rcond=None)
        errors = y - A @ x
        loss = len(y) * np.log(max(float(errors @ errors), 1e-300)) + 2 * float(np.sum(np.log(factor[0])))
        return loss, A, y, errors

    tried = np.linspace(-0.99, 0.99, 23)
    best = float(tried[int(np.argmin([whitened(u)[0] for u in tried]))])
    near = scipy.optimize.minimize_scalar(lambda u: whitened(u)[0], bounds=(max(best - 0.09, -0.999), min(best + 0.09, 0.999)), method="bounded")  # fmt: skip
    return whitened(float(near.x))[1:]


def _variance(A, errors) -> float:
    """Of a whitened error: as of even and independent ones, widened where blocks of steps show more.

    A motor works harder at some times than at others, and what it does between samples may last."""
    inverse = np.linalg.pinv(A.T @ A)
    variance = float(errors @ errors) / max(len(errors) - A.shape[1], 1)
    scores = np.array([A[b].T @ errors[b] for b in np.array_split(np.arange(len(errors)), _BLOCKS)])
    seen = inverse @ (scores.T @ scores) @ inverse * _BLOCKS / (_BLOCKS - A.shape[1])
    return variance * max(1.0, float(np.max(np.diag(seen) / np.diag(variance * inverse))))


def _scale(steps: Steps, kept) -> tuple[float, float] | None:
    """Torque's integral over momentum gained beside the drag, by least squares over long blocks."""
    rows = np.array_split(np.flatnonzero(kept), _SCALE_BLOCKS)
    table = np.array(
        [[steps.lost[r].sum(), steps.dt[r].sum(), steps.turned[r].sum(), steps.gained[r].sum()] for r in rows]
    )
    y, X = table[:, 0], table[:, 1:]
    size = np.linalg.norm(X, axis=0)
    if not np.all(size > 0):
        return None
    X = X / size
    x, *_ = np.linalg.lstsq(X, y, rcond=None)
    error = float(np.sqrt(np.sum((y - X @ x) ** 2) / max(len(y) - 3, 1)))
    moved = X[:, 2] - X[:, :2] @ np.linalg.lstsq(X[:, :2], X[:, 2], rcond=None)[0]
    if float(np.std(moved)) * size[2] < _MOVED * error:
        return None
    return 1 + float(x[2] / size[2]), error / (float(np.linalg.norm(moved)) * float(size[2]))
