"""The inertia tensor from slews: laws, recovery from simulated flights, traps, and real recordings."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asflown.craft.load import load_craft
from asflown.dynamics.environment import gravity_gradient
from asflown.dynamics.rigid_body import elements_of
from asflown.estimate.inertia import consistent, from_torque, gather, prior, record, swings, tensor
from asflown.estimate.inertia.slews import find_slews
from asflown.estimate.inertia.tensor import METHODS, inertia
from asflown.kit.errors import BadInput
from asflown.kit.rotations import quaternion
from asflown.kit.timeline import NS
from asflown.telemetry.channels import AXES
from asflown.telemetry.load import load_telemetry
from asflown.trends.entries.inertia import inertia_entry
from cli.program import complaint, run
from conftest import flight_data
from flights import CASSINI, changed, conjugated, flown, inspiresat1, iss, saved, telemetry_of, with_channels, without


def flight(seed=1, noise="nominal"):
    return flown("slews", seed=seed, noise=noise)


@cache
def fitted(seed=1, method="consistent"):
    return inertia(flight(seed).telemetry, CASSINI, method=method)


def pulls(result, truth) -> np.ndarray:
    return elements_of(result.inertia_kgm2 - truth) / elements_of(result.inertia_sigma_random_kgm2)


# ---- laws ---------------------------------------------------------------------------------------------------


def test_law_slews_are_found_with_their_axis_angle_and_rate():
    tlm = flight().telemetry
    w = np.stack([tlm.channel(f"body_rate_{a}").values for a in AXES], axis=1)
    slews = find_slews(tlm.seconds(tlm.channel("body_rate_x").tai_ns), w, 2e-6)
    assert [s.about for s in slews] == ["x", "y", "z", "skew"]
    for s, axis, sign in zip(slews, ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]), (1, -1, 1, -1), strict=True):
        assert np.array(s.axis) == pytest.approx(sign * np.array(axis) / np.linalg.norm(axis), abs=0.01)
        assert s.angle_rad == pytest.approx(np.radians(25), rel=0.01) and s.rate_rad_s == pytest.approx(2e-3, rel=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_law_without_noise_every_method_finds_the_tensor(method):
    still = flight(noise="none")
    result = inertia(still.telemetry, CASSINI, method=method)
    # what is left to the paper's methods is the first reading, taken when the loop has not quite settled
    assert elements_of(result.inertia_kgm2 - still.inertia_kgm2) == pytest.approx(np.zeros(6), abs=0.5)


def test_law_the_scale_of_the_wheels_is_the_scale_of_the_tensor():
    """Degenerate: 1 % more spin inertia is 1 % more tensor, and no sigma may be smaller than the prior's."""
    wheels = tuple(w.model_copy(update={"spin_inertia": 1.01 * w.spin_inertia}) for w in CASSINI.wheels)
    other = inertia(flight().telemetry, CASSINI.model_copy(update={"wheels": wheels}), method="gls")
    one = fitted(1, "gls")
    assert other.inertia_kgm2 == pytest.approx(1.01 * one.inertia_kgm2, rel=1e-4, abs=0.05)
    for result in (one, fitted()):
        assert np.all(result.inertia_sigma_systematic_kgm2 >= 0.0024 * np.abs(result.inertia_kgm2) * (1 - 1e-3))


def test_law_both_estimates_of_every_product_are_given_axis_by_axis():
    result = fitted(1, "axis")
    assert set(result.products) == {"Ixy", "Ixz", "Iyz"}
    for (i, j), name in (((0, 1), "Ixy"), ((0, 2), "Ixz"), ((1, 2), "Iyz")):
        assert np.mean(result.products[name]) == pytest.approx(result.inertia_kgm2[i, j])
    assert result.doubts.has(tensor.SKEW_LEFT_OUT)


