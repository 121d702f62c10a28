"""Fly a scenario: build the plant, run the closed loop, hand over telemetry and truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...craft.load import load_craft
from ...craft.model import Craft, CraftAt
from ...kit.doubts import Doubts
from ...kit.errors import BadInput, some_of
from ...kit.rotations import rotation
from ...telemetry.channels import AXES
from ..scenario import Scenario, load_scenario
from .command import commanded_motion
from .controllers import wheel_loop
from .cover import MovingPart, motor_telemetry, moving_part
from .disturbances import profile_peaks, torque_table
from .faults import coasting, drag_table
from .modes import swinging
from .passage import Passed, passed
from .plant import Errors, Loop, Plant, Thrusters, fly_cycles, moving_part_history
from .sampling import axes_of, telemetry_of
from .sensors import NOISE, STAR_TRACKER_PERIOD_S, Estimator, normal
from .thrusters import (
    ThrusterTruth,
    accelerometer_reading,
    thrust_doubts,
    thruster_readings,
    thruster_truth,
    thrusters_of,
)
from .write import write_flight

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from ...telemetry.telemetry import Telemetry

__all__ = ["Flight", "Truth", "fly", "write_flight"]

MOST_CYCLES = 5_000_000  # a week at 8 Hz; some gigabytes of truth
QUATERNION = ("w", "x", "y", "z")


@dataclass(frozen=True)
class Truth:
    """What really happened, at the control instants from the epoch on; body axes unless named otherwise."""

    time_s: np.ndarray  # (N,)
    torque_Nm: np.ndarray  # (N, 3), disturbance: external torque, leaks, and the reaction of a moving part
    attitude: np.ndarray  # (N, 4), body to inertial
    body_rate_rad_s: np.ndarray  # (N, 3)
    wheel_rate_rad_s: np.ndarray  # (N, wheels), relative to the body
    wheel_momentum_Nms: np.ndarray  # (N, 3), stored, relative to the body
    momentum_inertial_Nms: np.ndarray  # (N, 3), of everything, inertial axes
    control_torque_Nm: np.ndarray  # (N, 3), as the controller orders it
    motor_torque_Nm: np.ndarray  # (N, wheels), held until the next instant
    holding_torque_Nm: np.ndarray  # (N, 3), from outside in place of coasting wheels, held until the next instant
    estimation_error_rad: np.ndarray  # (N, 3), estimated less true attitude
    mode_amplitude: np.ndarray  # (N, modes), hybrid coordinates [kg(1/2) m]
    mode_rate: np.ndarray  # (N, modes)
    ledger_J: np.ndarray  # (N, 4): work by the external torque, by the motors, lost in bearings, in modes
    density_kgm3: np.ndarray | None  # (N,), of the gas met in a flyby
    altitude_m: np.ndarray | None  # (N,)
    thrusters: ThrusterTruth | None
    cover_angle_rad: np.ndarray | None  # (N,)
    peaks: tuple[tuple[float, float, str], ...]  # (time [s], torque [N m], axis) of the injected profile


@dataclass(frozen=True)
class Flight:
    """A flight that has been flown."""

    telemetry: Telemetry
    truth: Truth
    scenario: Scenario
    craft: Craft
    inertia_kgm2: np.ndarray  # (3, 3), true, of the whole craft (a moving part where the flight began stowed)
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
    now = craft.at(scenario.epoch_ns)
    _check_flyable(scenario, now)
    part = moving_part(scenario.cover, now) if scenario.cover else None
    met = None
    if scenario.flyby is not None:
        met = passed(scenario.flyby, now, -scenario.settle, scenario.duration)
    flown = _integrated(scenario, now, _plant(scenario, now, part, met), progress)

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
    commanded_rate: np.ndarray  # (N, 3)
    plant: Plant
    thrusters: Thrusters
    period_s: float
    before: int  # control cycles flown before the epoch
    ended: str


def _integrated(scenario: Scenario, now: CraftAt, plant: Plant, progress) -> _Flown:
    """The plant under its controllers, cycle by cycle.  Raises BadInput where the motion cannot be recorded."""
    loop = wheel_loop(scenario, now)
    whole_s = scenario.settle + scenario.duration
    if whole_s / loop.period > MOST_CYCLES:
        raise BadInput(
            f"{whole_s:g} s are more than {MOST_CYCLES:,} control cycles of {loop.period:g} s",
            remedy="Shorten duration and settle: everything true is kept for every cycle.",
        )
    before = int(np.ceil(scenario.settle / loop.period))
    times = loop.period * np.arange(-before, round(scenario.duration / loop.period) + 1)
    q_c, w_c, alpha_c = commanded_motion(scenario.slews, times)
    errors = _errors(scenario, loop, len(times), len(now.wheels))
    x = _start(scenario, now, plant, q_c[0])
    thrusters = thrusters_of(scenario, now, times, loop.period)
    record = np.zeros((len(times), len(x) + 18 + 3 * len(now.wheels) + 4 * len(thrusters.delay)))
    if progress is not None:
        progress(f"flying {scenario.name}: {whole_s:g} s in {len(times)} control cycles")
    off = coasting(scenario, tuple(w.name for w in now.wheels), times)
    flown, full = fly_cycles(plant, loop, errors, thrusters, off, q_c, w_c, alpha_c, times[0], x, record)
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
    columns = _Columns(len(now.wheels), plant, len(thrusters.delay))
    return _Flown(record[before:flown], columns, times, w_c[before:flown], plant, thrusters, loop.period, before, ended)


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
    for what, name in asked:
        if name not in names:
            raise BadInput(
                f"{what} names {name!r}, which {now.craft.name} does not run on {scenario.epoch[:10]}",
                remedy=f"Its wheels then: {some_of(names)}.",
            )


def _plant(scenario: Scenario, now: CraftAt, part: MovingPart | None, met: Passed | None = None) -> Plant:
    coupling, natural, damping = swinging(scenario, now)
    drag = [(w.drag.viscous, w.drag.coulomb, w.drag.stiction) if scenario.friction else (0.0,) * 3 for w in now.wheels]
    times, torques = torque_table(scenario, met)
    spike_times, spikes = drag_table(scenario, tuple(w.name for w in now.wheels))
    zero = np.zeros(3)
    return Plant(
        fixed_inertia=np.ascontiguousarray(part.rest_inertia if part else now.inertia_kgm2, float),
        wheel_axes=np.array([w.axis for w in now.wheels], float),
        spin_inertia=np.array([w.spin_inertia for w in now.wheels], float),
        drag=np.array(drag, float),
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


def _start(scenario: Scenario, now: CraftAt, plant: Plant, attitude) -> np.ndarray:
    """At the commanded attitude, at rest, the wheels as the scenario says, the appendages still."""
    n, m = len(now.wheels), len(plant.mode_damping)
    x = np.zeros(7 + n + 2 * m + 4)
    x[:4] = attitude
    x[7 : 7 + n] = [scenario.wheel_rates.get(w.name, 0.0) for w in now.wheels]
    return x


def _errors(scenario: Scenario, loop: Loop, cycles: int, wheels: int) -> Errors:
    noise, seed = NOISE[scenario.noise], scenario.seed
    estimator = Estimator.giving(noise, loop.period)
    bias = np.asarray(scenario.gyro_bias, float)
    return Errors(
        gyro=bias + normal(seed, "gyro", (cycles, 3), noise.gyro_rad_s),
        start=normal(seed, "attitude at the start", 3, noise.attitude_coloured_rad),
        star_tracker=normal(seed, "star tracker", (cycles, 3), estimator.star_tracker_rad),
        star_tracker_every=max(round(STAR_TRACKER_PERIOD_S / loop.period), 1),
        star_tracker_gain=estimator.gain,
        tachometer=normal(seed, "tachometer", (cycles, wheels), noise.wheel_rad_s),
    )


class _Columns:
    """Which columns of the record hold what (plant.fly_cycles)."""

    attitude: slice
    rate: slice
    wheel_rate: slice
    mode: slice
    mode_rate: slice
    ledger: slice
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

    def __init__(self, n: int, plant: Plant, j: int):
        m = len(plant.mode_damping)
        widths = {"attitude": 4, "rate": 3, "wheel_rate": n, "mode": m, "mode_rate": m, "ledger": 4, "estimation_error": 3,
                  "attitude_error": 3, "rate_estimate": 3, "controller_rate_error": 3, "control_torque": 3,
                  "motor_torque": n, "drag_estimate": n, "wheel_reading": n, "outside": 3, "on": j, "thrust": j,
                  "impulse": j, "chill": j}  # fmt: skip
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
    )


def _readings(flown: _Flown, truth: Truth, now: CraftAt, scenario: Scenario, part) -> dict[str, np.ndarray]:
    """Every channel at every control instant, as the instruments and the flight software give it."""
    noise, seed = NOISE[scenario.noise], scenario.seed
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
    if part is not None and scenario.cover is not None:
        readings |= motor_telemetry(scenario.cover, part, truth.time_s, truth.cover_angle_rad - part.stowed)
    return readings


def _turned(attitude, small) -> np.ndarray:
    """Attitudes (N, 4) turned by small rotation vectors (N, 3) in body axes; signs follow the input."""
    s, v, half = attitude[:, :1], attitude[:, 1:], 0.5 * small
    turned = np.hstack([s - np.sum(v * half, axis=1, keepdims=True), v + s * half + np.cross(v, half)])
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)
