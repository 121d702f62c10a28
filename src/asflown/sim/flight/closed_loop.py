"""Fly a scenario: build the plant, run the closed loop, hand over telemetry and truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...craft.load import load_craft
from ...craft.model import Craft, CraftAt, check_inertia, tensor
from ...kit.doubts import Doubts
from ...kit.errors import BadInput, some_of
from ...kit.rotations import rotation
from ...telemetry.channels import AXES
from ..scenario import Scenario, load_scenario
from .command import ordered_motion
from .controllers import control_period, rods_of, wheel_loop
from .cover import MovingPart, motor_telemetry, moving_part
from .disturbances import profile_peaks, torque_table
from .faults import bearing_rows, coasting, drag_table
from .instruments import magnetometer_error, motor_readings, orbital_readings
from .modes import swinging
from .passage import Passed, passed
from .plant import SOURCES, Errors, Loop, Plant, Thrusters, fly_cycles, moving_part_history, outside_history
from .sampling import axes_of, telemetry_of
from .sensors import STAR_TRACKER_PERIOD_S, Estimator, noise_of, normal
from .thrusters import (
    accelerometer_reading,
    thrust_doubts,
    thruster_readings,
    thruster_truth,
    thrusters_of,
)
from .truth import Truth
from .world import Along, along_orbit, world_of
from .write import write_flight

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from ...telemetry.telemetry import Telemetry

__all__ = ["Flight", "Truth", "fly", "write_flight"]

MOST_CYCLES = 5_000_000  # a week at 8 Hz; some gigabytes of truth
QUATERNION = ("w", "x", "y", "z")


@dataclass(frozen=True)
class Flight:
    """A flight that has been flown."""

    telemetry: Telemetry
    truth: Truth
    scenario: Scenario
    craft: Craft
    inertia_kgm2: np.ndarray  # (3, 3), true (the craft is as its file has it), of the whole craft (a moving part where the flight began stowed)
    wheels: tuple[str, ...]
    seed: int
    ended: str
    doubts: Doubts = Doubts()
    met: Passed | None = None


def fly(
    scenario: str | Path | Scenario,
    *,
    craft: str | Path | Craft | None = None,
    seed: int | None = None,
    noise: str | None = None,
    progress: Callable[[str], None] | None = None,
    changes: dict | None = None,
) -> Flight:
    """Fly a scenario in the closed loop of plant, sensors, controller and actuators.

    The same scenario and seed give the same numbers, bit for bit, on one machine with the same package versions.

    Parameters
    ----------
    scenario : str, Path or Scenario
        A shipped scenario by name (``shipped_scenarios``), or a TOML file.
    craft : str, Path or Craft, optional
        The craft to fly in place of the scenario's own.
    seed : int, optional
        Another draw of the noise; the scenario's own unless given.
    noise : str, optional
        'none', 'half', 'nominal' or 'double', in place of the scenario's own.
    progress : callable, optional
        Called with a line of text before and after the flight.
    changes : dict, optional
        Values of the scenario to replace, written as in its TOML: ``{"duration": "60 s"}``.  Tables are merged key by key,
        lists replaced (see ``Scenario.changed``).

    Returns
    -------
    Flight
        ``telemetry`` as the ground receives it, and ``truth`` at every control cycle: body axes, torques on the body.

    Raises
    ------
    BadInput
        If the scenario, a change or the craft cannot be flown, or the motion does not stay finite.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    own = {"seed": seed, "noise": noise}
    changes = (changes or {}) | {name: value for name, value in own.items() if value is not None}
    scenario = scenario.changed(**changes) if changes else scenario
    craft = craft if isinstance(craft, Craft) else load_craft(craft or scenario.craft)
    told = craft.at(scenario.epoch_ns)
    _check_flyable(scenario, told)
    now = _truly(scenario, told)
    part = moving_part(scenario.cover, now) if scenario.cover else None
    met = None
    if scenario.flyby is not None:
        met = passed(scenario.flyby, now, -scenario.settle, scenario.duration)
    flown = _integrated(scenario, told, now, part, met, progress)

    fired = None
    if scenario.thrusters is not None:
        fired = thruster_truth(
            flown.rows, flown.columns, flown.thrusters, scenario, now.craft, flown.times, flown.period_s, flown.before
        )
    truth = _truth(flown, scenario, part, fired, met)
    readings = _readings(flown, truth, now, scenario, part)
    return Flight(
        telemetry=telemetry_of(readings, scenario, flown.period_s, scenario.seed, scenario.name),
        truth=truth,
        scenario=scenario,
        craft=craft,
        inertia_kgm2=np.asarray(now.inertia_kgm2),
        wheels=tuple(w.name for w in now.wheels),
        seed=scenario.seed,
        ended=flown.ended,
        doubts=now.doubts + thrust_doubts(scenario, craft),
        met=met,
    )