def test_law_momentum_balance_with_gravity_is_exact_where_the_torque_is():
    """A craft that swings in its orbit: the torque that Euler's equation and gravity ask for gives the tensor back."""
    I_B = np.array([[9e7, 3e5, -4e5], [3e5, 6e7, 2e5], [-4e5, 2e5, 1.2e8]])
    t = np.arange(0.0, 6 * 5600, 2.0)
    n = 2 * np.pi / 5600
    swing = np.stack([0.06 * np.sin(2 * n * t), 0.05 * np.sin(3.3 * n * t + 1), 0.07 * np.sin(1.7 * n * t + 2)], axis=1)
    R = Rotation.from_rotvec(np.outer(-n * t, [0, 1, 0])) * Rotation.from_rotvec(swing)
    step = (R[:-1].inv() * R[1:]).as_rotvec() / 2.0
    w = np.empty_like(swing)
    w[1:-1] = 0.5 * (step[1:] + step[:-1])
    w[0], w[-1] = step[0], step[-1]
    r_N = 6.8e6 * np.stack([np.cos(n * t), 0 * t, np.sin(n * t)], axis=1)
    H = R.apply(w @ I_B)
    constant = np.array([0.3, -0.2, 0.1])
    u = R.inv().apply(np.gradient(H, 2.0, axis=0)) - gravity_gradient(I_B, R.inv().apply(r_N)) - constant
    q = quaternion(R)
    columns = {f"quaternion_{m}": q[:, k] for k, m in enumerate("wxyz")}
    for k, a in enumerate(AXES):
        columns |= {f"body_rate_{a}": w[:, k], f"control_torque_{a}": u[:, k], f"orbit_position_{a}": r_N[:, k]}
    made = telemetry_of(592_000_000 * NS, **{k: (t, v) for k, v in columns.items()})
    result = inertia(made, load_craft("iss"))
    assert result.method == "momentum balance" and not result.excitation.not_identifiable
    assert result.inertia_kgm2 == pytest.approx(I_B, rel=2e-3, abs=1e5)
    assert result.external_torque_Nm == pytest.approx(constant, abs=0.02)


# ---- recovery -----------------------------------------------------------------------------------------------


def test_recovery_of_tensor_and_torque():
    """Two flights; the campaign over two hundred is benchmarks/inertia_accuracy.py."""
    found = np.array([pulls(fitted(seed), flight(seed).inertia_kgm2) for seed in range(1, 3)])
    assert np.abs(found).max() < 4 and 0.6 < found.std() < 1.5
    for seed in range(1, 3):
        r = fitted(seed)
        assert elements_of(r.inertia_sigma_random_kgm2) == pytest.approx(
            [0.2, 0.11, 0.08, 0.165, 0.07, 0.1], rel=0.25
        )  # kg m2
        assert np.all(np.abs(r.external_torque_Nm) < 4.5 * r.external_torque_sigma_Nm)
        assert np.all(r.external_torque_sigma_Nm < 0.4e-6)


@pytest.mark.slow
def test_recovery_pulls_are_unit_normal():
    found = np.array([pulls(inertia(flight(s).telemetry, CASSINI), flight().inertia_kgm2) for s in range(40)])
    assert np.all(np.abs(found.mean(axis=0)) < 0.5) and found.std() == pytest.approx(1.0, abs=0.15)


def test_recovery_of_propellant_that_swings():
    """Left out, it moves Ixx and Iyy by 2 to 2.5 sigma; how much of it there is, is found besides."""
    sloshing = flown("slews", seed=2, slosh=True, craft_mass="3170 kg")
    result = inertia(sloshing.telemetry, CASSINI)
    assert np.abs(pulls(result, sloshing.inertia_kgm2)).max() < 3.5
    for settings, share in ((result.settings, 1.0), (fitted(2).settings, 0.0)):
        found, sigma = settings["swings"]["fuel tank"]
        assert abs(found - share) < 4 * sigma < 0.5
    assert result.doubts.of(swings.SWINGS).about(name="fuel tank")


def test_recovery_of_propellant_that_no_craft_file_describes():
    """Left out, it moves Iyy by 2.8 sigma in the mean, and a step of momentum must not be invented for it."""
    sloshing = flown("slews", seed=2, slosh=True, craft_mass="3170 kg")
    result = inertia(sloshing.telemetry, CASSINI.model_copy(update={"slosh": (), "flexible_modes": ()}))
    assert np.abs(pulls(result, sloshing.inertia_kgm2)).max() < 3.5
    assert not result.doubts.has(record.MOMENTUM_STEPS)
    said = result.doubts.of(swings.SWING_FOUND)[0].numbers
    assert said["frequency_Hz"] == pytest.approx(0.012, rel=0.1) and said["percent"] == pytest.approx(0.45, rel=0.5)
    assert not fitted(2).doubts.has(swings.SWING_FOUND)


def test_recovery_of_an_external_torque_in_body_axes():
    torque = {"shape": "constant", "torque": "-0.53e-6 -2.11e-6 1.83e-6 N m"}
    result = inertia(flown("slews", seed=7, torques=[torque]).telemetry, CASSINI)
    assert np.all(
        np.abs(result.external_torque_Nm - [-0.53e-6, -2.11e-6, 1.83e-6]) < 4 * result.external_torque_sigma_Nm
    )
    assert result.external_torque_Nm[1] / result.external_torque_sigma_Nm[1] < -4


