"""An orbiting craft: its surroundings, what it is commanded, four wheels, rods and instruments, each against physics written out here."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import leo
from asflown.craft.load import load_craft
from asflown.craft.model import tensor
from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly
from asflown.sim.flight.plant import CURVES, SOURCES, World, outside_torques
from asflown.sim.flight.write import write_flight
from asflown.sim.scenario import load_scenario

MU = 3.986004418e14
I_B = np.array([[12.0, 0.3, -0.2], [0.3, 13.0, 0.1], [-0.2, 0.1, 9.0]])


def flown(name="leo-nadir", duration="300 s", **changes):
    return fly(name, changes={"duration": duration, "settle": "20 s"} | changes)


@pytest.fixture(scope="module")
def run_downs():
    return fly("leo-run-downs")


ROUGH = {"duration": "900 s", "flexible": True, "controller": {"delay_cycles": 1}}


@pytest.mark.parametrize("name", ["leo-nadir", "leo-unloading", "leo-slews", "leo-run-downs"])
@pytest.mark.parametrize("changes", [{}, ROUGH])
def test_law_momentum_in_space_grows_by_the_impulse_of_every_source(name, changes):
    truth = fly(name, changes=changes).truth
    gained = truth.momentum_inertial_Nms - truth.momentum_inertial_Nms[0]
    impulse = sum(truth.impulse_by_source_Nms.values())
    assert np.abs(gained - impulse).max() < 1e-9 * np.linalg.norm(truth.momentum_inertial_Nms[0])
    assert np.abs(impulse).max() > 1e-3


@pytest.mark.parametrize("source", ["gravity_gradient", "sunlight", "dipole", "drag"])
def test_law_the_told_torque_of_a_source_is_the_slope_of_its_impulse(source):
    """The columns of truth.csv, turned into space and summed by Simpson's rule: the integrator kept its own account."""
    truth = flown("leo-slews").truth
    told = Rotation.from_quat(truth.attitude, scalar_first=True).apply(truth.torque_by_source_Nm[source])
    h = truth.time_s[1] - truth.time_s[0]
    summed = h / 3 * (told[0] + told[-1] + 4 * told[1:-1:2].sum(axis=0) + 2 * told[2:-1:2].sum(axis=0))
    kept = truth.impulse_by_source_Nms[source][-1]
    # the attitude has a corner of 1e-5 rad/s2 at every order of the controller, and the Sun's share one in the penumbra
    assert np.abs(summed - kept).max() < 1e-8 * np.abs(kept).max()


def at_once(q=(1.0, 0, 0, 0), rods=(0.0, 0, 0), inertia=I_B, **world):
    """Torques of all sources at one instant in constant surroundings, by name."""
    columns = world.pop("columns", np.zeros(CURVES))
    curves = np.zeros((4, 1, CURVES))
    curves[3, 0] = columns
    out = np.empty((len(SOURCES), 3))
    outside_torques(0.0, np.array(q, float), inertia, np.array(rods, float), World(curves=curves, **world), out)
    return dict(zip(SOURCES, out, strict=True))


def surroundings(place=(7e6, 0, 0), wind=(0, 7.5e3, 0), field=(0, 0, 3e-5), sun=(0, 1, 0), lit=1.0, air=1e-12):
    return np.concatenate([place, wind, wind, field, sun, [lit, air]]).astype(float)


def test_law_gravity_gradient_is_that_of_a_cloud_of_point_masses():
    rng = np.random.default_rng(3)
    masses, places = rng.uniform(1, 3, 40), rng.normal(0, 0.6, (40, 3))
    places -= np.average(places, axis=0, weights=masses)
    inertia = np.einsum(
        "n,nij->ij", masses, np.sum(places**2, axis=1)[:, None, None] * np.eye(3) - places[:, :, None] * places[:, None]
    )
    attitude, r = Rotation.from_rotvec([0.4, -0.9, 1.3]), np.array([2.1e6, -5.5e6, 3.4e6])
    across = attitude.inv().apply(r)
    pull = -MU * (across + places) / np.linalg.norm(across + places, axis=1, keepdims=True) ** 3
    pull += (
        MU * across / np.linalg.norm(across) ** 3
    )  # the same for all: no torque, but a hundred million times as large
    torque = np.sum(np.cross(places, masses[:, None] * pull), axis=0)
    got = at_once(attitude.as_quat(scalar_first=True), inertia=inertia, mu=MU, columns=surroundings(r))[
        "gravity_gradient"
    ]
    # quadrupole alone: the next term is a metre over seven thousand kilometres
    assert got == pytest.approx(torque, abs=3e-6 * np.linalg.norm(torque))


