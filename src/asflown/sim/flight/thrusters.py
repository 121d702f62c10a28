"""Thrusters as a scenario uses them: what the plant is given, and what their counters and the accelerometer read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...craft.model import STALE_NS
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.rotations import rotation
from ...kit.timeline import utc_label
from ...telemetry.channels import AXES
from ..scenario import CatalystBeds, Scenario, ThrusterUse
from .plant import Thrusters
from .sampling import axes_of
from .sensors import normal

if TYPE_CHECKING:
    from ...craft.model import Craft, CraftAt


@dataclass(frozen=True)
class ThrusterTruth:
    """What each thruster did, at the control instants from the epoch on; j thrusters."""

    names: tuple[str, ...]
    delay_s: np.ndarray  # (j,)
    rise_s: np.ndarray  # (2, j), of a hot and of a cold catalyst bed
    fall_s: np.ndarray  # (2, j)
    arms_m: np.ndarray  # (j, 3), torque about the centre of mass per newton
    directions: np.ndarray  # (j, 3), of the force on the body
    on: np.ndarray  # (N, j) bool, until the next instant
    steady_N: np.ndarray  # (N, j), what a pulse that starts then rises to
    thrust_N: np.ndarray  # (N, j), leaks left out
    leak_N: np.ndarray  # (N, j), until the next instant
    impulse_Ns: np.ndarray  # (N, j), since the epoch, leaks included
    chill: np.ndarray  # (N, j), how cold each catalyst bed is: 1 at rest, 0 hot
    in_control: np.ndarray  # (N,) bool, whether they hold the attitude
    branch: np.ndarray  # (N,) str, the one whose valves open
    period_s: float

    @property
    def on_time_s(self) -> np.ndarray:
        """Ordered since the epoch, (N, j)."""
        return self.period_s * _so_far(self.on)

    @property
    def pulses(self) -> np.ndarray:
        """Begun since the epoch and before the instant, (N, j)."""
        begun = self.on.copy()
        begun[1:] &= ~self.on[:-1]
        return _so_far(begun)

    def pulses_of(self, name: str, times) -> list[tuple[float, float, float]]:
        """Start [s], on-time [s] and steady thrust [N] of each pulse of a thruster, in order."""
        k = self.names.index(name)
        edges = np.flatnonzero(np.diff(self.on[:, k].astype(int), prepend=0, append=0))
        return [
            (float(times[a]), float((b - a) * self.period_s), float(self.steady_N[a, k]))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]

    def linear_impulse_Ns(self, attitude) -> np.ndarray:
        """Force times time since the epoch in inertial axes, (N, 3).

        A cycle's impulse is turned by the mean of the attitudes (N, 4) at its ends: off by half the angle turned
        through in a cycle at the most."""
        along = np.diff(self.impulse_Ns, axis=0) @ self.directions
        turn = rotation(attitude)
        steps = 0.5 * (turn[:-1].apply(along) + turn[1:].apply(along))
        return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def thruster_truth(
    rows, columns, thrusters: Thrusters, scenario: Scenario, craft: Craft, times, period: float, before: int
) -> ThrusterTruth:
    """From the rows of the plant's record since the epoch, which is ``before`` cycles after the flight's start."""
    recorded, impulse = slice(before, before + len(rows)), rows[:, columns.impulse]
    return ThrusterTruth(
        names=tuple(t.name for t in craft.thrusters),
        delay_s=thrusters.delay,
        rise_s=thrusters.rise,
        fall_s=thrusters.fall,
        arms_m=thrusters.arms,
        directions=np.array([t.direction for t in craft.thrusters], float),
        on=rows[:, columns.on] > 0,
        steady_N=thrusters.steady[recorded],
        thrust_N=rows[:, columns.thrust],
        leak_N=thrusters.leak[recorded],
        impulse_Ns=impulse - impulse[0],
        chill=rows[:, columns.chill],
        in_control=thrusters.in_control[recorded],
        branch=branches(scenario, craft, times),
        period_s=period,
    )


def no_thrusters(wheels: int) -> Thrusters:
    none = np.empty((0, 0))
    return Thrusters(
        in_control=np.empty(0, np.bool_), arms=np.empty((0, 3)), steady=none, leak=none, delay=np.empty(0), rise=np.empty((2, 0)),
        fall=np.empty((2, 0)), heating=1.0, cooling=1.0, serves=np.empty((0, 3)), lead=0.0, approach_rate=0.0,
        hysteresis=0.0, deadband=np.empty((1, 3)), burn_start=np.empty(0), burn_on_time=np.empty(0),
        burns=np.empty(0, bool), spin_order=np.empty((0, wheels)), spin_cycles=np.empty((0, wheels)),
    )  # fmt: skip


def thrusters_of(scenario: Scenario, now: CraftAt, times, period: float) -> Thrusters:
    """The scenario's thrusters for the plant, cycle by cycle at ``times`` (N,) [s].

    Raises BadInput where thrusters, their controller, thrust or the centre of mass are wanted and not known."""
    use, craft = scenario.thrusters, now.craft
    if use is None:
        return no_thrusters(len(now.wheels))
    names = [t.name for t in craft.thrusters]
    law = _controller(craft)
    thrust = use.thrust or craft.believed_thrust(scenario.epoch_ns)
    steady = np.full((len(times), len(names)), thrust)
    leak = np.zeros_like(steady)
    for fault in scenario.thruster_faults:
        if fault.thruster not in names:
            raise BadInput(
                f"a fault names {fault.thruster!r}, which is no thruster of {craft.name}",
                remedy=f"Its thrusters: {some_of(names)}.",
            )
        acts = _between(times, fault.start, fault.stop)
        steady[acts, names.index(fault.thruster)] *= fault.factor
        leak[acts, names.index(fault.thruster)] += fault.leak
    for swap in scenario.branch_swaps:
        if swap.thrust is not None:
            steady[times > swap.start - 1e-9] *= swap.thrust / thrust
    steady *= 1 + normal(scenario.seed, "pulse scatter", steady.shape, use.pulse_scatter)
    rise, fall, beds = _lags(use, craft)
    delay = np.array([t.delay for t in craft.thrusters])
    if delay.max() > period:
        raise BadInput(
            f"a thruster answers {delay.max():g} s after its order, later than the next order {period:g} s after it",
            remedy="Shorten its delay, or lengthen the control period.",
        )
    deadband = np.array([use.deadband, *(b.deadband for b in scenario.burns)], float)
    if deadband.min() <= law.hysteresis:
        raise BadInput(
            f"a deadband of {1e3 * deadband.min():g} mrad is not wider than the controller's hysteresis, {1e3 * law.hysteresis:g} mrad",
            remedy="Widen the deadband, or give the craft's thruster_controller less hysteresis.",
        )
    wanted = [b.delta_v * scenario.known_mass("a burn") / (b.thrust or thrust) for b in scenario.burns]
    order, left = _spin_orders(scenario, now, times)
    return Thrusters(
        in_control=_in_control(scenario, times),
        arms=arms(craft, use),
        steady=steady,
        leak=leak,
        delay=delay,
        rise=rise,
        fall=fall,
        heating=float(beds.heating),
        cooling=float(beds.cooling),
        serves=np.array([[_sense(law.pairs, name, axis) for axis in AXES] for name in names], float),
        lead=float(law.lead),
        approach_rate=float(law.approach_rate),
        hysteresis=float(law.hysteresis),
        deadband=deadband,
        burn_start=np.searchsorted(times, [b.start - 1e-9 for b in scenario.burns]).astype(float),
        burn_on_time=np.array(wanted, float),
        burns=np.array([name in law.burn for name in names]),
        spin_order=order,
        spin_cycles=left,
    )


def arms(craft: Craft, use: ThrusterUse) -> np.ndarray:
    """Torque about the centre of mass for one newton of each thruster, (j, 3). [m]   Feldman & Lee eq 16"""
    middle = craft.center_of_mass or use.center_of_mass
    if middle is None:
        raise BadInput(
            f"{craft.name}'s centre of mass is not known, and thrusters turn it about that",
            remedy='Give [thrusters] a center_of_mass = "x y z m", in the axes of the thrusters\' positions.',
        )
    at, along = (np.array([getattr(t, key) for t in craft.thrusters], float) for key in ("position", "direction"))
    return np.cross(at - middle, along)


def branches(scenario: Scenario, craft: Craft, times) -> np.ndarray:
    """The branch whose valves open, at each time, (N,) str: '' where neither scenario nor craft names one."""
    own = next((t.branch for t in craft.thrusters if t.branch), "")
    assert scenario.thrusters is not None
    out = np.full(len(times), scenario.thrusters.branch or own, dtype=object)
    for swap in scenario.branch_swaps:
        out[times > swap.start - 1e-9] = swap.branch
    return out.astype(str)


def thruster_readings(truth: ThrusterTruth, scenario: Scenario, craft: Craft) -> dict[str, np.ndarray]:
    """Cumulative on-times and pulse counts, of the branch that is counted; who holds the attitude, with which branch;
    warmth of the beds, pressure of the tank."""
    use = scenario.thrusters
    assert use is not None
    counted = truth
    if use.counted_branch is not None:
        counted = replace(truth, on=truth.on & (truth.branch == use.counted_branch)[:, None])
    readings = axes_of("on_time", counted.on_time_s, truth.names)
    readings |= axes_of("pulse_count", counted.pulses, truth.names)
    readings["control_mode"] = np.where(truth.in_control, "RCS", "RWA")
    if (truth.branch != "").all():
        readings["thruster_branch"] = truth.branch
    beds = use.catalyst_beds or CatalystBeds()
    cold, hot = float(beds.cold_temperature), float(beds.hot_temperature)
    warmth = hot + truth.chill * (cold - hot)
    readings |= axes_of("catbed_temperature", warmth, truth.names)
    if craft.blow_down is not None:
        thrust = use.thrust or craft.believed_thrust(scenario.epoch_ns)
        readings["tank_pressure"] = np.full(len(truth.on), craft.blow_down.pressure_at(thrust))
    return readings


def accelerometer_reading(truth: ThrusterTruth, scenario: Scenario, craft: Craft, times) -> dict[str, np.ndarray]:
    """Whole counts of the velocity the thrusters give along its axis, and of its bias.  (Feldman & Lee, Appendix D)

    It is taken to sit in the centre of mass: what the body's turning adds elsewhere is left out."""
    if craft.accelerometer is None:
        raise BadInput(
            f"{craft.name} has no accelerometer",
            remedy="Give its file an [accelerometer], or do not sample its counts.",
        )
    axis = np.array(craft.accelerometer.axis) / np.linalg.norm(craft.accelerometer.axis)
    velocity = truth.impulse_Ns @ truth.directions @ axis / scenario.known_mass("an accelerometer")
    return {
        "accelerometer_count": np.floor((velocity + scenario.accelerometer_bias * times) / craft.accelerometer.scale)
    }


