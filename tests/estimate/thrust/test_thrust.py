"""Thrust as flown: 001's simulation and its day 28, laws of the model, recovery, faults, and what is refused."""

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.dynamics.pulses import Valve, moment_matrix
from asflown.estimate.firing.chains import momentum_chain, to_come
from asflown.estimate.firing.counters import COUNTER_FALLS, PULSES_GUESSED
from asflown.estimate.firing.firings import BRANCH_NOT_DESCRIBED, firings_of
from asflown.estimate.firing.priors import thrust_priors
from asflown.estimate.firing.pulse_counts import guess_pulses
from asflown.estimate.firing.pulse_lengths import weak_because_lasting
from asflown.estimate.subject import subject_of
from asflown.estimate.subject.wheel_limits import AT_LIMIT
from asflown.estimate.thrust.doubts import WEAK_OR_CENTER
from asflown.estimate.thrust.methods import thrust
from asflown.estimate.thrust.printed import ONE_THRUST_A_PAIR, printed_thrust
from asflown.kit.banded import Covariance
from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.telemetry import Channel, Telemetry
from cli.program import complaint, run
from conftest import flight_data
from flights import changed, flown, renamed, saved, with_channels, with_values, without

NAMES = ("Z1", "Z2", "Z3", "Z4", "Y1", "Y2", "Y3", "Y4")
CASSINI = load_craft("cassini", cm=(0, 0, 1.35))
MASS = 3160.0
#: 001 section V, 28 January: on-times [s] of Z1 ... Y4, wheel rates reached [rpm], RWA1, 2, 4.
ON_TIMES = np.array([0.74, 1.72, 4.28, 3.31, 9.81, 0.375, 9.81, 0.375])
RATES = np.array([-794.0, -870.0, -296.0])


@pytest.fixture
def fsds():
    return flown("wheel-bias-fsds")


@pytest.fixture(scope="module")
def day28():
    """One thrust of 0.7 N, on a centre of mass some way from where it is thought to be."""
    craft = load_craft("cassini", cm=(0.06, -0.04, 1.35))
    return fly("wheel-bias-day28", craft=craft, changes={"thrusters": {"thrust": "0.7 N", "fall": "55 ms"}})


@pytest.fixture(scope="module")
def burn():
    craft = load_craft("cassini", cm=(0.06, -0.04, 1.35))
    return fly("rcs-burn", craft=craft, changes={"thrusters": {"thrust": "0.7 N", "fall": "55 ms"}})


def every(tlm: Telemetry, count: int) -> Telemetry:
    """Only every ``count``-th reading of the thrusters' counters."""
    for stem in ("on_time", "pulse_count"):
        tlm = changed(tlm, stem, lambda c: c.where(slice(None, None, count)))
    return tlm


# ---- published ----------------------------------------------------------------------------------------------


def test_published_simulation_of_001(fsds):
    """Truth 0.75 N.  001 finds 0.98 N, over its R of 1.3406 0.731 N; the right R, 1.3099, brings 0.748 N."""
    craft = load_craft("cassini@001-fsds", cm=(0, 0, 1.35))
    result = thrust(fsds.telemetry, craft, method="printed")
    assert result.unadjusted_N["mean"] == pytest.approx(0.98, abs=0.015)
    assert result.pulse_ratio["printed"] == pytest.approx(1.3406, abs=0.02)
    assert result.pulse_ratio["corrected"] == pytest.approx(1.3099, abs=0.02)
    assert result.mean_thrust_N == pytest.approx(0.75, abs=0.0075)
    printed = thrust(fsds.telemetry, craft, method="printed", variant="printed")
    assert printed.mean_thrust_N == pytest.approx(0.75 * 1.3099 / 1.3406, abs=0.0075)
    assert result.thrust_N["Y2"] == result.thrust_N["Y4"] == pytest.approx(0.748, abs=0.008)
    joint = thrust(fsds.telemetry, craft)
    assert abs(joint.mean_thrust_N - 0.75) < 2 * joint.mean_thrust_sigma_N
    assert joint.correlation["fall_time"] < -0.98