def test_recovery_on_another_simulator():
    for name in ("slew", "slew_ext"):
        truth = json.loads(flight_data(f"simulated/{name}.json").read_text())
        tlm = load_telemetry(flight_data(f"simulated/{name}.csv.gz"), craft=CASSINI)
        result = inertia(tlm, CASSINI)
        assert np.all(np.abs(pulls(result, np.array(truth["inertia_kg_m2"]))) < 4)
        assert np.all(
            np.abs(result.external_torque_Nm - truth["external_torque_body_Nm"]) < 4 * result.external_torque_sigma_Nm
        )
        for method in ("axis", "all", "gls"):
            other = inertia(tlm, CASSINI, method=method)
            assert np.all(
                np.abs(elements_of(other.inertia_kgm2 - truth["inertia_kg_m2"]))
                < 4 * elements_of(other.inertia_sigma_kgm2)
            )


# ---- traps --------------------------------------------------------------------------------------------------


def test_trap_signs_of_the_quaternion_mean_nothing():
    sign = np.random.default_rng(2).choice([-1.0, 1.0], len(flight().telemetry.channel("quaternion_w").values))
    flipped = changed(flight().telemetry, "quaternion", lambda c: replace(c, values=sign * c.values))
    assert inertia(flipped, CASSINI).inertia_kgm2 == pytest.approx(fitted().inertia_kgm2, abs=0.01)


def test_trap_quaternion_the_other_way_round_is_named(tmp_path):
    turned = conjugated(flight().telemetry)
    with pytest.raises(BadInput, match="conjugate"):
        inertia(turned, CASSINI)
    assert "conjugate" in complaint("inertia", saved(turned, tmp_path))


def test_trap_rates_in_degrees_are_named_with_and_without_attitude():
    wrong = changed(flight().telemetry, "body_rate", lambda c: replace(c, values=np.degrees(c.values)))
    with pytest.raises(BadInput, match="deg/s labelled rad/s"):
        inertia(wrong, CASSINI)
    with pytest.raises(BadInput, match="deg/s labelled rad/s"):
        inertia(without(wrong, "quaternion"), CASSINI)


@pytest.mark.parametrize("stem, words", [("wheel_rate", "wheel rates"), ("body_rate", "body rates")])
def test_trap_time_stamps_apart_are_found_said_and_mended(stem, words):
    late = changed(flight().telemetry, stem, lambda c: replace(c, tai_ns=c.tai_ns + 4 * NS))
    result = inertia(late, CASSINI)
    (late,) = result.doubts.of(consistent.STAMPED_APART).about(channels=words, how="late")
    assert late.numbers["apart_s"] == pytest.approx(4.0, abs=0.05)
    assert elements_of(result.inertia_kgm2 - fitted().inertia_kgm2) == pytest.approx(np.zeros(6), abs=0.15)


def test_trap_a_thruster_inside_a_slew_is_left_out_and_said():
    kick = {"shape": "table", "axis": "x", "times": "800 800.5 801.5 802 s", "torques": "0 0.5 0.5 0 N m"}
    kicked = flown("slews", seed=5, torques=[kick])
    untold = inertia(kicked.telemetry, CASSINI)
    assert any(abs(d.numbers["at_s"] - 801) < 10 for d in untold.doubts.of(record.MOMENTUM_STEPS))
    t = np.arange(0, 2401, 8.0)
    fired = telemetry_of(kicked.telemetry.epoch_ns, on_time_Y1=(t, np.where(t > 800, 1.5, 0.0)))
    told = inertia(with_channels(kicked.telemetry, *fired.channels.values()), CASSINI)
    (firing,) = told.doubts.of(gather.THRUSTERS_FIRE)
    assert firing.about["spans"] == "799-812 s" and told.settings["arcs"] == 2
    for result in (untold, told):
        assert np.abs(pulls(result, kicked.inertia_kgm2)).max() < 4.5


def test_trap_a_whiff_of_a_thruster_that_no_channel_tells_of_is_found():
    """0.02 N m s of 15 that move: 2 % of conservation do not see it, and left in it moves Ixx by ten sigmas."""
    kick = {"shape": "table", "axis": "x", "times": "800 800.5 801.5 802 s", "torques": "0 0.02 0.02 0 N m"}
    kicked = flown("slews", seed=5, torques=[kick])
    result = inertia(kicked.telemetry, CASSINI)
    (said,) = result.doubts.of(record.MOMENTUM_STEPS)
    assert abs(said.numbers["at_s"] - 801) <= 6.5 and result.settings["arcs"] == 2
    assert np.abs(pulls(result, kicked.inertia_kgm2)).max() < 4


