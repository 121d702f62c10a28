"""Covariances of steps that are correlated with their neighbours only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy


@dataclass(frozen=True)
class Covariance:
    """Block tridiagonal covariance, factored once; K steps of d components."""

    factor: np.ndarray
    variance: np.ndarray  # (K d,)

    @classmethod
    def of(cls, main, off) -> Covariance:
        """From the blocks on the diagonal, main (K, d, d), and below it, off (K - 1, d, d); all symmetric."""
        K, d, _ = main.shape
        full = np.zeros((2 * d, K * d))  # lower form: full[i - j, j] = C[i, j]
        for r in range(d):
            for c in range(d):
                if r >= c:
                    full[r - c, c::d] = main[:, r, c]
                full[d + r - c, c : (K - 1) * d : d] = off[:, r, c]
        factor = scipy.linalg.cholesky_banded(full, lower=True)
        return cls(factor, full[0].copy())

    def solve(self, columns) -> np.ndarray:
        """C^-1 times columns (K d, m)."""
        return scipy.linalg.cho_solve_banded((self.factor, True), columns)
