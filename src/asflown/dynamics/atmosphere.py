"""Density of an atmosphere that thins out exponentially with altitude."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Exponential:
    """rho = rho_0 exp(-(h - h_0) / H), h above the body's sphere.  SI.

    An isothermal one whose gravity falls as 1/r^2 has (h - h_0)^2 / (r_0 H) more: 5 % 100 km above Titan's 1000 km."""

    density_kgm3: float
    altitude_m: float
    scale_height_m: float

    def density(self, altitude_m) -> np.ndarray:
        """[kg/m3], of the altitude's shape."""
        return self.density_kgm3 * np.exp(-(np.asarray(altitude_m, float) - self.altitude_m) / self.scale_height_m)
