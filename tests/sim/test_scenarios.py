"""Scenarios: what is shipped, what is refused, what comes out on disk."""

import json

import numpy as np
import pytest

from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly, write_flight
from asflown.sim.flight.command import commanded_motion, slew_time
from asflown.sim.scenario.scenario import load_scenario, shipped_scenarios
from cli.program import run
from flights import assert_refused


def test_shipped_scenarios_are_those_promised():
    assert set(shipped_scenarios()) >= {"profile-1", "profile-2", "cover-deploy", "cover-stow", "slews", "quiet",
                                           "wheel-run-down"}  # fmt: skip
    for name in shipped_scenarios():
        scenario = load_scenario(name)
        assert scenario.name == name and scenario.description and scenario.assumptions


@pytest.fixture(scope="module")
def deployment():
    return fly("cover-deploy", noise="none")


def test_published_course_of_a_cover_deployment(deployment):
    """000 section III: momentum about 0.3 N m s and back to nothing, about 10 rpm, 32.75 to 179.2 deg."""
    truth = deployment.truth
    h = truth.wheel_momentum_Nms - truth.wheel_momentum_Nms[0]
    assert 0.25 < -h[:, 1].min() < 0.35 and np.abs(h[-1]).max() < 0.005
    assert np.abs(h[:, [0, 2]]).max() < 0.01
    rpm = np.abs(truth.wheel_rate_rad_s - truth.wheel_rate_rad_s[0]).max(axis=0) * 30 / np.pi
    assert np.all((rpm > 5) & (rpm < 17))
    assert np.degrees(truth.cover_angle_rad[[0, -1]]) == pytest.approx([32.75, 179.2], abs=1e-6)
    minute = truth.time_s / 60
    first = (minute > 1) & (minute < 2.3)
    assert np.all(truth.torque_Nm[first, 1] < 0) and np.all(truth.torque_Nm[minute < 1] == 0)
    assert np.trapezoid(truth.torque_Nm[:, 1], truth.time_s) == pytest.approx(0, abs=1e-4)
    stall = load_scenario("cover-deploy").cover.stall / 60 - 1
    assert 2.2 < stall < 3.3


def test_published_thermal_and_switch_readings_of_a_deployment(deployment):
    t = deployment.telemetry
    angle = np.degrees(t.channel("cover_angle").values)
    minute = t.seconds(t.channel("cover_angle").tai_ns) / 60
    assert angle[0] == pytest.approx(32.75) and angle[np.argmin(np.abs(minute - 4.27))] == pytest.approx(179.2)
    current = t.channel("motor_current").values
    assert np.argmax(current == current.max()) == 4  # the sample at minute 4.27, the first after the stall
    assert list(t.channel("microswitch").values[[0, 2, -1]]) == ["stowed", "between", "deployed"]
    assert list(t.channel("motor_on").values) == ["off", "on", "on", "on", "on", "on", "on", "off"]


def test_law_the_cover_torque_is_what_the_wheels_and_body_absorb(deployment):
    """Impulse of the reported torque against momentum of wheels and body."""
    truth = deployment.truth
    torque = truth.torque_Nm[:, 1]
    impulse = np.concatenate([[0], np.cumsum((torque[1:] + torque[:-1]) / 2 * np.diff(truth.time_s))])
    absorbed = truth.wheel_momentum_Nms[:, 1] - truth.wheel_momentum_Nms[0, 1] + 5333 * truth.body_rate_rad_s[:, 1]
    # the body's inertia changes by 2 % as the cover travels, and cross-products are left out here
    assert np.abs(absorbed - impulse).max() < 0.002


def test_law_stowing_turns_the_wheels_the_other_way():
    truth = fly("cover-stow", noise="none").truth
    h = truth.wheel_momentum_Nms[:, 1] - truth.wheel_momentum_Nms[0, 1]
    assert 0.25 < h.max() < 0.35 and -0.06 < h.min() < 0 and abs(h[-1]) < 0.005  # axis of 000 Fig. B1
    assert np.degrees(truth.cover_angle_rad[[0, -1]]) == pytest.approx([179.2, 32.75], abs=1e-6)


