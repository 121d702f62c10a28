"""What the surroundings of an orbiting craft act on: its orbit, dipole, torque rods, and surfaces in sunlight and thin air.

Sunlight and air push either through a ``lever``, one torque vector that a lit or flown craft has, or on ``facets``, flat plates.
Signs: sunlight = lit x (lever x s), s to the Sun; drag = lever x (-v/|v|) x density / reference density; residual dipole = m x B.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from .fields import (
    AmpereMetre2,
    Date,
    Described,
    DipoleVector,
    Direction,
    KilogramPerMetre3,
    Metre,
    Metre2,
    MetreVector,
    NewtonMetre,
    Radian,
    Share,
    TorqueVector,
)

#: One sigma of a dipole or lever whose table states none, as a share of its length: assumed, wide.
ASSUMED_SHARE = 0.3

_EARTH_RADIUS_M = 6.378137e6
_FURTHEST_M = 1.5e9  # beyond it the Sun holds the craft


def _unit(direction, what: str) -> None:
    if abs(np.linalg.norm(direction) - 1) > 1e-3:
        raise ValueError(f"{what} is not a unit vector (its length is {np.linalg.norm(direction):.4g})")


class OrbitElements(Described):
    """Osculating elements about the Earth at ``epoch``, in the inertial axes of the telemetry (GCRS, J2000)."""

    body: Literal["Earth"]
    epoch: Date
    semi_major_axis: Metre
    eccentricity: float = Field(ge=0, lt=1)
    inclination: Radian = Field(ge=0, le=np.pi)
    ascending_node: Radian
    argument_of_perigee: Radian
    mean_anomaly: Radian
    source: str = ""

    @model_validator(mode="after")
    def _possible(self):
        perigee_m = self.semi_major_axis * (1 - self.eccentricity)
        if not perigee_m > _EARTH_RADIUS_M:
            raise ValueError(
                f"the perigee is {perigee_m / 1e3:.6g} km from the Earth's centre, below its surface: semi_major_axis counts from the "
                "centre (height + 6378 km); check its unit"
            )
        if not self.semi_major_axis < _FURTHEST_M:
            raise ValueError(
                f"semi_major_axis {self.semi_major_axis / 1e3:.4g} km is beyond the Earth's reach: check its unit"
            )
        return self


class Magnetics(Described):
    """The residual dipole of the craft. [A m2], body axes"""

    residual_dipole: DipoleVector
    sigma: AmpereMetre2 | None = Field(default=None, gt=0)  # of each component
    source: str = ""

    @property
    def residual_dipole_Am2(self) -> np.ndarray:
        """(3,), body axes."""
        return np.array(self.residual_dipole)

    @property
    def sigma_Am2(self) -> float:
        """One sigma of each component: the one stated, else ``ASSUMED_SHARE`` of the dipole's length."""
        return ASSUMED_SHARE * float(np.linalg.norm(self.residual_dipole)) if self.sigma is None else self.sigma


class TorqueRod(Described):
    """A magnetic torquer: its dipole lies along ``axis``."""

    name: str
    axis: Direction
    max_dipole: AmpereMetre2 = Field(gt=0)

    @model_validator(mode="after")
    def _directed(self):
        _unit(self.axis, f"torque rod {self.name!r}: the axis")
        return self


class Facet(Described):
    """A flat plate that faces outward along ``normal``; ``center`` in the origin of the centre of mass.

    ``specular``, ``diffuse``: shares of the light that are reflected as by a mirror and in all directions; the rest is absorbed."""

    area: Metre2 = Field(gt=0)
    normal: Direction
    center: MetreVector
    specular: float = Field(default=0.0, ge=0, le=1)
    diffuse: float = Field(default=0.0, ge=0, le=1)

    @model_validator(mode="after")
    def _possible(self):
        _unit(self.normal, "the facet's normal")
        if self.specular + self.diffuse > 1:
            raise ValueError(f"specular and diffuse together reflect {self.specular + self.diffuse:g} of the light")
        return self


def _either(lever, facets, what: str) -> None:
    if lever is not None and facets:
        raise ValueError(f"[{what}] has both lever and facets: give one of them")


