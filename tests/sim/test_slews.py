"""Slews for inertia estimates, and propellant that sloshes meanwhile."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from asflown.craft.model import Pendulum
from asflown.kit.errors import BadInput
from asflown.kit.rotations import rotation
from asflown.sim.flight.closed_loop import fly
from asflown.sim.flight.modes import pendulum_coupling
from asflown.sim.flight.plant import Plant, advance
from flights import CASSINI


@pytest.mark.parametrize("name", ["slews-axes", "slews-multi"])
@pytest.mark.parametrize("swing", [{}, {"flexible": True}, {"flexible": True, "slosh": True, "friction": True}])
def test_law_the_slews_are_flown_within_the_wheels_limits_and_momentum_balances(name, swing):
    flight = fly(name, changes=swing)
    truth, torque = flight.truth, np.zeros(3)
    assert flight.ended == "reached 2220 s"
    assert 30 / np.pi * np.abs(truth.wheel_rate_rad_s).max() < 1000
    if name == "slews-multi":
        torque = np.array([-0.53e-6, -2.11e-6, 1.83e-6])
        assert np.all(truth.torque_Nm == torque)
    in_space = rotation(truth.attitude).apply(np.tile(torque, (len(truth.time_s), 1)))
    H, impulse = truth.momentum_inertial_Nms, np.trapezoid(in_space, truth.time_s, axis=0)
    # trapezoids of a vector that turns by 2.5e-4 rad a cycle: 5e-9 of the impulse, itself 1e-3 of H
    assert np.abs(H[-1] - H[0] - impulse).max() < 1e-10 * np.linalg.norm(H[0])


@pytest.mark.parametrize("name, weakest", [("slews-axes", 0.3), ("slews-multi", 0.15)])
def test_law_the_slews_tell_the_whole_tensor(name, weakest):
    """001 eqs 9-11 on the true rates: rank 6, no direction much weaker than the others, and the tensor back."""
    flight = fly(name, noise="none", changes={"torques": []})
    truth = flight.truth
    every, none = slice(None, None, 32), np.zeros(len(truth.time_s[::32]))
    x, y, z = truth.body_rate_rad_s[every].T
    S = np.stack([np.stack([x, y, z, none, none, none], 1), np.stack([none, x, none, y, z, none], 1),
                  np.stack([none, none, x, none, y, z], 1)], 1).reshape(-1, 6)  # fmt: skip
    back = rotation(truth.attitude[every]).inv()
    gained = back.apply(truth.momentum_inertial_Nms[[0]]) - truth.wheel_momentum_Nms[every]
    found, _, rank, singular = np.linalg.lstsq(S, gained.ravel(), rcond=1e-6)
    assert rank == 6 and singular[-1] > weakest * singular[0]
    assert found == pytest.approx(flight.inertia_kgm2[np.triu_indices(3)], abs=1e-6)  # kg m2


TANK = Pendulum.model_validate({
    "name": "tank", "mass": "5 kg", "pivot": "0.3 -0.2 0.4 m", "direction": "1 2 -2", "length": "0.5 m",
    "frequency": "0.05 Hz", "damping": 0.02,
})  # fmt: skip
MASS, INERTIA = 40.0, np.array([[9.0, 0.6, 0.3], [0.6, 7.0, -0.4], [0.3, -0.4, 6.0]])
PUSH = np.array([0.02, -0.03, 0.025])  # for 5 s; N m


def hung(size: float, times) -> np.ndarray:
    """States (N, 15) under ``size`` times PUSH by the modes, integrated as ``fly`` does: the rate is [4:7]."""
    rows, natural = pendulum_coupling(TANK, MASS), 2 * np.pi * TANK.frequency
    empty = np.empty(0)
    plant = Plant(
        INERTIA, np.empty((0, 3)), empty, np.empty((0, 3)), rows, np.full(2, 2 * TANK.damping * natural),
        np.full(2, natural**2), empty, np.empty((0, 3)), *[np.zeros(3)] * 3, np.zeros((3, 3)), 0.0, empty,
        np.empty((5, 0)),
    )  # fmt: skip
    x, work = np.r_[1.0, np.zeros(14)], np.empty((5, 15))
    states = [x.copy()]
    for t, step in zip(times, np.diff(times), strict=False):
        advance(t, x, empty, size * PUSH if t < 4.999 else np.zeros(3), np.zeros(3), plant, step / 8, 8, work)
        states.append(x.copy())
    return np.array(states)


def swung(size: float, times) -> np.ndarray:
    """The same by two bodies and a rod of fixed length, nothing left out: momentum about the common centre of mass,
    and the forces across the rod against a spring of the swing angles."""
    m, mu = TANK.mass, TANK.mass * (MASS - TANK.mass) / MASS
    n = np.array(TANK.direction) / 3
    e1 = np.cross(n, [0, 0, 1.0]) / np.linalg.norm(np.cross(n, [0, 0, 1.0]))
    e2 = np.cross(n, e1)
    middle = np.array(TANK.pivot) + TANK.length * n
    still = middle * MASS / (MASS - m)
    rest = INERTIA - mu * (still @ still * np.eye(3) - np.outer(still, still))
    natural = 2 * np.pi * TANK.frequency

    def slopes(t, y):
        w, (a, b), rates = y[:3], y[3:5], y[5:]
        # rod direction sin a e1 + cos a sin b e2 + cos a cos b n, its derivatives by the two angles
        rod = np.sin(a) * e1 + np.cos(a) * (np.sin(b) * e2 + np.cos(b) * n)
        by_a = np.cos(a) * e1 - np.sin(a) * (np.sin(b) * e2 + np.cos(b) * n)
        by_b = np.cos(a) * (np.cos(b) * e2 - np.sin(b) * n)
        by_ab = -np.sin(a) * (np.cos(b) * e2 - np.sin(b) * n)
        by_bb = -np.cos(a) * (np.sin(b) * e2 + np.cos(b) * n)
        L, (da, db) = TANK.length, rates
        r = still + L * (rod - n)
        B = L * np.column_stack([by_a, by_b])
        v = B @ rates
        curved = L * (-rod * da**2 + 2 * by_ab * da * db + by_bb * db**2)
        inertia = rest + mu * (r @ r * np.eye(3) - np.outer(r, r))
        slope = mu * (2 * (r @ v) * np.eye(3) - np.outer(v, r) - np.outer(r, v))
        H = inertia @ w + mu * np.cross(r, v)
        carried = curved + 2 * np.cross(w, v) + np.cross(w, np.cross(w, r))
        left = np.zeros((5, 5))
        left[:3, :3], left[:3, 3:] = inertia, mu * np.cross(r[:, None], B, axis=0)
        left[3:, :3], left[3:, 3:] = left[:3, 3:].T, mu * B.T @ B
        torque = size * PUSH if t < 5 else np.zeros(3)
        spring = mu * L**2 * (natural**2 * np.array([a, b]) + 2 * TANK.damping * natural * rates)
        right = np.r_[torque - slope @ w - mu * np.cross(r, curved) - np.cross(w, H), -mu * B.T @ carried - spring]
        return np.r_[np.linalg.solve(left, right)[:3], rates, np.linalg.solve(left, right)[3:]]

    pushed = solve_ivp(slopes, (0, 5), np.zeros(7), "DOP853", times[times <= 5], rtol=1e-11, atol=1e-14)
    freely = solve_ivp(slopes, (5, times[-1]), pushed.y[:, -1], "DOP853", times[times > 5], rtol=1e-11, atol=1e-14)
    return np.hstack([pushed.y[:3], freely.y[:3]]).T


def test_law_slosh_is_the_small_swing_of_two_bodies():
    times = np.linspace(0, 40, 321)
    off = []
    for size in (0.2, 0.1):
        exact = swung(size, times)
        off.append(np.abs(hung(size, times)[:, 4:7] - exact).max() / np.abs(exact).max())
    coasting = np.linalg.norm(exact[times > 6], axis=1)
    assert np.ptp(coasting) > 0.02 * coasting.max()  # the swing shows
    assert off[0] / off[1] == pytest.approx(2, rel=0.1)  # what is left out is of second order
    assert off[1] < 0.01


def test_law_sloshing_energy_and_momentum_balance():
    states = hung(1.0, np.linspace(0, 40, 321))
    rows, natural = pendulum_coupling(TANK, MASS), 2 * np.pi * TANK.frequency
    w, eta, eta_dot = states[:, 4:7], states[:, 7:9], states[:, 9:11]
    H = w @ INERTIA + eta_dot @ rows
    E = 0.5 * np.sum(w * (w @ INERTIA), axis=1) + np.sum((w @ rows.T) * eta_dot, axis=1)
    E += 0.5 * np.sum(eta_dot**2 + (natural * eta) ** 2, axis=1)
    by_torque, _, _, in_modes = states[:, 11:].T
    assert in_modes[-1] > 1e-4 * by_torque[-1]
    assert np.abs(E - by_torque + in_modes).max() < 1e-8 * in_modes[-1]
    in_space = rotation(states[40:, :4]).apply(H[40:])  # the push ends at 5 s
    assert np.abs(in_space - in_space[0]).max() < 1e-10 * np.linalg.norm(in_space[0])


def test_slosh_needs_a_mass_and_fits_into_the_craft():
    with pytest.raises(BadInput, match="mass of the craft"):
        fly("quiet", changes={"slosh": True, "duration": "10 s"})
    with pytest.raises(BadInput, match="weighs less"):
        fly("slews-axes", changes={"slosh": True, "craft_mass": "50 kg"})
    heavy = tuple(p.model_copy(update={"pivot": (0.0, 0.0, 20.0)}) for p in CASSINI.slosh)
    with pytest.raises(BadInput, match="more inertia"):
        fly("slews-axes", craft=CASSINI.model_copy(update={"slosh": heavy}), changes={"slosh": True})
