"""Heights of excursions from drawn torques, and their sigma held against flights of the estimator's own model.

A posterior of corners is honest over all torques its prior allows, not for each: a curve that is taken for lines comes out with
peaks that are too sharp, by more than its draws say.  Some of the drawn torques are therefore taken as true, telemetry is
made of each by the estimator's own model, and the torque is drawn again from that; how far the heights of peaks are off, in
terms of the sigma then given, is a distribution, and its width is the scale (calibration by the bootstrap's pulls:
Beran, Biometrika 74 (1987) 457).

The scale only widens: what flights would take off on triangles (0.8 to 0.9) does not hold on narrow ones and on bumps,
whose peaks are too far off as it is (studies/peak_scale.py).
"""

from __future__ import annotations

import numpy as np

from ...kit.ensemble import _ONE_SIGMA, spread

#: Half of a peak's surroundings in which each drawn torque's own extremum is looked for: room for a doubtful corner's
#: time.  Further out the highest of a rough torque's many is too high (of a cover's, by 5 % at 5 s, 0.6 % at 2.5 s). [s]
PEAK_REACH_S = 2.5
#: An excursion stands out from its surroundings by this share of the largest torque.
_STANDS_OUT = 0.25
#: And its height is this many of its sigmas.
_SURE = 4.0


def excursions(torque: np.ndarray, sigma: np.ndarray | None = None) -> np.ndarray:
    """Indices of the excursions of either sign of a torque (M,), NaN where unknown. [N m]

    They are above four times their sigma (M,), if there is one, and stand out from their surroundings by a share of the largest of these."""
    known = np.isfinite(torque)
    sure = known if sigma is None else known & (np.abs(torque) > _SURE * sigma)
    if known.sum() < 3 or not np.any(torque[sure]):
        return np.empty(0, np.intp)
    least, filled = _STANDS_OUT * np.max(np.abs(torque[sure])), np.where(known, torque, 0.0)
    from scipy.signal import find_peaks  # half a second of import that only this needs

    found = [find_peaks(sign * filled, height=least, prominence=least)[0] for sign in (1, -1)]
    at = np.sort(np.concatenate(found))
    return at[sure[at]]


def heights(time_s: np.ndarray, torques: np.ndarray, at_s: float, reach_s: float, sign: float) -> np.ndarray:
    """Each torque's own extremum (...) of a sign within reach of a time; ``torques``: (..., M). [N m]"""
    near = np.abs(time_s - at_s) <= reach_s + 1e-9
    return sign * np.max(sign * torques[..., near], axis=-1)


def peak_scale(time_s: np.ndarray, mean: np.ndarray, at: np.ndarray, true: np.ndarray, drawn: np.ndarray) -> float:
    """By what the sigma of this torque's peaks is to be multiplied, at least 1.

    ``mean``: (M,), whose excursions ``at`` (P,) are meant; ``true``: (F, M), torques that were flown; ``drawn``: (F, K, M), drawn
    from each one's telemetry."""
    pulls = []
    for k in at:
        sign = float(np.sign(mean[k]))
        was = heights(time_s, true, time_s[k], PEAK_REACH_S, sign)
        found = heights(time_s, drawn, time_s[k], PEAK_REACH_S, sign)
        pulls.append(np.abs(found.mean(axis=1) - was) / spread(found.T))
    return max(1.0, float(np.quantile(pulls, _ONE_SIGMA)))
