"""What one axis's telemetry says of a torque of any shape: a regression with unit noise.

The loop is linear, so the telemetry's answer to a torque is a sum of answers to hat functions at nodes.  Once the filter has
whitened data and answers alike, under a remainder that is a Gaussian process of given size,

    y = W T(nodes) + e,   e ~ N(0, 1)

and whatever is taken as known (an inertia, a gain) has been solved for beside, with its own sigma as a prior.  Lag and smoothing never enter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...kit.ensemble import Gains, gains, paths, whiten
from ...kit.smoother import Measurements, smooth
from .body import Body, Levels, response, without_known
from .series import Times, step_of


@dataclass(frozen=True)
class AxisData:
    """One axis as the fused method prepared it: levels fitted, outliers and the turning of other axes taken off.

    ``columns``: (M, P), what each quantity taken as known does to the measurements by one sigma; ``start_s``: of the pass,
    from the telemetry's epoch."""

    body: Body
    levels: Levels
    times: Times
    data: Measurements
    columns: np.ndarray
    start_s: float

    @property
    def time_s(self) -> np.ndarray:
        """Instants of the pass from the epoch. (N,)"""
        return self.start_s + self.times.seconds

    @property
    def measured_s(self) -> np.ndarray:
        """When each measurement was taken, from the epoch. (M,)"""
        return self.time_s[step_of(self.data)]

    def smooth_torque(self) -> np.ndarray:
        """Of the fitted levels, at the instants of the pass. (N,) [N m]"""
        best = smooth(self.body.smooth_model(self.levels, self.times), self.data)
        return self.body.inertia_kgm2 * best.mean[:, self.body.torque]

    def without(self, torque_Nm: np.ndarray) -> AxisData:
        """The same less what a known torque (N,), at the instants of the pass, does."""
        return replace(self, data=without_known(self.body, self.levels, self.times, self.data, lambda _: torque_Nm))

    def until(self, stop_s: float) -> AxisData:
        """The same less what was measured later [s from the epoch]."""
        n = int(np.sum(self.measured_s <= stop_s))  # they are in order of time
        start, row, value = self.data.start, self.data.row, self.data.value
        return replace(self, data=Measurements(np.minimum(start, n), row[:n], value[:n]), columns=self.columns[:n])

    def answers(self, nodes_s: np.ndarray) -> np.ndarray:
        """Measurements (M, C) that torques of 1 N m at each node give, straight lines to zero at the nodes beside it."""
        return response(self.body, self.levels, self.times, self.data, hats(self.time_s, nodes_s))


def hats(time_s: np.ndarray, nodes_s: np.ndarray) -> np.ndarray:
    """Values (N, C) at some instants of piecewise linear functions that are 1 at one of the even nodes, 0 at all others."""
    return np.maximum(1 - np.abs(np.asarray(time_s)[:, None] - nodes_s) / (nodes_s[1] - nodes_s[0]), 0.0)


@dataclass(frozen=True)
class Regression:
    """y = W T + noise of unit size; rows of what is taken as known have been projected out.

    y (R,), W (R, C); ``log_evidence``: of the data with no torque at the nodes."""

    y: np.ndarray
    W: np.ndarray
    log_evidence: float
    axis: AxisData
    answers: np.ndarray
    gains: Gains

    def remainders(self, torque_Nm: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """One remaining torque (K, N) for each torque (K, C) at the nodes, drawn given the data."""
        columns, g = self.axis.columns, self.gains
        left = self.axis.data.value[:, None] - self.answers @ torque_Nm.T
        D = whiten(g, columns)
        precision = D.T @ D + np.eye(columns.shape[1])
        mean = np.linalg.solve(precision, D.T @ whiten(g, left)) if columns.shape[1] else np.zeros((0, len(torque_Nm)))
        root = np.linalg.cholesky(np.linalg.inv(precision))
        off = mean + root @ rng.standard_normal(mean.shape)
        return self.axis.body.inertia_kgm2 * paths(g, left - columns @ off, [self.axis.body.torque], rng)[:, :, 0]


def regression(axis: AxisData, nodes_s: np.ndarray, size_Nm, answers: np.ndarray | None = None) -> Regression:
    """The regression on a torque at even nodes [s from the epoch], under a remainder of ``size_Nm`` (one, or (N,))."""
    answers = axis.answers(nodes_s) if answers is None else answers
    g = gains(axis.body.model(axis.levels, axis.times, axis.levels.length_s, size_Nm), axis.data)
    P = axis.columns.shape[1]
    seen = whiten(g, np.column_stack([answers, axis.columns]))
    W, D = seen[:, : len(nodes_s)], np.vstack([seen[:, len(nodes_s) :], np.eye(P)])
    W, y = np.vstack([W, np.zeros((P, W.shape[1]))]), np.append(g.own, np.zeros(P))
    Q, R = np.linalg.qr(D)
    y, W = y - Q @ (Q.T @ y), W - Q @ (Q.T @ W)
    evidence = g.log_likelihood + 0.5 * float(g.own @ g.own - y @ y) - float(np.sum(np.log(np.abs(np.diag(R)))))
    return Regression(y, W, evidence, axis, answers, g)
