"""Density of a plume that jets from a moon's surface (plume paper section VII, eqs 23 to 28).

A jet stands radially on the surface.  ``tilt`` (delta) is its colatitude, positive on the side of closest approach;
``offset`` (Delta) its distance from the plane of trajectory and spin axis.  SI with radians.

Each formula is there as printed too (``variant='printed'``).  What is wrong in print:

- eq 23: atan(p/q) for the angle fails while q < 0, the craft being north of the source (Cairo: until +10.9 s of E3);
- Table 2: Damascus' offset by the printed formula is 146.2 km; the 0.40 km of the table need longitudes modulo 180 degrees;
- eq 25: its constant is in kg/m3 km^1.9, not kg/m3/km^1.9;
- eq 26: cut off at 1400 km while jets still blow, which makes steps: continued here;
- eq 28: a mean square, whose quoted value has the unit of its root.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import check_choice
from ..kit.quantities import quantity
from .flyby import Flyby, tables

if TYPE_CHECKING:
    from collections.abc import Sequence

VARIANTS, ANGLES = ("corrected", "printed"), ("plane", "space")
#: Distances within which the plume paper applies eq 26. [m]
NEAREST_M, FARTHEST_M = 50e3, 1400e3


@dataclass(frozen=True)
class Jet:
    """One source of a plume and the jet that leaves it radially (plume paper eq 26).

    Parameters
    ----------
    name : str
        As in 'Cairo'.
    density_kgm3 : float
        K, the density at one radius from the source on the jet's axis [kg/m3].
    width_rad : float
        K_theta, the angle from the axis at which exp(-(theta / K_theta)^n) has fallen to 1/e [rad].
    tilt_rad, offset_m : float
        As a flyby passes it: colatitude, positive on the side of closest approach [rad]; distance from the plane of
        trajectory and spin axis [m].
    latitude_south_rad, longitude_west_rad : float
        Where it stands on the moon [rad]; NaN where only tilt and offset are known."""

    name: str
    density_kgm3: float
    width_rad: float
    tilt_rad: float
    offset_m: float
    latitude_south_rad: float
    longitude_west_rad: float


@cache
def published_jets() -> tuple[Jet, ...]:
    """Alexandria, Cairo and Damascus as E3 passed them (plume paper Tables 2 and 3)."""
    return tuple(
        Jet(
            row["name"], quantity(row["density"], "kg/m3"), quantity(row["width"], "rad"), quantity(row["tilt"], "rad"),
            quantity(row["offset"], "m"), quantity(row["latitude_south"], "rad"), quantity(row["longitude_west"], "rad"),
        )
        for row in tables()["jet"]
    )  # fmt: skip


def offset(flyby: Flyby, latitude_south_rad: float, longitude_west_rad: float, variant: str = "corrected") -> float:
    """Delta = R_E cos(latitude) |longitude - longitude of the trajectory|, distance from the flyby's plane. [m]   plume paper Table 2

    The plane meets the moon in two meridians: the nearer one counts.  ``printed`` takes that of closest approach always."""
    check_choice(variant, VARIANTS, "variant")
    apart = abs(longitude_west_rad - flyby.known_longitude_rad())
    if variant == "corrected":
        apart = abs((apart + np.pi / 2) % np.pi - np.pi / 2)
    return float(flyby.moon.radius_m * np.cos(latitude_south_rad) * apart)


def tilt(flyby: Flyby, latitude_south_rad: float, longitude_west_rad: float) -> float:
    """delta = colatitude, positive on the side of closest approach. [rad]   plume paper Table 2"""
    side = np.sign(np.cos(longitude_west_rad - flyby.known_longitude_rad())) or 1.0
    return float(side * (np.pi / 2 - latitude_south_rad))


def as_passed(jet: Jet, flyby: Flyby) -> Jet:
    """The same source with the tilt and offset it has for another flyby."""
    place = jet.latitude_south_rad, jet.longitude_west_rad
    return replace(jet, tilt_rad=tilt(flyby, *place), offset_m=offset(flyby, *place))


def sources_passed(flyby: Flyby, given: Sequence[Jet] | None = None) -> list[Jet]:
    """Sources as a flyby passes them: those given, which are so already, or those published."""
    return [as_passed(j, flyby) for j in published_jets()] if given is None else list(given)


def seen_from(jet: Jet, flyby: Flyby, time_s, *, variant: str = "corrected", angle: str = "plane"):
    """Distance r [m] of the craft from a jet's source and angle theta [rad] from its axis.   plume paper eq 23

    ``angle``: of the projection into the flyby's plane, as in the paper, or in ``space``, the offset counted: it has no cusp
    where the craft crosses the axis."""
    check_choice(variant, VARIANTS, "variant")
    check_choice(angle, ANGLES, "angle")
    apart, axis = flyby.from_source(jet, time_s)
    p, q, r = apart[..., 0], apart[..., 1], np.linalg.norm(apart, axis=-1)
    if angle == "space":
        return r, np.arccos(np.clip(apart @ axis / np.maximum(r, 1e-9), -1, 1))
    if variant == "printed":
        with np.errstate(divide="ignore"):
            return r, np.abs(np.arctan(p / q) - jet.tilt_rad)
    off = np.arctan2(p, q) - jet.tilt_rad
    return r, np.abs((off + np.pi) % (2 * np.pi) - np.pi)


def jet_density(
    jet: Jet, flyby: Flyby, time_s, *, power: float = 1, falloff: float = 1.5, variant: str = "corrected", angle: str = "plane"
) -> np.ndarray:  # fmt: skip
    """rho = K (R_E / r)^falloff exp(-(theta / K_theta)^power), of one jet. [kg/m3]   plume paper eq 26

    The power in print can be read as 1 (default) or, as in eq 24, 2.  Within 50 km the distance counts as 50 km, where the
    paper's formula is not to be used and ``printed`` gives nothing; so it does beyond 1400 km."""
    r, theta = seen_from(jet, flyby, time_s, variant=variant, angle=angle)
    rho = (flyby.moon.radius_m / np.maximum(r, NEAREST_M)) ** falloff * np.exp(-((theta / jet.width_rad) ** power))
    if variant == "printed":
        rho = np.where((r >= NEAREST_M) & (r <= FARTHEST_M), rho, 0.0)
    return jet.density_kgm3 * rho


