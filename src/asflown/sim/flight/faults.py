"""Wheels that are switched off, and bearings that misbehave."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...craft.model import Drag
from ...kit.timeline import NS
from ..scenario import DragSpike, Scenario
from .plant import DRAG_REVERSAL_RATE

if TYPE_CHECKING:
    from ...craft.model import Wheel

_DAY_NS = 86_400 * NS
#: A sign change that is passed in fewer steps than this is not integrated well.
_STEPS_THROUGH_REST = 1.5


def true_drag(scenario: Scenario, wheel: Wheel) -> Drag:
    """A bearing's drag on the scenario's day, growth included; none where it flies without friction."""
    if not scenario.friction:
        return Drag()
    drag = scenario.wheel_drag.get(wheel.name, wheel.drag)
    coulomb = viscous = 1.0
    for g in scenario.drag_growth:
        if g.wheel == wheel.name and scenario.epoch_ns > g.since:
            days = (scenario.epoch_ns - g.since) / _DAY_NS
            coulomb, viscous = coulomb + g.coulomb_per_day * days, viscous + g.viscous_per_day * days
    grown = {"viscous": viscous * drag.viscous, "coulomb": coulomb * drag.coulomb, "stiction": coulomb * drag.stiction}
    return drag.model_copy(update=grown)


def bearing_rows(scenario: Scenario, wheels: tuple[Wheel, ...], step_s: float) -> np.ndarray:
    """Drag as the kernel takes it (n, 4): viscous, Coulomb, stiction, and the rate over which the sign changes.

    A light wheel is stopped within a step: there the sign changes over so wide a rate that the step can follow it."""
    rows = []
    for w in wheels:
        drag = true_drag(scenario, w)
        spikes = sum(d.torque for d in scenario.drag_spikes if d.wheel == w.name)
        slowing = (max(drag.coulomb, drag.stiction) + spikes) / float(w.spin_inertia or np.inf)
        rows.append(
            [drag.viscous, drag.coulomb, drag.stiction, max(DRAG_REVERSAL_RATE, slowing * step_s / _STEPS_THROUGH_REST)]
        )
    return np.array(rows, float)


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