@dataclass(frozen=True)
class _Flown:
    """The integrated motion from the epoch on, as ``plant.fly_cycles`` recorded it."""

    rows: np.ndarray  # (N, columns)
    columns: _Columns
    times: np.ndarray  # (N,) control instants
    commanded_attitude: np.ndarray  # (N, 4)
    commanded_rate: np.ndarray  # (N, 3)
    plant: Plant
    along: Along | None
    errors: Errors
    thrusters: Thrusters
    period_s: float
    before: int  # control cycles flown before the epoch
    ended: str


def _integrated(scenario: Scenario, told: CraftAt, now: CraftAt, part, met, progress) -> _Flown:
    """The plant under its controllers, cycle by cycle; ``told``: the craft as the controller knows it, ``now``: as it is.

    Raises BadInput where the motion cannot be recorded."""
    times, before = _instants(scenario, control_period(scenario, told))
    off = coasting(scenario, tuple(w.name for w in now.wheels), times)
    loop = wheel_loop(scenario, told, off)
    along = along_orbit(scenario, now, times[0], times[-1], loop.period)
    q_c, w_c, alpha_c = ordered_motion(scenario, along, times)
    plant = _plant(scenario, now, part, met, loop.period)._replace(world=world_of(scenario, now, along))
    errors = _errors(scenario, loop, len(times), len(now.wheels))
    x = _start(scenario, now, plant, q_c[0], w_c[0])
    thrusters = thrusters_of(scenario, now, times, loop.period)
    rods = rods_of(scenario, now, loop.period)
    columns = _Columns(len(now.wheels), plant, len(thrusters.delay))
    record = np.zeros((len(times), columns.rods.stop))
    if progress is not None:
        progress(f"flying {scenario.name}: {times[-1] - times[0]:g} s in {len(times)} control cycles")
    flown, full = fly_cycles(plant, loop, errors, thrusters, rods, off, q_c, w_c, alpha_c, times[0], x, record)
    if flown <= before:
        raise BadInput(
            f"wheel {now.wheels[full].name} is at its rate limit before the recording starts",
            remedy="Start the wheels slower (wheel_rates), or shorten settle.",
        )
    if not np.isfinite(record[:flown]).all():
        raise BadInput(
            "the simulated motion is not finite: the loop is unstable or the step is too long",
            remedy="Raise substeps, lower the delay, or check inertia, gains and torques.",
        )
    times = times[before:flown]
    ended = f"reached {times[-1]:g} s"
    if full >= 0:
        ended = f"wheel {now.wheels[full].name} at its rate limit at {times[-1]:g} s"
    if progress is not None:
        progress(ended)
    errors = errors._replace(magnetometer=errors.magnetometer[before:flown])
    return _Flown(
        record[before:flown], columns, times, q_c[before:flown], w_c[before:flown], plant, along, errors, thrusters, loop.period,
        before, ended,
    )  # fmt: skip


def _instants(scenario: Scenario, period_s: float) -> tuple[np.ndarray, int]:
    """Control instants (N,) [s], settling included, and how many come before the epoch.  Raises BadInput for too many."""
    whole_s = scenario.settle + scenario.duration
    if whole_s / period_s > MOST_CYCLES:
        raise BadInput(
            f"{whole_s:g} s are more than {MOST_CYCLES:,} control cycles of {period_s:g} s",
            remedy="Shorten duration and settle: everything true is kept for every cycle.",
        )
    before = int(np.ceil(scenario.settle / period_s))
    return period_s * np.arange(-before, round(scenario.duration / period_s) + 1), before


