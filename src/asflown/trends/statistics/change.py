"""A sudden change in a figure: between which two events, how large, and its significance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .slope import Values, shuffles

#: Events needed on each side of a change, and in all before one is looked for.
_SIDE, _FEWEST = 2, 6
#: Up to this many events a change found is a hint: they hardly distinguish a step from a slope.
FEW = 15


@dataclass(frozen=True)
class Step:
    """The likeliest sudden change: after event number ``before`` (0 is the first), of ``percent`` of the value before it."""

    before: int
    percent: float | None
    p_value: float
    rather_than_slope: float  # log likelihood of the step less that of a slope: above 0 the step fits better


def step_of(values: Values, sigmas: np.ndarray) -> Step | None:
    """The likeliest step, by weighted least squares over all places; None with fewer than six events.

    ``sigmas``: standard deviation of every event, up to a factor.  The p-value is the share of shuffles of the events whose
    best step fits as well: it tests against no change of any kind, so a slope makes it small too."""
    n = len(values.value)
    if n < _FEWEST:
        return None
    w = 1 / sigmas**2
    places = np.arange(_SIDE, n - _SIDE + 1)
    drops = _drops(values.value, w, places)
    best = int(places[np.argmax(drops)])
    chance = _drops(values.value[shuffles(n)], w, places).max(axis=-1)
    p = (1 + np.sum(chance >= drops.max() * (1 - 1e-12))) / (1 + len(chance))
    before = np.average(values.value[:best], weights=w[:best])
    after = np.average(values.value[best:], weights=w[best:])
    total = np.sum(w * (values.value - np.average(values.value, weights=w)) ** 2)
    u = values.share - np.average(values.share, weights=w)
    sloped = total - np.sum(w * u * values.value) ** 2 / np.sum(w * u * u)
    stepped = total - drops.max()
    better = 0.5 * n * np.log(max(sloped, 1e-300) / max(stepped, 1e-300))
    percent = None if before == 0 else float(100 * (after / before - 1))
    return Step(best - 1, percent, float(p), float(better))


def _drops(y, w, places) -> np.ndarray:
    """Fall of the weighted sum of squares by a step before each place, (..., len(places))."""
    weight, sum_w = np.cumsum(w), np.cumsum(w * y, axis=-1)
    a, b = weight[places - 1], weight[-1] - weight[places - 1]
    first, last = sum_w[..., places - 1], sum_w[..., -1:] - sum_w[..., places - 1]
    return first**2 / a + last**2 / b - sum_w[..., -1:] ** 2 / weight[-1]
