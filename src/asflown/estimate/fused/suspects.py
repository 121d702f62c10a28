"""Where a torque may bend sharply in a long record: instants that the smooth torque of the fitted levels does not explain.

One smoothing says of every instant how large a kick of the torque, and of its slope, the data ask for there, and how sure it is.
A corner costs a column in the search (``corners``), so in an hour or more corners are looked for near such instants only.
The levels were fitted with the edges in them, which makes the torque look rougher than it is elsewhere: its size and length are
fitted anew with the torque free to move at the surest edges, and the instants are looked for again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.smoother import Model, log_likelihood, score

if TYPE_CHECKING:
    from .body import AxisData, Levels

#: An instant may be an edge, about which the torque is free while its levels are fitted; it is a suspect, near which corners are
#: looked for. [sigma]
_EDGE, _SUSPECT = 3.5, 2.5
#: How far from a suspect corners are looked for, and how far from an edge the torque is free. [s]
NEAR_S, _FREE_S = 15.0, 10.0
#: By what share of its size it moves there.
_FREELY = 0.3
#: An edge makes its surroundings look like edges: the surest within this is taken, then they are looked at again. [s]
_APART_S = 150.0
#: Edges are looked for under a torque this many times smaller than was fitted with them in it; so many are taken at once, if they
#: are worth their price: the logarithm of one in ten minutes at a place known to its reach.
_SMOOTHER, _AT_ONCE, _EDGE_COSTS = 4.0, 4, 3.4
#: By this log likelihood ratio a torque of continuous curvature, whose band is narrower, has to be the better one.
_CLEARLY = 3.0
#: Most suspects in an hour, the surest first.
_MOST_AN_HOUR = 15


@dataclass(frozen=True)
class Suspects:
    """Instants (S,) near which corners are looked for [s], the edges (E,) among them, and the axis with the levels, and the kind, of
    the torque between edges."""

    seconds: np.ndarray
    edges: np.ndarray
    axis: AxisData


def suspects(axis: AxisData) -> Suspects:
    """Of an axis whose known torque is taken off.

    Between edges the torque of a craft in orbit is smoother than most: the data choose between one of continuous slope and one of
    continuous curvature."""
    rough, curved = axis, replace(axis, body=replace(axis.body, curved=not axis.body.wiener))
    found = _suspects(curved)
    levels, cost = _between(rough, axis.levels, found.edges)
    if cost < _cost(curved, found.axis.levels, found.edges) + _CLEARLY:
        return replace(found, axis=replace(rough, levels=levels))
    return found


def freed(axis: AxisData) -> Model:
    """The model of the fitted levels, its torque free to move wherever the data ask for a kick: an edge taken for a smooth torque
    makes a motion that never was."""
    at = axis.times.seconds
    return _model(axis, axis.levels, at[_kick(axis, axis.levels, np.empty(0)) > _EDGE])


def _suspects(axis: AxisData) -> Suspects:
    edges = np.empty(0)
    levels, cost = _between(axis, axis.levels, edges)
    for most in (_AT_ONCE, _AT_ONCE, 1):
        smoother = replace(levels, torque_Nm=levels.torque_Nm / _SMOOTHER)
        seconds, size = _kicks(axis, smoother, edges, _APART_S)
        more = seconds[size > _EDGE][:most]
        if not len(more):
            break
        trial = np.append(edges, more)
        found, then = _between(axis, smoother, trial)
        if then + _EDGE_COSTS * len(more) < cost:
            levels, edges, cost = found, trial, then
    seconds, size = _kicks(axis, levels, edges, NEAR_S)
    most = max(1, round(_MOST_AN_HOUR * np.ptp(axis.times.seconds) / 3600))
    return Suspects(np.append(edges, seconds[np.argsort(-size)[:most]]), edges, replace(axis, levels=levels))


def _model(axis: AxisData, levels: Levels, edges: np.ndarray) -> Model:
    """Of the smooth torque, free to move near the edges."""
    at, edges = axis.times.seconds, np.sort(edges)
    near = np.searchsorted(edges, at + _FREE_S, "right") > np.searchsorted(edges, at - _FREE_S)
    moves = near * _FREELY * levels.torque_Nm / np.sqrt(2 * _FREE_S) if near.any() else None
    return axis.body.model(axis.levels, axis.times, levels.length_s, levels.torque_Nm, moves)


def _kicks(axis: AxisData, levels: Levels, edges: np.ndarray, apart_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants of the suspects away from the edges and how sure each is, none this near a surer one."""
    at, kick = axis.times.seconds, _kick(axis, levels, edges)
    for t in edges:
        kick[np.abs(at - t) <= NEAR_S] = 0.0
    kick[np.minimum(at - at[0], at[-1] - at) < NEAR_S] = 0.0  # the start is free as it is, and the end nearly so
    found = []
    left = np.flatnonzero(kick > _SUSPECT)
    while len(left):
        worst = left[np.argmax(kick[left])]
        found.append(worst)
        left = left[np.abs(at[left] - at[worst]) > apart_s]
    return at[found], kick[found]


def _kick(axis: AxisData, levels: Levels, edges: np.ndarray) -> np.ndarray:
    """How sure a kick of the torque or its slope is at each instant, (N,) [sigma]."""
    kicks = score(_model(axis, levels, edges), axis.data).kick
    return np.abs(kicks[:, [axis.body.torque, axis.body.slope]]).max(axis=1)


def _cost(axis: AxisData, levels: Levels, edges: np.ndarray) -> float:
    """Less the log posterior of the torque's levels; noises stay."""
    z = (levels.logs() - axis.levels.logs())[:2] / np.array(axis.body.SPREAD[:2])
    found = 0.5 * z @ z - log_likelihood(_model(axis, levels, edges), axis.data)
    return float(found) if np.isfinite(found) else 1e10


def _between(axis: AxisData, start: Levels, edges: np.ndarray) -> tuple[Levels, float]:
    """Levels whose torque is the most probable one between the edges, and their cost."""

    def of(p) -> Levels:
        return replace(start, torque_Nm=float(np.exp(p[0])), length_s=float(np.exp(p[1])))

    corners = start.logs()[:2] + np.array([[0, 0], [0.7, 0], [0, 0.5]])
    how = {"maxfev": 25, "xatol": 0.05, "fatol": 0.2, "initial_simplex": corners}
    found = scipy.optimize.minimize(lambda p: _cost(axis, of(p), edges), corners[0], method="Nelder-Mead", options=how)
    return of(found.x), float(found.fun)
