"""Whether chains of draws agree: rank-normalised split R-hat, and effective numbers of draws in the bulk and in the tails.

Definitions are those of Vehtari, Gelman, Simpson, Carpenter and Bürkner, Bayesian Analysis 16 (2021) 667, as ArviZ has them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy


class Convergence(NamedTuple):
    """Of one quantity, or the worst of several."""

    r_hat: float
    bulk: float
    tail: float


def convergence(chains: np.ndarray) -> Convergence:
    """Of one quantity's draws (chains, draws)."""
    halves = _split(np.asarray(chains, float))
    if np.ptp(halves) == 0:
        return Convergence(1.0, float(halves.size), float(halves.size))
    folded = np.abs(halves - np.median(halves))
    tails = [_effective(halves <= np.quantile(halves, q)) for q in (0.05, 0.95)]
    normal = _normal(halves)
    return Convergence(max(_r_hat(normal), _r_hat(_normal(folded))), _effective(normal), min(tails))


def worst(quantities) -> Convergence:
    """The largest R-hat and the fewest effective draws of several quantities, each (chains, draws)."""
    found = [convergence(q) for q in quantities]
    return Convergence(max(c.r_hat for c in found), min(c.bulk for c in found), min(c.tail for c in found))


def _split(chains: np.ndarray) -> np.ndarray:
    half = chains.shape[1] // 2
    return np.vstack([chains[:, :half], chains[:, -half:]])


def _normal(chains: np.ndarray) -> np.ndarray:
    """Normal scores of the ranks."""
    _, which, counts = np.unique(chains, return_inverse=True, return_counts=True)
    rank = (np.cumsum(counts) - (counts - 1) / 2)[which].reshape(chains.shape)  # equal draws share their mean rank
    return scipy.special.ndtri((rank - 0.375) / (chains.size + 0.25))


def _r_hat(chains: np.ndarray) -> float:
    n = chains.shape[1]
    within = float(np.mean(np.var(chains, axis=1, ddof=1)))
    between = n * float(np.var(np.mean(chains, axis=1), ddof=1))
    if within == 0:
        return 1.0 if between == 0 else np.inf
    return float(np.sqrt((between / within + n - 1) / n))


def _effective(chains: np.ndarray) -> float:
    """Number of independent draws that tell the mean as well; Geyer's initial monotone sequence of the correlations."""
    chains = chains.astype(float)
    n = chains.shape[1]
    if np.ptp(chains) == 0:
        return float(chains.size)
    correlated = _autocovariance(chains).mean(axis=0)
    within = correlated[0] * n / (n - 1)
    variance = correlated[0] + np.var(chains.mean(axis=1), ddof=1)
    rho = 1 - (within - correlated) / variance
    rho[0] = 1.0
    pairs = rho[: n - n % 2].reshape(-1, 2).sum(axis=1)[: max(1, (n - 3) // 2 + 1)]
    negative = np.flatnonzero(pairs <= 0)
    positive = int(negative[0]) if len(negative) else len(pairs)
    tau = -1 + 2 * float(np.minimum.accumulate(pairs[:positive]).sum())
    if positive < len(pairs):
        tau += max(0.0, float(rho[2 * positive]))
    return chains.size / max(tau, 1 / np.log10(chains.size))


def _autocovariance(chains: np.ndarray) -> np.ndarray:
    """Of each chain at every lag, over its length."""
    n = chains.shape[1]
    centred = chains - chains.mean(axis=1, keepdims=True)
    size = 2 ** int(np.ceil(np.log2(2 * n)))
    power = np.abs(np.fft.rfft(centred, size, axis=1)) ** 2
    return np.fft.irfft(power, size, axis=1)[:, :n] / n
