"""An exponential atmosphere fitted to the momentum it gave a craft in a flyby: density at an altitude, and scale height.

    impulse of a step = T/rho  rho_0  int exp(-(h - h_0) / H) dt  +  thrusters' unknowns  +  a small constant torque  +  noise

For every scale height H the rest is linear and solved for at once (separable least squares); so no search can end in a wrong
minimum.  Intervals are where the misfit, least over all else, is below its limit; the scale of drag and inertia is not in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.digits import interval
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.schema import Annotated, Doc, Interval, TypedDict
from ...kit.table import Table

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby
    from ..firing import Gained

NO_ATMOSPHERE = Kind(
    "density.no-atmosphere", Severity.SUSPECT,
    "no exponential atmosphere explains the momentum gained (chi-square {chi_square:.1f} per degree of freedom)",
    "Check that the record is of the flyby of {flyby}; see the residual density with --plot.",
)  # fmt: skip

#: Chi-square per degree of freedom beyond which an atmosphere does not explain the record.  Assumed.
_MISFIT = 3.0
#: Scale heights tried [m], then as many again within those that fit, and instants within a step at which the atmosphere is summed.
_HEIGHTS_M = np.geomspace(10e3, 300e3, 401)
_WITHIN = 8
_FEWEST = 8


class AtmosphereRecord(TypedDict):
    """rho = density exp(-(h - altitude) / scale height)."""

    altitude_m: float
    density_kgm3: float
    density_ci95_kgm3: Interval
    scale_height_m: float
    scale_height_ci95_m: Interval
    misfit: Annotated[float, Doc("chi-square per degree of freedom")]
    steps: Annotated[int, Doc("of momentum, used by the fit")]


@dataclass(frozen=True)
class AtmosphereFit:
    """rho = density exp(-(h - altitude) / scale height); 95 % intervals, an open end None; ``misfit``: chi-square per degree
    of freedom."""

    altitude_m: float
    density_kgm3: float
    density_ci95_kgm3: tuple[float, float]
    scale_height_m: float
    scale_height_ci95_m: tuple[float | None, float | None]
    misfit: float
    steps: int

    def density(self, altitude_m) -> np.ndarray:
        return self.density_kgm3 * np.exp(-(np.asarray(altitude_m, float) - self.altitude_m) / self.scale_height_m)

    def record(self) -> dict:
        record = {
            "altitude_m": self.altitude_m, "density_kgm3": self.density_kgm3,
            "density_ci95_kgm3": list(self.density_ci95_kgm3), "scale_height_m": self.scale_height_m,
            "scale_height_ci95_m": list(self.scale_height_ci95_m), "misfit": self.misfit, "steps": self.steps,
        }  # fmt: skip
        return record | {  # keys of earlier versions
            "altitude_km": self.altitude_m / 1e3, "scale_height_km": self.scale_height_m / 1e3,
            "scale_height_ci95_km": [None if v is None else v / 1e3 for v in self.scale_height_ci95_m],
        }  # fmt: skip

    def table(self) -> Table:
        low, high = (None if v is None else v / 1e3 for v in self.scale_height_ci95_m)
        return Table(
            "Exponential atmosphere",
            (
                (
                    f"density at {self.altitude_m / 1e3:g} km [kg/m3]",
                    f"{self.density_kgm3:.3g}",
                    interval(*self.density_ci95_kgm3),
                ),
                ("scale height [km]", f"{self.scale_height_m / 1e3:.1f}", interval(low, high)),
            ),
            ("", "value", "95 % interval"),
            (f"chi-square per degree of freedom {self.misfit:.2f}, {self.steps} steps of momentum",),
        )

    def doubts(self, flyby: str) -> Doubts:
        return Doubts([NO_ATMOSPHERE(chi_square=self.misfit, flyby=flyby)] if self.misfit > _MISFIT else [])


def fit_atmosphere(g: Gained, flyby: Flyby, closest_s: float, per_density, gravity=None) -> AtmosphereFit:
    """The exponential atmosphere for which the momentum gained is likeliest.

    ``closest_s``: closest approach, from the epoch [s].  ``per_density``: torque per density about the axis, with its sign, at
    times from closest approach [N m / (kg/m3)].  ``gravity``: instants [s from closest approach] and the gravity gradient's
    torque [N m], taken off.

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
        limit = least + max(least / free, 1.0) * scipy.special.fdtri(1, free, 0.95)
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
