"""Thrusters: pulses, what holds for momentum, the papers' wheel biasings, burns, leaks."""

import json
from collections import Counter

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.kit.rotations import rotation
from asflown.sim.flight.closed_loop import fly, write_flight
from asflown.sim.flight.plant import impulses
from asflown.sim.flight.thrusters import OLD_THRUST, thrusters_of
from flights import CASSINI, assert_refused

DELAY, RISE, FALL = 0.005, 0.020, 0.065
WHEELS = ("RWA1", "RWA2", "RWA4")


def pulse_ratio(on_time: float, fall: float = FALL) -> float:
    """Impulse over thrust x on-time of a lone pulse as 001 section V describes it, by quadrature of the thrust's course."""
    t = np.linspace(0, on_time + DELAY + 30 * fall, 2_000_001)
    closing = on_time + DELAY
    course = np.where(t > DELAY, 1 - np.exp(-(np.minimum(t, on_time) - DELAY) / RISE), 0.0)
    course *= np.exp(-np.maximum(t - closing, 0) / fall)
    return float(np.trapezoid(course, t)) / on_time


def flown_ratio(cycles: int, substeps: int = 4, **changes) -> float:
    """The same from the plant's kernel."""
    from asflown.sim.scenario.scenario import load_scenario

    scenario = load_scenario("wheel-bias-fsds").changed(**changes)
    now = load_craft(scenario.craft).at(scenario.epoch_ns)
    thrusters = thrusters_of(scenario, now, 0.125 * np.arange(60), 0.125)
    thrust, given, total = np.zeros(8), np.zeros(8), np.zeros(8)
    for cycle in range(60):
        on, was_on = np.full(8, cycle < cycles), np.full(8, 0 < cycle <= cycles)
        for s in range(substeps):
            step = 0.125 / substeps
            impulses(
                thrusters, cycle, on, was_on, thrusters.steady[0], np.zeros(8), thrust, s * step, (s + 1) * step, given
            )
            total += given
    return float(total[5] / (0.75 * 0.125 * cycles))


@pytest.mark.parametrize("cycles", [1, 2, 4, 6])
@pytest.mark.parametrize("substeps", [1, 4, 7])
def test_law_the_impulse_of_a_pulse_is_that_of_the_thrusts_course(cycles, substeps):
    D = 0.125 * cycles
    exact = D + FALL - RISE + (RISE - DELAY - FALL) * np.exp(-(D - DELAY) / RISE)
    assert pulse_ratio(D) == pytest.approx(exact / D, rel=1e-9)
    assert flown_ratio(cycles, substeps) == pytest.approx(exact / D, rel=1e-12)


def test_published_pulses_and_what_001_makes_of_them():
    """Ratios of 001 section V's own model.  Printed: 1.395, 1.198, 1.195 and 1.3406 (docs/errata.md)."""
    histogram = {1: 133, 2: 16, 4: 1, 6: 1}  # pulses of so many 125 ms
    assert flown_ratio(1) == pytest.approx(1.3590, abs=5e-5)
    assert flown_ratio(2) == pytest.approx(1.1800, abs=5e-5)
    assert flown_ratio(1, thrusters={"fall": "40 ms"}) == pytest.approx(1.1595, abs=5e-5)
    total = sum(n * c * flown_ratio(c) for c, n in histogram.items()) / sum(n * c for c, n in histogram.items())
    assert total == pytest.approx(1.3099, abs=5e-5)


def test_law_momentum_gained_is_torque_times_time_to_rounding():
    """Everything about z, whatever the attitude: three like wheels, a diagonal tensor, no noise; pulses of Y2 and Y4 alone."""
    craft = load_craft("cassini@001-drift", inertia=(7375, 6061, 3829, 0, 0, 0))
    flight = fly("wheel-bias-fsds", craft=craft, noise="none")
    fired, H = flight.truth.thrusters, flight.truth.momentum_inertial_Nms[:, 2]
    assert fired.on_time_s[-1, 5] > 20 and fired.on_time_s[-1, [0, 1, 2, 3]].sum() == 0
    impulse = fired.impulse_Ns @ fired.arms_m[:, 2]
    assert np.abs(H - H[0] - impulse).max() < 1e-12 * np.abs(impulse).max()