OLD_THRUST = Kind(
    "sim.old-thrust", Severity.CAUTION,
    "the thrust is that of {date}, the last one known: it has changed since with use or recharge",
    "Give the scenario thrusters.thrust.",
)  # fmt: skip


def thrust_doubts(scenario: Scenario, craft: Craft) -> Doubts:
    """What to say of a thrust taken from long before the flight."""
    if scenario.thrusters is None or scenario.thrusters.thrust is not None or not craft.thrust_history:
        return Doubts()
    last = max(h.date for h in craft.thrust_history)
    if scenario.epoch_ns - last < STALE_NS:
        return Doubts()
    return Doubts([OLD_THRUST(date=utc_label(last)[:10])])


def _so_far(what) -> np.ndarray:
    """Sum of all rows before each, (N, j)."""
    return np.cumsum(what, axis=0, dtype=float) - what


def _controller(craft: Craft):
    if craft.thruster_controller is None or not craft.thrusters:
        raise BadInput(
            f"{craft.name} has no thrusters, or no controller of them",
            remedy="Give the craft file [[thrusters]] and a [thruster_controller], or fly another craft.",
        )
    return craft.thruster_controller


def _sense(pairs, name: str, axis: str) -> int:
    return (name in pairs.get(f"+{axis}", ())) - (name in pairs.get(f"-{axis}", ()))


