"""What acts on a body in orbit through a lever of its own that no one knows: field, sunlight and air stream, as the telemetry has them.

Each torque is p x u with u a vector in body axes that is measured, and p constant in the body: the residual dipole with the field, the
lever of sunlight with the Sun's direction, that of drag with the stream.  p is fitted.  The air's density swings by day and night, by a
third to a half of its mean at 500 km: drag's lever therefore swings once an orbit.  Left to a slow torque in inertial axes, which does not
turn with the body, that swing makes the tensor's errors half as large again as their sigma."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ..environment import levers

if TYPE_CHECKING:
    from ...dynamics.orbit import Orbit
    from ...telemetry.telemetry import Telemetry

_FEWEST = 20
_SOURCES = (("dipole", "magnetic_field"), ("sunlight", "sun_direction"))


@dataclass(frozen=True)
class Surroundings:
    """Vectors in body axes at their own instants, {name: (time_s (N,), u (N, 3))}, each scaled to one; the stream from the orbit."""

    vectors: dict[str, tuple[np.ndarray, np.ndarray]]
    orbit: Orbit

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.vectors, "drag", "drag's cosine", "drag's sine")

    def grown(self, time_s: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Momentum that each lever's components bring since the first instant, per N m, inertial axes. (N, 3, 3 sources)

        R (N, 3, 3): body to inertial."""
        v = self.orbit.velocity_at(time_s)
        stream = -v / np.linalg.norm(v, axis=1, keepdims=True)
        every = [np.stack([np.interp(time_s, t, u[:, j]) for j in range(3)], axis=1) for t, u in self.vectors.values()]
        stream = np.einsum("nji,nj->ni", R, stream)
        angle = orbit_angle(self.orbit.at(time_s))[:, None]
        every += [stream, np.cos(angle) * stream, np.sin(angle) * stream]
        columns = np.concatenate([levers(u) for u in every], axis=2)
        return scipy.integrate.cumulative_trapezoid(R @ columns, time_s, axis=0, initial=0)


def orbit_angle(position_N: np.ndarray) -> np.ndarray:
    """Along the orbit from the first of its positions (N, 3), in its plane. (N,) [rad]"""
    r = position_N / np.linalg.norm(position_N, axis=1, keepdims=True)
    normal = np.cross(r[:-1], r[1:]).sum(axis=0)
    across = np.cross(normal / max(np.linalg.norm(normal), 1e-300), r[0])
    return np.arctan2(r @ across, r @ r[0])


def surroundings_of(telemetry: Telemetry, start_ns: int, orbit: Orbit) -> Surroundings:
    """Those of which the telemetry has the vector."""
    vectors = {}
    for name, stem in _SOURCES:
        if not telemetry.has_axes(stem):
            continue
        tai_ns, u = together(telemetry, [f"{stem}_{a}" for a in AXES])
        size = float(np.sqrt(np.mean(np.sum(u**2, axis=1)))) if len(tai_ns) >= _FEWEST else 0.0
        if size > 0:
            vectors[name] = (tai_ns - start_ns) / 1e9, u / size
    return Surroundings(vectors, orbit)
