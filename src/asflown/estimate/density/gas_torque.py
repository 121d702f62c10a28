"""The torque that is left to the gas: by the method that the record allows, less the gravity gradient where that is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.environment import gravity_gradient, gravity_gradient_bound
from ...dynamics.plume import FARTHEST_M
from ...kit.errors import BadInput
from ..subject import check_on_times
from ..torque import Transfer, chosen_method, method_called, torque_of
from .asked import REACH_S

if TYPE_CHECKING:
    from ..subject import Subject
    from ..torque import Method, TorqueResult
    from .asked import Asked, Passage
    from .drag import DragAlong

_FEWEST = 10  # instants


@dataclass(frozen=True)
class GasTorque:
    """Torque about the n axes that gas turns, at instants (N,) from closest approach.

    ``torque_Nm`` (N, n) as estimated, with its sigma; ``gravity_Nm`` (N, n): the gravity gradient taken off, None where it is
    bounded; ``bound_Nm`` (N,): the most that all that is left out can do; ``near`` (N,): what a result shows; ``known`` (N,):
    where a plume can be looked for."""

    time_s: np.ndarray
    torque_Nm: np.ndarray
    torque_sigma_Nm: np.ndarray | None
    gravity_Nm: np.ndarray | None
    bound_Nm: np.ndarray
    near: np.ndarray
    known: np.ndarray

    @property
    def of_gas_Nm(self) -> np.ndarray:
        return self.torque_Nm - (0.0 if self.gravity_Nm is None else self.gravity_Nm)

    def gravity_at(self, time_s: np.ndarray, column: int) -> np.ndarray:
        """Gravity gradient taken off about an axis, at other instants from closest approach. [N m]"""
        if self.gravity_Nm is None:
            return np.zeros(len(time_s))
        return np.interp(time_s, self.time_s, self.gravity_Nm[:, column])


def estimated_torque(subject: Subject, asked: Asked, drag: DragAlong) -> TorqueResult:
    """The torque about the axes of the drag.

    Raises BadInput where there is none in N m."""
    check_on_times(subject.telemetry, subject.craft.craft)
    about = drag.names if len(drag.axes) == 1 else "all"
    torque = torque_of(subject, _method_for(subject, asked, drag), about)
    if torque.relative or subject.craft.relative:
        raise BadInput(
            "inertia and torque are known per unit spin inertia only, and a density needs the torque in N m",
            remedy="Give the wheels' spin inertia and the inertia in kg m2 in the craft file.",
        )
    return torque


def _method_for(subject: Subject, asked: Asked, drag: DragAlong) -> Method:
    """The one asked for; else the plume paper's reduced loop for its printed way, or what suits the record."""
    if asked.method is not None:
        order = asked.order if asked.method == "polynomial" else None
        return method_called(asked.method, variant=asked.variant, order=order)
    if asked.printed:
        return Transfer(model="hankel", variant="printed")
    return chosen_method(subject, tuple(drag.axes))


def without_rates(subject: Subject, drag: DragAlong) -> list[str]:
    """Axes that gas turns whose body rate is not in the telemetry."""
    return [a for a in drag.names if f"body_rate_{a}" not in subject.telemetry]


def gas_torque(subject: Subject, asked: Asked, passage: Passage, drag: DragAlong, torque: TorqueResult) -> GasTorque:
    """From closest approach on, about the drag's axes, with the gravity gradient taken off or bounded.

    Raises BadInput where the torque is known at too few instants near the moon, and where the inertia is not known."""
    flyby, axes = passage.flyby, list(drag.axes)
    time_s = torque.time_s - passage.closest_s
    near = np.abs(time_s) <= REACH_S
    # a plume is looked for within reach of the plume paper's models: beyond, a method's own errors are the largest
    within = flyby.altitude(time_s) <= FARTHEST_M
    known = near & np.isfinite(torque.torque_Nm[:, axes]).all(axis=1) & within
    if known.sum() < _FEWEST:
        raise BadInput(
            f"the torque is known at {known.sum()} instants within {FARTHEST_M / 1e3:g} km of {flyby.name}'s moon: too few",
            file=subject.telemetry.source or None,
            remedy="Take a longer record, or check --closest-approach.",
        )
    gravity, bound = _gravity(subject, asked, passage, time_s)
    sigma = torque.torque_sigma_Nm
    return GasTorque(
        time_s,
        torque.torque_Nm[:, axes],
        None if sigma is None else sigma[:, axes],
        None if gravity is None else gravity[:, axes],
        bound,
        near,
        known,
    )


def _gravity(subject: Subject, asked: Asked, passage: Passage, time_s) -> tuple[np.ndarray | None, np.ndarray]:
    """Gravity gradient (N, 3), None where it is bounded; and the bound (N,) of all that is left out."""
    I_B, flyby = subject.known_inertia(), passage.flyby
    bound = np.full(len(time_s), flyby.moon.small_torques_Nm)
    if asked.takes_gravity_off:
        place = flyby.position(time_s, asked.up_B, asked.velocity_B)
        return gravity_gradient(I_B, place, flyby.moon.mu_m3_s2), bound
    return None, bound + gravity_gradient_bound(I_B, flyby.distance(time_s), flyby.moon.mu_m3_s2)