def test_trap_a_gap_in_a_slew():
    cut = flight().telemetry.epoch_ns + NS * np.array([100, 250])
    gap = changed(flight().telemetry, "wheel_rate", lambda c: c.where((c.tai_ns < cut[0]) | (c.tai_ns > cut[1])))
    result = inertia(gap, CASSINI)
    assert np.abs(pulls(result, flight().inertia_kgm2)).max() < 4
    assert result.inertia_sigma_random_kgm2[0, 0] > fitted().inertia_sigma_random_kgm2[0, 0]


def test_trap_one_axis_two_axes_one_skew_axis():
    tlm, truth = flight().telemetry, flight().inertia_kgm2
    one = inertia(tlm.between(0, 560), CASSINI)
    assert one.excitation.rank == 3 and one.excitation.not_identifiable == ("Iyy", "Iyz", "Izz")
    assert one.inertia_sigma_random_kgm2[1, 1] == pytest.approx(
        0.1 * CASSINI.at(tlm.epoch_ns).inertia_kgm2[1, 1], rel=0.05
    )
    assert abs(one.inertia_kgm2[0, 0] - truth[0, 0]) < 4 * one.inertia_sigma_random_kgm2[0, 0] < 4
    assert one.doubts.has(prior.FROM_CRAFT) and one.doubts.has(prior.RANK_DEFICIENT)
    assert inertia(tlm.between(0, 1130), CASSINI).excitation.rank == 5
    skew = inertia(tlm.between(1690, 2400), CASSINI, method="all")
    assert skew.excitation.rank == 3
    axis = np.ones(3) / np.sqrt(3)
    assert axis @ skew.inertia_kgm2 @ axis == pytest.approx(axis @ truth @ axis, rel=0.01)


def test_trap_wheels_taken_for_each_other_between_slews():
    tlm = flight().telemetry
    one, two = tlm.channel("wheel_rate_RWA1"), tlm.channel("wheel_rate_RWA2")
    after = one.tai_ns > tlm.epoch_ns + 1150 * NS
    first = replace(one, values=np.where(after, two.values, one.values))
    second = replace(two, values=np.where(after, one.values, two.values))
    with pytest.raises(BadInput, match="RWA1 and RWA2 were mistaken for each other from 1"):
        inertia(with_channels(tlm, first, second), CASSINI)


def wheel_described(times=1.0, turned_deg=0.0, which=1):
    """Cassini with one wheel's spin inertia and axis wrong."""
    wheels = list(CASSINI.wheels)
    k = [w.name for w in wheels].index(f"RWA{which}")
    axis = Rotation.from_euler("y", turned_deg, degrees=True).apply(wheels[k].axis)
    changes = {"spin_inertia": times * wheels[k].spin_inertia, "axis": tuple(axis)}
    wheels[k] = wheels[k].model_copy(update=changes)
    return CASSINI.model_copy(update={"wheels": tuple(wheels)})


@pytest.mark.parametrize(
    "order, senses, craft, words",
    [
        ((1, 2, 4), (-1, -1, 1), CASSINI, "wheels RWA1, RWA2 turned the other way"),
        ((1, 2, 4), (-1, -1, -1), CASSINI, "all of them turned the other way"),
        ((2, 4, 1), (1, 1, 1), CASSINI, "the readings of RWA1, RWA2, RWA4 were those of RWA2, RWA4, RWA1"),
        ((1, 2, 4), (1, 1, 1), wheel_described(1.3, which=2), "spin inertia of wheel RWA2 were 0.769"),
        ((1, 2, 4), (1, 1, 1), wheel_described(turned_deg=20), "axis of wheel RWA1 were turned by 12 deg"),
    ],
)
def test_trap_misread_wheels_are_named(order, senses, craft, words):
    tlm = flight().telemetry
    read = {k: tlm.channel(f"wheel_rate_RWA{k}") for k in (1, 2, 4)}
    wrong = [replace(read[k], values=s * read[j].values) for k, j, s in zip((1, 2, 4), order, senses, strict=True)]
    with pytest.raises(BadInput, match=words):
        inertia(with_channels(tlm, *wrong), craft)