def test_law_levers_dipoles_and_rods_have_the_signs_of_their_definition():
    q = Rotation.from_rotvec([0.2, 0.5, -0.7])
    columns = surroundings(lit=0.4, air=2e-12)
    got = at_once(
        q.as_quat(scalar_first=True), rods=(1.0, 2, -3), columns=columns, dipole=np.array([0.1, 0.2, 0.3]),
        sunlight_lever=np.array([1e-6, 2e-6, 3e-6]), drag_lever=np.array([4e-6, 5e-6, -1e-6]) / 1e-12,
    )  # fmt: skip
    s, v, B = (q.inv().apply(x) for x in ([0.0, 1, 0], [0.0, 1, 0], [0, 0, 3e-5]))
    assert got["sunlight"] == pytest.approx(0.4 * np.cross([1e-6, 2e-6, 3e-6], s), abs=1e-18)
    assert got["drag"] == pytest.approx(2 * np.cross([4e-6, 5e-6, -1e-6], -v), abs=1e-18)
    assert got["dipole"] == pytest.approx(np.cross([0.1, 0.2, 0.3], B), abs=1e-18)
    assert got["rods"] == pytest.approx(np.cross([1.0, 2, -3], B), abs=1e-18)


def test_published_torques_of_another_simulation_come_out_of_the_same_place_and_attitude():
    """../shared/data/leo, whose truth states what acts: agreement to the noise of its attitude and field, the penumbra aside."""
    told, rows = leo.said("nadir-eclipse")["truth"], leo.rows("nadir-eclipse")[::40]
    acting, t = told["acting"], leo.seconds()[::40]
    r, v, B = (np.array([[float(row[f"{n}_{a}"]) for a in "XYZ"] for row in rows]) for n in ("POS", "VEL", "MAG"))
    q = np.array([[float(row[f"ADCS_Q{k}"]) for k in (4, 1, 2, 3)] for row in rows])
    field = Rotation.from_quat(q, scalar_first=True).apply(1e-9 * B)
    dark, swing = told["eclipse_s"], 1 + acting["density_swing"] * np.cos(np.sqrt(MU / 6871e3**3) * t - 0.6)
    want = np.array(told["torque_Nm"])[np.searchsorted(told["t_s"], t)]
    for k in np.flatnonzero(np.all(np.abs(t[:, None] - dark) > 20, axis=1)):
        lit = not dark[0] < t[k] < dark[1]
        columns = surroundings(1e3 * r[k], 1e3 * v[k], field[k], [0.25, 0.94, 0.22], lit, swing[k])
        got = at_once(
            q[k] / np.linalg.norm(q[k]), inertia=np.array(told["inertia_kgm2"]), columns=columns, mu=MU,
            dipole=np.array(acting["dipole_Am2"]), sunlight_lever=np.array(acting["sunlight_lever_Nm"]),
            drag_lever=np.array(acting["drag_lever_Nm"]),
        )  # fmt: skip
        assert sum(got.values()) == pytest.approx(want[k], abs=1e-7)  # of 3e-5 N m; 60 nT are 4e-8


def test_law_a_black_sphere_of_facets_is_pushed_straight_back():
    """Many facets evenly spread: the force is pressure times the disc, and a sphere off the centre has a lever."""
    n = 4000
    k = np.arange(n) + 0.5
    z, turn = 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    normals = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])
    centre, area = np.array([0.3, 0.1, -0.2]), 4 * np.pi / n
    s, v = np.array([0.0, 1, 0]), np.array([0, 7.5e3, 0])
    columns = surroundings(sun=s, wind=v)
    black = np.column_stack([np.full(n, 4.5e-6 * area), normals, centre + normals, np.zeros((n, 2))])
    air = np.column_stack([np.full(n, 2.2 * area), normals, centre + normals])
    got = at_once(columns=columns, sunlit_facets=black, air_facets=air)
    assert got["sunlight"] == pytest.approx(np.cross(centre, -4.5e-6 * np.pi * s), abs=1e-9)
    assert got["drag"] == pytest.approx(np.cross(centre, -0.5 * 1e-12 * 7.5e3**2 * 2.2 * np.pi * s), rel=2e-3, abs=1e-9)


