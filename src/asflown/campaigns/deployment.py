"""A mechanism's actuation in numbers: what 000 says of a deployment, measured on any record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..estimate.torque import Comparison, TorqueResult
    from ..telemetry.telemetry import Telemetry

#: 000 section V: motor on at minute 1; the "second dynamics" begin at minute 2.35. [s]
MOTOR_ON_S, SECOND_PHASE_S = 60.0, 141.0


def stall_time(time_s, angle_rad) -> float:
    """When the mechanism reached its last angle: the first instant within 0.1 % of the travel. [s]"""
    angle = np.asarray(angle_rad)
    travel = abs(angle[-1] - angle[0])
    return float(np.asarray(time_s)[np.argmax(np.abs(angle - angle[-1]) <= 1e-3 * travel)])


def actuation_summary(telemetry: Telemetry, momentum: TorqueResult, against: Comparison, stall_s: float) -> dict:
    """Peak and net momentum, largest excursion, wheel changes, stall, and the two printed methods' ratio.

    ``momentum``: the printed momentum torque about one axis; ``against``: the transfer torque set
    against it."""
    j = momentum.axes[0]
    if momentum.momentum_Nms is None:
        raise ValueError("the summary needs a momentum torque")
    h = momentum.momentum_Nms[:, j]
    late = momentum.time_s > SECOND_PHASE_S
    ratios = [r for t, r in zip(against.peak_times_s, against.ratios, strict=True) if t > SECOND_PHASE_S]
    rpm = 60 / (2 * np.pi)
    changes = {}
    for name in telemetry.members("wheel_rate"):
        r = telemetry.channel(f"wheel_rate_{name}").usable.values
        change = r - r[0]
        changes[name] = float(rpm * change[np.argmax(np.abs(change))])
    return {
        "peak_momentum_Nms": float(np.nanmax(np.abs(h - h[0]))),
        "net_momentum_Nms": float(h[-1] - h[0]),
        "peak_torque_Nm": float(np.nanmax(np.abs(momentum.torque_Nm[late, j]))),
        "wheel_change_rpm": changes,
        "stall_after_motor_on_min": (stall_s - MOTOR_ON_S) / 60,
        "transfer_over_momentum": float(np.median(ratios)) if ratios else None,
        "transfer_lag_s": against.lag_s,
    }
