"""What an inertia fit takes: momentum of the wheels, body rates and attitude, each at its own times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.environment import gravity_gradient_regressor
from ...dynamics.rigid_body import momentum_regressor
from ...kit.doubts import Doubts, Kind, Severity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...dynamics.orbit import Orbit
    from .surroundings import Surroundings
    from .swings import Swing

MOMENTUM_STEPS = Kind(
    "inertia.momentum-steps", Severity.SUSPECT,
    "the total momentum steps near {at_s:.0f} s, and no channel shows why (a thruster?): it is fitted separately before and after",
    "Add the thrusters' on-times, or leave the span out (--start, --stop).",
)  # fmt: skip


@dataclass(frozen=True)
class MomentumSamples:
    """Components d . h of the wheels' momentum, body axes; seconds from the record's start.

    ``unit``: what one unit of reading error (rad/s of a wheel, or N m s) makes of the component; ``count``: readings
    averaged in it; ``arc``: the stretch of undisturbed momentum it belongs to."""

    time_s: np.ndarray  # (M,)
    direction: np.ndarray  # (M, 3)
    value_Nms: np.ndarray  # (M,)
    unit: np.ndarray  # (M,)
    count: np.ndarray  # (M,)
    arc: np.ndarray  # (M,) int

    def vectors(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Instants (N,), the sum of ``values`` (M,) along their directions at each (N, 3), and each sample's instant (M,)."""
        times, index = np.unique(self.time_s, return_inverse=True)
        total = np.zeros((len(times), 3))
        np.add.at(total, index, self.direction * values[:, None])
        return times, total, index

    def unit_covariance(self) -> np.ndarray:
        """Of the wheels' momentum for unit variance of one reading. (3, 3)"""
        first = self.time_s == self.time_s[0]
        d, u = self.direction[first], self.unit[first]
        return (d * u[:, None] ** 2).T @ d

    def sorted_into(self, arcs: Sequence[tuple[float, float]]) -> MomentumSamples:
        """The samples that lie in an arc, each with its arc's number."""
        arc = np.full(len(self.time_s), -1)
        for k, (a, b) in enumerate(arcs):
            arc[(self.time_s >= a) & (self.time_s < b)] = k
        keep = arc >= 0
        return MomentumSamples(
            self.time_s[keep], self.direction[keep], self.value_Nms[keep], self.unit[keep], self.count[keep], arc[keep]
        )


@dataclass(frozen=True)
class RateSamples:
    """Body rates, one axis each; (0,) where the telemetry has none."""

    time_s: np.ndarray
    axis: np.ndarray  # (M,) int
    value_rad_s: np.ndarray
    count: np.ndarray

    @classmethod
    def none(cls) -> RateSamples:
        return cls(np.empty(0), np.empty(0, int), np.empty(0), np.empty(0))


@dataclass(frozen=True)
class AttitudeSamples:
    """Attitude as the telemetry has it, body to inertial; (0, 4) where it has none."""

    time_s: np.ndarray
    q_NB: np.ndarray
    count: np.ndarray

    @classmethod
    def none(cls) -> AttitudeSamples:
        return cls(np.empty(0), np.empty((0, 4)), np.empty(0))


@dataclass(frozen=True)
class SlewRecord:
    """One record.  ``arcs``: spans [s] over which nothing but an external torque changes the momentum.

    ``wanders``: whether that torque varies so much that the total momentum is modelled as a random walk; ``slow``: whether a
    slow coloured torque is part of the model, and with it the levers of the ``surroundings``; ``orbit``: where the gravity gradient comes from; ``steps``: at which instants
    arcs were parted because the momentum steps."""

    zero_s: float  # the record's start, from the telemetry's epoch
    momentum: MomentumSamples
    rates: RateSamples
    attitude: AttitudeSamples
    arcs: tuple[tuple[float, float], ...]
    wheels: tuple[str, ...]
    axes: np.ndarray  # (n, 3), momentum of each per unit of its reading
    relative: bool  # momentum per unit spin inertia
    counts: dict[str, float]  # one count of each kind of channel, 0 where not known
    doubts: Doubts
    spins: tuple[np.ndarray, np.ndarray] | None = (
        None  # instants (N,) and readings (N, n) of all wheels, where they are read together
    )
    swings: tuple[Swing, ...] = ()
    wanders: bool = False
    slow: bool = False
    orbit: Orbit | None = None
    surroundings: Surroundings | None = None
    steps: tuple[float, ...] = ()
    whole: SlewRecord | None = None  # before any step

    @property
    def has_attitude(self) -> bool:
        return len(self.attitude.time_s) > 0

    @property
    def has_rates(self) -> bool:
        return len(self.rates.time_s) > 0

    def grown_by_gravity(self, time_s: np.ndarray, R: np.ndarray) -> np.ndarray | None:
        """What the gravity gradient adds to the momentum since the first instant, per unit of each element of the tensor,
        inertial axes (N, 3, 6); None where there is no orbit, or no attitude to say how it lies in the body.

        R (N, 3, 3): body to inertial."""
        if self.orbit is None or not self.has_attitude:
            return None
        r_B = np.einsum("nji,nj->ni", R, self.orbit.at(time_s))
        return scipy.integrate.cumulative_trapezoid(
            R @ gravity_gradient_regressor(r_B, self.orbit.mu), time_s, axis=0, initial=0
        )

    def tensor_columns(self, time_s: np.ndarray, R: np.ndarray, omega_B: np.ndarray) -> np.ndarray:
        """Momentum of the wheels per unit of each element of the tensor, body axes: what the body turns with less, and what the
        gravity gradient has brought. (N, 3, 6)"""
        columns = -momentum_regressor(omega_B)
        grown = self.grown_by_gravity(time_s, R)
        return columns if grown is None else columns + np.swapaxes(R, 1, 2) @ grown

    def common_rates(self) -> tuple[np.ndarray, np.ndarray]:
        """Instants at which all three rates are known (N,), and the rates (N, 3)."""
        parts = [(self.rates.time_s[m], self.rates.value_rad_s[m]) for j in range(3) for m in [self.rates.axis == j]]
        times = np.intersect1d(np.intersect1d(parts[0][0], parts[1][0]), parts[2][0])
        return times, np.stack([v[np.searchsorted(t, times)] for t, v in parts], axis=1)

    @property
    def levers(self) -> int:
        """How many levers of the surroundings are fitted."""
        return len(self.surroundings.names) if self.slow and self.surroundings is not None else 0

    def split_at(self, time_s: float) -> SlewRecord:
        """The same record with the arc around an instant parted there, where the momentum steps."""
        arcs = []
        for a, b in self.arcs:
            arcs += [(a, time_s), (time_s, b)] if a < time_s < b else [(a, b)]
        doubts = Doubts([*self.doubts, MOMENTUM_STEPS(at_s=self.zero_s + time_s)])
        return replace(
            self, arcs=tuple(arcs), momentum=self.momentum.sorted_into(arcs), doubts=doubts, steps=(*self.steps, time_s),
            whole=self.whole or self,
        )  # fmt: skip
