"""What a pulse of a thruster gives: impulse from on-time, and the torque of a thrust.

A valve ordered open for D lets the thrust F begin after a delay td, rise as F (1 - exp(-(t - td)/tr)), hold for td after the
order to close, and fall with tf (001 section V).  The area under that course is

    J / F = D + tf - tr + (tr - td - tf) exp(-(D - td)/tr)        D >= td, else nothing        ``corrected``

001 prints another: the area under F (1 - exp(-t/tr)), which at t = td jumps to 22 % of F, and at D = td gives 15 ms where
nothing has come yet.  For 125 ms its ratio J / (F D) is 1.395, that of the course 1.359.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

VARIANTS = ("corrected", "printed")


@dataclass(frozen=True)
class Valve:
    """Delay, rise and fall of a thruster, or of several (arrays). [s]"""

    delay_s: Any
    rise_s: Any
    fall_s: Any

    def effective(self, on_time_s, variant: str = "corrected") -> np.ndarray:
        """Impulse per newton of steady thrust of a lone pulse that was ordered for ``on_time_s`` (any shape). [s]

        ``printed``: 001's formula as it stands."""
        D = np.asarray(on_time_s, float)
        td, tr, tf = self.delay_s, self.rise_s, self.fall_s
        if variant == "printed":
            return D + tf + tr * (np.exp(-D / tr) - np.exp(-td / tr)) - (tf + td) * np.exp(-D / tr)
        return np.where(td > D, 0.0, D + tf - tr + (tr - td - tf) * np.exp(-(np.maximum(D, td) - td) / tr))

    def added(self, variant: str = "corrected") -> float:
        """What a long pulse gives beyond its on-time, per newton. [s]"""
        if variant == "printed":
            return self.fall_s - self.rise_s * float(np.exp(-self.delay_s / self.rise_s))
        return self.fall_s - self.rise_s

    def ratio(self, on_times_s, counts=1.0, variant: str = "corrected") -> float:
        """R of a histogram: impulse over thrust times on-time of ``counts`` pulses of each of ``on_times_s``.

        001 divides thrusts that were estimated without regard to delay, rise and fall by it."""
        D, n = np.broadcast_arrays(np.asarray(on_times_s, float), np.asarray(counts, float))
        return float(np.sum(n * self.effective(D, variant)) / np.sum(n * D))


def expected_effective(on_time_s, pulses, step_s: float, valve: Valve, variant: str = "corrected") -> np.ndarray:
    """Impulse per newton of so many ``pulses`` that were on for ``on_time_s`` together. [s]  Arrays of one shape.

    Pulses are whole multiples of the control step.  How a total is shared out hardly matters: the impulse is linear in on-time
    and count but for an exponential, 0.1 ms of the 170 ms that one step gives.  Taken here: pulses of one step, but for as
    many, of one length, as the total has steps over.  Counts need not be whole: a part of a pulse is its share."""
    T, n = np.broadcast_arrays(np.asarray(on_time_s, float), np.asarray(pulses, float))
    long = np.clip(T / step_s - n, 0.0, n)
    short = n - long
    length = np.where(long > 1e-9, (T - short * step_s) / np.where(long > 1e-9, long, 1.0), step_s)
    own, linear = valve.effective(step_s, variant), valve.added(variant)
    late = np.where(length > step_s, valve.effective(np.maximum(length, step_s), variant) - length, own - step_s)
    return T + n * linear + short * (own - step_s - linear) + long * (late - linear)


def moment_matrix(positions, directions, center_of_mass) -> np.ndarray:
    """Torque about the centre of mass per newton of every thruster, (3, j). [m]   Q of 001 eq 16

    positions, center_of_mass [m] in one set of axes, directions of the force on the body; (j, 3), (3,), (j, 3)."""
    return np.cross(np.asarray(positions, float) - np.asarray(center_of_mass, float), np.asarray(directions, float)).T
