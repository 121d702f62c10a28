"""How many pulses made up an on-time, where they are not counted.

A deadband controller fires for one control step and waits; Feldman & Lee have 175 steps in 151 pulses (their simulation) and
243 in 240 (28 January 2005).  A rise by one step is one pulse.  A larger one may be one long pulse or several: several where
samples are further apart than pulses are, and then of MEAN_STEPS each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Mean length of a pulse in control steps, the mean of the two cases above, and its sigma, which reaches beyond both.
MEAN_STEPS, MEAN_STEPS_SIGMA = 1.09, 0.12
#: Samples this many usual distances apart hold several pulses.
_SEVERAL = 1.5
#: Variance of a number of pulses, over the number: about one in five is longer than a step.
_CHANCE = 0.2
#: Share of the range between one pulse and the most that one sigma of a number within it is.
_WITHIN = 0.25


@dataclass(frozen=True)
class Guess:
    """Pulses in each interval, what one sigma of their mean length changes in their number, and the variance of the number in
    each interval; (M, j) each."""

    pulses: np.ndarray
    spread: np.ndarray
    chance: np.ndarray


def guess_pulses(on_time_s, interval_s, step_s: float) -> Guess:
    """From on-times (M, j) within intervals (M,) [s] of a controller with that step [s].

    There cannot be more pulses than steps on, nor than steps off: in a burn thrusters are on except for short breaks."""
    steps = np.asarray(on_time_s, float) / step_s
    room = np.asarray(interval_s, float)[:, None]
    breaks = np.maximum(room - on_time_s, 0.0) / step_s
    most = np.minimum(steps / np.maximum(1.0, np.minimum(MEAN_STEPS, steps)), breaks)
    least = np.minimum(np.minimum(1.0, steps), most)
    pulses = most
    for _ in range(5):  # their usual distance follows from their number
        fired = steps > 0
        first = np.argmax(fired, axis=0)
        last = len(fired) - 1 - np.argmax(fired[::-1], axis=0)
        ends = np.cumsum(np.r_[0.0, interval_s])
        span = ends[last + 1] - ends[first]
        apart = span / np.maximum(pulses.sum(axis=0), 1.0)
        seldom = np.clip(room / apart, least, np.maximum(most, least))
        pulses = np.where(fired, np.where(room > _SEVERAL * apart, most, seldom), 0.0)
    several = pulses >= most - 1e-9
    spread = np.where(several, pulses * MEAN_STEPS_SIGMA / MEAN_STEPS, _WITHIN * (most - least))
    unsure = steps > 1 + 1e-6
    return Guess(pulses, np.where(unsure, spread, 0.0), np.where(unsure, _CHANCE * pulses, 0.0))
