"""What is left of a bias after a patch: the epochs before and after it, under one model (002 Figures 1, 3, 5, 7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from ...kit.errors import BadInput
from .checks import sign_test
from .fit import problems

if TYPE_CHECKING:
    from ...maneuvers.table import Maneuvers

#: Burns on either side that a comparison takes: two biases, and something to spare.
_FEWEST = 4


@dataclass(frozen=True)
class Epoch:
    """Magnitude errors on one side of a patch, with the bias that is in them; ``bias_p``: of no bias at all."""

    name: str
    count: int
    below: int
    sign_p: float
    bias_fixed_mps: float
    sigma_bias_fixed_mps: float
    bias_proportional: float
    sigma_bias_proportional: float
    bias_p: float

    def record(self) -> dict:
        return {
            "name": self.name, "count": self.count, "below_zero": self.below, "above_zero": self.count - self.below, "sign_p": self.sign_p,
            "bias_fixed_mps": self.bias_fixed_mps, "sigma_bias_fixed_mps": self.sigma_bias_fixed_mps,
            "bias_proportional": self.bias_proportional, "sigma_bias_proportional": self.sigma_bias_proportional, "bias_p": self.bias_p,
        }  # fmt: skip

    def __str__(self) -> str:
        return (
            f"{self.name:18s} below zero {self.below} of {self.count} (p = {self.sign_p:.2g}); bias {1e3 * self.bias_fixed_mps:+.2f} +- "
            f"{1e3 * self.sigma_bias_fixed_mps:.2f} mm/s, {100 * self.bias_proportional:+.3f} +- {100 * self.sigma_bias_proportional:.3f} % (p = {self.bias_p:.2g})"
        )


@dataclass(frozen=True)
class Patch:
    """Epochs before (as flown), before (bias taken out) and after; ``difference_p``: of one bias in the last two."""

    id: str
    removed_fixed_mps: float
    removed_proportional: float
    epochs: tuple[Epoch, Epoch, Epoch]
    difference_p: float

    def record(self) -> dict:
        return {
            "first_after": self.id, "removed_fixed_mps": self.removed_fixed_mps, "removed_proportional": self.removed_proportional,
            "epochs": [e.record() for e in self.epochs], "difference_p": self.difference_p,
        }  # fmt: skip

    def __str__(self) -> str:
        lines = [
            f"patch before {self.id}, taking out {1e3 * self.removed_fixed_mps:+.3g} mm/s and {100 * self.removed_proportional:+.3g} %"
        ]
        lines += ["  " + str(e) for e in self.epochs]
        return "\n".join([*lines, f"  the last two differ by chance: p = {self.difference_p:.2g}"])

    @property
    def doubts(self) -> tuple[str, ...]:
        found = []
        after = self.epochs[-1]
        if after.bias_p < 0.05:
            found.append(f"a bias is left after the patch before {self.id} (p = {after.bias_p:.2g})")
        if self.difference_p < 0.05:
            found.append(
                f"before and after {self.id} the errors differ still, once the bias is taken out (p = {self.difference_p:.2g}): "
                "the patch did something else, or both are not of one family"
            )
        return tuple(found)


def across_patch(m: Maneuvers, first_after: str, fixed_mps: float, proportional: float) -> tuple[Maneuvers, Patch]:
    """All maneuvers as if the patch had been there from the start, and what became of the bias.

    ``first_after``: id of the first burn flown with the patch; the bias taken out of those before it is fixed + proportional v.
    Sigmas are those of all burns, adjusted.  Raises BadInput where either side has fewer than four burns."""
    at = m.place(first_after)
    if min(at, len(m) - at) < _FEWEST:
        raise BadInput(
            f"{at} burns before {first_after} and {len(m) - at} from it on: too few to compare", file=m.source or None,
            remedy=f"It takes {_FEWEST} on either side.",
        )  # fmt: skip
    adjusted = m.with_bias_removed(at, fixed_mps, proportional, f"patch before {first_after}")
    point = problems(adjusted)["magnitude"].minimum()
    spare = len(m) - 4
    cuts = [
        ("before, as flown", m.take(slice(0, at))),
        ("before, adjusted", adjusted.take(slice(0, at))),
        ("after", adjusted.take(slice(at, None))),
    ]
    fits = [_epoch(name, part, point, spare) for name, part in cuts]
    (_, b, B), (_, a, A) = fits[1:]
    off = a - b
    difference = float(stats.f.sf(off @ np.linalg.solve(A + B, off) / 2, 2, spare))
    first, second, third = (e for e, *_ in fits)
    return adjusted, Patch(first_after, fixed_mps, proportional, (first, second, third), difference)


def _epoch(name: str, m: Maneuvers, point, spare: int) -> tuple[Epoch, np.ndarray, np.ndarray]:
    """One epoch, its biases by weighted least squares at the sigmas of ``point``, and their covariance."""
    v = m.dv_mps
    w = 1 / (point.fixed**2 + (point.proportional * v) ** 2 + m.sigma_magnitude_mps**2 + 1e-18)
    X = np.stack([np.ones_like(v), v], axis=1)
    covariance = np.linalg.pinv(X.T @ (w[:, None] * X), hermitian=True)
    bias = covariance @ X.T @ (w * m.magnitude_error_mps)
    p = float(stats.f.sf(bias @ np.linalg.pinv(covariance, hermitian=True) @ bias / 2, 2, spare))
    sigma = np.sqrt(np.diag(covariance))
    below = int(np.sum(m.magnitude_error_mps < 0))
    epoch = Epoch(
        name,
        len(m),
        below,
        sign_test(below, len(m)),
        float(bias[0]),
        float(sigma[0]),
        float(bias[1]),
        float(sigma[1]),
        p,
    )
    return epoch, bias, covariance
