"""Whole curves of actuations compared: registered in time, then subtracted.

Two runs of a mechanism show the same excursions a second or two apart, since it runs a little faster or slower.  A
curve is therefore shifted and stretched in time (and scaled, where size is judged elsewhere) to fit another best.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from ..entry import Curve

#: Curves are compared from the motor's start until this share of the median's squares is past, at so many instants.
_PAST, _INSTANTS = 0.998, 241
#: Largest shift and stretch in registration, as shares of that span.
_SHIFT, _STRETCH = 0.04, 0.06
TORQUE = "torque, fused"
#: Past curves needed to judge the shape of a new one.
FEWEST_CURVES = 6


@dataclass(frozen=True)
class Shape:
    """How far the newest curve's shape lies from the family of past ones, compared with how far they lie from each other."""

    distance: float  # rms over time of the difference, in sigmas of the family
    usual: float  # median of the past curves' own, each against the others
    p_value: float


def instants(curves: list[Curve]) -> np.ndarray:
    """Span in which curves are compared: from the motor's start until the motion has nearly ended, plus a tenth. [s]"""
    last = min(float(c.time_s[-1]) for c in curves)
    t = np.linspace(0.0, last, 4 * _INSTANTS)
    past = np.cumsum(np.median([_at(c, t) for c in curves], axis=0) ** 2)
    stop = float(t[np.searchsorted(past, _PAST * past[-1])]) if past[-1] > 0 else last
    return np.linspace(0.0, min(1.1 * stop, last), _INSTANTS)


def registered(curve: Curve, t: np.ndarray, onto: np.ndarray, *, scaled: bool) -> np.ndarray:
    """``curve`` shifted and stretched (and ``scaled``) to fit ``onto`` at the instants ``t``.

    The best of a grid of shifts and stretches, then of a finer one about it."""
    best, shift, stretch = np.inf, 0.0, 1.0
    for width, steps in ((1.0, 9), (0.2, 9)):
        around = (shift, stretch)
        for a in around[0] + width * _SHIFT * t[-1] * np.linspace(-1, 1, steps):
            for b in around[1] + width * _STRETCH * np.linspace(-1, 1, steps):
                v = _at(curve, a + b * t)
                size = _size(v, onto) if scaled else 1.0
                miss = np.sum((size * v - onto) ** 2)
                if miss < best:
                    best, shift, stretch = miss, a, b
    values = _at(curve, shift + stretch * t)
    return (_size(values, onto) if scaled else 1.0) * values


def distance(a: Curve, b: Curve) -> float:
    """Distance between two registered curves: rms difference as a share of their own rms, symmetric. []"""
    both, t = [], instants([a, b])
    for one, other in ((a, b), (b, a)):
        onto = _at(other, t)
        moved = registered(one, t, onto, scaled=False)
        both.append(np.sqrt(np.mean((moved - onto) ** 2) / (0.5 * np.mean(moved**2 + onto**2))))
    return float(np.mean(both))


def shape_of(newest: Curve, past: list[Curve], day) -> Shape | None:
    """The newest curve's shape against the family's, regardless of size; None with fewer than six past curves.

    ``day``: of the past curves and the newest, in that order.  A shape may drift over the years, so every instant of
    the registered curves has its own line over the dates.  A past curve lies as far from the line of the others as it
    does, in the scatter there; the newest from that of all past ones.  The logarithm of its distance is set against
    theirs (Student's t)."""
    if len(past) < FEWEST_CURVES:
        return None
    t = instants(past)
    onto = np.median([_at(c, t) for c in past], axis=0)
    values = np.array([registered(c, t, onto, scaled=True) for c in past])
    new = registered(newest, t, onto, scaled=True)
    own = np.array([
        _apart(values[k], np.delete(values, k, axis=0), day[k], np.delete(day[:-1], k)) for k in range(len(past))
    ])  # fmt: skip
    # lines of the others have one curve fewer: judge the newest against as many
    apart = float(np.median([
        _apart(new, np.delete(values, k, axis=0), day[-1], np.delete(day[:-1], k)) for k in range(len(past))
    ]))  # fmt: skip
    logs = np.log(own)
    z = (np.log(apart) - logs.mean()) / (logs.std(ddof=1) * np.sqrt(1 + 1 / len(own)))
    return Shape(apart, float(np.median(own)), float(scipy.stats.t.sf(z, len(own) - 1)))


def family_band(curves: list[Curve], share: float = 0.95) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(times, low, high): prediction interval, at each instant, of a further curve of the family."""
    t = instants(curves)
    values = np.array([_at(c, t) for c in curves])
    n = len(values)
    reach = scipy.stats.t.ppf(0.5 + share / 2, n - 1) * values.std(axis=0, ddof=1) * np.sqrt(1 + 1 / n)
    return t, values.mean(axis=0) - reach, values.mean(axis=0) + reach


def _apart(curve, family, day: float, days) -> float:
    """rms over time of a curve's difference from the family's lines at its date, in units of the scatter of such a difference.

    The scatter is taken to be no smaller than a tenth of the usual."""
    X = np.column_stack([np.ones(len(days)), days - np.mean(days)])
    inverse = np.linalg.inv(X.T @ X)
    lines = inverse @ X.T @ family
    x = np.array([1.0, day - np.mean(days)])
    scatter = np.sqrt(np.sum((family - X @ lines) ** 2, axis=0) / (len(days) - 2) * (1 + x @ inverse @ x))
    floor = 0.1 * np.sqrt(np.mean(scatter**2))
    return float(np.sqrt(np.mean(((curve - x @ lines) / np.maximum(scatter, floor)) ** 2)))


def _size(values, onto) -> float:
    """Factor that fits ``values`` to ``onto`` best, positive and within limits."""
    return float(np.clip((values @ onto) / max(values @ values, 1e-300), 0.2, 5.0))


def _at(curve: Curve, t) -> np.ndarray:
    return np.interp(t, curve.time_s, curve.values)