def _truly(scenario: Scenario, told: CraftAt) -> CraftAt:
    """The craft as it is, where the scenario says that its file is wrong."""
    if scenario.inertia is None:
        return told
    inertia = tensor(scenario.inertia)
    check_inertia(inertia, f"inertia of {scenario.name}")
    return replace(told, inertia_kgm2=inertia)


def _check_flyable(scenario: Scenario, now: CraftAt) -> None:
    names = [w.name for w in now.wheels]
    if now.inertia_kgm2 is None or now.relative or any(w.spin_inertia is None for w in now.wheels):
        raise BadInput(
            f"{now.craft.name} cannot be flown: its inertia or its wheels' spin inertia is not known",
            remedy="Fly a craft whose file gives both, or give --inertia and a craft file with the wheels' inertia.",
        )
    asked = [("wheel_rates", n) for n in scenario.wheel_rates]
    asked += [("a coast", c.wheel) for c in scenario.coasts] + [("a drag spike", d.wheel) for d in scenario.drag_spikes]
    asked += [("a wheel bias", name) for b in scenario.wheel_biases for name in b.rates]
    asked += [("wheel_drag", n) for n in scenario.wheel_drag] + [("drag_growth", g.wheel) for g in scenario.drag_growth]
    balance = scenario.controller.null_space
    asked += [("null_space", n) for n in (balance.rates if balance else ())]
    asked += [("wheel_current_zero", n) for n in scenario.sensors.wheel_current_zero]
    for what, name in asked:
        if name not in names:
            raise BadInput(
                f"{what} names {name!r}, which {now.craft.name} does not run on {scenario.epoch[:10]}",
                remedy=f"Its wheels then: {some_of(names)}.",
            )


def _plant(scenario: Scenario, now: CraftAt, part: MovingPart | None, met: Passed | None, period_s: float) -> Plant:
    coupling, natural, damping = swinging(scenario, now)
    times, torques = torque_table(scenario, met)
    spike_times, spikes = drag_table(scenario, tuple(w.name for w in now.wheels))
    zero = np.zeros(3)
    return Plant(
        fixed_inertia=np.ascontiguousarray(part.rest_inertia if part else now.inertia_kgm2, float),
        wheel_axes=np.array([w.axis for w in now.wheels], float),
        spin_inertia=np.array([w.spin_inertia for w in now.wheels], float),
        drag=bearing_rows(scenario, now.wheels, period_s / scenario.substeps),
        coupling=coupling,
        mode_damping=2 * damping * natural,
        mode_stiffness=natural**2,
        torque_time=times,
        torque=np.ascontiguousarray(torques),
        hinge_axis=part.hinge_axis if part else zero,
        hinge=part.hinge if part else zero,
        arm=part.arm if part else zero,
        part_inertia=part.part_inertia if part else np.zeros((3, 3)),
        reduced_mass=part.reduced_mass if part else 0.0,
        motion_time=part.times if part else np.empty(0),
        motion_angle=part.quartics if part else np.empty((5, 0)),
        extra_drag_time=spike_times,
        extra_drag=spikes,
    )


def _start(scenario: Scenario, now: CraftAt, plant: Plant, attitude, rate) -> np.ndarray:
    """At the commanded attitude, at rest or turning along the orbit, the wheels as the scenario says, the appendages still."""
    n = len(now.wheels)
    x = np.zeros(_Columns(n, plant, 0).estimation_error.start)
    x[:4] = attitude
    if scenario.pointings:
        x[4:7] = rate
    x[7 : 7 + n] = [scenario.wheel_rates.get(w.name, 0.0) for w in now.wheels]
    return x


