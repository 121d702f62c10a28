"""What one axis's telemetry says of a torque of any shape: a regression with unit noise.

The loop is linear, so the telemetry's answer to a torque is a sum of answers to hat functions at nodes.  Once the filter has
whitened data and answers alike, under a remainder that is a Gaussian process of given size,

    y = W T(nodes) + e,   e ~ N(0, 1)

and whatever is taken as known (an inertia, a gain) is solved for too, with its own sigma as a prior.  There is neither lag nor smoothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.ensemble import Gains, gains, paths, whiten

if TYPE_CHECKING:
    from .body import AxisData


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