def test_law_commanded_motion_is_consistent():
    slews = load_scenario("slews").slews
    t = np.arange(0, 2400, 0.125)
    q, w, a = commanded_motion(slews, t)
    from asflown.kit.rotations import rates_between

    _, rate = rates_between(t, q)
    off = np.abs(rate - (w[1:] + w[:-1]) / 2).max(axis=1)
    assert off.max() < 2e-5 * 0.125 / 2 and np.sum(off > 1e-9) <= 8  # two corners of each slew fall between the steps
    assert np.abs(np.diff(w, axis=0) / 0.125 - (a[1:] + a[:-1]) / 2).max() <= 1.01 * 2e-5
    assert np.abs(w).max() == pytest.approx(2e-3) and np.all(w[-1] == 0) and np.all(w[0] == 0)
    for slew in slews:
        assert slew_time(slew) == pytest.approx(100 + np.radians(25) / 2e-3)


def test_law_the_plume_takes_momentum_away():
    flight = fly(
        "quiet",
        noise="none",
        changes={
            "epoch": "2008-03-12T19:00:00",
            "duration": "300 s",
            "torques": [{"shape": "plume", "closest_approach": "60 s"}],
        },
    )
    H = flight.truth.momentum_inertial_Nms
    impulse = np.trapezoid(flight.truth.torque_Nm[:, 2], flight.truth.time_s)
    assert impulse < -0.5
    assert H[-1, 2] - H[0, 2] == pytest.approx(impulse, abs=2e-3)
    assert flight.truth.peaks[0][2] == "z" and flight.truth.peaks[0][0] == pytest.approx(99.3, abs=0.1)


def test_a_torque_table_from_a_file(tmp_path):
    (tmp_path / "push.csv").write_text("# mine\ntime [s],y [mN m]\n0,0\n10,5\n20,0\n")
    toml = 'duration = "30 s"\nnoise = "none"\n[[torques]]\nshape = "table"\nfile = "push.csv"\n'
    (tmp_path / "mine.toml").write_text(toml)
    truth = fly(tmp_path / "mine.toml").truth
    assert truth.torque_Nm[80] == pytest.approx([0, 0.005, 0])


