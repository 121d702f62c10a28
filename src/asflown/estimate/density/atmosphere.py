"""An exponential atmosphere fitted to the momentum it gave a craft in a flyby: density at an altitude, and scale height.

    impulse of a step = T/rho  rho_0  int exp(-(h - h_0) / H) dt  +  thrusters' unknowns  +  a small constant torque  +  noise

For every scale height H the rest is linear and solved for at once (separable least squares); so no search can end in a wrong
minimum.  Intervals are where the misfit, least over all else, is below its limit; the scale of drag and inertia is not in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import f as fisher

from ...kit.errors import BadInput

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby
    from ..firing import Gained

#: Scale heights tried [m], then as many again within those that fit, and instants within a step at which the atmosphere is summed.
_HEIGHTS_M = np.geomspace(10e3, 300e3, 401)
_WITHIN = 8
_FEWEST = 8


@dataclass(frozen=True)
class AtmosphereFit:
    """rho = density exp(-(h - altitude) / scale height); 95 % intervals, an open end None; ``misfit``: chi square over its
    degrees of freedom."""

    altitude_m: float
    density_kgm3: float
    density_95: tuple[float, float]
    scale_height_m: float
    scale_height_95: tuple[float | None, float | None]
    misfit: float
    steps: int

    def density(self, altitude_m) -> np.ndarray:
        return self.density_kgm3 * np.exp(-(np.asarray(altitude_m, float) - self.altitude_m) / self.scale_height_m)

    def record(self) -> dict:
        low, high = self.scale_height_95
        return {
            "altitude_km": self.altitude_m / 1e3, "density_kgm3": self.density_kgm3, "density_ci95_kgm3": list(self.density_95),
            "scale_height_km": self.scale_height_m / 1e3,
            "scale_height_ci95_km": [None if v is None else v / 1e3 for v in (low, high)],
            "misfit": self.misfit, "steps": self.steps,
        }  # fmt: skip

    def __str__(self) -> str:
        low, high = ("open" if v is None else f"{v / 1e3:.1f}" for v in self.scale_height_95)
        return (
            f"{self.density_kgm3:.3g} kg/m3 ({self.density_95[0]:.3g} to {self.density_95[1]:.3g}) {self.altitude_m / 1e3:.0f} km high, "
            f"scale height {self.scale_height_m / 1e3:.1f} km ({low} to {high})"
        )


def fit_atmosphere(g: Gained, flyby: Flyby, closest_s: float, per_density, gravity=None) -> AtmosphereFit:
    """``closest_s``: of closest approach, from the epoch.  ``per_density``: of times from closest approach, N m per kg/m3 about the axis, with its sign.
    ``gravity``: instants [s from closest approach] and the gravity gradient's torque [N m], taken off.

    Raises BadInput for a body without an atmosphere, and where too few steps are near."""
    air = flyby.moon.atmosphere
    if air is None:
        raise BadInput(f"{flyby.moon.name} has no atmosphere of a scale height", remedy="Use asflown jets.")
    t = g.time_s - closest_s
    y = g.impulse_Nms.copy()
    fine = t[:-1, None] + np.diff(t)[:, None] * (np.arange(_WITHIN) + 0.5) / _WITHIN
    if gravity is not None:
        y = y - np.interp(fine, *gravity).mean(axis=1) * np.diff(t)
    if len(y) < _FEWEST:
        raise BadInput(f"{len(y)} steps of momentum are too few for an atmosphere", remedy="Take a longer record.")
    above = flyby.altitude(fine) - air.altitude_m
    drag = per_density(fine)
    known = np.column_stack([-g.columns, flyby.moon.small_torques_Nm * np.diff(t)])
    C_known, Cy = g.covariance.solve(known), g.covariance.solve(y[:, None])[:, 0]
    # the unknowns, with their unit variances, are taken out of both sides; what is left has one parameter
    inverse = np.linalg.inv(known.T @ C_known + np.eye(known.shape[1]))
    yy = float(y @ Cy - (known.T @ Cy) @ inverse @ (known.T @ Cy))
    free = len(y) - 2

    def profile(heights):
        """Best density for each scale height, its weight, and the misfit."""
        shape = (drag[..., None] * np.exp(-above[..., None] / heights)).mean(axis=1) * np.diff(t)[:, None]
        C_shape = g.covariance.solve(shape)
        across = known.T @ C_shape
        ss = np.sum(shape * C_shape, axis=0) - np.einsum("mh,mn,nh->h", across, inverse, across)
        sy = shape.T @ Cy - across.T @ inverse @ (known.T @ Cy)
        density = np.maximum(sy / ss, 0.0)
        return density, ss, yy - density * (2 * sy - density * ss)

    def fitting(misfit):
        """Scale heights within the limit."""
        least = float(misfit.min())
        limit = least + max(least / free, 1.0) * fisher.ppf(0.95, 1, free)
        return np.flatnonzero(misfit <= limit), limit

    inside, _ = fitting(profile(_HEIGHTS_M)[2])
    first, last = max(inside[0] - 1, 0), min(inside[-1] + 1, len(_HEIGHTS_M) - 1)
    fines = np.geomspace(_HEIGHTS_M[first], _HEIGHTS_M[last], len(_HEIGHTS_M))
    density, ss, misfit = profile(fines)
    best = int(np.argmin(misfit))
    rho, H, chi = float(density[best]), float(fines[best]), float(misfit[best]) / free
    inside, limit = fitting(misfit)
    heights = (
        None if fines[inside[0]] <= _HEIGHTS_M[0] else float(fines[inside[0]]),
        None if fines[inside[-1]] >= _HEIGHTS_M[-1] * (1 - 1e-12) else float(fines[inside[-1]]),
    )
    reach = np.sqrt((limit - misfit[inside]) / ss[inside])
    low, high = float((density[inside] - reach).min()), float((density[inside] + reach).max())
    return AtmosphereFit(air.altitude_m, rho, (max(low, 0.0), high), H, heights, chi, len(y))
