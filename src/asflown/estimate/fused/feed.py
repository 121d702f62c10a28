"""Torques known beforehand, as an input of the fit: what is estimated is the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.timeline import NS

if TYPE_CHECKING:
    from ..subject import Grid
    from .body import Known

#: At instants [ns TAI] (N,): torques (N, 3), and by what they are off for one sigma of each thing that makes them (N, 3, K). [N m]
Foreknown = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Feed:
    """At instants (F,) [s from the grid's start], twice as near as the grid's: torques (F, 3), and their errors for one sigma (F, 3, K)."""

    seconds: np.ndarray
    torque_Nm: np.ndarray
    errors_Nm: np.ndarray

    @classmethod
    def of(cls, foreknown: Foreknown, grid: Grid) -> Feed:
        seconds = grid.step_s / 2 * np.arange(2 * grid.count - 1)
        return cls(seconds, *foreknown(grid.start_ns + np.round(seconds * NS).astype(np.int64)))

    def known(self, j: int) -> Known:
        """The torque about an axis at any time."""
        return lambda t: np.interp(t, self.seconds, self.torque_Nm[:, j])

    def unsure(self, j: int, t: np.ndarray) -> list[np.ndarray]:
        """By what the torque about an axis is off at some times for one sigma of each thing that moves it."""
        return [np.interp(t, self.seconds, e) for e in self.errors_Nm[:, j].T if np.any(e)]
