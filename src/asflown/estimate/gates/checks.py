"""Small tests on execution errors: counts against binomial bands, signs, and directions on a circle."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import comb, erf
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from ...maneuvers.model import Quantity

#: Share of a normal distribution inside one sigma.
INSIDE = erf(2**-0.5)


@dataclass(frozen=True)
class Shape:
    """The distribution of a quantity's standardised errors, all rows together, beside the normal one.

    ``envelope`` (2, M): 95 % of sets simulated from the fit and fitted anew; ``p``: of the largest distance between the distributions."""

    quantiles: np.ndarray  # (M,), sorted
    envelope: np.ndarray
    p: float

    @property
    def normal_quantiles(self) -> np.ndarray:
        """What is to be expected of M sorted normal numbers, (M,)."""
        n = len(self.quantiles)
        return scipy.stats.norm.ppf((np.arange(n) + 0.5) / n)

    @property
    def pit(self) -> np.ndarray:
        """Probability integral transform of every error: uniform where the model is right, (M,)."""
        return scipy.stats.norm.cdf(self.quantiles)

    def count_band(self, bins: int) -> tuple[float, float]:
        """How many errors a bin of the transform holds in 95 of 100 sets."""
        low, high = scipy.stats.binom.interval(0.95, len(self.quantiles), 1 / bins)
        return float(low), float(high)


@dataclass(frozen=True)
class Spread:
    """Errors of one component about a mean: of the magnitude, or of pointing along one axis.

    ``inside`` counts those within one sigma of model and orbit determination together, of which 68 % are to be expected;
    ``inside_model`` those within the model's own sigma, as the paper counts.  ``below``: errors below zero (underburns).
    None where no model is known."""

    quantity: Quantity
    axis: str
    count: int
    below: int
    sign_p: float
    inside: int | None = None
    inside_model: int | None = None
    band: tuple[int, int] | None = None
    standardised: np.ndarray | None = field(default=None, repr=False)  # (N,), about the mean
    shape: Shape | None = field(default=None, repr=False)

    @property
    def name(self) -> str:
        return f"{self.quantity} {self.axis}".strip()

    def record(self) -> dict:
        counts = None
        if self.standardised is not None:
            counts = np.histogram(scipy.stats.norm.cdf(self.standardised), bins=10, range=(0, 1))[0].tolist()
        return {
            "name": self.name, "count": self.count, "below_zero": self.below, "above_zero": self.count - self.below, "sign_p": self.sign_p,
            "inside_1_sigma": self.inside, "inside_model_1_sigma": self.inside_model, "inside_band95": None if self.band is None else list(self.band),
            "pit_counts": counts, "distribution_p": None if self.shape is None else self.shape.p,
        }  # fmt: skip

    #: Heads of ``row``.
    HEAD = (
        "component",
        "below zero",
        "p of signs",
        "inside 1 sigma",
        "expected",
        "by the model alone",
        "p of distribution",
    )

    def row(self) -> tuple[str, ...]:
        known = ("", "", "")
        if self.band is not None:
            known = (str(self.inside), f"{self.band[0]} to {self.band[1]}", str(self.inside_model))
        shape = "" if self.shape is None else f"{self.shape.p:.2g}"
        return (self.name, f"{self.below} of {self.count}", f"{self.sign_p:.2g}", *known, shape)


def sign_test(below: int, count: int) -> float:
    """p-value of as uneven a split of signs, by a fair coin."""
    return float(scipy.stats.binomtest(below, count).pvalue) if count else 1.0


def inside_band(count: int) -> tuple[int, int]:
    """How many of ``count`` errors are inside one sigma in 95 of 100 sets."""
    low, high = scipy.stats.binom.interval(0.95, count, INSIDE)
    return int(low), int(high)


def spread_of(
    quantity: Quantity, axis: str, error_mps, mean_mps, sigma_mps, od_mps, shape: Shape | None = None
) -> Spread:
    """Counts of errors (N,); ``mean_mps`` None: no model is known."""
    below, n = int(np.sum(error_mps < 0)), len(error_mps)
    counted = Spread(quantity, axis, n, below, sign_test(below, n))
    if mean_mps is None:
        return counted
    off = error_mps - mean_mps
    standardised = off / np.sqrt(sigma_mps**2 + od_mps**2 + 1e-24)
    return replace(
        counted, inside=int(np.sum(np.abs(standardised) <= 1)), inside_model=int(np.sum(np.abs(off) <= sigma_mps)),
        band=inside_band(n), standardised=standardised, shape=shape,
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
            f"directions: towards {np.degrees(self.mean_rad):+.0f} deg from X (resultant {self.length:.2f}), uniform: p = {self.rayleigh_p:.2g} "
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
