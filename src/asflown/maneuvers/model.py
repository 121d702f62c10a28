"""The Gates model of execution errors: four sigmas and the biases (Wagner 2014 eq 1)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..kit.doubts import Doubt, Kind, Severity
from ..kit.errors import check_choice

POINTING_BELOW_BIASES = Kind(
    "maneuvers.pointing-below-biases", Severity.SUSPECT,
    "{model}: its pointing sigma about zero, {sigma_mrad:.2f} mrad per axis, is below the rms of its own biases, {floor_mrad:.2f} mrad, "
    "for a burn of {dv_mps:g} m/s: the model cannot hold for large burns",
    "Use its sigmas with its biases, or another model.",
)  # fmt: skip


class Quantity(StrEnum):
    """What an execution error has: a magnitude, along the dV, and a pointing, across it along TVC X and Y."""

    MAGNITUDE = "magnitude"
    POINTING = "pointing"

    @property
    def axes(self) -> tuple[str, ...]:
        return ("",) if self is Quantity.MAGNITUDE else ("X", "Y")


@dataclass(frozen=True)
class Gates:
    """Execution errors of one engine, in the TVC frame; SI, proportional values as fractions and radians.

    A burn of size v [m/s] has errors that are Gaussian about the biases, with standard deviations
    sqrt(fixed^2 + v^2 proportional^2); those of pointing are per axis.  NaN: not known."""

    magnitude_fixed_mps: float
    magnitude_proportional: float
    pointing_fixed_mps: float
    pointing_proportional_rad: float
    bias_fixed_mps: float = 0.0
    bias_proportional: float = 0.0
    pointing_bias_fixed_mps: tuple[float, float] = (0.0, 0.0)  # TVC X, Y
    pointing_bias_proportional_rad: tuple[float, float] = (0.0, 0.0)
    valid_to_mps: float | None = None  # largest dV it was made for
    name: str = ""

    def sigma_magnitude(self, dv_mps) -> np.ndarray:
        """One sigma of the magnitude error. [m/s]"""
        return np.hypot(self.magnitude_fixed_mps, self.magnitude_proportional * np.asarray(dv_mps, float))

    def sigma_pointing(self, dv_mps) -> np.ndarray:
        """One sigma of the pointing error per axis. [m/s]"""
        return np.hypot(self.pointing_fixed_mps, self.pointing_proportional_rad * np.asarray(dv_mps, float))

    def mean_magnitude(self, dv_mps) -> np.ndarray:
        return self.bias_fixed_mps + self.bias_proportional * np.asarray(dv_mps, float)

    def mean_pointing(self, dv_mps) -> np.ndarray:
        """(N, 2), TVC X and Y. [m/s]"""
        v = np.asarray(dv_mps, float)
        return np.array(self.pointing_bias_fixed_mps) + v[..., None] * np.array(self.pointing_bias_proportional_rad)

    def covariance(self, dv_mps: float) -> np.ndarray:
        """(3, 3) in TVC axes X, Y, Z (Wagner 2014 eq 1, whose x is our Z). [m2/s2]"""
        across, along = float(self.sigma_pointing(dv_mps)), float(self.sigma_magnitude(dv_mps))
        return np.diag([across**2, across**2, along**2])

    def parameters(self, of: Quantity) -> tuple[float, ...]:
        """Fixed and proportional sigma, then fixed and proportional bias along each axis; m/s, and fractions or radians."""
        if of is Quantity.MAGNITUDE:
            return (self.magnitude_fixed_mps, self.magnitude_proportional, self.bias_fixed_mps, self.bias_proportional)
        (fx, fy), (px, py) = self.pointing_bias_fixed_mps, self.pointing_bias_proportional_rad
        return self.pointing_fixed_mps, self.pointing_proportional_rad, fx, px, fy, py

    def pointing_floor_mps(self, dv_mps) -> np.ndarray:
        """What a sigma per axis about zero cannot be below while the biases stay in the errors: their rms. [m/s]"""
        return np.sqrt(np.mean(self.mean_pointing(dv_mps) ** 2, axis=-1))

    def contradiction(self) -> Doubt | None:
        """A doubt where this model's pointing sigma about zero is below the rms of its own biases at its largest burn."""
        v = self.valid_to_mps
        if v is None or not self.pointing_floor_mps(v) > self.sigma_pointing(v):
            return None
        sigma, floor = (1e3 * float(x) / v for x in (self.sigma_pointing(v), self.pointing_floor_mps(v)))
        return POINTING_BELOW_BIASES(model=self.name or "the model", sigma_mrad=sigma, floor_mrad=floor, dv_mps=v)

    def record(self) -> dict:
        return {
            "name": self.name or None,
            "magnitude": {
                "fixed_mps": self.magnitude_fixed_mps, "proportional": self.magnitude_proportional,
                "bias_fixed_mps": self.bias_fixed_mps, "bias_proportional": self.bias_proportional,
            },
            "pointing": {
                "fixed_mps": self.pointing_fixed_mps, "proportional_rad": self.pointing_proportional_rad,
                "bias_fixed_mps": list(self.pointing_bias_fixed_mps),
                "bias_proportional_rad": list(self.pointing_bias_proportional_rad),
            },
            "valid_to_mps": self.valid_to_mps,
        }  # fmt: skip


def pointing_density(error_mps, sigma_mps: float, variant: str = "corrected") -> np.ndarray:
    """Density of a pointing error (..., 2) about zero, sigma per axis. [s2/m2]

    ``corrected`` (default): exp(-|x|^2 / 2 s^2) / (2 pi s^2).  ``printed`` (Wagner 2014 eq 4) divides by sqrt(2 pi) s^2 instead and
    integrates to sqrt(2 pi); where its maximum lies is not touched by that, only the likelihood's value."""
    check_choice(variant, ("corrected", "printed"), "variant")
    area = (2 * np.pi if variant == "corrected" else np.sqrt(2 * np.pi)) * sigma_mps**2
    return np.exp(-0.5 * np.sum(np.asarray(error_mps) ** 2, axis=-1) / sigma_mps**2) / area