def _errors(scenario: Scenario, loop: Loop, cycles: int, wheels: int) -> Errors:
    noise, seed = noise_of(scenario), scenario.seed
    estimator = Estimator.giving(noise, loop.period)
    bias = np.asarray(scenario.gyro_bias, float)
    return Errors(
        gyro=bias + normal(seed, "gyro", (cycles, 3), noise.gyro_rad_s),
        start=normal(seed, "attitude at the start", 3, noise.attitude_coloured_rad),
        star_tracker=normal(seed, "star tracker", (cycles, 3), estimator.star_tracker_rad),
        star_tracker_every=max(round(STAR_TRACKER_PERIOD_S / loop.period), 1),
        star_tracker_gain=estimator.gain,
        tachometer=normal(seed, "tachometer", (cycles, wheels), noise.wheel_rad_s),
        magnetometer=magnetometer_error(scenario, cycles),
    )


class _Columns:
    """Which columns of the record hold what (plant.fly_cycles)."""

    attitude: slice
    rate: slice
    wheel_rate: slice
    mode: slice
    mode_rate: slice
    ledger: slice
    source_impulse: slice
    estimation_error: slice
    attitude_error: slice
    rate_estimate: slice
    controller_rate_error: slice
    control_torque: slice
    motor_torque: slice
    drag_estimate: slice
    wheel_reading: slice
    outside: slice
    on: slice
    thrust: slice
    impulse: slice
    chill: slice
    rods: slice

    def __init__(self, n: int, plant: Plant, j: int):
        m = len(plant.mode_damping)
        widths = {"attitude": 4, "rate": 3, "wheel_rate": n, "mode": m, "mode_rate": m, "ledger": 4,
                  "source_impulse": 3 * len(SOURCES) if plant.world.curves.shape[1] else 0, "estimation_error": 3,
                  "attitude_error": 3, "rate_estimate": 3, "controller_rate_error": 3, "control_torque": 3,
                  "motor_torque": n, "drag_estimate": n, "wheel_reading": n, "outside": 3, "on": j, "thrust": j,
                  "impulse": j, "chill": j, "rods": 3}  # fmt: skip
        at = 0
        for name, width in widths.items():
            setattr(self, name, slice(at, at + width))
            at += width


def _truth(flown: _Flown, scenario: Scenario, part, fired, met) -> Truth:
    rows, times, columns, plant = flown.rows, flown.times, flown.columns, flown.plant
    rate, wheel_rate = rows[:, columns.rate], rows[:, columns.wheel_rate]
    stored = wheel_rate * plant.spin_inertia @ plant.wheel_axes
    torque = np.zeros_like(rate)
    if len(plant.torque_time):
        for axis in range(3):
            torque[:, axis] = np.interp(times, plant.torque_time, plant.torque[:, axis])
    H = rate @ plant.fixed_inertia + stored + rows[:, columns.mode_rate] @ plant.coupling
    angle = None
    if part is not None:
        angle, momentum, reaction = moving_part_history(times, np.ascontiguousarray(rate), plant)
        H, torque = H + momentum, torque + reaction
    if fired is not None:
        torque = torque + fired.leak_N @ fired.arms_m
    attitude = rows[:, columns.attitude]
    by_source, impulses = _by_source(flown)
    torque = torque + sum(by_source.values())
    return Truth(
        time_s=times,
        torque_Nm=torque,
        attitude=attitude,
        body_rate_rad_s=rate,
        wheel_rate_rad_s=wheel_rate,
        wheel_momentum_Nms=stored,
        momentum_inertial_Nms=rotation(attitude).apply(H),
        control_torque_Nm=rows[:, columns.control_torque],
        motor_torque_Nm=rows[:, columns.motor_torque],
        holding_torque_Nm=rows[:, columns.outside],
        estimation_error_rad=rows[:, columns.estimation_error],
        mode_amplitude=rows[:, columns.mode],
        mode_rate=rows[:, columns.mode_rate],
        ledger_J=rows[:, columns.ledger] - rows[0, columns.ledger],
        density_kgm3=None if met is None else np.interp(times, met.time_s, met.density_kgm3),
        altitude_m=None if met is None else np.interp(times, met.time_s, met.altitude_m),
        thrusters=fired,
        cover_angle_rad=None if part is None else part.stowed + angle,
        peaks=tuple(profile_peaks(scenario, met)),
        torque_by_source_Nm=by_source,
        impulse_by_source_Nms=impulses,
        rod_dipole_Am2=rows[:, columns.rods],
        along=None if flown.along is None else flown.along.at(times),
        shadows=() if flown.along is None else tuple(flown.along.shadows(times[0], times[-1])),
    )