def _lags(use: ThrusterUse, craft: Craft) -> tuple[np.ndarray, np.ndarray, CatalystBeds]:
    """Time constants of rise and fall, (2, j) each, hot and cold bed; and the beds.  Alike unless beds are asked for."""
    beds, j = use.catalyst_beds, len(craft.thrusters)
    if beds is not None:
        return np.tile([[beds.hot_rise], [beds.cold_rise]], j), np.tile([[beds.hot_fall], [beds.cold_fall]], j), beds
    rise = [t.rise if use.rise is None else use.rise for t in craft.thrusters]
    fall = [t.fall if use.fall is None else use.fall for t in craft.thrusters]
    return np.array([rise, rise], float), np.array([fall, fall], float), CatalystBeds()


def _in_control(scenario: Scenario, times) -> np.ndarray:
    """Whether thrusters hold the attitude in the cycle that begins at each time, (N,) bool."""
    use = scenario.thrusters
    assert use is not None
    if not scenario.thruster_control:
        return np.full(len(times), use.control)
    return np.any([_between(times, c.start, c.stop) for c in scenario.thruster_control], axis=0)


def _between(times, start: float, stop: float) -> np.ndarray:
    # a nanosecond of rounding must not move a start by a cycle
    return (times > start - 1e-9) & (times < stop - 1e-9)


def _spin_orders(scenario: Scenario, now: CraftAt, times) -> tuple[np.ndarray, np.ndarray]:
    """Where each wheel's rate is to go and in how many cycles, (N, n) each; nan and 1 where it is to stay."""
    wheels = [w.name for w in now.wheels]
    order, left = np.full((len(times), len(wheels)), np.nan), np.ones((len(times), len(wheels)))
    for bias in scenario.wheel_biases:
        acts = np.flatnonzero(_between(times, bias.start, bias.stop))
        for name, rate in bias.rates.items():
            order[acts, wheels.index(name)] = rate
            left[acts, wheels.index(name)] = np.arange(len(acts), 0, -1)
    return order, left
