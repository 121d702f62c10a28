"""What acts on a body in orbit through a lever of its own that no one knows: field, sunlight and air stream, as the telemetry has them.

Each torque is p x u with u a vector in body axes that is measured, and p constant in the body: the residual dipole with the field, the
lever of sunlight with the Sun's direction, that of drag with the stream.  p is fitted; the density's own changes are left to the slow
torque beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

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
        return (*self.vectors, "drag")

    def grown(self, time_s: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Momentum that each lever's components bring since the first instant, per N m, inertial axes. (N, 3, 3 sources)

        R (N, 3, 3): body to inertial."""
        v = self.orbit.velocity_at(time_s)
        stream = -v / np.linalg.norm(v, axis=1, keepdims=True)
        every = [np.stack([np.interp(time_s, t, u[:, j]) for j in range(3)], axis=1) for t, u in self.vectors.values()]
        every.append(np.einsum("nji,nj->ni", R, stream))
        columns = np.concatenate([levers(u) for u in every], axis=2)
        return cumulative_trapezoid(R @ columns, time_s, axis=0, initial=0)


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