def plume_density(jets: Sequence[Jet], flyby: Flyby, time_s, **how) -> np.ndarray:
    """Sum of all jets. [kg/m3]   plume paper eq 27.  ``how``: see ``jet_density``."""
    return np.sum([jet_density(j, flyby, time_s, **how) for j in jets], axis=0)


def plume_around_pole(n0, radius_m, distance_m, angle_rad, width_rad, depletion_m) -> np.ndarray:
    """n = n0 (R_E/R)^2 exp(-(Theta/H_Theta)^2) exp(-(R - R_E)/H_d), in the unit of n0.   plume paper eq 24 (its reference 21)

    R from the moon's centre, Theta from the plume's."""
    R = np.asarray(distance_m, float)
    return (
        n0
        * (radius_m / R) ** 2
        * np.exp(-((np.asarray(angle_rad, float) / width_rad) ** 2))
        * np.exp(-(R - radius_m) / depletion_m)
    )


def density_by_altitude(altitude_m, constant=3.911e-8, start_m=20e3, epsilon=0.1) -> np.ndarray:
    """rho = C (h + h0)^(-2 + epsilon) of one jet, C in kg/m3 at 1 km: kg/m3 km^1.9. [kg/m3]   plume paper eq 25 (its reference 27)

    With the constants in print one jet has a tenth of E3's peak at its altitude: they are ten, or C is ten times larger."""
    return constant * ((np.asarray(altitude_m, float) + start_m) / 1e3) ** (-2 + epsilon)


def model_error(time_s, model_kgm3, reconstructed_kgm3, variant: str = "corrected") -> float:
    """Root of the mean square over time of model less reconstructed. [kg/m3]   plume paper eq 28

    ``printed``: without the root [kg2/m6]; the 0.435e-12 kg/m3 in print is of the root."""
    check_choice(variant, VARIANTS, "variant")
    t = np.asarray(time_s, float)
    off = np.asarray(model_kgm3, float) - np.asarray(reconstructed_kgm3, float)
    square = float(np.trapezoid(off**2, t) / (t[-1] - t[0]))
    return square if variant == "printed" else float(np.sqrt(square))
