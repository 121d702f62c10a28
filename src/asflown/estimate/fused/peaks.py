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
from ...kit.peaks import PEAK_REACH_S, heights


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
