"""A flyby along a trajectory that is given, in place of a straight line: altitude, speed, and where jets are seen from it.

Positions and velocities are in axes fixed to the body: z along its spin axis to the north pole, x through the prime meridian;
west longitude of a point is atan2(-y, x).  Between rows the path is a cubic with both, beyond its ends straight.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np
import scipy

from ..kit.doubts import Doubts, Kind, Severity
from ..kit.errors import BadInput
from .flyby import Flyby
from .plume import FARTHEST_M

#: A trajectory is nearest at the closest approach given, to within this. [s]  Assumed.
_NEAR_S = 1.0
#: A trajectory should hold what is below this altitude; gravity hardly bends the path above. [m]  Assumed.
_HELD_M = 1000e3

NEAREST_ELSEWHEN = Kind(
    "dynamics.nearest-elsewhen", Severity.SUSPECT,
    "the trajectory is nearest {apart_s:.1f} s {when} the closest approach given",
    "Check --closest-approach, and the trajectory's epoch.",
)  # fmt: skip
STRAIGHT_BEYOND = Kind(
    "dynamics.straight-beyond", Severity.CAUTION,
    "the trajectory covers {start_s:+.0f} to {stop_s:+.0f} s only: the path is assumed straight beyond, where gas is still possible",
    "Give a trajectory that covers all that lies below 1000 km.",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Trajectory(Flyby):
    """A flyby along rows of position and velocity; make one with ``Trajectory.along``.

    ``time_s`` (N,): from closest approach [s]; ``position_m`` (N, 3) [m] and ``velocity_m_s`` (N, 3) [m/s]: from the body's
    centre, in axes fixed to the body (z to its north pole, x through its prime meridian).  Altitude, speed, latitude and
    longitude are those of closest approach."""

    time_s: np.ndarray = field(default_factory=lambda: np.empty(0))
    position_m: np.ndarray = field(default_factory=lambda: np.empty(0))
    velocity_m_s: np.ndarray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def along(cls, flyby: Flyby, time_s, position_m, velocity_m_s) -> Trajectory:
        """The flyby ``flyby`` (its name, body and date) along a trajectory, as the class describes its rows.

        Raises BadInput where the trajectory does not hold closest approach, stays far from the body, or goes through it."""
        t, r, v = (np.asarray(x, float) for x in (time_s, position_m, velocity_m_s))
        common = {f.name: getattr(flyby, f.name) for f in fields(Flyby)}
        path = cls(**common | {"time_s": t, "position_m": r, "velocity_m_s": v})
        if not t[0] <= 0 <= t[-1]:
            raise BadInput(
                f"the trajectory covers {t[0]:.0f} to {t[-1]:.0f} s from closest approach and does not hold it",
                remedy="Give a trajectory that does, and check --closest-approach.",
            )
        least = float(path.distance(path.closest_s))
        if least < flyby.moon.radius_m:
            raise BadInput(
                f"the trajectory comes within {least / 1e3:.1f} km of {flyby.moon.name}'s centre, less than its radius of {flyby.moon.radius_m / 1e3:g} km",
                remedy="Give positions from the body's centre, with their unit.",
            )
        if least - flyby.moon.radius_m > FARTHEST_M:
            raise BadInput(
                f"the trajectory stays {least / 1e3:.0f} km and more from {flyby.moon.name}'s centre: gas is looked for within {FARTHEST_M / 1e3:.0f} km of its surface",
                remedy="Give positions from the body's centre, and check their unit.",
            )
        at, speed = path.place(0.0), float(path.speed(0.0))
        common |= {
            "altitude_m": float(np.linalg.norm(at)) - flyby.moon.radius_m,
            "speed_m_s": speed,
            "latitude_south_rad": float(-np.arcsin(at[2] / np.linalg.norm(at))),
            "longitude_west_rad": float(np.arctan2(-at[1], at[0]) % (2 * np.pi)),
            "noticed_s": None,
        }
        return cls(**common | {"time_s": t, "position_m": r, "velocity_m_s": v})

    @property
    def closest_s(self) -> float:
        """When the distance is least, after the closest approach that time counts from. [s]"""
        k = int(np.argmin(np.linalg.norm(self.position_m, axis=1)))
        low, high = self.time_s[max(k - 1, 0)], self.time_s[min(k + 1, len(self.time_s) - 1)]
        return float(
            scipy.optimize.minimize_scalar(
                self.distance, bounds=(low, high), method="bounded", options={"xatol": 1e-3}
            ).x
        )

    @property
    def doubts(self) -> Doubts:
        """Doubts about the path: its closest approach is another, or it ends within reach of gas."""
        late, found = self.closest_s, []
        if abs(late) >= _NEAR_S:
            found.append(NEAREST_ELSEWHEN(apart_s=abs(late), when="after" if late > 0 else "before"))
        ends = self.time_s[[0, -1]]
        if (self.altitude(ends) < _HELD_M).any():
            found.append(STRAIGHT_BEYOND(start_s=float(ends[0]), stop_s=float(ends[1])))
        return Doubts(found)

    @cached_property
    def _spline(self) -> scipy.interpolate.CubicHermiteSpline:
        return scipy.interpolate.CubicHermiteSpline(self.time_s, self.position_m, self.velocity_m_s)

    def place(self, time_s) -> np.ndarray:
        """Position in axes fixed to the body. (..., 3) [m]"""
        t = np.asarray(time_s, float)
        inside = np.clip(t, self.time_s[0], self.time_s[-1])
        held = np.where((t < self.time_s[0])[..., None], self.velocity_m_s[0], self.velocity_m_s[-1])
        return self._spline(inside) + (t - inside)[..., None] * held

    def speed(self, time_s) -> np.ndarray:
        t = np.clip(np.asarray(time_s, float), self.time_s[0], self.time_s[-1])
        return np.linalg.norm(self._spline(t, 1), axis=-1)

    def distance(self, time_s) -> np.ndarray:
        return np.linalg.norm(self.place(time_s), axis=-1)

    def climb_rate(self, time_s) -> np.ndarray:
        t = np.asarray(time_s, float)
        return (self.distance(t + 0.05) - self.distance(t - 0.05)) / 0.1

    def in_plane(self, time_s) -> np.ndarray:
        return self._turned(self.place(time_s))[..., :2]

    def from_source(self, jet, time_s) -> tuple[np.ndarray, np.ndarray]:
        south, west = jet.latitude_south_rad, jet.longitude_west_rad
        up = np.array([np.cos(south) * np.cos(west), -np.cos(south) * np.sin(west), -np.sin(south)])
        return self._turned(self.place(time_s) - self.moon.radius_m * up), self._turned(up)

    def from_south(self, time_s) -> np.ndarray:
        return self.place(time_s)[..., :2] * np.array([1, -1])

    def position(self, time_s, up_B, velocity_B) -> np.ndarray:
        super().position(0.0, up_B, velocity_B)  # refuses what is no pair of directions
        fixed = _triad(self.place(0.0), self._spline(0.0, 1))
        return self.place(time_s) @ fixed.T @ _triad(up_B, velocity_B)

    def _turned(self, vector) -> np.ndarray:
        """From body-fixed axes to: away from the spin axis on the side of closest approach, south, and across both."""
        west = self.longitude_west_rad or 0.0
        out, south = np.array([np.cos(west), -np.sin(west), 0.0]), np.array([0.0, 0.0, -1.0])
        return vector @ np.stack([out, south, np.cross(out, south)]).T


def _triad(up, along) -> np.ndarray:
    """Rows: up, along without its part along up, and across."""
    u = np.asarray(up, float) / np.linalg.norm(up)
    v = np.asarray(along, float) - np.dot(along, u) * u
    v = v / np.linalg.norm(v)
    return np.stack([u, v, np.cross(u, v)])
