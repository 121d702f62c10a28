"""A torque that is a Gaussian process: smoothed exactly, jointly with what is taken as known.

A quantity taken as known (an inertia, a gain) is off by d sigma, d ~ N(0, 1), and changes the
measurements by a column of sensitivities times d.  The filter whitens data and columns alike; d is then
an ordinary regression, and the smoothed torque is linear in it.  Where the data must not say what d is,
the torque is smoothed without it, and d only widens the band.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.ensemble import gains, paths, smoothed, whiten
from ...kit.smoother import smooth
from .body import AxisData, Posterior

if TYPE_CHECKING:
    from numpy.random import Generator


def gaussian_torque(axis: AxisData, count: int, rng: Generator) -> Posterior:
    """The posterior at the axis's levels, with ``count`` paths."""
    model, data, columns = axis.model, axis.data, axis.columns
    g, best = gains(model, data), smooth(model, data)
    X = whiten(g, columns)
    precision = X.T @ X + np.eye(X.shape[1])
    offset = np.linalg.solve(precision, X.T @ g.own)
    spread = np.linalg.cholesky(np.linalg.inv(precision))
    drawn = offset + rng.standard_normal((count, len(offset))) @ spread.T
    torque = [axis.body.torque]
    moved = smoothed(g, columns, torque)[:, 0, :]  # (N, P): what a sigma of each does to the torque
    mean = best.mean[:, axis.body.torque] - moved @ offset
    drawn_paths = paths(g, data.value[:, None] - columns @ drawn.T, torque, rng)[:, :, 0]
    size = axis.body.inertia_kgm2
    return Posterior(size * mean, size * drawn_paths, drawn, g.own - X @ offset)


def widened(post: Posterior, axis: AxisData, rng: Generator) -> Posterior:
    """A posterior made without the axis's columns, its paths moved by what is taken as known, of which nothing is learnt."""
    drawn = rng.standard_normal((len(post.paths), axis.columns.shape[1]))
    moved = smoothed(gains(axis.model, axis.data), axis.columns, [axis.body.torque])[:, 0, :]
    return replace(post, paths=post.paths - axis.body.inertia_kgm2 * drawn @ moved.T, considered=drawn)
