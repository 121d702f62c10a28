"""Small tests on execution errors: counts against binomial bands, signs, and directions on a circle."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import comb

import numpy as np
from scipy import stats

#: Share of a normal distribution inside one sigma.
INSIDE = float(stats.norm.cdf(1) - stats.norm.cdf(-1))


@dataclass(frozen=True)
class Spread:
    """Errors of one component about a mean.

    ``inside`` counts those within one sigma of model and orbit determination together, of which 68 % are to be expected;
    ``inside_model`` those within the model's own sigma, as the papers count.  ``below``: errors below zero (underburns).
    None where no model is known."""

    name: str
    count: int
    below: int
    sign_p: float
    inside: int | None
    inside_model: int | None
    band: tuple[int, int] | None
    standardised: np.ndarray = field(repr=False)  # (N,), about the mean; NaN where no model is known
    quantiles: np.ndarray | None = field(default=None, repr=False)  # sorted, of all rows of the part
    envelope: np.ndarray | None = field(default=None, repr=False)  # (2, M)
    shape_p: float | None = None

    @property
    def pit(self) -> np.ndarray:
        """Probability integral transform of every error: uniform where the model is right."""
        return stats.norm.cdf(self.standardised)

    def record(self) -> dict:
        counts = np.histogram(self.pit, bins=10, range=(0, 1))[0].tolist() if self.inside is not None else None
        return {
            "name": self.name, "count": self.count, "below_zero": self.below, "above_zero": self.count - self.below, "sign_p": self.sign_p,
            "inside_1_sigma": self.inside, "inside_model_1_sigma": self.inside_model, "inside_band95": None if self.band is None else list(self.band),
            "pit_counts": counts, "distribution_p": self.shape_p,
        }  # fmt: skip

    def __str__(self) -> str:
        said = f"{self.name:14s}  below zero {self.below} of {self.count} ({100 * self.below / self.count:.0f} %, p = {self.sign_p:.2g})"
        if self.inside is not None and self.band is not None:
            said += f"; inside 1 sigma {self.inside} ({self.band[0]} to {self.band[1]}), {self.inside_model} without tracking's"
        if self.shape_p is not None:
            said += f"; distribution p = {self.shape_p:.2g}"
        return said


def sign_test(below: int, count: int) -> float:
    """p-value of as uneven a split of signs, by a fair coin."""
    return float(stats.binomtest(below, count).pvalue) if count else 1.0


def inside_band(count: int) -> tuple[int, int]:
    """How many of ``count`` errors are inside one sigma in 95 of 100 sets."""
    low, high = stats.binom.interval(0.95, count, INSIDE)
    return int(low), int(high)


def spread_of(name: str, error_mps, mean_mps, sigma_mps, od_mps, shape) -> Spread:
    """``mean_mps`` None: no model is known.  ``shape``: sorted standardised rows, their envelope, and a p-value."""
    below, n = int(np.sum(error_mps < 0)), len(error_mps)
    if mean_mps is None:
        return Spread(name, n, below, sign_test(below, n), None, None, None, np.full(n, np.nan))
    off = error_mps - mean_mps
    standardised = off / np.sqrt(sigma_mps**2 + od_mps**2 + 1e-24)
    quantiles, envelope, p = shape or (None, None, None)
    return Spread(
        name, n, below, sign_test(below, n), int(np.sum(np.abs(standardised) <= 1)), int(np.sum(np.abs(off) <= sigma_mps)), inside_band(n),
        standardised, quantiles, envelope, p,
    )  # fmt: skip


@dataclass(frozen=True)
class Directions:
    """Of pointing errors in the TVC plane, counted from X to Y.  Without a bias they are uniform."""

    angle_rad: np.ndarray = field(repr=False)
    mean_rad: float
    length: float  # of the mean unit vector: 0 uniform, 1 all alike
    rayleigh_p: float  # against one preferred direction
    hodges_ajne_p: float  # against any half circle
    quadrants: tuple[int, int, int, int]  # +X+Y, -X+Y, -X-Y, +X-Y

    def record(self) -> dict:
        return {
            "mean_rad": self.mean_rad, "resultant": self.length, "rayleigh_p": self.rayleigh_p, "hodges_ajne_p": self.hodges_ajne_p,
            "quadrants": dict(zip(("+x+y", "-x+y", "-x-y", "+x-y"), self.quadrants, strict=True)),
        }  # fmt: skip

    def __str__(self) -> str:
        return (
            f"directions      towards {np.degrees(self.mean_rad):+.0f} deg from X (resultant {self.length:.2f}), uniform: p = {self.rayleigh_p:.2g} "
            f"(Rayleigh), {self.hodges_ajne_p:.2g} (Hodges-Ajne)"
        )


def directions_of(pointing_mps) -> Directions:
    """Directions of pointing errors (N, 2), with two tests of uniformity."""
    angle = np.arctan2(pointing_mps[:, 1], pointing_mps[:, 0])
    n = len(angle)
    mean = np.mean(np.exp(1j * angle))
    quadrant = np.floor(np.mod(angle, 2 * np.pi) / (np.pi / 2)).astype(int) % 4
    return Directions(
        angle, float(np.angle(mean)), float(abs(mean)), rayleigh(n, float(abs(mean))), hodges_ajne(angle),
        tuple(np.bincount(quadrant, minlength=4).tolist()),
    )  # fmt: skip


def rayleigh(n: int, length: float) -> float:
    """p-value of a mean unit vector as long among n directions (Zar's approximation)."""
    R = n * length
    return float(min(1.0, np.exp(np.sqrt(1 + 4 * n + 4 * (n * n - R * R)) - (1 + 2 * n))))


def hodges_ajne(angle) -> float:
    """p-value of the fewest directions in any half circle; exact where they are under a third of all."""
    n = len(angle)
    a = np.sort(np.mod(angle, 2 * np.pi))
    ahead = np.searchsorted(np.concatenate([a, a + 2 * np.pi]), a + np.pi, side="left") - np.arange(n)
    fewest = int(
        min(ahead.min() - 1, n - ahead.max())
    )  # the half circle may begin just after a direction, or end just before
    return float(min(1.0, (n - 2 * fewest) * comb(n, fewest) / 2.0 ** (n - 1)))