BAD = {
    "no such scenario": ("nothing", {}),
    "no such file": ("nothing.toml", {}),
    "unknown key": ("quiet", {"durations": "1 s"}),
    "no unit": ("quiet", {"duration": 60}),
    "wrong unit": ("quiet", {"duration": "60 m"}),
    "negative": ("quiet", {"duration": "-1 s"}),
    "not a date": ("quiet", {"epoch": "yesterday"}),
    "unknown wheel": ("quiet", {"wheel_rates": {"RWA9": "1 rpm"}}),
    "wheel not in use": ("quiet", {"wheel_rates": {"RWA3": "1 rpm"}}),
    "unknown noise": ("quiet", {"noise": "some"}),
    "unknown torque": ("quiet", {"torques": [{"shape": "squares"}]}),
    "times do not increase": (
        "quiet", {"torques": [{"shape": "table", "axis": "x", "times": "0 0 s", "torques": "1 1 N m"}]}),
    "no table": ("quiet", {"torques": [{"shape": "table", "file": "absent.csv"}]}),
    "slews overlap": ("slews", {"slews": [
        {"start": "0 s", "axis": "1 0 0", "angle": "1 rad", "rate": "1 mrad/s", "acceleration": "1e-5 rad/s2"}] * 2}),
    "no travel": ("cover-deploy", {"cover": {"rates": "0 1 0 deg/s", "times": "60 70 80 s"}}),
    "no such part": ("cover-deploy", {"cover": {"mechanism": "door"}}),
    "an impossible controller": ("quiet", {"controller": {"inertia": "1 1 9 0 0 0"}}),
    "an unknown craft": ("quiet", {"craft": "voyager"}),
    "a craft without inertia": ("quiet", {"craft": "inspiresat1"}),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_in_words(case):
    name, changes = BAD[case]
    assert_refused(name, **changes)


def test_files_hold_the_flight(tmp_path):
    from asflown.telemetry.load import load_telemetry

    flight = fly("cover-deploy", seed=3)
    files = write_flight(flight, tmp_path / "out")
    read = load_telemetry(files["telemetry"])
    assert read.epoch_ns == flight.telemetry.epoch_ns and set(read.channels) == set(flight.telemetry.channels)
    for name, c in flight.telemetry.channels.items():
        assert np.array_equal(read.channel(name).tai_ns, c.tai_ns)
        assert np.array_equal(read.channel(name).values, c.values)
    lines = [line for line in files["truth"].read_text().splitlines() if not line.startswith("#")]
    assert lines[0].startswith("time [s],disturbance_torque_x [N m],") and len(lines) == 8 * 480 + 2
    assert np.array([line.split(",") for line in lines[1:]], float)[8 * 100, 2] == flight.truth.torque_Nm[8 * 100, 1]
    kept = json.loads(files["truth_json"].read_text())
    assert kept["seed"] == 3 and kept["noise"] == "nominal" and len(kept["assumptions"]) > 3
    assert kept["inertia_kg_m2"][1][1] == 5333
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["telemetry.csv", "truth.csv", "truth.json"]


def test_the_command_writes_and_reports(tmp_path):
    done = run("simulate", "quiet", "--out", tmp_path, "--noise", "half", "--json")
    assert done.code == 0
    said = done.record
    assert said["command"] == "simulate" and said["ended"] == "reached 480 s" and said["seed"] == 1
    assert all((tmp_path / n).is_file() for n in ("telemetry.csv", "truth.csv", "truth.json"))


def test_law_a_wheel_without_motor_coasts_as_its_bearing_has_it_and_the_attitude_is_held():
    """Against the law of Coulomb and viscous drag in closed form; the other wheels stay in the loop."""
    coasts = [{"wheel": "RWA1", "start": "60 s", "stop": "360 s"}]
    flight = fly(
        "quiet",
        noise="none",
        changes={"friction": True, "controller": {"friction_compensation": True}, "coasts": coasts},
    )
    t, truth = flight.truth.time_s, flight.truth
    coasting = (t >= 60) & (t < 360)
    assert np.all(truth.motor_torque_Nm[coasting, 0] == 0) and np.all(truth.motor_torque_Nm[:, 1:] != 0)
    assert np.all(truth.holding_torque_Nm[~coasting] == 0)
    wheel = flight.craft.at(flight.scenario.epoch_ns).wheel("RWA1")
    a, b = wheel.drag.coulomb / wheel.spin_inertia, wheel.drag.viscous / wheel.spin_inertia
    u = truth.wheel_rate_rad_s[coasting, 0]
    # what the body's rate changes by counts for the wheel
    u = u + (truth.body_rate_rad_s @ wheel.axis)[coasting]
    expected = (u[0] + a / b) * np.exp(-b * (t[coasting] - 60)) - a / b
    assert np.abs(u - expected).max() < 1e-8  # rad/s
    drag = 0.16138 * (a + b * u[-1])
    assert truth.holding_torque_Nm[coasting][-1] == pytest.approx(-drag * np.array(wheel.axis), abs=2e-5)
    assert np.abs(truth.attitude[:, 1:]).max() < 5e-5


def test_law_momentum_grows_by_the_impulse_from_outside():
    coasts = [{"wheel": "RWA1", "start": "60 s", "stop": "360 s"}]
    truth = fly("quiet", noise="none", changes={"friction": True, "coasts": coasts, "drag_spikes": SPIKES}).truth
    gained = truth.momentum_inertial_Nms[-1] - truth.momentum_inertial_Nms[0]
    impulse = truth.holding_torque_Nm[:-1].sum(axis=0) * 0.125
    assert gained == pytest.approx(impulse, abs=2e-4 * np.abs(impulse).max()) and np.abs(impulse).max() > 0.5


SPIKES = [{"wheel": "RWA4", "start": "100 s", "duration": "50 s", "torque": "0.01 N m"},
          {"wheel": "RWA4", "start": "140 s", "duration": "50 s", "torque": "0.01 N m"}]  # fmt: skip


def test_law_drag_spikes_only_move_momentum_between_wheel_and_body():
    flight = fly("quiet", noise="none", changes={"friction": True, "drag_spikes": SPIKES})
    H = flight.truth.momentum_inertial_Nms
    assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
    plain = fly("quiet", noise="none", changes={"friction": True}).truth
    lost = (plain.wheel_rate_rad_s - flight.truth.wheel_rate_rad_s)[:, 2] * 0.16138
    at = np.searchsorted(flight.truth.time_s, [99.0, 101.5])
    assert abs(lost[at[0]]) < 1e-12 and lost[at[1]] == pytest.approx(0.01, rel=0.05)  # 1 s at 0.01 N m


@pytest.mark.parametrize("key", ["coasts", "drag_spikes"])
def test_coasts_and_spikes_name_a_wheel_that_is_there(key):
    more = {"stop": "20 s"} if key == "coasts" else {"duration": "20 s", "torque": "0.01 N m"}
    with pytest.raises(BadInput, match="'RWA3', which cassini does not run"):
        fly("quiet", changes={key: [{"wheel": "RWA3", "start": "10 s"} | more]})
    with pytest.raises(BadInput):
        bad = {"stop": "5 s"} if key == "coasts" else {"duration": "0 s", "torque": "0.01 N m"}
        fly("quiet", changes={key: [{"wheel": "RWA1", "start": "10 s"} | bad]})
