"""External torques on the body: every source becomes one table, linear in time, in body axes."""

from __future__ import annotations

import csv

import numpy as np

from ..kit.errors import BadInput
from ..kit.quantities import si_factor
from ..telemetry.channels import AXES, split_header
from .scenario import Constant, Plume, Scenario, Table, Triangles, axis_number

# 004 section VII: flyby Enceladus-3 and the three jets (Table 2: tilt delta and offset Delta; Table 3: K)
ENCELADUS_RADIUS_KM, CLOSEST_ALTITUDE_KM, SPEED_KM_S, LATITUDE_RAD = 252.3, 47.9, 14.41, np.radians(20.0)
JETS = {  # name: delta [rad], Delta [km], K [kg/m3]
    "Alexandria": (np.radians(17.1), 17.8, 0.55e-12),
    "Cairo": (np.radians(7.9), 11.8, 10.3e-12),
    "Damascus": (np.radians(-10.6), 0.40, 8.5e-12),
}
JET_WIDTH_RAD = 0.36
#: Torque about z over density, (1/2) C_D V^2 A l = 0.5 x 2.1 x 14410^2 x 18.401 x 0.853 (004 eq 22). [N m / (kg/m3)]
TORQUE_PER_DENSITY = 3.4222e9
#: Jet distances within which 004 eq 26 is meant to hold. [km]
NEAREST_KM, FARTHEST_KM = 50.0, 1400.0


def plume_density(since_closest_s, exponent: int = 1) -> np.ndarray:
    """Density along the Enceladus-3 flyby, the sum of three jets. [kg/m3]   004 eqs 23, 26, 27

        rho = sum K (R_E / r)^(3/2) exp(-(theta / K_theta)^exponent)

    theta uses atan2 where the paper prints atan, which fails before the craft has passed the jet's
    pole; a jet counts only between 50 and 1400 km, where the paper applies the model, and fades to
    nothing over the last tenth of that reach: cut off outright it would leave a step in the torque."""
    t = np.asarray(since_closest_s, float)
    total = np.zeros_like(t)
    radius = ENCELADUS_RADIUS_KM + CLOSEST_ALTITUDE_KM
    for tilt, offset, strength in JETS.values():
        p = radius * np.cos(LATITUDE_RAD) - SPEED_KM_S * t * np.sin(LATITUDE_RAD) - ENCELADUS_RADIUS_KM * np.sin(tilt)
        q = radius * np.sin(LATITUDE_RAD) + SPEED_KM_S * t * np.cos(LATITUDE_RAD) - ENCELADUS_RADIUS_KM * np.cos(tilt)
        r = np.sqrt(p**2 + q**2 + offset**2)
        theta = np.abs(np.arctan2(p, q) - tilt)
        fade = np.clip((FARTHEST_KM - r) / (0.1 * FARTHEST_KM), 0, 1)
        density = strength * (ENCELADUS_RADIUS_KM / r) ** 1.5 * np.exp(-((theta / JET_WIDTH_RAD) ** exponent))
        total += np.where(r >= NEAREST_KM, density * fade, 0.0)
    return total


def triangle_corners(source: Triangles) -> tuple[np.ndarray, np.ndarray]:
    """Times and torques of the corners: zero, peak, zero, -peak, ..., zero."""
    times = source.first + source.rise * np.arange(2 * source.count + 1)
    torques = np.zeros(len(times))
    torques[1::2] = source.peak * (-1.0) ** np.arange(source.count)
    return times, torques


def profile_peaks(scenario: Scenario) -> list[tuple[float, float, str]]:
    """(time [s], torque [N m], axis) of every injected peak, in order of time.

    A peak is a corner of a triangle, a turning point of an inline table, the largest plume torque."""
    peaks = []
    for source in scenario.torques:
        if isinstance(source, Triangles):
            times, torques = triangle_corners(source)
            peaks += [(float(t), float(T), source.axis) for t, T in zip(times[1::2], torques[1::2], strict=True)]
        elif isinstance(source, Table) and source.file is None:
            t, T = np.array(source.times), np.array(source.torques)
            turns = np.flatnonzero(np.diff(np.sign(np.diff(T))) * np.sign(T[1:-1]) < 0) + 1
            peaks += [(float(t[i]), float(T[i]), source.axis) for i in turns]
        elif isinstance(source, Plume):
            times, torques = _plume_table(source, scenario.duration)
            i = int(np.argmax(np.abs(torques)))
            peaks.append((float(times[i]), float(torques[i]), source.axis))
    return sorted(peaks)


def torque_table(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """All sources together: times (k,) [s] and torques (k, 3) [N m], to be joined by straight lines."""
    pieces = [_corners(source, scenario) for source in scenario.torques]
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
        return _ended(*_read_table(scenario.folder / source.file))
    if isinstance(source, Triangles):
        times, torques = triangle_corners(source)
    elif isinstance(source, Table):
        times, torques = np.array(source.times), np.array(source.torques)
    else:
        times, torques = _plume_table(source, scenario.duration)
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


def _plume_table(source: Plume, duration: float) -> tuple[np.ndarray, np.ndarray]:
    times = np.arange(0.0, duration + 0.03125, 0.03125)  # one Runge-Kutta step: the curve, not its chords
    density = plume_density(times - source.closest_approach, source.exponent)
    return times, source.sign * TORQUE_PER_DENSITY * density


def _read_table(path) -> tuple[np.ndarray, np.ndarray]:
    remedy = "Write a CSV with the header time [s],x [N m],y [N m],z [N m] (any of the axes) and increasing times."
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = [r for r in csv.reader(file) if r and not r[0].lstrip().startswith("#")]
    except (OSError, UnicodeDecodeError) as why:
        raise BadInput(f"this torque table cannot be read ({why})", file=path, remedy=remedy) from why
    split = [split_header(cell) for cell in rows[0]] if rows else []
    heads = [head for head in split if head is not None]
    if (
        len(heads) < 2
        or len(heads) < len(split)
        or heads[0][0] != "time"
        or any(name not in AXES for name, _ in heads[1:])
    ):
        raise BadInput("the header of this torque table is not understood", file=path, remedy=remedy)
    try:
        values = np.array([[float(cell) for cell in row] for row in rows[1:]])
    except ValueError as why:
        raise BadInput(f"a row of this torque table is not all numbers ({why})", file=path, remedy=remedy) from why
    if values.ndim != 2 or len(values) < 2 or values.shape[1] != len(heads) or not np.isfinite(values).all():
        raise BadInput("the rows of this torque table do not match its header", file=path, remedy=remedy)
    times = values[:, 0] * si_factor(heads[0][1], "s")
    if np.any(np.diff(times) <= 0):
        raise BadInput("the times of this torque table do not increase", file=path, remedy=remedy)
    torques = np.zeros((len(times), 3))
    for column, (name, unit) in enumerate(heads[1:], start=1):
        torques[:, axis_number(name)] = values[:, column] * si_factor(unit, "N m")
    return times, torques