def test_published_day_28_balances_with_the_centre_of_mass_off_the_axis():
    """From the on-times alone, wheels from rest, e = 0: 0.83, 1.24 and 0.82 N about the axes and 0.82 N together (001: 0.80);
    e = (0.127, 0.021) m makes X and Y agree on 0.81 N: the centre of mass must be a parameter."""
    now = CASSINI.at(CASSINI.thrust_history[2].date)
    gained = np.array([np.array(w.axis) * w.spin_inertia for w in now.wheels]).T @ (RATES * 2 * np.pi / 60)
    places, along = [t.position for t in CASSINI.thrusters], [t.direction for t in CASSINI.thrusters]
    u = moment_matrix(places, along, (0, 0, 1.35)) @ ON_TIMES
    assert gained / u == pytest.approx([0.831, 1.239, 0.817], abs=0.015)
    assert u @ gained / (u @ u) == pytest.approx(0.822, abs=0.006)
    moved = moment_matrix(places, along, (0.127, 0.021, 1.35)) @ ON_TIMES
    assert (gained / moved)[:2] == pytest.approx([0.81, 0.81], abs=0.015)


def test_published_pairs_have_one_column_whatever_the_centre_of_mass(day28):
    for center in ((0, 0, 1.35), (0.2, 0.1, 1.35)):
        found = printed_thrust([firings_of(subject_of(day28.telemetry, CASSINI))], center)
        assert len(found.pairs) <= 2
        assert found.doubts.has(ONE_THRUST_A_PAIR)


def test_published_virtual_accelerometer_ends_the_burn(burn):
    """Flight software without the accelerometer: thrust believed x on-time / mass reaches the velocity ordered.  The
    thrust that would have made it right is M dV over the on-times, R of the burn included."""
    on = burn.truth.thrusters.on_time_s[-1].sum()
    assert 0.704 * on / MASS == pytest.approx(0.25, rel=8e-3)  # with the pulses of the hold before and after it
    found = thrust(burn.telemetry, CASSINI, method="accelerometer", priors=thrust_priors(CASSINI, mass_kg=MASS))
    true = -burn.truth.thrusters.impulse_Ns[-1].sum() / MASS
    assert found.burn.delta_v_m_s() == pytest.approx(true, abs=3 * found.burn.delta_v_sigma_m_s)
    assert found.unadjusted_N["bias subtracted"] == pytest.approx(-true * MASS / on, rel=1e-2)


def test_published_appendix_d_with_both_signs(burn):
    """The bias is the output's drift before the burn: added, as printed, it counts twice (29 mm/s for 1e-4 m/s2 over 290 s)."""
    found = thrust(burn.telemetry, CASSINI, method="accelerometer", priors=thrust_priors(CASSINI, mass_kg=MASS))
    assert found.mean_thrust_N == pytest.approx(0.7, abs=3 * found.mean_thrust_sigma_N)
    assert found.burn.bias_m_s2 == pytest.approx(1e-4, rel=0.02)
    wrong = found.unadjusted_N["bias added, as printed"]
    assert abs(wrong / found.unadjusted_N["bias subtracted"] - 1) > 0.2


# ---- laws ---------------------------------------------------------------------------------------------------


def test_law_what_is_still_to_come_by_quadrature():
    """Pulses of 125 ms once a second, sampled at any time: what the counters have and the craft has not."""
    valve, D = Valve(0.005, 0.020, 0.065), 0.125
    t = np.linspace(0, 1, 200_001)
    counted = np.minimum(t, D) + valve.added()
    course = np.where(t > 0.005, 1 - np.exp(-(np.minimum(t, D) - 0.005) / 0.020), 0.0)
    course *= np.exp(-np.maximum(t - D - 0.005, 0) / 0.065)
    given = np.cumsum(course) * (t[1] - t[0])
    missing = counted - given
    mean, variance = to_come(np.array([D]), np.array([1.0]), valve)
    assert mean[0] == pytest.approx(np.trapezoid(missing, t), rel=0.03)
    assert variance[0] == pytest.approx(np.trapezoid(missing**2, t) - np.trapezoid(missing, t) ** 2, rel=0.06)


