"""Wheels that are switched off, and bearings that misbehave."""

from __future__ import annotations

import numpy as np

from ..scenario import DragSpike, Scenario


def coasting(scenario: Scenario, wheels: tuple[str, ...], times) -> np.ndarray:
    """Whether each wheel's motor is off in the control cycle that begins at each time.  (N, wheels) bool"""
    off = np.zeros((len(times), len(wheels)), bool)
    for c in scenario.coasts:
        # a nanosecond of rounding must not move a start by a cycle
        off[:, wheels.index(c.wheel)] |= (times > c.start - 1e-9) & (times < c.stop - 1e-9)
    return off


def drag_table(scenario: Scenario, wheels: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """All drag spikes together: times (s,) [s] and what they add to each wheel's drag (s, wheels) [N m].

    Trapezoids, to be joined by straight lines; zero outside."""
    corners = [_corners(d) for d in scenario.drag_spikes]
    if not corners:
        return np.empty(0), np.empty((0, len(wheels)))
    times = np.unique(np.concatenate([t for t, _ in corners]))
    extra = np.zeros((len(times), len(wheels)))
    for d, (t, torque) in zip(scenario.drag_spikes, corners, strict=True):
        extra[:, wheels.index(d.wheel)] += np.interp(times, t, torque, left=0.0, right=0.0)
    return times, extra


def _corners(d: DragSpike) -> tuple[np.ndarray, np.ndarray]:
    edge = min(DragSpike.EDGE_S, d.duration / 4)
    return d.start + np.array([0.0, edge, d.duration - edge, d.duration]), d.torque * np.array([0.0, 1.0, 1.0, 0.0])
