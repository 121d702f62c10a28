"""Likelihood of jets over all their widths: where densities are linear and not negative, nothing has to be searched.

Momentum gained is  y = a + sum_j K_j G_j(width_j) + noise,  G_j the impulse that jet j of unit density has given by each instant.
On a lattice of widths every combination is solved for its densities at once; a profile is the surface's minimum over all
other parameters, with no local minimum to be caught in.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

#: Widths considered: from sharper than any reported to a jet that blows into all directions. [rad]
WIDTHS_RAD = np.geomspace(0.05, 1.6, 44)


class Surface:
    """Misfit of every combination of widths.

    y (N,); columns (J, W, N): what each jet of unit density gives, for each of its widths (J, W), those of ``WIDTHS_RAD`` unless
    given.  ``common``: all jets have one width."""

    def __init__(self, y: np.ndarray, columns: np.ndarray, *, common: bool, widths_rad: np.ndarray | None = None):
        self.jets, self.count = columns.shape[:2]
        self.common = common
        self.widths_rad = np.tile(WIDTHS_RAD, (self.jets, 1)) if widths_rad is None else widths_rad
        flat = columns.reshape(-1, columns.shape[2])
        self.size = float(
            np.sqrt(np.mean(flat**2))
        )  # densities of 1e-12 beside momenta of 1: solve with columns near one
        flat = flat / self.size
        self._gram, self._cross, self._power = flat @ flat.T, flat @ y, float(y @ y)
        axes = [np.arange(self.count)] if common else [np.arange(self.count)] * self.jets
        self.shape = tuple(len(a) for a in axes)
        mesh = np.stack([m.ravel() for m in np.meshgrid(*axes, indexing="ij")], axis=1)
        mesh = np.repeat(mesh, self.jets, axis=1) if common else mesh
        self._at = mesh + self.count * np.arange(self.jets)  # (M, J), rows of ``flat``
        self.misfit, self.densities = self._solved()
        self.best = int(np.argmin(self.misfit))

    def _solved(self, held: int | None = None, value: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Least misfit (M,) and its densities (M, J) with none negative; jet ``held`` kept at ``value``."""
        at, c = self._at, self._cross[self._at]
        misfit = np.full(len(at), self._power)
        densities = np.zeros(c.shape)
        if held is not None:
            fixed, own = value * self.size, at[:, held]
            densities[:, held] = fixed
            misfit = misfit - 2 * fixed * c[:, held] + fixed**2 * self._gram[own, own]
            c = c - fixed * self._gram[at, own[:, None]]
        base, free = misfit.copy(), [j for j in range(self.jets) if j != held]
        for n in range(1, len(free) + 1):
            for some in map(list, combinations(free, n)):  # the best without negative ones is the best of these
                G = self._gram[at[:, some][:, :, None], at[:, some][:, None, :]]
                G = G + 1e-10 * np.trace(G, axis1=1, axis2=2)[:, None, None] * np.eye(n)
                k = np.linalg.solve(G, c[:, some, None])[:, :, 0]
                left = base - np.sum(c[:, some] * k, axis=1)
                better = (k >= 0).all(axis=1) & (left < misfit)
                misfit[better] = left[better]
                rows = np.zeros((int(better.sum()), self.jets))
                rows[:, some] = k[better]
                if held is not None:
                    rows[:, held] = value * self.size
                densities[better] = rows
        return np.maximum(misfit, 1e-300), densities / self.size

    @property
    def least(self) -> float:
        return float(self.misfit[self.best])

    def widths(self) -> np.ndarray:
        """Of the best combination, (J,). [rad]"""
        return self.widths_rad[np.arange(self.jets), self._at[self.best] - self.count * np.arange(self.jets)]

    def finer(self, limit: float, count: int) -> np.ndarray:
        """Widths (J, count) over what each jet's profile leaves open, and a step beyond."""
        found = []
        for j in range(self.jets):
            inside = np.flatnonzero(self.width_profile(j) <= limit)
            low, high = max(inside[0] - 1, 0), min(inside[-1] + 1, self.count - 1)
            found.append(np.geomspace(self.widths_rad[j, low], self.widths_rad[j, high], count))
        return np.array(found)

    def width_profile(self, jet: int) -> np.ndarray:
        """Least misfit for each width of one jet."""
        cube = self.misfit.reshape(self.shape)
        return cube if self.common else cube.min(axis=tuple(a for a in range(self.jets) if a != jet))

    def density_profile(self, jet: int, density: float) -> float:
        """Least misfit with one jet's density held."""
        return float(self._solved(jet, density)[0].min())
