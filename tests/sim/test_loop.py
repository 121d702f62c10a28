"""The closed loop against control theory, written out again here: the simulator shares none of it."""

import numpy as np
import pytest
from scipy.linalg import expm

from asflown.craft.load import load_craft
from asflown.sim.flight.closed_loop import fly

WN, ZN = 2 * np.pi * 0.0299, 0.4138
KP, KD = WN / (2 * ZN), 2 * ZN * WN
WF, ZF = 2.34048, 0.4000
IYY = 5226.0
DIAGONAL = {"inertia": (6510, IYY, 3519, 0, 0, 0)}


def error_per_torque(f_Hz: float, held_s: float = 0.0) -> complex:
    """000 eq 11, with Den = (s2 + KP KD)(s2 + 2 z w s + w2)2 + KD w4 s (the printed s4 term is wrong).

    ``held_s``: the control torque is held over cycles of this length, the one thing the paper leaves out."""
    s = 2j * np.pi * f_Hz
    section = s * s + 2 * ZF * WF * s + WF**2
    hold = (1 - np.exp(-s * held_s)) / (s * held_s) if held_s else 1.0
    return -(section**2) / IYY / (s * s * section**2 + hold * (KP * KD * section**2 + KD * WF**4 * s))


def simulated_response(f_Hz: float, **controller) -> complex:
    """Drive the loop at one frequency, a sum of straight pieces, and fit the settled response."""
    cycles = 6
    first, length = 4 / f_Hz, cycles / f_Hz
    t = np.arange(0.0, first + length + 0.0624, 0.0625)
    torque = 1e-3 * np.sin(2 * np.pi * f_Hz * t)
    torques = [{
        "shape": "table", "axis": "y",
        "times": " ".join(f"{v:.4f}" for v in t) + " s",
        "torques": " ".join(f"{v:.12e}" for v in torque) + " N m",
    }]  # fmt: skip
    truth_flight = fly(
        "quiet",
        craft=load_craft("cassini", **DIAGONAL),
        noise="none",
        changes={
            "settle": "0 s",
            "wheel_rates": {},
            "duration": f"{first + length} s",
            "torques": torques,
            "controller": controller,
            "telemetry": {"attitude_error": "0.125 s"},
        },
    )
    c = truth_flight.telemetry.channel("attitude_error_y")
    s = truth_flight.telemetry.seconds(c.tai_ns)
    keep = (s >= first) & (s < first + length)
    wave = np.exp(-2j * np.pi * f_Hz * s[keep])
    applied = np.interp(s[keep], t, torque)
    return complex(np.sum(c.values[keep] * wave) / np.sum(applied * wave))


@pytest.mark.parametrize("f_Hz", [1 / 120, 1 / 60, 0.0299, 0.05, 0.1])
def test_law_error_per_torque_is_the_analytic_one(f_Hz):
    flown = simulated_response(f_Hz)
    # what is left is the bilinear rule's frequency warp, exact only at the filter's own frequency
    assert abs(flown / error_per_torque(f_Hz, held_s=0.125) - 1) < (0.0015 if f_Hz < 0.06 else 0.008)
    assert abs(flown / error_per_torque(f_Hz) - 1) < 0.02  # the hold's half cycle of delay, at resonance


def test_law_tustin_is_nearer_the_continuous_loop_than_a_held_filter():
    want = error_per_torque(0.0299)
    tustin, zoh = (abs(simulated_response(0.0299, filter=rule) / want - 1) for rule in ("tustin", "zoh"))
    assert tustin == pytest.approx(0.019, abs=0.001)
    assert zoh > 1.5 * tustin


def test_law_the_discrete_loop_tends_to_the_continuous_one_with_the_cycle():
    want = error_per_torque(0.0299)
    off = [abs(simulated_response(0.0299, period=p) / want - 1) for p in ("0.125 s", "0.0625 s")]
    assert off[0] / off[1] == pytest.approx(2, abs=0.1)


def linear_loop(t, torque):
    """One axis, continuous: angle, rate, two filter sections, wheel momentum; torque linear between."""
    A, B = np.zeros((7, 7)), np.zeros((7, 1))
    A[0, 1] = 1
    A[1, 0], A[1, 4], B[1, 0] = -KD * KP, -KD, 1 / IYY
    A[2, 3], A[3, 1], A[3, 2], A[3, 3] = 1, WF**2, -(WF**2), -2 * ZF * WF
    A[4, 5], A[5, 2], A[5, 4], A[5, 5] = 1, WF**2, -(WF**2), -2 * ZF * WF
    A[6, 0], A[6, 4] = IYY * KD * KP, IYY * KD
    d = t[1] - t[0]
    M = np.zeros((9, 9))
    M[:7, :7], M[:7, 7:8], M[7, 8] = A * d, B * d, 1
    E = expm(M)
    x = np.zeros((len(t), 7))
    for k in range(len(t) - 1):
        x[k + 1] = E[:7, :7] @ x[k] + E[:7, 7] * torque[k] + E[:7, 8] * (torque[k + 1] - torque[k])
    return -x[:, 0], x[:, 1], x[:, 6]