def test_law_a_mirror_that_faces_the_sun_is_pushed_twice_as_hard_as_a_black_one():
    mirror, black, white = ([1e-5, 0, 1, 0, 0.5, 0, 0, *shares] for shares in ((1, 0), (0, 0), (0, 1)))
    m, b, w = (
        at_once(columns=surroundings(), sunlit_facets=np.array([f], float))["sunlight"][2]
        for f in (mirror, black, white)
    )
    assert [m / b, w / b] == pytest.approx([2, 5 / 3])


def test_law_the_shadow_begins_and_ends_where_straight_lines_graze_the_earth():
    """Rays from the craft to points of the Sun's limb, against the ellipsoid of the Earth: none, some or all are cut."""
    flight = fly("leo-nadir", noise="none")
    truth, (passage,) = flight.truth, flight.truth.shadows
    r, s = truth.along.position_N, truth.along.sun_N[0]
    across = np.cross(s, [0, 0, 1.0]) / np.linalg.norm(np.cross(s, [0, 0, 1.0]))
    around = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    limb = s + 6.957e8 / 1.495978707e11 * (
        np.outer(np.cos(around), across) + np.outer(np.sin(around), np.cross(s, across))
    )
    squash = 1 / np.array([6378137.0, 6378137.0, 6356752.3])
    origin, cut = r * squash, np.zeros((len(r), len(limb)), bool)
    for k, ray in enumerate(limb * squash):
        ahead = origin @ ray
        cut[:, k] = (ahead < 0) & (ahead**2 > ray @ ray * (np.sum(origin**2, axis=1) - 1))
    for inside, key in ((cut.any(axis=1), "penumbra"), (cut.all(axis=1), "umbra")):
        assert passage[f"{key}_begins_s"] == pytest.approx(truth.time_s[inside][0], abs=0.5)  # two knots
        assert passage[f"{key}_ends_s"] == pytest.approx(truth.time_s[inside][-1], abs=0.5)
    assert 8 < passage["umbra_begins_s"] - passage["penumbra_begins_s"] < 12
    dark = (truth.time_s > passage["umbra_begins_s"]) & (truth.time_s < passage["umbra_ends_s"])
    assert np.all(truth.torque_by_source_Nm["sunlight"][dark] == 0)
    sensor = flight.telemetry.channel("sun_direction_x")
    seconds = flight.telemetry.seconds(sensor.tai_ns)
    assert np.all(sensor.values[(seconds > 945) & (seconds < 2995)] == 0) and np.all(sensor.values[seconds < 930] != 0)


def test_law_a_nadir_hold_turns_once_an_orbit_and_looks_down():
    truth = flown(noise="none").truth
    n = np.sqrt(MU / 6878e3**3)
    assert truth.body_rate_rad_s[-1] == pytest.approx([0, -n, 0], abs=5e-6)  # eccentricity and J2
    down = Rotation.from_quat(truth.attitude, scalar_first=True).inv().apply(-truth.along.position_N)
    assert np.abs(down[:, :2] / down[:, 2:]).max() < 3e-4  # what the loop leaves


