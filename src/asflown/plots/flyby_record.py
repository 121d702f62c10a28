"""A flyby over time: what the telemetry shows, the torque, and the momentum of wheels and body."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..telemetry.channels import AXES
from .figure import BLUE, BY_AXIS, GREEN, ORANGE

if TYPE_CHECKING:
    from ..estimate.density import DensityResult, MomentumHeld
    from ..telemetry.telemetry import Telemetry


def draw_readings(telemetry: Telemetry, stem: str, closest_s: float, ax, scale: float):
    """A family of channels about the three axes.  Returns ax."""
    for axis, color in zip(AXES, BY_AXIS, strict=True):
        u = telemetry.channel(f"{stem}_{axis}").usable
        ax.plot(telemetry.seconds(u.tai_ns) - closest_s, scale * u.values, color=color, linewidth=1.0, label=axis)
    return ax


def draw_torque(result: DensityResult, ax):
    """Torque about the flyby's axes, with its 95 % band where it is one, and the gravity gradient where it is taken off.  Returns ax."""
    t, one = result.time_s, len(result.axis) == 1
    torques = 1e3 * result.about(result.torque_Nm)
    if result.torque_sigma_Nm is not None:
        half, middle = 1.96 * 1e3 * result.torque_sigma_Nm, torques[:, 0]
        ax.fill_between(t, middle - half, middle + half, color=BLUE, alpha=0.25, linewidth=0, label="95 %")
    for a, T in zip(result.axis, torques.T, strict=True):
        color = BLUE if one else BY_AXIS[AXES.index(a)]
        ax.plot(t, T, color=color, linewidth=1.4, label=f"{result.method}, {result.variant}{'' if one else f', {a}'}")
    if result.gravity_gradient_Nm is not None:
        for T in 1e3 * result.about(result.gravity_gradient_Nm).T:
            ax.plot(t, T, color=ORANGE, linewidth=1.0, label="gravity gradient")
    ax.set_ylabel("torque [mN m]")
    return ax


def draw_momentum(held: MomentumHeld, axes: str, ax):
    """Momentum of wheels and body about axes, less its first value.  Returns ax."""
    one = len(axes) == 1
    for a, H, body in zip(axes, held.momentum_Nms.T, held.body_Nms.T, strict=True):
        color, name = BY_AXIS[AXES.index(a)], "" if one else f", {a}"
        ax.plot(held.time_s, H - H[0], ".", color=BLUE if one else color, markersize=3, label=f"wheels and body{name}")
        ax.plot(held.time_s, body, color=GREEN if one else color, linewidth=0.8, label=f"body alone{name}")
    ax.set_ylabel("momentum gained [N m s]")
    return ax