@pytest.fixture(scope="module")
def published():
    """000 section VI on one axis: Iyy without the cover, wheels at rest."""
    craft = load_craft("cassini", **DIAGONAL)
    return {
        n: fly(f"profile-{n}", craft=craft, noise="none", changes={"wheel_rates": {name: "0 rpm" for name in ("RWA1", "RWA2", "RWA4")}, "telemetry": {"attitude_error": "0.125 s"}})
        for n in (1, 2)
    }  # fmt: skip


def test_published_peaks_of_profile_1(published):
    """Recomputed from 000's loop with 5226 kg m2: 106.2 microrad and 5.1 microrad/s."""
    flight = published[1]
    assert 1e6 * np.abs(flight.telemetry.channel("attitude_error_y").values).max() == pytest.approx(106.2, abs=1.0)
    assert 1e6 * np.abs(flight.truth.body_rate_rad_s[:, 1]).max() == pytest.approx(5.1, abs=0.1)


@pytest.mark.parametrize("n", [1, 2])
def test_law_noise_free_flight_is_the_linear_loop(published, n):
    flight = published[n]
    t = flight.truth.time_s
    error, rate, momentum = linear_loop(t, flight.truth.torque_Nm[:, 1])
    for got, want in (
        (flight.telemetry.channel("attitude_error_y").values, error),
        (flight.truth.body_rate_rad_s[:, 1], rate),
        (flight.truth.wheel_momentum_Nms[:, 1], momentum),
    ):
        # the flown loop is sampled at 8 Hz: half a cycle late in torque
        assert np.abs(got - want).max() < 0.015 * np.abs(want).max()


def test_published_injected_peaks(published):
    assert [p[0] for p in published[1].truth.peaks] == [90, 150, 210, 270, 330, 390]
    assert [p[0] for p in published[2].truth.peaks] == [75, 105, 135, 165, 195, 225]
    for n, size in ((1, 0.0198), (2, 0.0197)):
        truth = published[n].truth
        for time, torque, axis in truth.peaks:
            assert axis == "y" and abs(torque) == size
            assert truth.torque_Nm[round(8 * time), 1] == torque


def test_law_a_delay_and_a_wrong_inertia_change_the_loop(published):
    craft = load_craft("cassini", **DIAGONAL)
    right = fly("profile-1", craft=craft, noise="none").truth.control_torque_Nm[:, 1]
    late = fly(
        "profile-1", craft=craft, noise="none", changes={"controller": {"delay_cycles": 1}}
    ).truth.control_torque_Nm[:, 1]
    stiff = fly(
        "profile-1", craft=craft, noise="none", changes={"controller": {"inertia": "13020 10452 7038 0 0 0 kg m2"}}
    )
    assert 0 < np.abs(late - right).max() < 0.1 * np.abs(right).max()
    e = [np.abs(f.telemetry.channel("attitude_error_y").values).max() for f in (published[1], stiff)]
    # believed twice as large, the loop is twice as stiff at low frequency
    assert e[1] == pytest.approx(e[0] / 2, rel=0.1)


def test_law_friction_is_compensated_and_estimated():
    """Wheel 4 passes through rest under profile 1: compensation keeps the pointing, its estimate is the drag."""
    slow = {"wheel_rates": {"RWA1": "60 rpm", "RWA2": "-45 rpm", "RWA4": "4 rpm"}, "noise": "none", "friction": True}
    without = fly("profile-1", changes=slow)
    with_it = fly("profile-1", changes={"controller": {"friction_compensation": True}, **slow})
    clean = fly("profile-1", changes=slow | {"friction": False})
    worst = [np.abs(f.truth.body_rate_rad_s - clean.truth.body_rate_rad_s).max() for f in (without, with_it)]
    assert worst[1] < 0.5 * worst[0]
    drag = with_it.telemetry.channel("wheel_drag_torque_RWA1").values
    rate = with_it.telemetry.channel("wheel_rate_RWA1").values
    assert drag[20:] == pytest.approx(0.002 + 3.5e-5 * rate[20:], rel=0.02)


def test_law_a_wheel_at_its_rate_limit_ends_the_flight():
    push = [{"shape": "constant", "torque": "0 0.05 0 N m"}]
    flight = fly("quiet", noise="none", changes={"settle": "0 s", "torques": push, "wheel_rates": {"RWA1": "2015 rpm"}})
    assert flight.ended.startswith("wheel RWA1 at its rate limit at ")
    assert flight.truth.time_s[-1] < 60


def test_law_slews_are_followed():
    flight = fly("slews", noise="none", changes={"duration": "1180 s"})
    e = flight.telemetry.channel("attitude_error_x").values
    # 4 zf / wf = 0.684 s of filter delay leaves e = 0.684 a / KP = 60 microrad while accelerating
    assert 1e6 * np.abs(e).max() < 90
    assert np.abs(flight.truth.body_rate_rad_s[:, 0]).max() == pytest.approx(2e-3, rel=0.02)
