"""Flybys as the simulator flies them: jets, atmosphere, gravity gradient and small torques; what the truth says of them."""

import json

import numpy as np
import pytest

from asflown.dynamics.environment import gravity_gradient, gravity_gradient_bound
from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly
from asflown.sim.flight.passage import passed
from asflown.sim.scenario.scenario import load_scenario
from cli.program import complaint, run
from flights import CASSINI

JETS = ("Alexandria", "Cairo", "Damascus")


def met(scenario="e3", **flyby):
    s = load_scenario(scenario).changed(flyby=flyby)
    return passed(s.flyby, CASSINI.at(s.epoch_ns), -s.settle, s.duration)


def drag_only(scenario="e3", **flyby):
    return met(scenario, gravity_gradient=False, small_torques=False, **flyby)


# ---- published ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("how", "peak", "at_s"), [
    ({}, 6.476, 39.3), ({"exponent": 2}, 6.954, 33.1), ({"angle": "space"}, 6.27, 36.7),
])  # fmt: skip
def test_published_density_of_table_3_along_e3(how, peak, at_s):
    """004 Tables 2 and 3 in eqs 23-27, and the torque of eq 22."""
    found = drag_only(**how).peak
    assert 1e12 * found[1] == pytest.approx(peak, abs=0.006) and found[0] - 180 == pytest.approx(at_s, abs=0.06)
    assert found[3] == pytest.approx(-3.4222e9 * found[1], rel=1e-4)


@pytest.mark.parametrize(("name", "at_s", "since_s", "km"), [
    ("e3", 180, 34, 322.3), ("e3", 180, 50, 528.2), ("e4", 180, 26, 298.0), ("e9", 300, 0, 99.0),
])  # fmt: skip
def test_published_altitudes(name, at_s, since_s, km):
    m = met(name)
    assert np.interp(at_s + since_s, m.time_s, m.altitude_m) / 1e3 == pytest.approx(km, abs=0.05)


# ---- laws ---------------------------------------------------------------------------------------------------


def test_law_jets_add_up_and_scale():
    alone = [drag_only(jets={n: 1}).density_kgm3 for n in JETS]
    assert sum(alone) == pytest.approx(drag_only().density_kgm3, rel=1e-12)
    two = drag_only(jets={"Cairo": 2, "Damascus": 0.5}).density_kgm3
    assert two == pytest.approx(2 * alone[1] + 0.5 * alone[2], rel=1e-12)


def test_law_the_arm_turns_drag_about_every_axis_it_has():
    m = drag_only(arm="0.2 -0.1 0.4 m", area="9.2005 m2")
    assert m.torque_Nm == pytest.approx(0.5 * 2.1 * 14410**2 * 9.2005 * m.density_kgm3[:, None] * [0.2, -0.1, 0.4])
    assert m.axis == 2 and m.peak[3] > 0


def test_law_gravity_gradient_and_small_torques_come_by_themselves():
    """The simulator's own formula against that of the estimators, and within 004 eq 19's bound."""
    plain, both = drag_only(), met(small_torques=False)
    gradient = both.torque_Nm - plain.torque_Nm
    inertia, since = CASSINI.at(load_scenario("e3").epoch_ns).inertia_kgm2, both.time_s - 180
    r = both.flyby.position(since, (1, 0, 0), (0, 1, 0))
    assert gradient == pytest.approx(gravity_gradient(inertia, r, both.flyby.moon.mu_m3_s2), abs=1e-15)
    bound = gravity_gradient_bound(inertia, both.flyby.distance(since), both.flyby.moon.mu_m3_s2)
    assert np.all(np.linalg.norm(gradient, axis=1) <= bound) and np.abs(gradient).max() > 2e-4
    small = met().torque_Nm - both.torque_Nm
    assert small == pytest.approx(np.tile([0, 0, -4.3228e-6], (len(small), 1)), abs=1e-10)  # N m, 004 section V


