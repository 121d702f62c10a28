"""What no simulated flight may break, whatever it does."""

import os
import subprocess
import sys

import numpy as np
import pytest

from asflown.sim.flight.closed_loop import fly

EVERYTHING = {
    "flexible": True,
    "friction": True,
    "controller": {"friction_compensation": True, "delay_cycles": 1},
}


def drift_of_momentum(flight) -> float:
    H = flight.truth.momentum_inertial_Nms
    return float(np.abs(H - H[0]).max() / np.linalg.norm(H[0]))


@pytest.mark.parametrize(
    "scenario, changes",
    [
        ("quiet", {}),
        ("quiet", EVERYTHING),
        ("cover-deploy", {}),
        ("cover-deploy", EVERYTHING),
        ("cover-stow", {"noise": "double"}),
        ("slews", {"duration": "620 s"}),
        ("slews", EVERYTHING | {"duration": "620 s", "substeps": 8}),
    ],
)
def test_law_momentum_is_conserved_in_inertial_space_without_external_torque(scenario, changes):
    assert drift_of_momentum(fly(scenario, changes=changes)) < 1e-10


def test_law_momentum_grows_by_the_impulse_of_the_torque():
    push = [{"shape": "table", "axis": "x", "times": "10 20 40 s", "torques": "0 0.02 0 N m"}]
    H = fly("quiet", changes={"duration": "60 s", "torques": push}).truth.momentum_inertial_Nms
    # the attitude turns by some 1e-4 rad meanwhile, and body axes with it
    assert H[-1] - H[0] == pytest.approx([0.3, 0, 0], abs=1e-4)


def energy(flight, plant_craft) -> np.ndarray:
    """Kinetic and elastic, from the truth alone. [J]"""
    t, now = flight.truth, plant_craft.at(flight.scenario.epoch_ns)
    J = np.array([w.spin_inertia for w in now.wheels])
    axes = np.array([w.axis for w in now.wheels])
    w, rho = t.body_rate_rad_s, t.wheel_rate_rad_s
    E = 0.5 * np.einsum("ni,ij,nj->n", w, now.inertia_kgm2, w) + 0.5 * rho**2 @ J
    E += np.sum((w @ axes.T) * rho * J, axis=1)
    if t.mode_rate.shape[1]:
        delta = np.array([m.coupling for m in now.craft.flexible_modes])
        stiffness = (2 * np.pi * np.array([m.frequency for m in now.craft.flexible_modes])) ** 2
        E += np.sum((w @ delta.T) * t.mode_rate, axis=1)
        E += 0.5 * np.sum(t.mode_rate**2, axis=1) + 0.5 * t.mode_amplitude**2 @ stiffness
    return E


def test_law_energy_balances():
    push = [{"shape": "triangles", "axis": "x", "peak": "0.5 N m", "rise": "3 s", "first": "2 s", "count": 4}]
    flight = fly(
        "slews",
        noise="none",
        changes={
            "duration": "300 s",
            "settle": "0 s",
            "torques": push,
            "substeps": 8,
            "flexible": True,
            "friction": True,
            "controller": {"friction_compensation": True},
        },
    )
    E = energy(flight, flight.craft)
    by_torque, by_motors, in_bearings, in_modes = flight.truth.ledger_J.T
    exchanged = np.abs(by_torque).max() + np.abs(by_motors).max()
    assert in_bearings[-1] > 1
    balance = E - E[0] - (by_torque + by_motors - in_bearings - in_modes)
    assert np.abs(balance).max() < 1e-7 * exchanged


TUMBLING = np.array([1.0, 0, 0, 0, 0.5, -0.8, 0.3, 20.0, -10.0, 5.0, 0.1, 0.0, 0, 0, 0, 0])
MOTORS = np.array([0.01, 0.0, -0.02])


