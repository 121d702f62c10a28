"""What a flyby does to a craft: the gas it meets, its drag torque, gravity gradient and the small torques, over time.

Where the body is, what its jets and atmosphere hold, and what drag makes of that come from ``dynamics``, the one place of their
formulas and figures; gravity gradient and everything that moves are the simulator's own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...dynamics.drag import torque_per_density
from ...dynamics.flyby import Flyby, flyby_called
from ...dynamics.plume import as_passed, plume_density, published_jets
from ...kit.errors import BadInput, some_of
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ...craft.model import CraftAt
    from ..scenario import Passage, Plume

#: One Runge-Kutta step: the curve, not its chords. [s]
_STEP_S = 0.03125
_BEYOND_S = 600.0  # closest approach may lie so far outside a record


@dataclass(frozen=True)
class Passed:
    """At times (k,) [s]: torque on the body (k, 3), density (k,), altitude (k,); ``per_density`` (3,) N m per kg/m3."""

    flyby: Flyby
    time_s: np.ndarray
    torque_Nm: np.ndarray
    density_kgm3: np.ndarray
    altitude_m: np.ndarray
    per_density: np.ndarray

    @property
    def axis(self) -> int:
        """About which gas turns the craft most."""
        return int(np.argmax(np.abs(self.per_density)))

    @property
    def peak(self) -> tuple[float, float, float, float]:
        """Time [s], density [kg/m3], altitude [m] and drag torque [N m] where the density is largest."""
        k = int(np.argmax(self.density_kgm3))
        rho = float(self.density_kgm3[k])
        return float(self.time_s[k]), rho, float(self.altitude_m[k]), rho * float(self.per_density[self.axis])

    def record(self) -> dict:
        """For the truth beside the telemetry."""
        at, rho, altitude, torque = self.peak
        return {
            "flyby": self.flyby.name, "body": self.flyby.moon.name, "speed_m_s": self.flyby.speed_m_s,
            "altitude_closest_m": self.flyby.altitude_m, "torque_per_density_m5_s2": self.per_density.tolist(),
            "peak": {"time_s": at, "density_kgm3": rho, "altitude_m": altitude, "torque_Nm": torque, "axis": AXES[self.axis]},
        }  # fmt: skip


def passed(p: Passage, now: CraftAt, start_s: float, stop_s: float) -> Passed:
    """Between two instants of the scenario.

    Raises BadInput for an unknown flyby or jet, for one whose place jets need, and where drag or inertia are not known."""
    where = flyby_called(p.name)
    given: dict[str, Any] = {"altitude_m": p.altitude, "speed_m_s": p.speed, "latitude_south_rad": p.latitude_south,
             "longitude_west_rad": p.longitude_west}  # fmt: skip
    where = replace(where, **{k: v for k, v in given.items() if v is not None})
    air = now.craft.aerodynamics
    if air is None or not air.in_flyby:
        raise BadInput(
            f"the drag of {now.craft.name} is not known, and the gas of a flyby acts by it",
            remedy="Describe it under [aerodynamics] in the craft file.",
        )
    arm = 0.0 - air.moment_arm * np.eye(3)[AXES.index(air.axis)] if p.arm is None else np.array(p.arm)
    per_density = torque_per_density(air.drag_coefficient, where.speed_m_s, p.area or air.projected_area, arm)
    if not start_s - _BEYOND_S <= p.closest_approach <= stop_s + _BEYOND_S:
        raise BadInput(
            f"closest approach at {p.closest_approach:g} s is far outside the record, which runs from {start_s:g} to {stop_s:g} s",
            remedy="Set flyby.closest_approach within it.",
        )
    t = np.arange(start_s, stop_s + _STEP_S, _STEP_S)
    since = t - p.closest_approach
    rho = _density(p, where, since)
    swept = (where.speed(since) / where.speed_m_s) ** 2  # the torque per density is that of closest approach
    torque = (rho * swept)[:, None] * per_density
    if p.gravity_gradient:
        r = where.position(since, p.up, p.velocity)
        moment = np.cross(r, r @ now.inertia_kgm2)
        torque = torque + 3 * where.moon.mu_m3_s2 * moment / np.linalg.norm(r, axis=1, keepdims=True) ** 5
    if p.small_torques:
        torque = torque + where.moon.small_torques_Nm * arm / max(float(np.linalg.norm(arm)), 1e-300)
    return Passed(where, t, torque, rho, where.altitude(since), per_density)


def plume_torque(p: Plume, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """The plume paper's own: E3, Table 3, 0.5 x 2.1 x 14410^2 x 18.401 x 0.853 N m per kg/m3 (eq 22). (k,), (k,)"""
    t, where = np.arange(0.0, duration + _STEP_S, _STEP_S), flyby_called(p.flyby)
    per_density = torque_per_density(2.1, where.speed_m_s, 18.401, 0.853)
    return t, p.sign * per_density * plume_density(published_jets(), where, t - p.closest_approach, power=p.exponent)


def _density(p: Passage, where: Flyby, since) -> np.ndarray:
    atmosphere = where.moon.atmosphere
    if atmosphere is not None:
        if p.jets is not None:
            raise BadInput(
                f"{where.moon.name} has an atmosphere, and no jets are known of it", remedy="Leave jets out."
            )
        given = {"density_kgm3": p.density, "scale_height_m": p.scale_height}
        atmosphere = replace(atmosphere, **{k: v for k, v in given.items() if v is not None})
        return atmosphere.density(where.altitude(since))
    if p.density is not None or p.scale_height is not None:
        raise BadInput(
            f"{where.moon.name} has jets and no atmosphere of a scale height",
            remedy="Scale its jets: jets = { Cairo = 2 }.",
        )
    known = {j.name: j for j in published_jets()}
    blowing = p.jets or dict.fromkeys(known, 1.0)
    for name in blowing:
        if name not in known:
            raise BadInput(f"{name!r} is none of the jets", remedy=f"Choose of: {some_of(known)}.")
    sources = [
        replace(j, density_kgm3=factor * j.density_kgm3)
        for name, factor in blowing.items()
        for j in [known[name] if where.name == "E3" else as_passed(known[name], where)]
    ]
    return plume_density(sources, where, since, power=p.exponent, angle=p.angle)