class Sunlight(Described):
    """How sunlight turns the craft: by one ``lever`` [N m, body axes], or on ``facets``."""

    lever: TorqueVector | None = None
    sigma: NewtonMetre | None = Field(default=None, gt=0)  # of each component
    facets: tuple[Facet, ...] = ()
    source: str = ""

    @model_validator(mode="after")
    def _one_form(self):
        _either(self.lever, self.facets, "sunlight")
        if self.lever is None and not self.facets:
            raise ValueError("[sunlight] needs lever (three torques in N m) or facets")
        return self

    @property
    def lever_Nm(self) -> np.ndarray | None:
        """(3,), body axes; None where facets are given."""
        return None if self.lever is None else np.array(self.lever)

    @property
    def sigma_Nm(self) -> float | None:
        """One sigma of each component; None where nothing tells: facets without a sigma."""
        return _sigma(self.sigma, self.lever)


class Aerodynamics(Described):
    """Drag of a thin gas: along an orbit by one ``lever`` [N m at ``reference_density``, body axes] or on ``facets``; in a flyby by
    ``projected_area`` and ``moment_arm`` about ``axis``, in the attitude of one ``flyby`` (plume paper eq 21).

    ``scale_sigma``: one sigma of the product C_D V^2 area arm, as a share.  Zero: not given."""

    lever: TorqueVector | None = None
    sigma: NewtonMetre | None = Field(default=None, gt=0)  # of each component of the lever
    reference_density: KilogramPerMetre3 = Field(default=0.0, gt=0)
    facets: tuple[Facet, ...] = ()
    drag_coefficient: float = Field(default=0.0, gt=0)
    drag_coefficient_sigma: float = Field(default=0.0, ge=0)
    projected_area: Metre2 = Field(default=0.0, gt=0)
    moment_arm: Metre = Field(default=0.0, gt=0)
    axis: Literal["x", "y", "z"] = "z"
    flyby: str = ""
    scale_sigma: Share | None = None
    source: str = ""

    @model_validator(mode="after")
    def _one_form(self):
        _either(self.lever, self.facets, "aerodynamics")
        given = self.model_fields_set
        if self.lever is None and not self.facets and not given & {"projected_area", "moment_arm"}:
            raise ValueError(
                "[aerodynamics] needs lever (three torques in N m) with reference_density, or facets with drag_coefficient; for a "
                "flyby drag_coefficient, drag_coefficient_sigma, projected_area and moment_arm"
            )
        needs = {
            "lever": ("reference_density",), "sigma": ("lever",), "reference_density": ("lever",), "facets": ("drag_coefficient",),
            **dict.fromkeys(("projected_area", "moment_arm", "flyby", "scale_sigma"), _OF_A_FLYBY),
        }  # fmt: skip
        for key in sorted(given & set(needs)):
            if missing := [n for n in needs[key] if n not in given]:
                raise ValueError(f"{key} needs {', '.join(missing)} beside it")
        if any(f.specular or f.diffuse for f in self.facets):
            raise ValueError("a facet of [aerodynamics] has specular or diffuse: they belong to [sunlight]")
        return self

    @property
    def in_flyby(self) -> bool:
        """Whether its drag in a flyby is described."""
        return self.projected_area > 0

    @property
    def in_orbit(self) -> bool:
        """Whether its drag along an orbit is described."""
        return self.lever is not None or bool(self.facets)

    @property
    def lever_Nm(self) -> np.ndarray | None:
        """(3,), body axes, at the reference density; None where it is not given."""
        return None if self.lever is None else np.array(self.lever)

    @property
    def sigma_Nm(self) -> float | None:
        """One sigma of each component of the lever; None without one."""
        return _sigma(self.sigma, self.lever)


_OF_A_FLYBY = ("drag_coefficient", "drag_coefficient_sigma", "projected_area", "moment_arm")


def _sigma(stated: float | None, lever) -> float | None:
    if stated is not None or lever is None:
        return stated
    return ASSUMED_SHARE * float(np.linalg.norm(lever))
