"""A part of the craft that turns about its hinge: geometry, motion and its motor's telemetry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...craft.model import CraftAt, check_inertia, tensor
from ...kit.errors import BadInput

if TYPE_CHECKING:
    from ..scenario import CoverMotion

#: The motor warms towards its end temperature with this time constant. Assumed. [s]
WARMING_TIME_S = 120.0


@dataclass(frozen=True)
class MovingPart:
    """The plant's view of it; angles count from the stowed position, where the craft's inertia holds."""

    rest_inertia: np.ndarray  # (3, 3), about the rest's own centre of mass
    hinge_axis: np.ndarray
    hinge: np.ndarray  # from the rest's centre of mass [m]
    arm: np.ndarray  # hinge to the part's centre of mass, stowed [m]
    part_inertia: np.ndarray  # (3, 3), about its own centre of mass, stowed
    reduced_mass: float
    times: np.ndarray  # (b + 1,)
    quartics: np.ndarray  # (5, b), angle from stowed
    stowed: float  # potentiometer reading when stowed [rad]
    travel: float


def moving_part(cover: CoverMotion, now: CraftAt) -> MovingPart:
    """Split the craft into a part that moves and the rest.

    The craft's inertia is taken to hold with the part stowed.  With r from the rest's centre of mass
    to the part's, I_craft = I_rest + I_part + mu (r.r 1 - r r^T); ``from_cm`` of the mechanism counts
    from the whole craft's centre of mass, r = from_cm m / m_rest."""
    mechanism = now.craft.mechanism(cover.mechanism)
    rest_mass = cover.craft_mass - mechanism.mass
    if rest_mass <= 0:
        raise BadInput(
            f"the craft ({cover.craft_mass:g} kg) weighs less than its {mechanism.name} ({mechanism.mass:g} kg)",
            remedy="craft_mass is the mass of the whole craft, the moving part included.",
        )
    mu = mechanism.mass * rest_mass / cover.craft_mass
    r = np.array(mechanism.from_cm) * cover.craft_mass / rest_mass
    own = tensor(mechanism.inertia)
    rest = now.inertia_kgm2 - own - mu * (r @ r * np.eye(3) - np.outer(r, r))
    check_inertia(rest, f"{now.craft.name} without its {mechanism.name}")
    axis = np.array(mechanism.hinge_axis) / np.linalg.norm(mechanism.hinge_axis)
    arm = cover.arm * scipy.spatial.transform.Rotation.from_rotvec(cover.arm_tilt * axis).apply([0.0, 0.0, 1.0])
    travel = float(mechanism.deployed) - float(mechanism.stowed)
    times, quartics = _motion(cover, travel)
    return MovingPart(rest, axis, r - arm, arm, own, mu, times, quartics, mechanism.stowed, travel)


def _motion(cover: CoverMotion, travel: float) -> tuple[np.ndarray, np.ndarray]:
    """The angle as quartics between the table's times: the integral of a monotone cubic of the rate."""
    # at rest for a second before and after: the cubic then starts and ends without a jump in acceleration
    rate = scipy.interpolate.PchipInterpolator(
        [cover.times[0] - 1, *cover.times, cover.times[-1] + 1], [0, *cover.rates, 0]
    )
    turned = float(rate.integrate(cover.times[0], cover.times[-1]))
    if abs(turned / travel - 1) > 0.02:
        raise BadInput(
            f"the rates turn the {cover.mechanism} by {np.degrees(turned):.2f} deg, its travel is {np.degrees(travel):.2f} deg",
            remedy="Change the rates until the two agree within 2 %; the rest is scaled away.",
        )
    angle = rate.antiderivative()
    sign = travel / turned if cover.direction == "deploy" else -travel / turned
    quartics = sign * angle.c
    if cover.direction == "stow":
        quartics[-1] += travel
    return np.ascontiguousarray(angle.x), np.ascontiguousarray(quartics)


def momentum_per_rate(part: MovingPart, angles) -> np.ndarray:
    """Momentum of the part, the body still, for one rad/s about its hinge: C k + mu r x r', (N, 3). [N m s per rad/s]"""
    k = part.hinge_axis
    turned = scipy.spatial.transform.Rotation.from_rotvec(np.outer(angles, k))
    arm = turned.apply(part.arm)
    own = turned.apply(turned.apply(np.tile(k, (len(arm), 1)), inverse=True) @ part.part_inertia)
    return own + part.reduced_mass * np.cross(part.hinge + arm, np.cross(k, arm))


def motor_telemetry(cover: CoverMotion, part: MovingPart, times, angle) -> dict[str, np.ndarray]:
    """Readings at ``times`` for the part's angle from stowed: one array a channel, states as words."""
    times = np.asarray(times, float)
    on = (times >= cover.motor_on) & (times < cover.motor_off)
    stalled = on & (times >= cover.stall)
    current = np.where(on, np.where(stalled, cover.stall_current, cover.run_current), 0.0)
    heating = 1 - np.exp(-np.clip(times - cover.motor_on, 0, cover.motor_off - cover.motor_on) / WARMING_TIME_S)
    cooling = np.exp(-np.clip(times - cover.motor_off, 0, None) / (5 * WARMING_TIME_S))
    switch = np.where(angle > part.travel - 1e-3, "deployed", np.where(angle < 1e-3, "stowed", "between"))
    return {
        "cover_angle": part.stowed + angle,
        "motor_current": current,
        "motor_temperature": cover.temperature + cover.temperature_rise * heating * cooling,
        "motor_on": np.where(on, "on", "off"),
        "microswitch": switch,
    }
