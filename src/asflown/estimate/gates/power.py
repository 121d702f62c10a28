"""What a watch could have seen: the chance that a burn which falls short raises the alarm, before it is flown.

The alarm's threshold is ``cut`` estimated sigmas from the estimated mean, and the chance belongs to the true sigma, which
nobody knows.  Taking the estimate for the truth counts its error twice: where it is too small the threshold is too near,
and the shortfall looks large beside it.  Averaged over the truth's posterior, the chance is still too high by a few
hundredths near one half.  What has no bias is the chance given the scale estimate alone (Rao-Blackwell; for normal
shares: Kolmogorov 1950, Lieberman and Resnikoff 1955).  Each burn that went into the estimate is taken for the new one,
judged by the others: given the estimate s with f degrees of freedom its error is s sqrt(f) r, r one coordinate of a point
uniform on the sphere of f dimensions, and the others' estimate s sqrt(f (1 - r^2) / (f - 1)).  With
w = r sqrt(f - 1) / sqrt(1 - r^2), which is t-distributed with f - 1 degrees of freedom, a shortfall of x s is seen where

    (cut - w) sqrt(f) / sqrt(f - 1 + w^2) < x
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from .foreseen import Foreseen

#: The power that a detectable underburn is seen with.
POWER = 0.8
#: A scale has no estimate without each single burn below this many degrees of freedom.
_FEWEST = 1.5


def alarm_chance(told: Foreseen, short_mps: float, limit_p: float, *, drawn: Foreseen | None = None) -> float:
    """Probability that a burn which falls short by so much raises the alarm by itself: the power.

    ``told``: what the alarm judges by.  ``drawn``: what errors are drawn from about the shortfall, where that is known better:
    burns that were weak already and went into the model hide a further one."""
    drawn = told if drawn is None else drawn
    sigma = _sigma(drawn)
    x = (short_mps + float(told.mean[0] - drawn.mean[0])) / sigma
    cut = _cut(told, limit_p) * _sigma(told) / sigma
    freedom = _freedom(drawn)
    return min(1.0, _beyond(x, cut, freedom) + _beyond(-x, cut, freedom))


def detectable(told: Foreseen, limit_p: float, power: float = POWER) -> float:
    """Underburn that raises the alarm by itself with this probability, of a burn foreseen so. [m/s]"""
    sigma, cut, freedom = _sigma(told), _cut(told, limit_p), _freedom(told)
    sure = sigma * np.sqrt(freedom * (cut * cut + freedom - 1) / (freedom - 1))
    return float(scipy.optimize.brentq(lambda d: alarm_chance(told, d, limit_p) - power, 0.0, sure, xtol=1e-9 * sure))


def _beyond(x: float, cut: float, f: float) -> float:
    """Chance that an error moved by ``x`` estimated sigmas passes ``cut`` of them on that side."""
    q = x * x / f
    inside = (cut * cut + (1 - q) * (f - 1)) / f
    if inside < 0:  # moved so far that no error brings it back
        return float(x > 0)
    if abs(1 - q) < 1e-9:
        q = 1 - 1e-9
    near, far = ((cut - s * x * np.sqrt(inside)) / (1 - q) for s in (1, -1))
    if q < 1:  # one of both roots has cut - w on the side of x
        return float(scipy.special.stdtr(f - 1, -near))
    if x < 0:
        return 0.0
    return float(scipy.special.stdtr(f - 1, -max(near, far)) + scipy.special.stdtr(f - 1, min(near, far)))


def _sigma(told: Foreseen) -> float:
    return float(np.sqrt(told.covariance[0, 0]))


def _freedom(told: Foreseen) -> float:
    return float(np.clip(told.freedom, _FEWEST, 1e9))  # special's t has no infinity


def _cut(told: Foreseen, limit_p: float) -> float:
    """Error in sigmas at which one burn raises the alarm."""
    return float(-scipy.special.stdtrit(min(told.freedom, 1e9), limit_p / 2))
