"""External torques on the body: every source becomes one table, linear in time, in body axes."""

from __future__ import annotations

import numpy as np

from ...telemetry.channels import AXES
from ..scenario import Constant, Plume, Scenario, Table, Triangles, axis_number
from ..tables import read_table
from .passage import Passed, plume_torque


def triangle_corners(source: Triangles) -> tuple[np.ndarray, np.ndarray]:
    """Times and torques of the corners: zero, peak, zero, -peak, ..., zero."""
    times = source.first + source.rise * np.arange(2 * source.count + 1)
    torques = np.zeros(len(times))
    torques[1::2] = source.peak * (-1.0) ** np.arange(source.count)
    return times, torques


def profile_peaks(scenario: Scenario, met: Passed | None) -> list[tuple[float, float, str]]:
    """(time [s], torque [N m], axis) of every injected peak, in order of time.

    A peak is a corner of a triangle, a turning point of an inline table, the largest torque of a gas."""
    peaks = []
    if met is not None:
        at, _, _, torque = met.peak
        peaks.append((at, torque, AXES[met.axis]))
    for source in scenario.torques:
        if isinstance(source, Triangles):
            times, torques = triangle_corners(source)
            peaks += [(float(t), float(T), source.axis) for t, T in zip(times[1::2], torques[1::2], strict=True)]
        elif isinstance(source, Table) and source.file is None:
            t, T = np.array(source.times), np.array(source.torques)
            turns = np.flatnonzero(np.diff(np.sign(np.diff(T))) * np.sign(T[1:-1]) < 0) + 1
            peaks += [(float(t[i]), float(T[i]), source.axis) for i in turns]
        elif isinstance(source, Plume):
            times, torques = plume_torque(source, scenario.duration)
            i = int(np.argmax(np.abs(torques)))
            peaks.append((float(times[i]), float(torques[i]), source.axis))
    return sorted(peaks)


def torque_table(scenario: Scenario, met: Passed | None) -> tuple[np.ndarray, np.ndarray]:
    """All sources together: times (k,) [s] and torques (k, 3) [N m], to be joined by straight lines."""
    pieces = [_corners(source, scenario) for source in scenario.torques]
    if met is not None:
        pieces.append((met.time_s, met.torque_Nm))
    if not pieces:
        return np.empty(0), np.empty((0, 3))
    times = np.unique(np.concatenate([t for t, _ in pieces]))
    torques = np.zeros((len(times), 3))
    for t, T in pieces:
        for axis in range(3):
            torques[:, axis] += np.interp(times, t, T[:, axis])
    return times, torques


def _corners(source, scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(source, Constant):
        return np.zeros(1), np.array([source.torque])
    if isinstance(source, Table) and source.file is not None:
        return _ended(*read_table(scenario.folder / source.file, "torque", "N m"))
    if isinstance(source, Triangles):
        times, torques = triangle_corners(source)
    elif isinstance(source, Table):
        times, torques = np.array(source.times), np.array(source.torques)
    else:
        times, torques = plume_torque(source, scenario.duration)
    along = np.zeros((len(times), 3))
    along[:, axis_number(source.axis)] = torques
    return _ended(times, along)


def _ended(times, torques) -> tuple[np.ndarray, np.ndarray]:
    """Nothing outside the table: a torque that starts or ends off zero does so within a microsecond."""
    if np.any(torques[0]):
        times, torques = np.r_[times[0] - 1e-6, times], np.vstack([np.zeros(3), torques])
    if np.any(torques[-1]):
        times, torques = np.r_[times, times[-1] + 1e-6], np.vstack([torques, np.zeros(3)])
    return times, torques
