"""What telemetry says of a density along a flyby, as a regression that is linear in it.

    y = A rho(nodes) + noise

By ``momentum``: what wheels and body hold at each instant is the integral of the torque; its noise is that of the sensors, white.
Through the ``loop``: attitude error, body rate and wheel momentum each respond to the torque as the craft's controller lets them,
and the filter whitens them all; neither lag nor smoothing enters, but gains and filter must be right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.plume import FARTHEST_M, Jet, seen_from
from ...kit.errors import BadInput
from ...kit.regression import noise_sigma
from ..fused import hats, regression

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...dynamics.flyby import Flyby
    from ..density import DensityResult

_STEP_S = 0.25  # between nodes: it resolves a jet's cusp
_BEFORE_S = 120.0  # of quiet before closest approach, to know the momentum that craft and wheels had


@dataclass(frozen=True)
class JetData:
    """y (N,) and A (N, C) for densities at even nodes (C,) [s from closest approach]; ``unit`` of y: 'N m s' for the momentum of
    one axis, else 'sigma'."""

    y: np.ndarray
    A: np.ndarray
    nodes_s: np.ndarray
    unit: str

    @property
    def last_s(self) -> float:
        return float(self.nodes_s[-1])


def by_momentum(met: DensityResult, sources: Sequence[Jet]) -> JetData:
    """From the momentum of wheels and body about every axis of ``met``, less what gravity gradient gave, centred.

    Raises BadInput where that momentum is not in the telemetry."""
    if met.momentum is None:
        raise BadInput(
            "jets are fitted to the momentum that the actuators hold, and it is not in the telemetry",
            remedy="Add wheel_rate_<WHEEL> or wheel_momentum_x, _y, _z.",
        )
    t = met.momentum.time_s
    used = (t >= -_BEFORE_S) & _within(met.flyby, sources, t)
    _check(t[used])
    t = t[used]
    nodes = np.arange(t[0], t[-1] + _STEP_S, _STEP_S)
    integral = hats(t, nodes) @ np.apply_along_axis(
        scipy.integrate.cumulative_trapezoid, 0, np.eye(len(nodes)), dx=_STEP_S, initial=0
    )
    y, A = [], []
    for i, a in enumerate(met.axis):
        H = met.momentum.momentum_Nms[used, i]
        if met.gravity_gradient_Nm is not None:
            gravity = met.about(met.gravity_gradient_Nm)[:, i]
            H = H - np.interp(t, met.time_s, scipy.integrate.cumulative_trapezoid(gravity, met.time_s, initial=0))
        column = integral * met.per_density(a, nodes)
        # several axes are weighted by their noise
        sigma = 1.0 if len(met.axis) == 1 else noise_sigma(t, H, degree=3, half_width=4 * float(np.median(np.diff(t))))
        y.append((H - H.mean()) / sigma)
        A.append((column - column.mean(axis=0)) / sigma)
    return JetData(np.concatenate(y), np.concatenate(A), nodes, "N m s" if len(met.axis) == 1 else "sigma")


def through_loop(met: DensityResult, sources: Sequence[Jet]) -> JetData:
    """From all telemetry that the fused torque of ``met`` rests on, less what gravity gradient does.

    Raises BadInput where that torque is not the fused one."""
    if set(met.evidence) != set(met.axis):
        raise BadInput(
            f"the fit through the loop needs the fused torque, and this density is of the {met.method} method",
            remedy="Leave --method out, or use --fit momentum.",
        )
    y, A = [], []
    reach = met.time_s[_within(met.flyby, sources, met.time_s)]
    _check(reach)
    nodes = np.arange(-_BEFORE_S, reach[-1] + _STEP_S, _STEP_S)
    for i, a in enumerate(met.axis):
        axis = met.evidence[a]
        if met.gravity_gradient_Nm is not None:
            gravity = met.about(met.gravity_gradient_Nm)[:, i]
            axis = axis.without(np.interp(axis.time_s - met.closest_s, met.time_s, gravity))
        # later measurements respond to a torque beyond the last node, which quantities taken as known would be bent to fit
        axis = axis.until(met.closest_s + nodes[-1])
        r = regression(axis, nodes + met.closest_s, 1e-6 * axis.levels.torque_Nm)
        y.append(r.y)
        A.append(r.W * met.per_density(a, nodes))
    return JetData(np.concatenate(y), np.concatenate(A), nodes, "sigma")


def _within(flyby: Flyby, sources: Sequence[Jet], time_s) -> np.ndarray:
    return np.max([seen_from(j, flyby, time_s)[0] for j in sources], axis=0) <= FARTHEST_M


def _check(time_s) -> None:
    if len(time_s) < 8 or time_s[-1] < 20:
        raise BadInput(
            f"{len(time_s)} instants of the plume are in this record: too few for jets",
            remedy="Take the record from two minutes before closest approach to two minutes after.",
        )