def assert_momentum_balances(truth):
    """With the impulse of each cycle turned by the mean of two attitudes: off by half a cycle's turn, some 1e-5, of each pulse."""
    turn, fired, H = rotation(truth.attitude), truth.thrusters, truth.momentum_inertial_Nms
    given = np.diff(fired.impulse_Ns, axis=0) @ fired.arms_m
    gained = np.cumsum(0.5 * (turn[:-1].apply(given) + turn[1:].apply(given)), axis=0)
    assert np.abs(H[1:] - H[0] - gained).max() < 1e-6 * np.abs(gained).max()


@pytest.mark.parametrize("name", ["wheel-bias-fsds", "wheel-bias-day28", "rcs-burn", "leak"])
def test_law_momentum_balances_with_every_thruster(name):
    assert_momentum_balances(fly(name, changes={"flexible": True, "friction": True}).truth)


@pytest.mark.slow
def test_law_the_truth_of_each_pulse_adds_up():
    flight = fly("wheel-bias-day28", changes={"thrusters": {"pulse_scatter": 0.0}})
    fired = flight.truth.thrusters
    for k, name in enumerate(fired.names):
        pulses = fired.pulses_of(name, flight.truth.time_s)
        assert fired.on_time_s[-1, k] == pytest.approx(sum(p[1] for p in pulses))
        assert fired.pulses[-1, k] == len(pulses)
        assert all(p[2] == 0.699 for p in pulses)
        alone = sum(0.699 * p[1] * pulse_ratio(p[1], 0.040) for p in pulses)
        # a pulse that finds the last one's tail is not quite alone
        assert fired.impulse_Ns[-1, k] == pytest.approx(alone, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_published_on_times_of_the_simulated_wheel_biasing(seed):
    """001 section V: Y2 and Y4 21.875 s each, most pulses of 125 ms (133), some of 250 (16), two longer; no other thruster."""
    flight = fly("wheel-bias-fsds", seed=seed)
    fired = flight.truth.thrusters
    y2, y4 = fired.on_time_s[-1, [5, 7]]
    assert y2 == y4 == pytest.approx(21.6, abs=0.3)
    assert fired.on_time_s[-1, [0, 1, 2, 3, 4, 6]].max() < 0.5  # the bounce between the other deadbands
    lengths = Counter(p[1] for p in fired.pulses_of("Y2", flight.truth.time_s))
    assert lengths[0.125] > 115 and 8 < lengths[0.25] < 30 and max(lengths) <= 1.0
    rates = flight.truth.wheel_rate_rad_s[-1] * 30 / np.pi
    assert rates == pytest.approx([1800] * 3, abs=0.1)
    worst = max(np.abs(flight.telemetry.channel(f"attitude_error_{a}").values).max() for a in "xyz")
    assert 1.9e-3 < worst < 2.05e-3


def test_published_on_times_of_28_january_2005():
    """001 section V's on-times Z1 ... Y4 and pulse counts, from totals and mean lengths; the centre of mass is chosen for it."""
    flights = [fly("wheel-bias-day28", seed=s).truth.thrusters for s in range(1, 6)]
    on = np.mean([f.on_time_s[-1] for f in flights], axis=0)
    assert on[[4, 6]] == pytest.approx(9.81, rel=0.03)
    assert on[[2, 3]] == pytest.approx([4.28, 3.31], rel=0.15)
    assert on[:2] == pytest.approx([0.74, 1.72], abs=0.5)
    assert on[[5, 7]].max() < 0.5
    assert np.mean([f.pulses[-1, 4] for f in flights]) == pytest.approx(75, rel=0.05)


@pytest.mark.slow
def test_law_a_thrust_is_found_back_from_wheels_and_on_times():
    """Momentum balance about z over the whole bias, noise-free, with the pulses' own ratio."""
    flight = fly("wheel-bias-fsds", noise="none")
    truth, fired = flight.truth, flight.truth.thrusters
    H = truth.wheel_momentum_Nms[:, 2] + truth.body_rate_rad_s @ flight.inertia_kgm2[2]
    effective = sum(p[1] * pulse_ratio(p[1]) for p in fired.pulses_of("Y2", truth.time_s))
    effective -= sum(p[1] * pulse_ratio(p[1]) for p in fired.pulses_of("Y1", truth.time_s))
    assert (H[-1] - H[0]) / (2 * 1.234 * effective) == pytest.approx(0.75, rel=1e-3)


def test_published_centre_of_mass_of_28_january():
    """The scenario's x and y: those with which 001's on-times balance the wheels about x and y for the thrust that z asks."""
    craft = CASSINI.at(None)
    on = np.array([0.74, 1.72, 4.28, 3.31, 9.81, 0.375, 9.81, 0.375])
    rates = np.array([-794, -870, -296]) * np.pi / 30
    H = sum(w.spin_inertia * r * np.array(w.axis) for w, r in zip(craft.wheels, rates, strict=True))
    thrust = H[2] / (2 * 1.234 * (0.375 - 9.81))
    x, y = np.array([1, -1, -1, 1]) * 1.234, np.array([1, 1, -1, -1]) * 1.580
    about_x, about_y = -thrust * (on[:4] @ y), thrust * (on[:4] @ x)
    pushed = thrust * on[:4].sum()
    e_x, e_y = (about_y - H[1]) / pushed, (H[0] - about_x) / pushed
    assert [e_x, e_y] == pytest.approx([0.127, 0.021], abs=0.01)  # m


def test_law_a_burn_ends_where_the_flight_software_reckons_it_does():
    flight = fly("rcs-burn", changes={"thrusters": {"pulse_scatter": 0.0}})
    truth, fired = flight.truth, flight.truth.thrusters
    z = slice(0, 4)
    last = np.flatnonzero(fired.on[:, z].sum(axis=1) >= 3)[-1]
    wanted = 0.25 * 3160 / 0.704
    assert wanted <= fired.on_time_s[last + 1, z].sum() < wanted + 4 * 0.125
    error = np.array([flight.telemetry.channel(f"attitude_error_{a}").values for a in "xyz"])
    t = flight.telemetry.seconds(flight.telemetry.channel("attitude_error_x").tai_ns)
    assert 550 < truth.time_s[last] < 620
    assert np.degrees(np.abs(error[:2, t < truth.time_s[last]]).max()) == pytest.approx(0.5, abs=0.01)
    assert np.abs(error[:, t > 800]).max() < 2.1e-3  # the narrow deadband again
    assert fired.on_time_s[-1, 4:].sum() < 1  # nothing pushes about z
    force = fired.impulse_Ns[-1] @ fired.directions
    assert np.linalg.norm(fired.linear_impulse_Ns(truth.attitude)[-1]) == pytest.approx(np.linalg.norm(force), rel=1e-4)


def test_law_the_accelerometer_counts_velocity_and_bias():
    flight = fly("rcs-burn")
    truth, fired = flight.truth, flight.truth.thrusters
    c = flight.telemetry.channel("accelerometer_count")
    cycles = np.rint(8 * flight.telemetry.seconds(c.tai_ns)).astype(int)
    velocity = -fired.impulse_Ns[cycles, :4].sum(axis=1) / 3160 + 1e-4 * truth.time_s[cycles]
    counted = 2.0202e-3 * c.values
    assert np.all((velocity - counted > -1e-12) & (velocity - counted < 2.0202e-3))
    assert c.values[300] == 14  # 300 s of bias


def test_law_a_leak_pushes_whatever_is_ordered_and_its_signs_name_the_thruster():
    flight = fly("leak", noise="none")
    truth, fired = flight.truth, flight.truth.thrusters
    assert not fired.on.any() and fired.impulse_Ns[-1, 2] == pytest.approx(2.4)
    gained = truth.momentum_inertial_Nms[-1] - truth.momentum_inertial_Nms[0]
    assert gained == pytest.approx([2.4 * 1.580, -2.4 * 1.234, 0], abs=1e-3)
    assert np.all(truth.torque_Nm[truth.time_s < 1200] == 0)
    assert truth.torque_Nm[-2] == pytest.approx([1.580e-3, -1.234e-3, 0])
    signs = {name: "".join("-0+"[int(np.sign(round(v, 1))) + 1] for v in arm)
             for name, arm in zip(fired.names, fired.arms_m, strict=True)}  # fmt: skip
    assert len(set(signs.values())) == 8
    assert signs["Z1"] == "-+0" and signs["Z3"] == "+-0" and signs["Y1"] == "+0-" and signs["Y4"] == "-0+"


def test_law_a_weak_thruster_fires_longer_and_unbalances_its_pair():
    weak = [{"thruster": "Y2", "start": "0 s", "factor": 0.8}]
    flights = [fly("wheel-bias-fsds", changes={"thruster_faults": f}) for f in ([], weak)]
    sound, faulty = (f.truth.thrusters for f in flights)
    assert faulty.on_time_s[-1, 5] > 1.08 * sound.on_time_s[-1, 5]
    assert faulty.impulse_Ns[-1, [5, 7]].sum() == pytest.approx(sound.impulse_Ns[-1, [5, 7]].sum(), rel=0.01)
    assert faulty.impulse_Ns[-1, 5] / faulty.impulse_Ns[-1, 7] == pytest.approx(0.8, rel=1e-3)


def test_law_catalyst_beds_warm_with_firing():
    flight = fly("wheel-bias-fsds", noise="none", changes={"thrusters": {"catalyst_beds": {}}})
    fired, k = flight.truth.thrusters, 5
    starts = [round(8 * p[0]) for p in fired.pulses_of("Y2", flight.truth.time_s) if p[1] == 0.125]
    gains = np.array([fired.impulse_Ns[s + 5, k] - fired.impulse_Ns[s, k] for s in starts]) / (0.75 * 0.125)
    cold = (0.125 + 0.090 - 0.025 + (0.025 - 0.005 - 0.090) * np.exp(-0.12 / 0.025)) / 0.125
    hot = (0.125 + 0.040 - 0.015 + (0.015 - 0.005 - 0.040) * np.exp(-0.12 / 0.015)) / 0.125
    assert np.all(gains < cold) and gains[1] > 1.05 * gains[-1]
    assert gains[-1] == pytest.approx(hot, rel=0.02)


def test_law_pulses_scatter_one_by_one():
    flight = fly("wheel-bias-fsds", changes={"thrusters": {"pulse_scatter": 0.03}})
    thrusts = np.array([p[2] for p in flight.truth.thrusters.pulses_of("Y4", flight.truth.time_s)])
    assert thrusts.std() == pytest.approx(0.03 * 0.75, rel=0.25)
    assert thrusts.mean() == pytest.approx(0.75, rel=0.01)


def test_law_wheels_run_down_under_thrusters():
    """Both wheels coast on drag alone, and nothing but pulses holds the attitude."""
    flight = fly(
        "wheel-run-down",
        changes={
            "torques": [],
            "drag_spikes": [],
            "duration": "900 s",
            "settle": "0 s",
            "thrusters": {"center_of_mass": "0 0 1.35 m", "thrust": "0.8 N"},
        },
    )
    truth = flight.truth
    assert np.all(truth.holding_torque_Nm == 0) and truth.thrusters.pulses[-1].sum() > 3
    assert truth.wheel_rate_rad_s[-1, 0] < 0.8 * truth.wheel_rate_rad_s[0, 0]
    assert truth.wheel_rate_rad_s[-1, 2] == pytest.approx(truth.wheel_rate_rad_s[0, 2], abs=0.1)  # held by its motor
    error = np.array([flight.telemetry.channel(f"attitude_error_{a}").values for a in "xyz"])
    assert np.abs(error).max() < 2.1e-3


def test_law_control_passes_from_wheels_to_thrusters_and_back():
    """Within the span nothing but pulses turns the craft, outside of it nothing but wheels; momentum is what pulses gave."""
    flight = fly("wheel-bias-handover", noise="none")
    truth, fired, period = flight.truth, flight.truth.thrusters, 0.125
    inside = (truth.time_s >= 300) & (truth.time_s < 540)
    assert np.array_equal(fired.in_control, inside) and not fired.on[~inside].any() and fired.on[inside].any()
    assert np.all(truth.control_torque_Nm[inside] == 0)
    assert_momentum_balances(truth)
    # brought to the rates ordered, then taken on by the wheels' loop from within the thrusters' deadband
    bias = np.array([-794, -870, -296])
    assert truth.wheel_rate_rad_s[round(500 / period)] * 30 / np.pi == pytest.approx(bias, abs=0.2)
    assert np.abs(truth.wheel_rate_rad_s[-1] * 30 / np.pi - bias).max() < 40
    error = np.array([flight.telemetry.channel(f"attitude_error_{a}").values for a in "xyz"])
    t = flight.telemetry.seconds(flight.telemetry.channel("attitude_error_x").tai_ns)
    assert np.abs(error).max() < 2.1e-3 and np.abs(error[:, t > 640]).max() < 2e-5
    mode = flight.telemetry.channel("control_mode")
    assert set(mode.values) == {"RWA", "RCS"}
    assert np.array_equal(
        mode.values == "RCS", inside[np.rint(flight.telemetry.seconds(mode.tai_ns) / period).astype(int)]
    )


def test_law_each_bed_has_its_own_warmth_and_telemetry_shows_it():
    """What fires is hot and answers fast, what rests stays cold: rise and fall of each follow from its own firing."""
    flight = fly("wheel-bias-handover", noise="none", changes={"thrusters": {"fall": None, "catalyst_beds": {}}})
    fired, tlm = flight.truth.thrusters, flight.telemetry
    warm, cold = tlm.channel("catbed_temperature_Y1").values, tlm.channel("catbed_temperature_Y2").values
    assert np.all(cold == 420) and warm[0] == 420 and 850 < warm.max() < 900 and warm[-1] < warm.max() - 100
    # between firings a bed cools as exp(-t / 900 s)
    k = len(warm) - 10
    assert (warm[-1] - 420) / (warm[k] - 420) == pytest.approx(np.exp(-9 * 16 / 900), rel=1e-9)
    assert fired.chill[-1, 5] == 1 and fired.chill[:, 4].min() < 0.1
    psia = 6894.757
    assert tlm.channel("tank_pressure").values[0] / psia == pytest.approx(255 * (0.699 / 0.69) ** (1 / 0.84), rel=0.01)


def test_law_a_swap_of_branches_changes_counters_and_thrust_alone():
    """Both branches sit in one place: the counters of the one stop where those of the other go on."""
    swap = [{"start": "120 s", "branch": "B", "thrust": "0.6 N"}]
    flights = {
        c: fly(
            "wheel-bias-day28", changes={"branch_swaps": swap, "thrusters": {"counted_branch": c, "pulse_scatter": 0.0}}
        )
        for c in "AB"
    }
    a, b = (flights[c].telemetry.channel("on_time_Y1").values for c in "AB")
    fired = flights["A"].truth.thrusters
    assert np.all(np.diff(a[8:]) == 0) and np.all(b[:8] == 0) and b[-1] > 3
    assert a[-1] + b[-1] == fired.on_time_s[-1, 4]
    thrusts = [p[2] for p in fired.pulses_of("Y1", flights["A"].truth.time_s)]
    assert sorted(set(np.round(thrusts, 9))) == [0.6, 0.699]
    state = flights["A"].telemetry.channel("thruster_branch")
    assert list(state.values) == ["A", "A", "B", "B", "B", "B"]  # every 64 s


def test_law_a_wheel_at_its_limit_goes_no_further_under_thruster_control():
    fast = [{"start": "60 s", "stop": "180 s", "rates": {"RWA1": "-2300 rpm"}}]
    flight = fly("wheel-bias-day28", changes={"wheel_biases": fast})
    rates = flight.truth.wheel_rate_rad_s[:, 0] * 30 / np.pi
    assert flight.ended == "reached 360 s" and rates[-1] == pytest.approx(-2020, abs=3)
    assert rates.min() > -2025
    back = fly(
        "wheel-bias-day28", changes={"wheel_biases": fast, "thruster_control": [{"start": "50 s", "stop": "200 s"}]}
    )
    assert back.ended == "wheel RWA1 at its rate limit at 200 s"  # the wheels cannot hold an attitude then


def test_thruster_telemetry_is_cumulative_counted_and_on_disk(tmp_path):
    flight = fly("wheel-bias-day28")
    tlm, fired = flight.telemetry, flight.truth.thrusters
    on, count = tlm.channel("on_time_Y1"), tlm.channel("pulse_count_Y1")
    assert np.all(np.diff(tlm.seconds(on.tai_ns)) == 16) and np.all(np.diff(on.values) >= 0)
    assert np.all(on.values % 0.125 == 0)
    assert on.values[-1] == fired.on_time_s[128 * (len(on.values) - 1), 4] and count.values[0] == 0
    files = write_flight(flight, tmp_path)
    kept = json.loads(files["truth_json"].read_text())["thrusters"]["Y1"]
    assert kept["on_time_s"] == fired.on_time_s[-1, 4] and len(kept["pulses"]) == fired.pulses[-1, 4]
    assert "impulse_Y1 [N s]" in files["truth"].read_text().splitlines()[3]
    from asflown.telemetry.load import load_telemetry

    assert np.array_equal(load_telemetry(files["telemetry"]).channel("on_time_Y1").values, on.values)


BAD = {
    "biases without thrusters": ("quiet", {"wheel_biases": [{"start": "0 s", "stop": "9 s", "rates": {"RWA1": "9 rpm"}}]}),
    "burns under wheels": ("leak", {"burns": [{"start": "0 s", "delta_v": "1 m/s"}]}),
    "faults without thrusters": ("quiet", {"thruster_faults": [{"thruster": "Z1", "start": "0 s"}]}),
    "an unknown thruster": ("leak", {"thruster_faults": [{"thruster": "Z9", "start": "0 s"}]}),
    "an unknown wheel": ("wheel-bias-fsds", {"wheel_biases": [{"start": "0 s", "stop": "9 s", "rates": {"RWA3": "9 rpm"}}]}),
    "backwards": ("wheel-bias-fsds", {"wheel_biases": [{"start": "9 s", "stop": "0 s", "rates": {"RWA1": "9 rpm"}}]}),
    "a bias under wheel control": ("wheel-bias-day28", {"thruster_control": [{"start": "0 s", "stop": "100 s"}]}),
    "control that never is": ("wheel-bias-day28", {"wheel_biases": [], "thrusters": {"control": False}, "thruster_control": [{"start": "0 s", "stop": "9 s"}]}),
    "a swap without thrusters": ("quiet", {"branch_swaps": [{"start": "0 s", "branch": "B"}]}),
    "no centre of mass": ("quiet", {"thrusters": {}}),
    "no mass": ("leak", {"telemetry": {"accelerometer_count": "1 s"}}),
    "a slow valve": ("wheel-bias-fsds", {"controller": {"period": "4 ms"}, "duration": "1 s"}),
    "a deadband of nothing": ("wheel-bias-fsds", {"thrusters": {"deadband": "2 2 0.01 mrad"}}),
    "two models of a lag": ("wheel-bias-fsds", {"thrusters": {"fall": "40 ms", "catalyst_beds": {}}}),
    "a craft without thrusters": ("quiet", {"craft": "inspiresat1", "thrusters": {}}),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_in_words(case):
    name, changes = BAD[case]
    assert_refused(name, **changes)


def test_a_thrust_from_long_ago_is_doubted():
    flight = fly("quiet", changes={"duration": "10 s", "thrusters": {"center_of_mass": "0 0 1 m"}})
    assert flight.doubts.of(OLD_THRUST)[0].about["date"] == "2006-04-15"
