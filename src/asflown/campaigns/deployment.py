"""A mechanism's actuation in numbers: what the cover paper says of a deployment, measured on any record."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..estimate.subject import Subject, grid_for, splined
from ..estimate.torque import smoothed_as_printed, splined_momentum
from ..kit.table import Table

if TYPE_CHECKING:
    from ..estimate.torque import TorqueComparison, TorqueResult
    from ..telemetry.telemetry import Telemetry

#: The paper's section V: motor on at minute 1; the "second dynamics" begin at minute 2.35. [s]
MOTOR_ON_S, SECOND_PHASE_S = 60.0, 141.0


@dataclass(frozen=True)
class Smoothed:
    """Samples splined to 1 s, before and after the smoothing as printed."""

    time_s: np.ndarray  # (N,) from the epoch
    values: np.ndarray  # (N, n)
    smoothed: np.ndarray  # (N, n)
    span: int  # samples in a local regression


def smoothed_momentum(subject: Subject) -> Smoothed:
    """Wheel momentum since the start of the record, body axes. [N m s]"""
    grid, momentum = splined_momentum(subject)
    smooth, span = smoothed_as_printed(momentum)
    return Smoothed(grid.from_epoch(subject.telemetry), momentum - momentum[0], smooth - momentum[0], span)


def smoothed_attitude_error(telemetry: Telemetry, axis: str) -> Smoothed:
    """Attitude error about one axis, commanded minus estimated. [rad]"""
    channel = telemetry.channel(f"attitude_error_{axis}")
    grid = grid_for([channel], step_s=1.0)
    error = splined(channel, grid)[:, None]
    smooth, span = smoothed_as_printed(error)
    return Smoothed(grid.from_epoch(telemetry), error, smooth, span)


def stall_time(time_s, angle_rad) -> float:
    """When the mechanism reached its last angle: the first instant within 0.1 % of the travel. [s]"""
    angle = np.asarray(angle_rad)
    travel = abs(angle[-1] - angle[0])
    return float(np.asarray(time_s)[np.argmax(np.abs(angle - angle[-1]) <= 1e-3 * travel)])


@dataclass(frozen=True)
class ActuationSummary:
    """Peak and net momentum, largest excursion, wheel changes, stall, and the two printed methods' ratio and lag."""

    peak_momentum_Nms: float
    net_momentum_Nms: float
    peak_torque_Nm: float
    wheel_change_rpm: dict[str, float]
    stall_after_motor_on_min: float
    transfer_over_momentum: float | None
    transfer_lag_s: float

    def record(self) -> dict:
        return asdict(self)

    def table(self, title: str) -> Table:
        """The numbers beside the paper's."""
        ratio = self.transfer_over_momentum
        wheels = ", ".join(f"{n} {v:+.1f}" for n, v in self.wheel_change_rpm.items())
        rows = (
            ("peak wheel momentum about y [N m s]", f"{self.peak_momentum_Nms:.2f}", "about 0.3"),
            ("net momentum at the end [N m s]", f"{self.net_momentum_Nms:+.3f}", "0"),
            ("largest torque excursion [N m]", f"{self.peak_torque_Nm:.4f}", "within 0.015 to 0.02"),
            ("stall after motor on [min]", f"{self.stall_after_motor_on_min:.2f}", "2.2 to 3.3"),
            ("transfer over momentum, printed", "" if ratio is None else f"{ratio:.2f}", "about 0.5"),
            ("transfer lags momentum by [s]", f"{self.transfer_lag_s:+.1f}", "leads"),
        )
        return Table(title, rows, ("", "flown here", "the paper"), (f"wheels [rpm]: {wheels} (paper: order of 10)",))


def actuation_summary(
    telemetry: Telemetry, momentum: TorqueResult, against: TorqueComparison, stall_s: float
) -> ActuationSummary:
    """``momentum``: the printed momentum torque about one axis; ``against``: the transfer torque set against it."""
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
    return ActuationSummary(
        peak_momentum_Nms=float(np.nanmax(np.abs(h - h[0]))),
        net_momentum_Nms=float(h[-1] - h[0]),
        peak_torque_Nm=float(np.nanmax(np.abs(momentum.torque_Nm[late, j]))),
        wheel_change_rpm=changes,
        stall_after_motor_on_min=(stall_s - MOTOR_ON_S) / 60,
        transfer_over_momentum=float(np.median(ratios)) if ratios else None,
        transfer_lag_s=against.lag_s,
    )