def small_body():
    """A body, three wheels and one mode that carries a sixth of the inertia: everything matters."""
    from asflown.sim.flight.plant import Plant

    empty = np.empty(0)
    return Plant(
        np.array([[3.0, 0.2, 0.1], [0.2, 2.0, -0.1], [0.1, -0.1, 1.5]]), np.eye(3), np.full(3, 0.05),
        np.tile([0.0, 0, 0, 1], (3, 1)), np.array([[0.7, 0.1, 0.0]]), np.array([0.05]), np.array([4.0]),
        empty, np.empty((0, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((3, 3)), 0.0, empty, np.empty((5, 0)),
    )  # fmt: skip


def test_law_runge_kutta_is_of_fourth_order():
    """Without the control cycle: the integrator alone, tumbling."""
    from asflown.sim.flight.plant import advance

    plant, ends = small_body(), []
    for steps in (80, 160, 320, 2560):
        x = TUMBLING.copy()
        advance(0.0, x, MOTORS, np.zeros(3), np.zeros(3), plant, 4.0 / steps, steps, np.empty((5, len(x))))
        ends.append(x[:12])
    errors = [np.abs(x - ends[-1]).max() for x in ends[:3]]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([4, 4], abs=0.3)


def test_law_energy_balances_with_a_heavy_mode():
    from asflown.sim.flight.plant import advance

    plant, x = small_body(), TUMBLING.copy()

    def held(x):
        w, rho, eta, eta_dot = x[4:7], x[7:10], x[10], x[11]
        h = 0.05 * rho
        return (0.5 * w @ plant.fixed_inertia @ w + w @ h + 0.5 * rho @ h
                + w @ plant.coupling[0] * eta_dot + 0.5 * eta_dot**2 + 2.0 * eta**2)  # fmt: skip

    before = held(x)
    advance(0.0, x, MOTORS, np.zeros(3), np.zeros(3), plant, 0.001, 20_000, np.empty((5, len(x))))
    by_torque, by_motors, in_bearings, in_modes = x[12:]
    assert by_torque == 0 and in_bearings == 0 and in_modes > 1e-3
    assert abs(held(x) - before - by_motors + in_modes) < 1e-8 * in_modes


def test_law_the_step_does_not_matter():
    coarse, fine = (fly("profile-2", noise="none", changes={"flexible": True, "substeps": n}).truth for n in (4, 16))
    difference = np.abs(coarse.body_rate_rad_s - fine.body_rate_rad_s).max()
    assert difference < 1e-5 * np.abs(fine.body_rate_rad_s).max()


def test_law_same_seed_same_numbers_other_seed_other_numbers():
    a, b, c = (fly("profile-1", seed=s, changes={"duration": "60 s"}).telemetry for s in (5, 5, 6))
    for name in a.channels:
        assert np.array_equal(a.channels[name].values, b.channels[name].values)
    assert not np.array_equal(a.channels["body_rate_y"].values, c.channels["body_rate_y"].values)


SHORT = """
import numpy as np
from asflown.sim.flight import fly
f = fly("cover-deploy", noise="nominal", changes={"duration": "6 s", "settle": "0 s", "flexible": True, "friction": True,
        "cover": {"times": "1 3 5 s", "rates": "0 73.225 0 deg/s", "motor_on": "1 s", "stall": "5 s"}})
np.save("OUT", np.hstack([f.truth.body_rate_rad_s, f.truth.wheel_rate_rad_s, f.truth.attitude]))
"""


WITH_THRUSTERS = """
import numpy as np
from asflown.sim.flight import fly
bias = [{"start": "0 s", "stop": "2 s", "rates": {"RWA1": "30 rpm", "RWA4": "30 rpm"}}]
f = fly("wheel-bias-fsds", changes={"duration": "6 s", "wheel_biases": bias,
        "thrusters": {"deadband": "30 30 30 urad", "catalyst_beds": {}}})
assert f.truth.thrusters.pulses[-1].sum() > 3
np.save("OUT", np.hstack([f.truth.body_rate_rad_s, f.truth.wheel_rate_rad_s, f.truth.attitude]))
"""


@pytest.mark.parametrize("short", [SHORT, WITH_THRUSTERS])
def test_law_without_numba_the_same_flight_within_rounding(tmp_path, short):
    """Compiled code may fuse and reorder: agreement to 1e-9 of each column's size, not to the bit."""
    made = []
    for switch in ("0", "1"):
        path = tmp_path / f"{switch}.npy"
        subprocess.run(
            [sys.executable, "-c", short.replace("OUT", str(path))],
            env=os.environ | {"NUMBA_DISABLE_JIT": switch}, check=True,
        )  # fmt: skip
        made.append(np.load(path))
    size = np.abs(made[0]).max(axis=0)
    assert np.all(np.abs(made[0] - made[1]).max(axis=0) <= 1e-9 * size)