def test_law_a_target_stays_ahead_of_z_and_the_turn_there_is_smooth():
    """Over it at 300 s: latitude and longitude are those of the track, so the craft looks straight down then."""
    from asflown.dynamics.frames import geodetic

    base = flown(duration="600 s", noise="none")
    along, t = base.truth.along, base.truth.time_s
    k = np.searchsorted(t, 300.0)
    east, north, _ = geodetic(along.position_N[k : k + 1], np.array([base.scenario.epoch_ns / 1e9 + t[k]]))
    pointings = [{"frame": "lvlh"}, {"frame": "target", "start": "20 s", "turn": "120 s",
                 "latitude": f"{north[0]} rad", "longitude": f"{east[0]} rad"},
                 {"frame": "inertial", "start": "480 s", "turn": "60 s"}]  # fmt: skip
    flight = flown(duration="600 s", noise="none", pointings=pointings)
    truth, w_c = flight.truth, np.column_stack([flight.telemetry.channel(f"commanded_rate_{a}").values for a in "xyz"])
    z = Rotation.from_quat(truth.attitude[k], scalar_first=True).apply([0, 0, 1])
    assert (
        np.degrees(np.arccos(z @ -along.position_N[k] / np.linalg.norm(along.position_N[k]))) < 0.3
    )  # geodetic, not geocentric
    assert np.abs(np.diff(w_c, axis=0)).max() < 2 * 5e-4  # rad/s from one to the next, 2 s later
    assert np.abs(w_c[-20:]).max() < 1e-9 and np.linalg.norm(truth.body_rate_rad_s[-1]) < 1e-4
    assert np.abs(w_c[k // 8]).max() > 8e-3  # passing overhead: speed over height


def test_law_commanded_rate_and_acceleration_are_derivatives_of_the_attitude():
    from asflown.sim.flight.command import ordered_motion
    from asflown.sim.flight.world import along_orbit

    scenario = load_scenario("leo-slews")
    now = load_craft("pyramid").at(scenario.epoch_ns)
    t = np.arange(0, 3000, 0.5)
    q, w, alpha = ordered_motion(scenario, along_orbit(scenario, now, 0.0, 3000.0, 0.25), t)
    steps = Rotation.from_quat(q, scalar_first=True)
    mean = (steps[:-1].inv() * steps[1:]).as_rotvec() / 0.5
    off = np.abs(mean - (w[1:] + w[:-1]) / 2).max(axis=1)
    assert np.median(off) < 1e-8 and off.max() < 2e-4 * 0.5 / 2  # corners of the slews' acceleration
    assert np.quantile(np.abs(np.diff(w, axis=0) / 0.5 - (alpha[1:] + alpha[:-1]) / 2).max(axis=1), 0.98) < 1e-7
    assert np.abs(np.linalg.norm(q, axis=1) - 1).max() < 1e-12


def test_law_rods_take_momentum_out_across_the_field_within_their_limits():
    flight = fly("leo-unloading", changes={"duration": "1200 s", "unloading": {"gain": "3e-3 1/s"}})
    truth, limit = flight.truth, 15.0
    m = truth.rod_dipole_Am2
    B = Rotation.from_quat(truth.attitude, scalar_first=True).inv().apply(truth.along.field_N)
    assert np.abs(m).max() <= limit and truth.torque_by_source_Nm["rods"] == pytest.approx(np.cross(m, B), abs=1e-15)
    on = np.any(m != 0, axis=1)
    assert on.mean() == pytest.approx(0.8, abs=0.01)  # the duty
    # across both field and momentum, and against the momentum
    h, k = truth.wheel_momentum_Nms, np.flatnonzero(on)[::40]
    work = np.sum(truth.torque_by_source_Nm["rods"][k] * h[k], axis=1)
    assert work.max() < 1e-9
    weak = fly("leo-unloading", changes={"duration": "60 s", "unloading": {"gain": "10 1/s"}}).truth.rod_dipole_Am2
    assert np.abs(weak).max() == pytest.approx(limit)
    unloaded = np.linalg.norm(truth.wheel_momentum_Nms, axis=1)
    assert unloaded[-1] < 0.6 * np.linalg.norm(flown(duration="1200 s").truth.wheel_momentum_Nms[-1])


def test_law_a_coasting_wheel_follows_its_bearing_and_the_others_keep_the_momentum(run_downs):
    truth, scenario = run_downs.truth, run_downs.scenario
    assert np.all(truth.holding_torque_Nm == 0)
    for k, coast in enumerate(scenario.coasts):
        wheel = run_downs.craft.at(scenario.epoch_ns).wheel(coast.wheel)
        inside = (truth.time_s >= coast.start) & (truth.time_s < coast.stop)
        assert np.all(truth.motor_torque_Nm[inside, k] == 0) and np.any(truth.motor_torque_Nm[~inside, k])
        a, b = wheel.drag.coulomb / wheel.spin_inertia, wheel.drag.viscous / wheel.spin_inertia
        u = np.abs(truth.wheel_rate_rad_s[inside, k] + truth.body_rate_rad_s[inside] @ wheel.axis)
        t = truth.time_s[inside] - coast.start
        want = (u[0] + a / b) * np.exp(-b * t) - a / b
        # the drag is that of the rate relative to the body, which moves by 1e-4 rad/s
        assert np.abs(u - want).max() < 1e-4 * 0.01 * 100
        moved = truth.wheel_rate_rad_s[inside][-1] - truth.wheel_rate_rad_s[inside][0]
        assert np.abs(moved).min() > 0.8 * np.abs(moved[k]) > 100  # all in the null space, (1, -1, 1, -1)
        assert np.abs(np.diff(truth.wheel_momentum_Nms[inside], axis=0)).max() < 1e-3


def test_law_null_space_torques_bring_the_rates_back_and_do_not_turn_the_craft(run_downs):
    truth = run_downs.truth
    null = truth.wheel_rate_rad_s @ np.array([1, -1, 1, -1]) / 4
    last_coast = truth.time_s > 1060
    assert null[last_coast][0] < 0.45 * null[0] and null[-1] == pytest.approx(null[0], rel=0.02)
    kept = np.array([2600, 2500, 2550, 2600]).mean() * 2 * np.pi / 60
    assert null[-1] == pytest.approx(kept, rel=0.02)


def test_law_drag_grows_with_the_date():
    growth = [{"wheel": "RW2", "since": "2026-06-02T06:00:00", "coulomb_per_day": "2 %", "viscous_per_day": "1 %"}]
    flight = flown("leo-run-downs", "60 s", drag_growth=growth, wheel_drag={"RW1": {"coulomb": "1 mN m"}})
    from asflown.sim.flight.write import truth_record

    drag = truth_record(flight)["wheel_drag"]
    assert drag["RW2"]["coulomb_Nm"] == pytest.approx(1.2 * 5e-4) and drag["RW2"]["viscous_Nms"] == pytest.approx(
        1.1 * 2e-6
    )
    assert drag["RW1"] == {"viscous_Nms": 0.0, "coulomb_Nm": 1e-3, "stiction_Nm": 0.0}


def test_law_a_light_wheel_that_coasts_to_rest_stays_there():
    """Its drag would stop it within a step: the sign change is widened to what the step can follow."""
    coasts = [{"wheel": "RW1", "start": "0 s", "stop": "60 s"}]
    rates = {"RW1": "200 rpm", "RW2": "-200 rpm", "RW3": "200 rpm", "RW4": "-200 rpm"}
    truth = flown("leo-run-downs", "60 s", noise="none", coasts=coasts, wheel_rates=rates).truth
    assert np.abs(truth.wheel_rate_rad_s[-40:, 0]).max() < 0.05


def test_law_gyroscopic_and_acceleration_terms_are_those_of_the_craft_unless_ordered():
    """Without w x H the loop leaves an attitude error of that torque over its stiffness."""
    stored = {"RW1": "3000 rpm", "RW2": "3000 rpm"}
    errors = [
        np.mean(flown(noise="none", wheel_rates=stored, controller={"gyroscopic_feedforward": fed}).telemetry.channel("attitude_error_x").values[-100:])
        for fed in (True, False)
    ]  # fmt: skip
    assert abs(errors[1]) > 5 * abs(errors[0])
    slews = [
        np.abs(flown("leo-slews", "120 s", noise="none", controller={"acceleration_feedforward": fed}).telemetry.channel("attitude_error_x").values).max()
        for fed in (True, False)
    ]  # fmt: skip
    assert slews[1] > 2 * slews[0]


def test_law_instruments_read_the_truth_with_the_stated_noise():
    bias = "1e-6 0 -2e-6 T"
    flight = flown(
        duration="1200 s",
        sensors={"magnetic_bias": bias, "magnetic_field": "50 nT", "wheel_current_zero": {"RW2": "3 mA"}},
    )
    truth, telemetry = flight.truth, flight.telemetry
    back = Rotation.from_quat(truth.attitude, scalar_first=True).inv()
    B = back.apply(truth.along.field_N)[::4]
    read = np.column_stack([telemetry.channel(f"magnetic_field_{a}").values for a in "xyz"])
    off = read - B - [1e-6, 0, -2e-6]
    assert np.std(off) == pytest.approx(50e-9, rel=0.05) and np.abs(off.mean(axis=0)).max() < 10e-9
    assert 2e-5 < np.linalg.norm(B, axis=1).min() < np.linalg.norm(B, axis=1).max() < 6e-5
    for k, name in enumerate(flight.wheels):
        held = truth.motor_torque_Nm[:, k]
        left = telemetry.channel(f"wheel_current_{name}").values[1:] - (held[1:-1:2] + held[2::2]) / 2 / 0.05
        assert np.std(left) == pytest.approx(0.5e-3, rel=0.05)
        assert np.mean(left) == pytest.approx(3e-3 if name == "RW2" else 0.0, abs=5e-5)
    place = telemetry.channel("orbit_position_x").values
    assert np.array_equal(place, truth.along.position_N[::20, 0])


def test_law_what_is_true_may_be_drawn_and_the_craft_file_is_still_the_controllers():
    drawn = {"inertia": "12.3 13.4 9.5 0.2 -0.1 0.1 kg m2", "environment": {"residual_dipole": "0.5 0 0 A m2",
             "sunlight_lever": "1e-5 0 0 N m", "density_factor": 2.0}, "controller": {"bandwidth": "0.018 Hz"}}  # fmt: skip
    flight = flown(**drawn)
    assert flight.inertia_kgm2 == pytest.approx(tensor((12.3, 13.4, 9.5, 0.2, -0.1, 0.1)))
    assert flight.craft.at(flight.scenario.epoch_ns).inertia_kgm2[0, 0] == 11.8
    B = Rotation.from_quat(flight.truth.attitude, scalar_first=True).inv().apply(flight.truth.along.field_N)
    assert flight.truth.torque_by_source_Nm["dipole"] == pytest.approx(np.cross([0.5, 0, 0], B), abs=1e-15)
    air = flight.truth.along.density_kgm3 / flown().truth.along.density_kgm3
    assert air == pytest.approx(2.0)


def test_law_an_orbit_by_table_is_the_same_flight(tmp_path):
    base = flown(duration="60 s", noise="none", settle="0 s")
    from asflown.dynamics.orbit import propagate, state_of

    t = np.arange(-30.0, 120.0, 10.0)
    places, _ = propagate(*state_of(load_scenario("leo-nadir").orbit), t)
    rows = [f"{a},{x / 1e3!r},{y / 1e3!r},{z / 1e3!r}" for a, (x, y, z) in zip(t, places.tolist(), strict=True)]
    (tmp_path / "orbit.csv").write_text("time [s],x [km],y [km],z [km]\n" + "\n".join(rows) + "\n")
    text = '\n'.join(["craft = 'pyramid'", "epoch = '2026-06-10T09:00:00'", "duration = '60 s'", "noise = 'none'",
        "[orbit]", "file = 'orbit.csv'", "[[pointings]]", "[telemetry]", "orbit_position = '1 s'"])  # fmt: skip
    (tmp_path / "mine.toml").write_text(text)
    mine = fly(tmp_path / "mine.toml")
    assert mine.truth.along.position_N == pytest.approx(base.truth.along.position_N, abs=0.01)  # m
    assert not mine.truth.torque_by_source_Nm and np.all(mine.truth.torque_Nm == 0)


def test_law_the_density_of_msis_has_the_day_above_the_night():
    air = flown(duration="3600 s", environment={"air": "msis", "density_swing": 0.0}).truth.along.density_kgm3
    assert 5e-14 < air.min() < 0.6 * air.max() < 5e-12


def test_files_hold_the_sources(tmp_path):
    flight = flown(duration="60 s")
    files = write_flight(flight, tmp_path)
    head = next(line for line in files["truth"].read_text().splitlines() if not line.startswith("#"))
    for name in ("gravity_gradient_torque_x [N m]", "sunlight_torque_y [N m]", "drag_torque_z [N m]", "sunlit []"):
        assert name in head.split(",")
    said = json.loads(files["truth_json"].read_text())["environment"]
    assert said["dipole_Am2"] == [0.27, 0.04, -0.19] and said["drag_lever_Nm"] == [1e-6, 8e-6, -1.2e-5]
    assert said["drag_lever_at_mean_density_Nm"] == pytest.approx(said["drag_lever_Nm"])  # the exponential air's mean
    assert said["sources"] == ["gravity_gradient", "sunlight", "dipole", "drag"]


def test_law_runge_kutta_is_of_fourth_order_in_an_orbit():
    """A body that tumbles under torques a thousand times too large, in surroundings that change as cubics."""
    from asflown.sim.flight.plant import Plant, advance

    curves = np.zeros((4, 1, CURVES))
    curves[3, 0] = surroundings()
    curves[2, 0, :9] = 0.05 * np.roll(curves[3, 0, :9], 1)
    curves[1, 0, 9:12] = [1e-6, -2e-6, 1e-6]
    world = World(
        curves=curves, mu=1e3 * MU, dipole=np.array([1e3, 2e3, -1e3]), sunlight_lever=np.array([0.02, -0.01, 0.03]),
        drag_lever=np.array([0.02, 0.01, -0.03]) / 1e-12,
    )  # fmt: skip
    empty, wheels = np.empty(0), np.tile([1e-4, 0, 0, 1], (3, 1))
    plant = Plant(
        I_B, np.eye(3), np.full(3, 0.05), wheels, np.empty((0, 3)), empty, empty, empty, np.empty((0, 3)), *np.zeros((3, 3)),
        np.zeros((3, 3)), 0.0, empty, np.empty((5, 0)), world=world,
    )  # fmt: skip
    ends = []
    for steps in (40, 80, 160, 1280):
        x = np.zeros(7 + 3 + 4 + 15)
        x[:10] = [1, 0, 0, 0, 0.4, -0.3, 0.2, 20, -10, 5]
        advance(
            0.0, x, np.zeros(3), np.zeros(3), np.array([1e3, 0, 0]), plant, 8.0 / steps, steps, np.empty((5, len(x)))
        )
        ends.append(x)
    errors = np.array([np.abs(x - ends[-1]).max() for x in ends[:3]])
    assert np.abs(ends[-1][14:]).max() > 0.1
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx([4, 4], abs=0.3)


BAD = {
    "no orbit": ("quiet", {"pointings": [{"frame": "lvlh"}]}, "needs an orbit"),
    "two sources of an orbit": ("leo-nadir", {"orbit": {"file": "x.csv"}}, "either semi_major_axis"),
    "below the surface": ("leo-nadir", {"orbit": {"semi_major_axis": "6300 km"}}, "below its surface"),
    "a target nowhere": ("leo-nadir", {"pointings": [{"frame": "target"}]}, "latitude"),
    "turns overlap": ("leo-nadir", {"pointings": [{"frame": "lvlh"}, {"start": "10 s", "frame": "inertial"},
                      {"start": "20 s", "frame": "lvlh"}]}, "before the craft has turned"),
    "no rods": ("quiet", {"unloading": {"gain": "1e-3 1/s"}, "orbit": {"semi_major_axis": "7000 km"}}, "no torque rods"),
    "not described": ("quiet", {"environment": {"dipole": True}, "orbit": {"semi_major_axis": "7000 km"}}, "not described"),
    "an unknown wheel": ("leo-nadir", {"wheel_drag": {"RW9": {"coulomb": "1 mN m"}}}, "RW9"),
    "a gyro too noisy for its estimate": ("leo-nadir", {"sensors": {"gyro": "50 urad/s"}}, "gyro's noise alone"),
    "an impossible body": ("leo-nadir", {"inertia": "1 1 9 0 0 0 kg m2"}, "no rigid body"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_in_words(case):
    name, changes, words = BAD[case]
    with pytest.raises(BadInput, match=words):
        fly(name, changes={"duration": "60 s"} | changes)