def test_law_covariance_of_steps_is_what_its_blocks_say():
    rng = np.random.default_rng(1)
    half = rng.standard_normal((6, 3, 3))
    main = half @ np.swapaxes(half, 1, 2) + 6 * np.eye(3)
    off = 0.3 * (half[1:] + np.swapaxes(half[1:], 1, 2))
    dense = np.zeros((18, 18))
    for k in range(6):
        dense[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = main[k]
    for k in range(5):
        dense[3 * k + 3 : 3 * k + 6, 3 * k : 3 * k + 3] = dense[3 * k : 3 * k + 3, 3 * k + 3 : 3 * k + 6] = off[k]
    columns = rng.standard_normal((18, 2))
    assert Covariance.of(main, off).solve(columns) == pytest.approx(np.linalg.solve(dense, columns), rel=1e-10)


def test_law_pulses_are_guessed_between_what_is_possible():
    """One step is one pulse; several far apart are several; on without a break is none that begins."""
    alone = guess_pulses(np.full((40, 1), 0.125), np.full(40, 1.0), 0.125)
    assert alone.pulses == pytest.approx(1.0) and not alone.spread.any()
    fine = np.where(np.arange(200)[:, None] % 2 == 0, 0.125, 0.0)
    fine[::20] = 0.25
    assert guess_pulses(fine, np.full(200, 1.0), 0.125).pulses.sum() == pytest.approx(100, abs=8)
    coarse = guess_pulses(np.full((6, 1), 1.25), np.full(6, 16.0), 0.125)
    assert coarse.pulses.sum() == pytest.approx(6 * 10 / 1.09) and coarse.spread.sum() > 5
    assert guess_pulses(np.full((6, 1), 4.0), np.full(6, 4.0), 0.125).pulses.sum() == 0


def test_law_squares_of_lengths_follow_single_pulses(burn):
    f = firings_of(subject_of(burn.telemetry, CASSINI))
    for k, name in enumerate(NAMES[:4]):
        lengths = np.array([p[1] for p in burn.truth.thrusters.pulses_of(name, burn.truth.time_s)])
        assert f.counters.lengths.squares[-1, k] == pytest.approx(np.sum(lengths**2), rel=0.1)


def test_law_long_pulses_are_followed_one_by_one(burn):
    """Their on-times are those flown; what is not followed is the rest."""
    f = firings_of(subject_of(burn.telemetry, CASSINI))
    lengths = f.counters.lengths
    longest = {n: max(p[1] for p in burn.truth.thrusters.pulses_of(n, burn.truth.time_s)) for n in NAMES[:4]}
    for k, name in enumerate(NAMES[:4]):
        own = lengths.long[-1][lengths.thruster == k]
        if longest[name] > 20:
            assert own.max() == pytest.approx(longest[name], abs=4.0)  # a reading every 4 s
    assert max(longest.values()) > 60
    followed = np.array([np.sum(lengths.long[-1][lengths.thruster == k] ** 2) for k in range(8)])
    assert lengths.short[-1] + followed == pytest.approx(lengths.squares[-1], rel=1e-9, abs=1e-9)
    assert np.all(np.diff(lengths.long, axis=0) >= 0)


def test_law_what_lasts_is_weak_by_the_scatter_squared_over_the_share_off():
    """Pulses end when what they give too much has added up: with draws of their own the longer ones are the weaker."""
    rng, share, scatter = np.random.default_rng(7), 0.15, 0.02
    stronger = scatter * rng.standard_normal(200_000)
    length = 1 / np.maximum(share + stronger, 1e-3)
    found = weak_because_lasting(np.full((50, 1), 4.0 * (1 - share)), np.full(50, 4.0), scatter)[0]
    assert found == pytest.approx(-(stronger @ length) / length.sum(), rel=0.07)
    assert not weak_because_lasting(np.full((50, 1), 4.0), np.full(50, 4.0), scatter).any()  # never off: one pulse
    assert not weak_because_lasting(np.full((50, 1), 0.5), np.full(50, 4.0), scatter).any()  # no burn


# ---- recovery -----------------------------------------------------------------------------------------------


def test_recovery_of_thrust_fall_time_and_centre_of_mass(day28, burn):
    """A biasing alone leaves thrust and fall time tied; with a burn both are known."""
    alone = thrust(day28.telemetry, CASSINI)
    assert abs(alone.mean_thrust_N - 0.7) < 2.5 * alone.mean_thrust_sigma_N and alone.correlation["fall_time"] < -0.9
    both = thrust([day28.telemetry, burn.telemetry], CASSINI, priors=thrust_priors(CASSINI, mass_kg=MASS))
    assert (
        both.mean_thrust_N == pytest.approx(0.7, abs=0.012)
        and both.mean_thrust_sigma_N < 0.4 * alone.mean_thrust_sigma_N
    )
    assert both.fall_time_s == pytest.approx(0.055, abs=0.009)
    assert both.fall_time_sigma_s < alone.fall_time_sigma_s
    for j in (0, 1):
        assert abs(both.center_of_mass_m[j] - (0.06, -0.04)[j]) < 3 * both.center_of_mass_sigma_m[j]
    assert abs(both.correlation["fall_time"]) < 0.7
    assert {d.about.get("record") for d in both.doubts if d.origin == "craft"} == {"wheel-bias-day28", "rcs-burn"}


def test_recovery_of_one_weak_thruster():
    """It looks like a centre of mass off its place, which is said, unless that is known better."""
    weak = [{"thruster": "Z3", "start": "0 s", "factor": 0.8}]
    flight = fly("wheel-bias-day28", craft=CASSINI, changes={"thrusters": {"thrust": "0.7 N"}, "thruster_faults": weak})
    loose = thrust(flight.telemetry, CASSINI)
    assert loose.doubts.has(WEAK_OR_CENTER)
    ratio, sigma = thrust(
        flight.telemetry, CASSINI, priors=thrust_priors(CASSINI, center_sigma_m=(0.01, 0.01, 0.1))
    ).over_mean["Z3"]
    assert abs(ratio - 0.8) < 3 * sigma < 0.12


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("counted", [True, False])
def test_recovery_with_coarse_on_times(day28, count, counted):
    """Every 16 and 64 s, with and without pulse counts: within what is stated, which stays below 001's 10 %."""
    tlm = every(day28.telemetry, count)
    result = thrust(tlm if counted else without(tlm, "pulse_count"), CASSINI)
    assert abs(result.mean_thrust_N - 0.7) < 2.5 * result.mean_thrust_sigma_N < 0.25
    assert result.mean_thrust_sigma_N < 0.1 * 0.7


@pytest.mark.parametrize("name", ["bias", "bias_fsds"])
def test_recovery_on_another_simulators_flight(name):
    """0.75 N, 65 ms, flown on dynamics and a controller that are not ours."""
    craft = load_craft("cassini@001-fsds", cm=(-0.01, 0.02, 1.35)).with_alternative("001-fsds")
    real = load_craft("cassini", inertia=(7375.02, 6061.58, 3829.70, -136.58, 6.23, 180.26), cm=(-0.01, 0.02, 1.35))
    tlm = load_telemetry(flight_data(f"simulated/{name}.csv.gz"), craft=real)
    result = thrust(tlm, real)
    assert abs(result.mean_thrust_N - 0.75) < 2 * result.mean_thrust_sigma_N < 0.1
    assert abs(result.fall_time_s - 0.065) < 2 * result.fall_time_sigma_s
    printed = thrust(tlm, craft, method="printed")
    assert printed.mean_thrust_N == pytest.approx(0.75, rel=0.015)
    assert thrust(tlm, craft, method="printed", variant="printed").mean_thrust_N < 0.745


@pytest.mark.slow
def test_recovery_pulls_are_unit_normal_with_the_truth_from_the_priors():
    """200 biasings and burns, each with a fall time, centre of mass, spin inertias, thrusts and scatter of its own.

    Against the steady thrust, also with a burn, in which a pulse of minutes keeps its scatter throughout (docs/theory/thrust.md)."""
    found = {"alone": [], "both": []}
    for seed in range(200):
        rng = np.random.default_rng(seed)
        fall, center = 0.065 + 0.013 * rng.standard_normal(), np.array([0, 0, 1.35]) + 0.1 * rng.standard_normal(3)
        wheels = tuple(
            w.model_copy(update={"spin_inertia": w.spin_inertia * (1 + 0.0024 * rng.standard_normal())})
            for w in CASSINI.wheels
        )
        true = CASSINI.model_copy(update={"wheels": wheels, "center_of_mass": tuple(center)})
        how = {
            "thrust": "0.7 N",
            "fall": f"{1e3 * max(fall, 0.025)} ms",
            "pulse_scatter": float(rng.uniform(0.01, 0.03)),
        }
        F = 0.7 * (1 + abs(0.05 * rng.standard_normal()) * rng.standard_normal(8))
        own = [{"thruster": n, "start": "0 s", "factor": f / 0.7} for n, f in zip(NAMES, F, strict=True)]
        bias, burned = (
            fly(s, craft=true, seed=seed, changes={"thrusters": how, "thruster_faults": own})
            for s in ("wheel-bias-day28", "rcs-burn")
        )
        priors = thrust_priors(CASSINI, mass_kg=MASS)
        for key, flights in (("alone", [bias]), ("both", [bias, burned])):
            r = thrust([f.telemetry for f in flights], CASSINI, priors=priors)
            impulse = sum(f.truth.thrusters.impulse_Ns[-1] for f in flights)
            steady = impulse @ F / impulse.sum()
            found[key].append([
                (r.mean_thrust_N - steady) / r.mean_thrust_sigma_N, (r.fall_time_s - max(fall, 0.025)) / r.fall_time_sigma_s,
                (r.center_of_mass_m[0] - center[0]) / r.center_of_mass_sigma_m[0], (r.center_of_mass_m[1] - center[1]) / r.center_of_mass_sigma_m[1],
                r.mean_thrust_N / steady - 1,
            ])  # fmt: skip
    alone, both = np.array(found["alone"]), np.array(found["both"])
    assert np.std(alone[:, :4], axis=0) == pytest.approx(1.0, abs=0.2)
    assert abs(alone[:, 4].mean()) < 0.01
    assert np.std(both[:, 1:4], axis=0) == pytest.approx(1.0, abs=0.2)
    assert np.sqrt(np.mean(both[:, 0] ** 2)) == pytest.approx(
        1.0, abs=0.2
    )  # what lasts is weak: low, and the sigma holds it
    assert np.std(both[:, 4]) < 0.006


# ---- faults -------------------------------------------------------------------------------------------------


def test_counter_reset_is_left_out_and_told(day28):
    c = day28.telemetry.channel("on_time_Y1")
    values = c.values.copy()
    values[9:] -= values[9]
    result = thrust(with_values(day28.telemetry, "on_time_Y1", values), CASSINI)
    assert result.doubts.of(COUNTER_FALLS).about(thruster="Y1")
    assert abs(result.mean_thrust_N - 0.7) < 2.5 * result.mean_thrust_sigma_N


def test_missing_pulse_counts_are_told(day28):
    result = thrust(without(day28.telemetry, "pulse_count_Y1"), CASSINI)
    assert not result.pulses_counted and result.doubts.has(PULSES_GUESSED)


def test_a_branch_that_the_craft_file_does_not_describe(day28):
    c = day28.telemetry.channel("on_time_Z1")

    def with_branch(values) -> Telemetry:
        state = Channel("thruster_branch", c.tai_ns, np.asarray(values), np.ones(len(values), bool), "")
        return with_channels(day28.telemetry, state)

    count = len(c.values)
    other = thrust(with_branch(["B"] * count), CASSINI)
    assert other.doubts.of(BRANCH_NOT_DESCRIBED).about(branch="B")
    with pytest.raises(BadInput, match="branch changes"):
        thrust(with_branch(["A"] * (count // 2) + ["B"] * (count - count // 2)), CASSINI)


def test_thrusters_misnamed_are_refused(day28):
    tlm = day28.telemetry
    with pytest.raises(BadInput, match="no thruster 'Q1'"):
        thrust(renamed(tlm, {"Z1": "Q1"}, "on_time"), CASSINI)
    with pytest.raises(BadInput, match="no on-time of thruster Z1"):
        thrust(without(tlm, "on_time_Z1"), CASSINI)
    exchanged = renamed(tlm, {"Y1": "Y2", "Y2": "Y1"}, "on_time", "pulse_count")
    for method in ("joint", "printed"):
        with pytest.raises(BadInput, match="contradict"):
            thrust(exchanged, CASSINI, method=method)


def test_saturated_wheel_is_told(day28):
    c = day28.telemetry.channel("wheel_rate_RWA2")
    limit = next(w.rate_limit for w in CASSINI.wheels if w.name == "RWA2")
    if limit is None:
        pytest.skip("no rate limit known")
    values = c.values / np.abs(c.values).max() * limit
    doubts = firings_of(subject_of(with_values(day28.telemetry, "wheel_rate_RWA2", values), CASSINI)).doubts
    assert doubts.has(AT_LIMIT)


def test_nothing_fires_no_mass_and_other_refusals(day28, burn):
    tlm = day28.telemetry
    with pytest.raises(BadInput, match="no thruster fires"):
        thrust(tlm.between("0", "40"), CASSINI)
    with pytest.raises(BadInput, match="mass is not known"):
        thrust(burn.telemetry, CASSINI, method="accelerometer")
    with pytest.raises(BadInput, match="not in the telemetry"):
        thrust(tlm, CASSINI, method="accelerometer", priors=thrust_priors(CASSINI, mass_kg=MASS))
    with pytest.raises(BadInput, match="variant"):
        thrust(tlm, CASSINI, variant="printed")
    with pytest.raises(BadInput, match="not known"):
        thrust(tlm, CASSINI, method="guess")
    with pytest.raises(BadInput, match="no thrusters"):
        thrust(tlm, load_craft("iss"))
    for bad in (
        {"fall_s": -1.0},
        {"pulse_scatter": 2.0},
        {"center_sigma_m": (0, 1, 1)},
        {"mass_kg": 0.0},
        {"unlike": 0.0},
        {"spin_share": 1.0},
    ):
        with pytest.raises(BadInput):
            thrust_priors(CASSINI, **bad)


def test_momentum_chain_uses_no_more_than_the_counters_tell(day28):
    f = firings_of(subject_of(every(day28.telemetry, 4), CASSINI))
    chain = momentum_chain(f, thrust_priors(CASSINI), 1)
    assert chain.on_time_s.sum() == pytest.approx(f.total_on_time_s.sum())
    assert chain.used.all() and (np.diff(f.tai_ns) > 0).all()


# ---- the program --------------------------------------------------------------------------------------------

KEYS = {"method", "thrust_N", "sigma_N", "thrust_sigma_N", "mean_thrust_N", "mean_sigma_N", "mean_thrust_sigma_N", "fall_time_s", "fall_time_sigma_s", "center_of_mass_m",
        "pulse_ratio", "correlation", "doubts", "provenance"}  # fmt: skip


@pytest.fixture(scope="module")
def file28(day28, tmp_path_factory):
    return saved(day28.telemetry, tmp_path_factory.mktemp("thrust"))


@pytest.mark.parametrize("method", ["joint", "printed"])
def test_program_gives_the_promised_keys(file28, method):
    done = run("thrust", file28, "--method", method, "--cm", "0,0,1.35", "--json")
    assert done.code == 0 and done.err == "", done.err
    assert set(done.record) >= KEYS and set(done.record["thrust_N"]) == set(NAMES)
    assert set(done.record["pulse_ratio"]) == {"printed", "corrected"}
    assert done.record["sigma_N"] == done.record["thrust_sigma_N"]
    pairs = {"+".join(p["thrusters"]): p for p in done.record["pairs"]}
    assert {n: p["thrust_N"] for n, p in pairs.items()} == {n: p["thrust_N"] for n, p in done.record["pairs_N"].items()}
    text = run("thrust", file28, "--method", method, "--cm", "0,0,1.35")
    assert all(d in text.out for d in done.record["doubts"])


def test_program_draws_and_keeps(file28, tmp_path):
    picture, store = tmp_path / "thrust.svg", tmp_path / "s.db"
    done = run("thrust", file28, "--cm", "0,0,1.35", "--plot", picture, "--store", store)
    assert done.code == 0 and picture.stat().st_size > 10_000
    assert "wheel rate [rpm]" in picture.read_text() and "Y1, Y3" in picture.read_text()
    shown = run("trend", "show", "--kind", "thrust", "--store", store, "--json")
    names = {f["figure"] for f in shown.record["figures"]}
    assert {"thrust_mean", "thrust_over_prediction", "thrust_Z3_over_mean"} <= names


def test_program_takes_what_is_known(file28):
    """Alike thrusters and an inertia known worse: both are in the JSON, and the sigmas follow."""
    usual, alike = (
        run("thrust", file28, "--cm", "0,0,1.35", "--json", *more).record
        for more in (
            [],
            [
                "--unlike",
                "0.001",
                "--spin-sigma",
                "0.02",
                "--inertia-sigma",
                "0.05",
                "--mass",
                "3160 kg",
                "--mass-sigma",
                "0.01",
            ],
        )
    )
    assert alike["priors"]["thrusters_unlike"] == 0.001 and alike["priors"]["mass_kg"] == [3160.0, pytest.approx(31.6)]
    assert alike["priors"]["wheel_inertia_share"] == 0.02 and alike["priors"]["inertia_share"] == 0.05
    assert alike["over_mean"]["Z3"]["ratio_sigma"] < 0.2 * usual["over_mean"]["Z3"]["sigma"]
    assert alike["mean_sigma_parts_N"]["spin inertia"] > 5 * usual["mean_sigma_parts_N"]["spin inertia"]


def test_program_says_what_is_wrong(file28):
    assert "--mass" in complaint("thrust", file28, "--method", "accelerometer")
    assert "fall time" in complaint("thrust", file28, "--fall-time", "-3 ms")