def _by_source(flown: _Flown) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Torque of each source in body axes, and its impulse from the epoch on in inertial axes; those that are not zero throughout."""
    if flown.along is None:
        return {}, {}
    rows, columns, plant = flown.rows, flown.columns, flown.plant
    attitude, rods = (np.ascontiguousarray(rows[:, c]) for c in (columns.attitude, columns.rods))
    torque = outside_history(flown.times, attitude, rods, plant.fixed_inertia, plant.world)
    impulse = (rows - rows[0])[:, columns.source_impulse].reshape(torque.shape)
    acting = [k for k in range(len(SOURCES)) if np.any(torque[:, k])]
    return {SOURCES[k]: torque[:, k] for k in acting}, {SOURCES[k]: impulse[:, k] for k in acting}


def _readings(flown: _Flown, truth: Truth, now: CraftAt, scenario: Scenario, part) -> dict[str, np.ndarray]:
    """Every channel at every control instant, as the instruments and the flight software give it."""
    noise, seed = noise_of(scenario), scenario.seed
    wheels = [w.name for w in now.wheels]
    rows, columns = flown.rows, flown.columns
    rate = rows[:, columns.rate_estimate]
    shape = (len(rows), 3)
    error = rows[:, columns.attitude_error] - normal(seed, "attitude error read-out", shape, noise.attitude_white_rad)
    estimate = rows[:, columns.estimation_error] + normal(seed, "quaternion read-out", shape, noise.attitude_white_rad)
    readings = axes_of("wheel_rate", rows[:, columns.wheel_reading], wheels)
    readings |= axes_of("body_rate", rate, AXES)
    readings |= axes_of("attitude_error", error, AXES)
    readings |= axes_of("rate_error", flown.commanded_rate - rate, AXES)
    readings |= axes_of("controller_rate_error", rows[:, columns.controller_rate_error], AXES)
    readings |= axes_of("quaternion", _turned(truth.attitude, estimate), QUATERNION)
    readings |= axes_of("control_torque", rows[:, columns.control_torque], AXES)
    momentum = (
        rows[:, columns.wheel_reading] * [w.spin_inertia for w in now.wheels] @ np.array([w.axis for w in now.wheels])
    )
    readings |= axes_of("wheel_momentum", momentum, AXES)
    if scenario.controller.friction_compensation:
        readings |= axes_of("wheel_drag_torque", rows[:, columns.drag_estimate], wheels)
    if truth.thrusters is not None:
        readings |= thruster_readings(truth.thrusters, scenario, now.craft)
        if scenario.telemetry.accelerometer_count:
            readings |= accelerometer_reading(truth.thrusters, scenario, now.craft, truth.time_s)
    readings |= axes_of("commanded_rate", flown.commanded_rate, AXES)
    readings |= axes_of("commanded_quaternion", flown.commanded_attitude, QUATERNION)
    readings |= motor_readings(scenario, truth, now)
    if truth.along is not None:
        readings |= orbital_readings(scenario, truth, truth.along, flown.errors.magnetometer)
    if part is not None and scenario.cover is not None:
        readings |= motor_telemetry(scenario.cover, part, truth.time_s, truth.cover_angle_rad - part.stowed)
    return readings


def _turned(attitude, small) -> np.ndarray:
    """Attitudes (N, 4) turned by small rotation vectors (N, 3) in body axes; signs follow the input."""
    s, v, half = attitude[:, :1], attitude[:, 1:], 0.5 * small
    turned = np.hstack([s - np.sum(v * half, axis=1, keepdims=True), v + s * half + np.cross(v, half)])
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)
