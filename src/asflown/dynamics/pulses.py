"""What a pulse of a thruster gives: impulse from on-time, and the torque of a thrust.

A valve ordered open for D lets the thrust F begin after a delay td, rise as F (1 - exp(-(t - td)/tr)), hold for td after the
order to close, and fall with tf (001 section V).  The area under that course is

    J / F = D + tf - tr + (tr - td - tf) exp(-(D - td)/tr)        D >= td, else nothing        ``corrected``

001 prints another: the area under F (1 - exp(-t/tr)), which at t = td jumps to 22 % of F, and at D = td gives 15 ms where
nothing has come yet.  For 125 ms its ratio J / (F D) is 1.395, that of the course 1.359.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

VARIANTS = ("corrected", "printed")


@dataclass(frozen=True)
class Valve:
    """Delay, rise and fall of a thruster. [s]"""

    delay_s: float
    rise_s: float
    fall_s: float

    def effective(self, on_time_s, variant: str = "corrected") -> np.ndarray:
        """Impulse per newton of steady thrust of a lone pulse that was ordered for ``on_time_s`` (any shape). [s]

        ``printed``: 001's formula as it stands."""
        D = np.asarray(on_time_s, float)
        td, tr, tf = self.delay_s, self.rise_s, self.fall_s
        if variant == "printed":
            return D + tf + tr * (np.exp(-D / tr) - np.exp(-td / tr)) - (tf + td) * np.exp(-D / tr)
        return np.where(td > D, 0.0, D + tf - tr + (tr - td - tf) * np.exp(-(np.maximum(D, td) - td) / tr))

    def ratio(self, on_times_s, counts=1.0, variant: str = "corrected") -> float:
        """R of a histogram: impulse over thrust times on-time of ``counts`` pulses of each of ``on_times_s``.

        001 divides thrusts that were estimated without regard to delay, rise and fall by it."""
        D, n = np.broadcast_arrays(np.asarray(on_times_s, float), np.asarray(counts, float))
        return float(np.sum(n * self.effective(D, variant)) / np.sum(n * D))


def expected_effective(on_time_s, pulses, step_s: float, valve: Valve, variant: str = "corrected") -> np.ndarray:
    """Impulse per newton of so many ``pulses`` that were on for ``on_time_s`` together. [s]  Arrays of one shape.

    Pulses are whole multiples of the control step.  How a total is shared out hardly matters: all but the exponential is linear
    in on-time and count, and that is 0.1 ms of the 170 ms which one step gives.  Taken here: pulses of one step,
    but for as many of the mean length of the others as the total leaves over."""
    T, n = np.broadcast_arrays(np.asarray(on_time_s, float), np.asarray(pulses, float))
    long = np.minimum(
        np.maximum(T / step_s - n, 0.0), n
    )  # pulses longer than a step, no more than there are steps over
    short = n - long
    length = np.where(long > 0, (T - short * step_s) / np.where(long > 0, long, 1.0), step_s)
    return short * valve.effective(step_s, variant) + long * valve.effective(length, variant)


def moment_matrix(positions, directions, center_of_mass) -> np.ndarray:
    """Torque about the centre of mass per newton of every thruster, (3, j). [m]   Q of 001 eq 16

    positions, center_of_mass [m] in one set of axes, directions of the force on the body; (j, 3), (3,), (j, 3)."""
    return np.cross(np.asarray(positions, float) - np.asarray(center_of_mass, float), np.asarray(directions, float)).T