def test_law_wheels_and_body_take_up_what_the_gas_gives():
    truth = fly("e3", noise="none", changes={"duration": "300 s"}).truth
    impulse = np.trapezoid(truth.torque_Nm, truth.time_s, axis=0)
    gained = truth.momentum_inertial_Nms[-1] - truth.momentum_inertial_Nms[0]
    assert gained == pytest.approx(impulse, abs=2e-3) and impulse[2] < -0.5
    assert truth.torque_Nm[:, 2] == pytest.approx(
        -3.4222e9 * truth.density_kgm3, abs=8e-4
    )  # gravity gradient is the rest
    assert truth.peaks[0][0] == pytest.approx(219.3, abs=0.1) and truth.peaks[0][2] == "z"


# ---- what it writes and refuses -----------------------------------------------------------------------------


def test_the_truth_beside_the_telemetry_and_the_docs_own_words(tmp_path):
    """As docs/cli.md has it: simulate, then density."""
    words = (
        "simulate",
        "e3",
        "--out",
        tmp_path,
        "--set",
        "flyby.jets={Cairo=1, Damascus=0.5}",
        "--set",
        "duration=400 s",
    )
    assert run(*words).code == 0
    head = next(x for x in (tmp_path / "truth.csv").read_text().splitlines() if not x.startswith("#"))
    assert "density [kg/m3],altitude [m]" in head
    kept = json.loads((tmp_path / "truth.json").read_text())
    assert kept["flyby"]["flyby"] == "E3" and kept["as_written"]["flyby"]["jets"] == {"Cairo": 1, "Damascus": 0.5}
    done = run("density", tmp_path / "telemetry.csv", "--flyby", "E3", "--closest-approach", "2008-03-12T19:06:12",
               "--method", "momentum", "--json")  # fmt: skip
    truth = kept["flyby"]["peak"]["density_kgm3"]
    assert done.code == 0 and done.record["peak"]["density_kgm3"] == pytest.approx(truth, rel=0.15)
    assert "density.wrong-date" not in {d["kind"] for d in done.record["doubts_detail"]}


@pytest.mark.parametrize(("flyby", "words"), [
    ({"name": "E21"}, "E3, E4, E5, E9"),
    ({"name": "E5"}, "longitude"),
    ({"jets": {"Bagdad": 1}}, "Alexandria, Cairo"),
    ({"jets": {"Cairo": -1}}, "not negative"),
    ({"density": "1e-10 kg/m3"}, "no atmosphere"),
    ({"gravity_gradient": True, "up": None}, "needs velocity and up"),
    ({"up": "0 1 0"}, "perpendicular"),
    ({"exponent": 3}, "1 or 2"),
    ({"speed": "5 km"}, "does not convert"),
])  # fmt: skip
def test_what_it_refuses(flyby, words):
    with pytest.raises(BadInput, match=words):
        met(**flyby)


def test_it_refuses_a_craft_of_unknown_drag_and_slews_beside_a_gravity_gradient():
    s = load_scenario("e3")
    with pytest.raises(BadInput, match="drag"):
        passed(s.flyby, CASSINI.model_copy(update={"aerodynamics": None}).at(s.epoch_ns), 0, 10)
    turn = {"start": "0 s", "axis": "0 0 1", "angle": "0.1 rad", "rate": "1 mrad/s", "acceleration": "1e-5 rad/s2"}
    with pytest.raises(BadInput, match="no slews"):
        s.changed(slews=[turn])


@pytest.mark.parametrize("setting", ["duration", "=3", "duration=60", "flyby.nothing=1", "seed=2 s"])
def test_set_refuses(setting, tmp_path):
    complaint("simulate", "e3", "--out", tmp_path / "o", "--set", setting)


def test_set_refuses_a_key_twice_and_a_mission(tmp_path):
    complaint("simulate", "e3", "--out", tmp_path / "o", "--set", "seed=1", "--set", "seed=2")
    complaint("simulate", "cassini-mission", "--out", tmp_path / "o", "--set", "seed=1")