def test_trap_a_wheel_a_little_misdescribed_is_suspect():
    """Momentum is conserved to 2 % all the same, and the tensor is off by many sigmas."""
    said = inertia(flight().telemetry, wheel_described(1.01, which=2)).doubts.of(tensor.WHEEL_MISREAD)
    assert said and "wheel RWA2 were 0.98" in said[0].about["words"] and said[0].numbers["sigmas"] > 4
    assert not fitted().doubts.has(tensor.WHEEL_MISREAD)


@pytest.mark.slow
def test_trap_a_wheel_replaced_on_its_date():
    """The set of wheels changes with the craft's dates: momentum begins anew, both spans are used."""
    tlm = flight().telemetry
    switch = tlm.epoch_ns + 1150 * NS
    c = tlm.channel("wheel_rate_RWA4")
    old = replace(c.where(c.tai_ns < switch), name="wheel_rate_RWA3")
    both = with_channels(without(tlm, c.name), old, c.where(c.tai_ns >= switch))
    dates = {"RWA3": {"valid_to": switch}, "RWA4": {"valid_from": switch}}
    wheels = tuple(w.model_copy(update=dates.get(w.name, {})) for w in CASSINI.wheels)
    result = inertia(both, CASSINI.model_copy(update={"wheels": wheels}))
    assert result.excitation.rank == 6 and result.settings["arcs"] == 2
    assert np.abs(pulls(result, flight().inertia_kgm2)).max() < 4
    silent = inertia(both, CASSINI)  # with the craft's own dates RWA4 is silent for half the record
    assert silent.doubts.of(gather.WHEEL_SILENT).about(wheels="RWA4") and silent.excitation.rank == 5


def test_trap_nothing_to_learn_from_a_hold():
    with pytest.raises(BadInput, match="hardly turns"):
        inertia(flown("quiet", duration="400 s").telemetry, CASSINI)
    bare = without(flight().telemetry, "quaternion", "body_rate")
    with pytest.raises(BadInput, match="how the body turned is not known"):
        inertia(bare, CASSINI)
    with pytest.raises(BadInput, match="inertia method 'best' is not known"):
        inertia(flight().telemetry, CASSINI, method="best")


# ---- the program, the store, real recordings ------------------------------------------------------------------


def test_golden_keys_of_the_record(tmp_path):
    file = saved(flight().telemetry, tmp_path)
    answer = run("inertia", file, "--json", "--plot", tmp_path / "slews.png")
    assert answer.code == 0, answer.err
    record = json.loads(answer.out)
    assert {"command", "method", "inertia_kgm2", "sigma_random_kgm2", "sigma_systematic_kgm2", "rank", "singular_values",
            "external_torque_Nm", "external_torque_sigma_Nm", "residual_rms_Nms", "slews", "doubts", "provenance"} <= set(record)  # fmt: skip
    assert record["method"] == "consistent" and record["rank"] == 6 and len(record["slews"]) == 4
    assert np.shape(record["inertia_kgm2"]) == (3, 3) and (tmp_path / "slews.png").stat().st_size > 20_000
    assert "inertia method 'best' is not known" in complaint("inertia", file, "--method", "best")
    assert "scale error" in complaint("inertia", file, "--wheel-error", "3")


def test_law_the_entry_of_the_store_holds_all_elements_with_total_sigma():
    entry = inertia_entry(fitted(), flight().telemetry, CASSINI)
    assert entry.kind == "inertia" and entry.event == "inertia-2005-02-09"
    kept = entry.value("Iyy", "telemetry")
    assert (kept.value, kept.sigma) == pytest.approx((fitted().inertia_kgm2[1, 1], fitted().inertia_sigma_kgm2[1, 1]))
    assert entry.value("external_torque_y", "telemetry").unit == "N m"


def test_inspiresat1_by_kicks_of_its_wheels():
    result = inertia(inspiresat1(), load_craft("inspiresat1"))
    assert result.relative and result.record()["inertia_kgm2"] is None
    assert result.excitation.not_identifiable == ("Izz",)
    x, y = result.inertia_kgm2[0, 0], result.inertia_kgm2[1, 1]
    assert 3850 < x < 4700 and 5000 < y < 6200  # ratios to a wheel's spin inertia
    assert np.all(np.diag(result.inertia_sigma_random_kgm2)[:2] < [250, 300])


def test_iss_says_what_it_cannot_tell():
    result = inertia(iss(), load_craft("iss"))
    assert {"Ixx", "Iyy", "Izz"} <= set(result.excitation.not_identifiable)
    assert result.doubts.has(from_torque.NOT_BY_DATA)
