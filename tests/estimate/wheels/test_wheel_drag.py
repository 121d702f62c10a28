"""Wheel drag: recovery from run-downs, estimates and commands; laws; and where it must stay silent."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from asflown.craft.load import load_craft
from asflown.estimate.wheels.doubts import (
    COMMAND_INCOMPLETE,
    COMMAND_SHOWS_NONE,
    DRAG_UNKNOWN,
    IN_GAPS,
    MAGNITUDE,
    NOT_SEPARABLE,
    ON_THE_WHEEL,
    PER_SPIN_INERTIA,
    SLOWS_AS_DRIVEN,
    SLOWS_WITH_OTHERS,
)
from asflown.estimate.wheels.run_downs import coast
from asflown.estimate.wheels.study import LOW_SPEED, wheels
from asflown.kit.errors import BadInput
from asflown.telemetry.load import load_telemetry
from asflown.trends.entries.wheels import wheel_entry
from cli.program import complaint, run
from conftest import flight_data
from flights import CASSINI, flown, inspiresat1, iss, saved, telemetry_of

J = 0.16138  # kg m2, RWA1
NOISE = 0.005  # rad/s


def course(t, first: float, coulomb: float, viscous: float, start: float, stop: float) -> np.ndarray:
    """A wheel held at a rate, let go, and held again, by small steps of Heun's rule: not the law's closed form."""
    step = 0.5
    fine = np.arange(0.0, t[-1] + step, step)
    w = np.full(len(fine), first)

    def slope(u):
        return -(viscous * u + coulomb * np.sign(u)) / J

    for k in range(1, len(fine)):
        w[k] = w[k - 1]
        if start <= fine[k - 1] < stop:
            a = slope(w[k])
            w[k] += 0.5 * step * (a + slope(w[k] + step * a))
    return np.interp(t, fine, w)


def wandering(rng, count: int, size: float = 0.05) -> np.ndarray:
    """What a wheel does in the loop: the controller answers a noisy attitude, over some 15 s."""
    x, keep = np.zeros(count), np.exp(-4 / 15)
    for k in range(1, count):
        x[k] = keep * x[k - 1] + size * np.sqrt(1 - keep**2) * rng.standard_normal()
    return x


def run_down(seed: int, *, first=94.0, coulomb=0.002, viscous=3.5e-5, length=1200.0, way=1, before=200.0, noise=NOISE):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 2 * before + length, 4.0)
    w = way * course(t, first, coulomb, viscous, before, before + length) + noise * rng.standard_normal(len(t))
    in_loop = (t < before) | (t > before + length)
    return t, w + np.where(in_loop, wandering(rng, len(t)), 0.0)


# ---- recovery --------------------------------------------------------------------------------------------


def test_recovery_pulls_of_run_downs_are_unit_normal():
    pulls = []
    for seed in range(60):
        rng = np.random.default_rng(1000 + seed)
        c, b = rng.uniform(0.001, 0.004), rng.uniform(2e-5, 6e-5)
        t, w = run_down(seed, coulomb=c, viscous=b, first=rng.uniform(60, 150), way=rng.choice([-1, 1]))
        wheel = wheels(telemetry_of(wheel_rate_RWA1=(t, w)), CASSINI).wheel("RWA1")
        (r,), f = wheel.run_downs, wheel.fit
        assert f.basis == "run-down" and not f.relative
        assert 200 <= r.start_s <= 216 and 1380 <= r.stop_s <= 1404
        total = c + b * f.mean_rate_rad_s
        pulls.append(((f.coulomb_Nm - c) / f.coulomb_sigma_Nm, (f.viscous_Nms - b) / f.viscous_sigma_Nms, (f.drag_at_mean_Nm - total) / f.drag_at_mean_sigma_Nm))  # fmt: skip
    pulls = np.array(pulls)
    assert np.abs(pulls.mean(axis=0)).max() < 0.45  # 3.5 sigma of 60
    assert pulls.std(axis=0) == pytest.approx([1, 1, 1], abs=0.3)  # 3.3 sigma of 60
    assert np.abs(pulls).max() < 4.5


@cache
def studied(seed):
    flight = flown("wheel-run-down", seed=seed)
    return flight, wheels(flight.telemetry, flight.craft)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_recovery_of_the_flown_run_down(seed):
    _, result = studied(seed=seed)
    for name, span in (("RWA1", (120, 2520)), ("RWA2", (120, 1320))):
        wheel, f = result.wheel(name), result.wheel(name).fit
        (r,) = wheel.run_downs
        assert f.basis == "run-down" and f.separable
        assert span[0] <= r.start_s <= span[0] + 12 and span[1] - 12 <= r.stop_s <= span[1]
        assert abs(f.coulomb_Nm - 0.002) < 4 * f.coulomb_sigma_Nm and f.coulomb_sigma_Nm < 5e-6  # N m
        assert abs(f.viscous_Nms - 3.5e-5) < 4 * f.viscous_sigma_Nms
    other = result.wheel("RWA4")
    assert other.fit.basis == "flight software estimate"
    assert (
        abs(other.fit.drag_at_mean_Nm - 0.002 - 3.5e-5 * other.fit.mean_rate_rad_s) < 1.5e-4
    )  # N m: the Stribeck rise is in it
    (spike,) = other.spikes
    assert spike.time_s == pytest.approx(600, abs=8) and spike.duration_s == pytest.approx(120, abs=10)
    assert spike.excess_Nm == pytest.approx(0.008, abs=0.0025)
    assert result.wheel("RWA1").spikes == () and other.use.zero_crossings >= 1


def test_recovery_of_the_estimates_of_the_flight_software():
    """On a wheel that coasts, both ways to its drag agree."""
    pulls = []
    for seed in (1, 2, 3):
        _, result = studied(seed=seed)
        for name in ("RWA1", "RWA2"):
            f = result.wheel(name).fits[1]
            assert f.basis == "flight software estimate"
            pulls += [(f.coulomb_Nm - 0.002) / f.coulomb_sigma_Nm, (f.viscous_Nms - 3.5e-5) / f.viscous_sigma_Nms]
    assert np.abs(pulls).max() < 3.5 and np.std(pulls) < 1.6


def test_recovery_from_the_commanded_torque_of_wheels_without_compensation():
    for seed in (1, 2):
        f = flown("quiet", friction=True, duration="1000 s", seed=seed, telemetry={"control_torque": "4 s"})
        result = wheels(f.telemetry, f.craft)
        for w in result.wheels:
            assert w.fit.basis == "command" and not w.fit.separable
            assert (
                abs(w.fit.drag_at_mean_Nm - 0.002 - 3.5e-5 * w.fit.mean_rate_rad_s)
                < 4 * w.fit.drag_at_mean_sigma_Nm + 2e-5
            )
        assert result.doubts.has(NOT_SEPARABLE) and result.doubts.has(COMMAND_INCOMPLETE)


def test_commanded_torque_of_wheels_with_compensation_shows_no_drag():
    f = flown(
        "quiet", friction=True, duration="1000 s", controller={"friction_compensation": True},
        telemetry={"control_torque": "4 s", "wheel_drag_torque": "0 s"},
    )  # fmt: skip
    result = wheels(f.telemetry, f.craft)
    assert all(w.fit is None for w in result.wheels)
    assert len(result.doubts.of(COMMAND_SHOWS_NONE)) == 3


def test_several_run_downs_share_one_law_and_gaps_are_not_bridged():
    t, w = run_down(5, length=1200)
    gap = (t > 700) & (t < 780)
    whole = wheels(telemetry_of(wheel_rate_RWA1=(t, w)), CASSINI).wheel("RWA1")
    result = wheels(telemetry_of(wheel_rate_RWA1=(t[~gap], w[~gap])), CASSINI)
    parted = result.wheel("RWA1")
    assert len(whole.run_downs) == 1 and len(parted.run_downs) == 2
    assert parted.run_downs[0].stop_s <= 700 and parted.run_downs[1].start_s >= 780
    assert parted.fit.coulomb_sigma_Nm > whole.fit.coulomb_sigma_Nm
    assert abs(parted.fit.coulomb_Nm - 0.002) < 4 * parted.fit.coulomb_sigma_Nm
    assert parted.use.revolutions < whole.use.revolutions and parted.use.gaps_s == pytest.approx(80, abs=8)
    assert result.doubts.has(IN_GAPS)


def test_lost_samples_single_outliers_and_coarse_counts_leave_the_drag():
    t, w = run_down(6)
    rng = np.random.default_rng(6)
    kept = rng.random(len(t)) > 0.1
    w = np.where(np.arange(len(t)) % 97 == 50, w + 0.2, w)
    for values, coarse in ((w, 1.0), (np.round(w / 0.04) * 0.04, 3.0)):
        f = wheels(telemetry_of(wheel_rate_RWA1=(t[kept], values[kept])), CASSINI).wheel("RWA1").fit
        assert abs(f.coulomb_Nm - 0.002) < 4 * f.coulomb_sigma_Nm and f.coulomb_sigma_Nm < coarse * 1e-5
        assert abs(f.viscous_Nms - 3.5e-5) < 4 * f.viscous_sigma_Nms


# ---- what must stay unknown ---------------------------------------------------------------------------------


STEADY = [{"shape": "constant", "torque": "0.005 -0.005 0.002 N m"}]


@pytest.mark.parametrize(
    "scenario, changes",
    [
        ("quiet", {}),
        ("quiet", {"noise": "none"}),
        ("quiet", {"friction": True, "duration": "1500 s", "torques": STEADY}),
        ("quiet", {"friction": True, "duration": "1500 s", "torques": STEADY, "noise": "none"}),
        ("profile-1", {"friction": True}),
        ("slews", {"noise": "none", "duration": "900 s"}),
    ],
)
def test_in_the_loop_drag_is_not_known_and_the_result_says_so(scenario, changes):
    flight = flown(scenario, **changes)
    result = wheels(flight.telemetry, flight.craft)
    for w in result.record()["wheels"]:
        assert w["basis"] is None and w["run_downs"] == [] and w["spikes"] is None
        assert all(w[k] is None for k in ("coulomb_Nm", "viscous_Nms", "drag_at_mean_Nm", "correlation"))
    (unknown,) = result.doubts.of(DRAG_UNKNOWN)
    assert unknown.about["wheels"] == "RWA1, RWA2, RWA4"


def test_wheels_that_slow_together_show_a_torque_not_a_bearing():
    """A torque that fades bends the courses as viscous drag would; where two wheels only trade momentum, one may coast."""
    t, w = run_down(11, before=0.0)
    lost = w - w[0]
    alone = wheels(telemetry_of(wheel_rate_RWA1=(t, w), wheel_rate_RWA2=(t, 0 * t + 50)), CASSINI)
    assert alone.wheel("RWA1").fit is not None
    # RWA2 speeds up by as much: a torque along neither axis
    shared = wheels(telemetry_of(wheel_rate_RWA1=(t, w), wheel_rate_RWA2=(t, 50 - lost)), CASSINI)
    assert shared.wheel("RWA1").fit is None and shared.doubts.has(SLOWS_WITH_OTHERS)
    # before 2003 RWA4 stands parallel to RWA1: what the one loses the other takes up, and no torque acts
    spare = tuple(
        x.model_copy(update={"axis": CASSINI.wheels[0].axis}) if x.name == "RWA4" else x for x in CASSINI.wheels
    )
    trade = {"wheel_rate_RWA1": (t, w), "wheel_rate_RWA4": (t, 50 - lost)}
    craft = CASSINI.model_copy(update={"wheels": spare})
    assert wheels(telemetry_of(**trade), craft).wheel("RWA1").fit is not None


@pytest.mark.parametrize("shape", ["ramp", "let out", "braked"])
def test_a_motor_that_slows_a_wheel_is_not_a_bearing(shape):
    t = np.arange(0.0, 1200.0, 4.0)
    w = {
        "ramp": 94 - 0.05 * t,
        "let out": 94 * np.exp(-t / 600),
        "braked": coast(t, 94.0, 0.06 / J, 3.5e-5 / J),
    }[shape]
    w = np.clip(w, 0, None) + NOISE * np.random.default_rng(0).standard_normal(len(t))
    result = wheels(telemetry_of(wheel_rate_RWA1=(t, w)), CASSINI)
    assert result.wheel("RWA1").fit is None and result.doubts.has(SLOWS_AS_DRIVEN)


def test_a_narrow_run_down_gives_the_drag_together_where_it_is_named():
    t, w = run_down(7, length=100, before=0.0)
    tlm = telemetry_of(wheel_rate_RWA1=(t, w))
    assert wheels(tlm, CASSINI).wheel("RWA1").fit is None
    result = wheels(tlm, CASSINI, run_down=("RWA1",))
    f = result.wheel("RWA1").fit
    assert not f.separable and result.doubts.has(NOT_SEPARABLE)
    assert (
        abs(f.drag_at_mean_Nm - 0.002 - 3.5e-5 * f.mean_rate_rad_s) < 4 * f.drag_at_mean_sigma_Nm
        and f.drag_at_mean_sigma_Nm < 0.01 * f.drag_at_mean_Nm
    )
    assert f.correlation < -0.99 and "not separable" in str(result)
    assert result.record()["wheels"][0]["run_downs"][0]["found_by"] == "named"


# ---- laws ----------------------------------------------------------------------------------------------------


def parts(result, name="RWA1"):
    f = result.wheel(name).fit
    return np.array(
        [f.coulomb_Nm, f.coulomb_sigma_Nm, f.viscous_Nms, f.viscous_sigma_Nms, f.drag_at_mean_Nm, f.correlation]
    )


def test_law_turning_the_other_way_moving_in_time_and_unsynchronised_wheels_change_nothing():
    t, w = run_down(8)
    plain = wheels(telemetry_of(wheel_rate_RWA1=(t, w)), CASSINI)
    back = wheels(telemetry_of(wheel_rate_RWA1=(t, -w)), CASSINI)
    later = wheels(telemetry_of(wheel_rate_RWA1=(t + 5000.125, w)), CASSINI)
    other = (np.arange(1.3, 1500, 2.7), np.full(556, 30.0))
    beside = wheels(telemetry_of(wheel_rate_RWA1=(t, w), wheel_rate_RWA2=other), CASSINI)
    for result in (back, later, beside):
        assert parts(result) == pytest.approx(parts(plain), rel=1e-6)
    assert back.wheel("RWA1").run_downs[0].from_rad_s == pytest.approx(-plain.wheel("RWA1").run_downs[0].from_rad_s)
    assert later.wheel("RWA1").run_downs[0].start_s == plain.wheel("RWA1").run_downs[0].start_s + 5000.125


def test_law_drag_scales_with_the_spin_inertia_and_is_relative_without_one():
    t, w = run_down(9)
    tlm = telemetry_of(wheel_rate_RWA1=(t, w))
    doubled = tuple(x.model_copy(update={"spin_inertia": 2 * J if x.name == "RWA1" else x.spin_inertia}) for x in CASSINI.wheels)  # fmt: skip
    unknown = tuple(x.model_copy(update={"spin_inertia": None}) for x in CASSINI.wheels)
    plain = parts(wheels(tlm, CASSINI))
    assert parts(wheels(tlm, CASSINI.model_copy(update={"wheels": doubled})))[:5] == pytest.approx(2 * plain[:5])
    result = wheels(tlm, CASSINI.model_copy(update={"wheels": unknown}))
    record = result.record()["wheels"][0]
    assert record["coulomb_Nm"] is None and record["sigma_viscous_Nms"] is None and record["drag_at_mean_Nm"] is None
    assert record["coulomb_per_spin_inertia_rad_s2"] == pytest.approx(plain[0] / J)
    assert record["viscous_per_spin_inertia_per_s"] == pytest.approx(plain[2] / J)
    assert "N m" not in str(result) and result.doubts.has(PER_SPIN_INERTIA)


@given(
    st.floats(-200, 200), st.floats(-0.3, 0.3), st.lists(st.floats(0.5, 60), min_size=4, max_size=40), st.floats(1, 100)
)
@settings(max_examples=60, deadline=None)
def test_property_use_of_a_wheel_on_a_straight_line(first, slope, steps, low):
    """Revolutions, dwell and crossings against their closed forms, whatever the sampling."""
    from asflown.estimate.wheels.use import wheel_use

    assume(abs(slope) > 1e-6 or abs(abs(first) - low) > 1e-6)  # along the limit itself either answer is right
    t = np.concatenate([[0.0], np.cumsum(steps)])
    w = first + slope * t
    c = telemetry_of(wheel_rate_RWA1=(t, w)).channel("wheel_rate_RWA1")
    use = wheel_use(c, t, low)
    if use.gaps_s > 0:
        assert use.seen_s + use.gaps_s == pytest.approx(t[-1])
        return
    fine = np.linspace(0, t[-1], 200_001)
    along = first + slope * fine
    assert use.revolutions == pytest.approx(np.trapezoid(np.abs(along), fine) / (2 * np.pi), rel=1e-4, abs=1e-6)
    assert use.low_speed_dwell_s == pytest.approx(np.mean(np.abs(along) < low) * t[-1], abs=1e-3 * t[-1] + 1e-9)
    assert use.zero_crossings in ({1} if w[0] * w[-1] < -1e-6 else {0, 1})
    assert use.largest_rate_rad_s == pytest.approx(np.abs(w).max())


def test_a_wheel_near_rest_does_not_cross_zero_by_noise():
    t = np.arange(0.0, 2000, 4.0)
    w = 0.01 * np.cos(t / 300) + NOISE * np.random.default_rng(3).standard_normal(len(t))
    assert wheels(telemetry_of(wheel_rate_RWA1=(t, w)), CASSINI).wheel("RWA1").use.zero_crossings == 0
    w = 2 * np.cos(t / 300) + NOISE * np.random.default_rng(3).standard_normal(len(t))
    use = wheels(telemetry_of(wheel_rate_RWA1=(t, w)), CASSINI).wheel("RWA1").use
    assert use.zero_crossings == 2
    assert use.crossing_times_s == pytest.approx(300 * np.pi * np.array([0.5, 1.5]), abs=3)
    assert use.low_speed_dwell_s == pytest.approx(t[-1])


@pytest.mark.parametrize("kind", ["opposing", "on the wheel", "size"])
def test_estimates_of_the_flight_software_in_three_conventions(kind):
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 3000, 4.0)
    w = 60 * np.cos(t / 500)
    drag = 0.002 * np.tanh(w / 0.02) + 3.5e-5 * w + 2e-4 * rng.standard_normal(len(t))
    drag = {"opposing": drag, "on the wheel": -drag, "size": drag * np.sign(w)}[kind]
    result = wheels(telemetry_of(wheel_rate_RWA1=(t, w), wheel_drag_torque_RWA1=(t + 0.5, drag)), CASSINI)
    f = result.wheel("RWA1").fit
    assert abs(f.coulomb_Nm - 0.002) < 4 * f.coulomb_sigma_Nm and abs(f.viscous_Nms - 3.5e-5) < 4 * f.viscous_sigma_Nms
    assert result.wheel("RWA1").spikes == ()
    found = result.doubts.of(ON_THE_WHEEL, MAGNITUDE)
    assert [d.about["channel"] for d in found] == ([] if kind == "opposing" else ["wheel_drag_torque_RWA1"])


# ---- bad input -------------------------------------------------------------------------------------------------


def test_bad_input():
    t = np.arange(0.0, 100.0, 4.0)
    with pytest.raises(BadInput, match=r"no wheel rates(.|\n)*body_rate_x"):
        wheels(telemetry_of(body_rate_x=(t, 0 * t)), CASSINI)
    with pytest.raises(BadInput, match="has no wheel 'W9'"):
        wheels(telemetry_of(wheel_rate_W9=(t, t)), CASSINI)
    with pytest.raises(BadInput, match="not positive"):
        wheels(telemetry_of(wheel_rate_RWA1=(t, t)), CASSINI, low_speed_rad_s=0.0)
    with pytest.raises(BadInput, match="no rate of wheel 'RWA2'"):
        wheels(telemetry_of(wheel_rate_RWA1=(t, t)), CASSINI, run_down=("RWA2",))
    with pytest.raises(BadInput, match="does not slow down"):
        wheels(telemetry_of(wheel_rate_RWA1=(t, 10 + t)), CASSINI, run_down=("RWA1",))


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_few_samples_are_no_error(count):
    t = 4.0 * np.arange(count)
    c = telemetry_of(wheel_rate_RWA1=(t, 5 + 0 * t), wheel_drag_torque_RWA1=(t, 0.002 + 0 * t))
    result = wheels(c, CASSINI)
    assert result.wheel("RWA1").fit is None and result.record()["wheels"][0]["zero_crossings"] == 0
    none = replace(c.channel("wheel_rate_RWA1"), valid=np.zeros(count, bool))
    wheels(replace(c, channels={"wheel_rate_RWA1": none}), CASSINI)


# ---- what is kept -------------------------------------------------------------------------------------------------


def test_entry_for_the_store():
    flight, result = studied(seed=1)
    entry = wheel_entry(result, flight.telemetry, flight.craft, "run-down-2015-272", guesses=True)
    assert (entry.kind, entry.craft, entry.date) == ("wheels", "cassini", "2015-09-29T00:00:00")
    stems = ("coulomb_drag", "viscous_drag", "drag_spikes", "low_speed_dwell", "zero_crossings", "revolutions")
    assert {v.figure for v in entry.values} == {f"{s}_{w}" for s in stems for w in flight.wheels}
    value = entry.value("coulomb_drag_RWA1", "telemetry")
    f = result.wheel("RWA1").fit
    assert (value.value, value.sigma, value.unit) == (f.coulomb_Nm, f.coulomb_sigma_Nm, "N m")
    assert entry.value("drag_spikes_RWA4", "telemetry").value == 1 and entry.doubts == result.doubts
    assert entry.provenance == result.provenance
    quiet = flown("quiet")
    entry = wheel_entry(wheels(quiet.telemetry, quiet.craft), quiet.telemetry, quiet.craft, "q")
    assert entry.value("coulomb_drag_RWA1", "telemetry").value is None
    assert entry.value("drag_spikes_RWA1", "telemetry").value is None
    with pytest.raises(BadInput, match="no epoch"):
        wheel_entry(result, replace(flight.telemetry, dated=False), flight.craft, "x")


KEYS = {"name", "coulomb_Nm", "sigma_coulomb_Nm", "viscous_Nms", "sigma_viscous_Nms", "correlation", "drag_at_mean_Nm",
        "sigma_drag_at_mean_Nm", "mean_rate_rad_s", "basis", "run_downs", "spikes", "low_speed_dwell_s", "zero_crossings",
        "revolutions", "largest_rate_rad_s"}  # fmt: skip


def test_the_verb(tmp_path):
    flight, result = studied(seed=1)
    path = saved(flight.telemetry, tmp_path)
    done = run("wheels", path, "--json", "--plot", tmp_path / "w.svg")
    assert done.code == 0 and done.err == f"wrote {tmp_path / 'w.svg'}\n"
    assert (tmp_path / "w.svg").read_text().startswith("<?xml")
    record = done.record
    assert (record["command"], record["craft"], record["epoch"]) == ("wheels", "cassini", "2015-09-29T00:00:00 UTC")
    assert all(isinstance(d, str) for d in record["doubts"]) and len(record["provenance"]["inputs"][0]["sha256"]) == 64
    assert [w["name"] for w in record["wheels"]] == list(flight.wheels)
    for told, wheel in zip(record["wheels"], result.wheels, strict=True):
        assert set(told) >= KEYS and told["basis"] == wheel.fit.basis
        assert told["coulomb_Nm"] == pytest.approx(wheel.fit.coulomb_Nm, rel=1e-6)
    assert set(record["wheels"][0]["run_downs"][0]) >= {"start_s", "stop_s", "from_rad_s", "to_rad_s"}
    assert set(record["wheels"][2]["spikes"][0]) >= {"time_s", "drag_Nm", "duration_s"}
    text = run("wheels", path, "--start", "200", "--stop", "300", "--run-down", "RWA1, RWA2", "--low-speed", "900 rpm")
    assert text.code == 0 and text.out.count("200 to 300") == 2 and "below 900 rpm [s]" in text.out
    assert "not separable" in text.out and "DOUBT" in text.out


def test_the_verb_refuses(tmp_path):
    flight, _ = studied(seed=1)
    path = saved(flight.telemetry, tmp_path)
    for words in (["--low-speed", "300"], ["--low-speed", "300 s"], ["--low-speed", "-3 rpm"], ["--run-down", "RWA9"],
                  ["--run-down", "RWA1", "--start", "2600"], ["--plot", tmp_path / "w.txt"], ["--craft", "iss"]):  # fmt: skip
        complaint("wheels", path, *words)
    assert not (tmp_path / "w.txt").exists()


# ---- real recordings ---------------------------------------------------------------------------------------------


def test_inspiresat1_drag_is_not_known_but_its_wheels_dwell():
    result = wheels(inspiresat1(), load_craft("inspiresat1"))
    assert all(w.fit is None for w in result.wheels)
    assert [w.use.zero_crossings for w in result.wheels] == [1, 0, 1]
    assert [w.use.low_speed_dwell_s for w in result.wheels] == pytest.approx([475, 0, 475])


def test_space_station_has_no_wheels():
    with pytest.raises(BadInput, match="no wheel rates"):
        wheels(iss(), load_craft("iss"))


@pytest.mark.parametrize("name", ["torque1", "cover", "slew", "bias", "bias_fsds"])
def test_flights_of_another_simulator_show_no_run_down(name):
    result = wheels(load_telemetry(flight_data(f"simulated/{name}.csv.gz")), CASSINI)
    assert all(w.fit is None and not w.run_downs for w in result.wheels)
    assert pytest.approx(300 * np.pi / 30) == LOW_SPEED
