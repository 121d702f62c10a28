"""The fused torque: recovery with a band that holds, and what it says when the model does not fit."""

import json
from dataclasses import replace

import numpy as np
import pytest

import asflown
from asflown import load_craft, load_telemetry
from asflown.campaigns.truth import against_truth
from asflown.estimate.fused import fuse, gather, innovations
from asflown.estimate.fused import levels as fitted_levels
from asflown.estimate.fused.body import AxisData
from asflown.estimate.fused.corners import draw_torques
from asflown.estimate.fused.free_body import FreeBody, FreeLevels
from asflown.estimate.fused.held_body import HeldBody, LoopLevels
from asflown.estimate.fused.levels import fit_levels
from asflown.estimate.fused.series import Series, arrange, channel_of, step_of
from asflown.estimate.fused.smooth_torque import gaussian_torque
from asflown.estimate.subject import GAPS_BRIDGED
from asflown.estimate.torque.choice import CANNOT_FUSE
from asflown.estimate.torque.compare import best_lag
from asflown.kit.ensemble import simulate, spread
from asflown.kit.errors import BadInput
from asflown.kit.smoother import smooth
from conftest import flight_data
from estimate.linear_loop import respond
from flights import CASSINI, changed, flown, only, scaled, without

BODY = HeldBody.under(CASSINI.wheel_controller, 5226.0)
LOOP = [0, 1, 4, 5, 6, 7]  # its states of attitude, rate and rate filter
LEVELS = LoopLevels(0.01, 15, 2e-6, 1e-3, 5e-6, 8e-6, 15, 3e-4)


def fused(telemetry, craft=CASSINI, **how):
    return asflown.torque(telemetry, craft, **{"axis": "y", "method": "fused", **how})


def coverage(result, truth, share=0.95):
    true = np.interp(result.time_s, truth.time_s, truth.torque_Nm[:, 1])
    low, high = result.band(share)
    inside = (low[:, 1] <= true) & (true <= high[:, 1])
    return np.mean(inside), float(np.sqrt(np.mean((result.torque_Nm[:, 1] - true) ** 2)))


def drawn_from_the_model(body, levels, rows, seed, seconds=480):
    """Series and torque drawn from a body's own Gaussian model: what its bounds are bounds of."""
    empty = [Series(r, np.arange(0, seconds + 0.1, step), np.ones(int(seconds / step) + 1)) for r, step in rows]
    times, data = arrange(empty, np.arange(seconds + 1.0))
    model = body.smooth_model(levels, times)
    torque, value = simulate(model, data, [body.torque], 1, np.random.default_rng(seed))
    data = replace(data, value=value[:, 0])
    at = times.seconds[step_of(data)]
    series = [Series(r, at[data.row == r], data.value[data.row == r]) for r, _ in rows]
    return series, times, data, body.inertia_kgm2 * torque[:, 0, 0], model


def test_law_one_axis_model_is_the_loop_of_the_papers():
    """The transfer function torque -> attitude error of the state space is 000 eq 11, worked out in dynamics."""
    from asflown.dynamics.loop import error_per_torque

    F, _ = BODY.dynamics(LEVELS)
    F[1, 8] = 1
    A, b = F[np.ix_(LOOP, LOOP)], F[LOOP, 8] / 5226.0  # torque enters per unit inertia
    num, den = error_per_torque(CASSINI.wheel_controller, 5226.0)
    for f in (1 / 480, 1 / 60, 0.03, 0.1):
        s = 2j * np.pi * f
        attitude = np.linalg.solve(s * np.eye(6) - A, b)[0]
        assert -attitude == pytest.approx(np.polyval(num, s) / np.polyval(den, s), rel=1e-9)


def test_law_a_delay_turns_the_phase_of_what_the_wheels_do():
    """To first order: the loop's answer with a delay of 0.1 s is that with exp(-0.1 s) in the controller."""
    k = CASSINI.wheel_controller
    F, _ = replace(BODY, delay_s=0.1).dynamics(LEVELS)
    f = k.rate_filter
    for hertz in (1 / 120, 1 / 60, 0.03):
        s = 2j * np.pi * hertz
        lowpass = (
            f.natural_frequency**2 / (s**2 + 2 * f.damping * f.natural_frequency * s + f.natural_frequency**2)
        ) ** 2
        late = k.kd_per_s * (k.kp_per_s + lowpass * s) * np.exp(-0.1 * s)
        attitude = np.linalg.solve(s * np.eye(6) - F[np.ix_(LOOP, LOOP)], np.eye(6)[1])[0]
        effect = abs((s**2 + late * np.exp(0.1 * s)) / (s**2 + late) - 1)
        assert abs(attitude * (s**2 + late) - 1) < 0.1 * effect


def test_law_total_momentum_feels_only_the_torque():
    """In the models d(I rate + h)/dt = T, whatever the wheels do beside their command."""
    free = FreeLevels(0.01, 15, 2e-6, 1e-3, 0.01, 2, 6, 5, 2e-6, 5, 0.1)
    for body, levels in ((BODY, LEVELS), (FreeBody(inertia_kgm2=5226.0), free)):
        F, Q = body.dynamics(levels)
        F[body.torque, body.slope] = 1
        if isinstance(body, HeldBody):
            F[body.RATE, body.torque] = 1
        total = np.zeros(body.states)
        total[[body.RATE, body.STORED]] = 1
        assert np.allclose(total @ F, np.eye(body.states)[body.torque]) and np.allclose(total @ Q, 0)


def test_law_sensitivities_are_what_other_numbers_would_measure():
    """Flown with 1 % more inertia or spin inertia, the measurements change by a hundredth of the column."""
    t = np.arange(0, 481.0)
    torque = 0.02 * np.sin(2 * np.pi * t / 80) * (t > 60) * (t < 380)
    rows = [(0, 2), (1, 4), (2, 4)]
    _, times, data, _, _ = drawn_from_the_model(BODY, LEVELS, rows, 0)
    axis = AxisData(BODY, LEVELS, times, data, np.empty((len(data.row), 0)))
    clean = axis.response(torque)
    tight = replace(LEVELS, rate_white_rad_s=1e-9, momentum_white_Nms=1e-6, error_white_rad=1e-9, error_slow_rad=1e-9)
    axis = replace(axis, levels=tight)
    best = smooth(axis.model, replace(data, value=clean))
    found = BODY.sensitivities(axis, best)
    heavier = replace(axis, body=replace(BODY, inertia_kgm2=1.01 * 5226.0)).response(torque)
    for row in (0, 1):  # the wheels take up the same momentum
        here = data.row == row
        size = np.abs(heavier - clean)[here].max()
        assert np.allclose(0.01 * found["inertia"][here], (heavier - clean)[here], atol=0.03 * size)
    stored = data.row == 2
    assert np.allclose(found["spin_inertia"][stored], clean[stored], atol=0.02 * np.abs(clean[stored]).max())
    assert not found["spin_inertia"][~stored].any() and not found["inertia"][stored].any()


@pytest.mark.parametrize("limit", ["momentum", "transfer"])
def test_law_the_papers_methods_are_limits(limit):
    """Total momentum alone, or attitude error alone taken as exact: each gives a smooth torque back, on a loop that
    shares no line with the model."""
    t = np.arange(0, 480 + 1e-9, 0.125)
    torque = 0.02 * np.sin(2 * np.pi * t / 120) ** 3
    attitude, rate, momentum = respond(t, torque, 5226.0)
    if limit == "momentum":
        body = FreeBody(inertia_kgm2=5226.0, wiener=True)
        levels = FreeLevels(0.02, 15, 1e-8, 1e-6, 0.02, 5, 100, 100, 1e-9, 5, 1e-3)
        series = [Series(1, t[::32], rate[::32]), Series(2, t[::32], momentum[::32])]
    else:
        body = replace(BODY, wiener=True)
        levels = replace(LEVELS, torque_Nm=0.02, error_white_rad=1e-9, error_slow_rad=1e-12, reaction_Nm_sqrt_s=1e-9)
        series = [Series(0, t[::16], -attitude[::16])]
    times, data = arrange(series, np.arange(481.0))
    best = body.inertia_kgm2 * smooth(body.smooth_model(levels, times), data).mean[times.wanted, body.torque]
    inner = slice(20, 460)
    assert np.allclose(best[inner], torque[::8][inner], atol=3e-4)  # N m of 0.02


def test_series_of_different_times_merge_into_one_pass():
    series = [
        Series(0, np.array([0.0, 2, 4]), np.array([1.0, 2, 3])),
        Series(2, np.array([0.0, 4]), np.array([7.0, 8])),
    ]
    times, data = arrange(series, np.array([1.0, 2.0, 3.0]))
    assert times.seconds.tolist() == [0, 1, 2, 3, 4] and times.wanted.tolist() == [False, True, True, True, False]
    assert data.start.tolist() == [0, 2, 2, 3, 3, 5]
    assert sorted(zip(data.row.tolist(), data.value.tolist(), strict=True)) == [(0, 1), (0, 2), (0, 3), (2, 7), (2, 8)]


def test_a_sample_at_a_jump_has_a_noise_of_its_own():
    """A wheel tears loose: the two readings beside it are uncertain by the jump's rate times that of their instants."""
    t = np.arange(40.0)
    values = 0.01 * np.sin(t) + 5.0 * (t >= 20)
    s = Series(2, t, values).with_jumps()
    assert np.flatnonzero(s.steep).tolist() == [19, 20] and s.steep[20] == pytest.approx(5, abs=0.05)
    assert not s.where(t < 19).steep.any() and Series(2, t, 0.01 * np.sin(t)).with_jumps().steep is None
    times, data = arrange([s])
    assert channel_of(times, data).tolist() == [2] * 40 and data.row.max() == 5
    body, levels = FreeBody(inertia_kgm2=1.0), FreeLevels(0.01, 15, 1e-3, 1e-2, 0.01, 2, 6, 5, 1e-3, 5, 0.1)
    model = body.smooth_model(levels, times)
    noise = np.sqrt(model.R[data.row])
    assert noise[10] == pytest.approx(1e-2) and noise[19] == pytest.approx(np.hypot(1e-2, 0.1 * s.steep[19]))
    assert np.array_equal(model.H[data.row[19]], model.H[2])


@pytest.mark.slow
@pytest.mark.parametrize("prior", ["matern", "edges"])
def test_law_near_the_bound_for_torques_drawn_from_the_prior(prior):
    """Within 1.15 of the posterior Cramer-Rao bound of the known linear Gaussian model, levels fitted, not told."""
    bound, found = [], []
    for seed in range(6):
        series, _, data, torque, model = drawn_from_the_model(BODY, LEVELS, [(0, 2), (1, 4), (2, 4)], seed)
        bound.append(BODY.inertia_kgm2**2 * smooth(model, data).covariance[:, BODY.torque, BODY.torque].mean())
        fit = fit_levels(BODY, series)
        axis = AxisData.of(BODY, fit.levels, fit.series, np.arange(481.0))
        solve = gaussian_torque if prior == "matern" else draw_torques
        post = solve(axis, 200, np.random.default_rng(seed))
        found.append(np.mean((post.mean[axis.times.wanted] - torque) ** 2))
    assert np.sqrt(np.mean(found) / np.mean(bound)) < 1.15


@pytest.mark.parametrize("profile", ["profile-1", "profile-2"])
def test_recovery_fused_beats_both_printed_methods_and_its_band_holds(profile):
    """Nominal noise, four seeds: RMS at most a quarter of printed momentum, 1/2.4 of printed transfer; 95 % band."""
    ours, momentum, transfer, held, lags = [], [], [], [], []
    for seed in range(4):
        flight = flown(profile, seed=seed)
        truth = (flight.truth.time_s, flight.truth.torque_Nm[:, 1])
        peaks = [(t, v) for t, v, _ in flight.truth.peaks]
        r = fused(flight.telemetry)
        inside, rms = coverage(r, flight.truth)
        held.append(inside)
        ours.append(rms)
        lags.append(best_lag(r.time_s, np.interp(r.time_s, *truth), r.time_s, r.torque_Nm[:, 1])[0])
        for method, to in (("momentum", momentum), ("transfer", transfer)):
            p = asflown.torque(flight.telemetry, CASSINI, method=method, variant="printed", axis="y")
            to.append(against_truth(p, *truth, peaks, "y").rms_Nm)
    ratio = np.exp(np.mean(np.log(np.array([momentum, transfer]) / ours), axis=1))
    assert ratio[0] > 4 and ratio[1] > 2.4
    assert 0.9 < np.mean(held) <= 1
    assert abs(np.mean(lags)) < 0.3  # s


@pytest.mark.parametrize("run", ["torque1", "torque2", "torque1_flex", "cover"])
def test_recovery_fused_on_another_simulator(run):
    tlm = load_telemetry(flight_data(f"simulated/{run}.csv.gz"))
    profile = json.loads(flight_data(f"simulated/{run}.json").read_text())["torque_profile"]
    craft = load_craft("cassini", inertia=(6570, 5333, 3400, -122, -10, 118))
    r = fused(tlm, craft)
    p = asflown.torque(tlm, craft, axis="y", variant="printed")
    true = np.interp(r.time_s, profile["t_s"], profile["torque_Nm"])
    error = r.torque_Nm[:, 1] - true
    printed = p.torque_Nm[:, 1] - np.interp(p.time_s, profile["t_s"], profile["torque_Nm"])
    assert np.sqrt(np.mean(error**2)) < np.sqrt(np.mean(printed**2)) / 4
    low, high = r.band(0.95)  # one record: some twenty stretches that err by themselves, so 0.95 +- 0.05
    assert np.mean((low[:, 1] <= true) & (true <= high[:, 1])) > 0.8


@pytest.mark.slow
def test_recovery_impulse_has_a_sigma_that_holds():
    """000's first figure of merit, minute 1 to 2.35, without differentiating."""
    pulls = []
    for seed in range(6):
        flight = flown("profile-1", seed=seed)
        value, sigma = fused(flight.telemetry).impulse(60, 141, "y")
        t = np.arange(60, 141.0001, 0.125)
        true = np.trapezoid(np.interp(t, flight.truth.time_s, flight.truth.torque_Nm[:, 1]), t)
        pulls.append((value - true) / sigma)
        assert sigma < 0.02 * abs(true)  # under 2 %
    assert np.max(np.abs(pulls)) < 3.5


def test_a_gap_is_bridged_with_a_wider_band():
    flight = flown("profile-1", seed=2)
    tlm = flight.telemetry
    keep = {n: c.where((tlm.seconds(c.tai_ns) < 200) | (tlm.seconds(c.tai_ns) > 230)) for n, c in tlm.channels.items()}
    r = fused(replace(tlm, channels=keep))
    assert np.isfinite(r.torque_Nm[:, 1]).all()
    hole = (r.time_s > 208) & (r.time_s < 222)
    assert r.torque_sigma_Nm[hole, 1].mean() > 2 * np.median(r.torque_sigma_Nm[:, 1])
    assert coverage(r, flight.truth)[0] > 0.9
    assert r.doubts.has(GAPS_BRIDGED)


def test_spikes_are_left_out_and_counted():
    """One in a hundred samples of every channel, also the first one, moved by thirty usual steps."""
    flight = flown("profile-1", seed=3)
    tlm, rng = flight.telemetry, np.random.default_rng(0)
    channels = {}
    for n, c in tlm.channels.items():
        v = c.values.copy()
        if not n.startswith("quaternion"):
            hit = rng.random(len(v)) < 0.01
            hit[0] = n == "wheel_rate_RWA1"
            v[hit] += 30 * np.std(np.diff(v)) * rng.choice([-1, 1], hit.sum())
        channels[n] = replace(c, values=v)
    r = fused(replace(tlm, channels=channels))
    assert r.settings["left_out"]["y"] >= 2 and r.doubts.has(fitted_levels.OUTLIERS)
    inside, rms = coverage(r, flight.truth)
    assert inside > 0.9 and rms < 4e-4


def test_same_input_gives_the_same_answer():
    tlm = flown("profile-2", seed=1).telemetry
    a, b = fused(tlm), fused(tlm)  # the paths' seed is fixed and stands in the settings
    assert np.array_equal(a.torque_Nm[:, 1], b.torque_Nm[:, 1])


def test_the_spread_of_normal_samples_is_their_sigma():
    samples = np.random.default_rng(0).normal(size=(200_000, 2)) * [1, 3]
    assert spread(samples) == pytest.approx([1, 3], rel=0.01)


def test_recovery_gyroscopic_torque_is_taken_off():
    """The craft turns about z with momentum in its wheels: w x h is 1 mN m about x and y and none of it a disturbance."""
    flight = flown("quiet", seed=1, wheel_rates={"RWA1": "900 rpm", "RWA2": "-900 rpm"}, torques=[
        {"shape": "constant", "torque": "0 0.004 0 N m"}])  # fmt: skip
    r = fused(flight.telemetry, axis="all")
    inner = (r.time_s > 60) & (r.time_s < 420)
    assert np.mean(r.torque_Nm[inner, 1]) == pytest.approx(0.004, abs=3e-4)
    one = fused(flight.telemetry, axis="y")
    assert np.array_equal(one.torque_Nm[:, 1], r.torque_Nm[:, 1])


def test_recovery_with_the_controller_unknown():
    """Wheels and rates alone: what the wheels do is measured.  The band holds; the attitude error's part is missed."""
    flight = flown("profile-1", seed=2)
    r = fused(without(flight.telemetry, "attitude_error"))
    assert r.settings["loop"] == "measured" and r.doubts.has(gather.LOOP_MEASURED)
    inside, rms = coverage(r, flight.truth)
    assert inside > 0.9 and rms < 9e-4  # printed momentum: 1.4e-3


def test_recovery_from_control_torque_alone():
    """Commands and rates, as where gyroscopes hold a station."""
    flight = flown("profile-1", seed=2, telemetry={"control_torque": "1 s", "wheel_rate": "0 s"})
    r = fused(flight.telemetry)
    assert r.settings["loop"] == "measured" and "control_torque" in r.settings["considered"]["y"]
    inside, rms = coverage(r, flight.truth)
    assert inside > 0.85 and rms < 1e-3


def test_recovery_a_clock_that_is_late_is_found_and_set():
    flight = flown("profile-2", seed=4)
    late = changed(flight.telemetry, "attitude_error", lambda c: replace(c, tai_ns=c.tai_ns + 1_500_000_000))
    r = fused(late)
    offset = r.settings["time_offsets"]["y"]["attitude_error"]
    assert offset["corrected"] and offset["seconds"] == pytest.approx(1.5, abs=0.4)
    assert r.doubts.of(fitted_levels.TIMES_SHIFTED).about(channel="attitude_error", side="late")
    assert coverage(r, flight.truth)[1] < 6e-4


def test_recovery_a_wrong_inertia_is_noticed():
    """10 % off: the data say so, and the answer does not follow it."""
    flight = flown("profile-1", seed=1, noise="half")
    wrong = load_craft("cassini", inertia=(6510, 0.9 * 5333, 3519, -125, -39, 133))
    r = fused(flight.telemetry, wrong)
    assert r.doubts.of(innovations.KNOWN_OFF).about(name="inertia") or r.doubts.has(fuse.LOOP_NOT_USED)
    assert coverage(r, flight.truth)[1] < 5e-4


def test_a_loop_that_does_not_explain_the_data_is_not_used():
    """Attitude error of another craft: nothing in the loop as described could make it."""
    flight, other = flown("profile-1", seed=1), flown("profile-2", seed=5)
    mixed = changed(flight.telemetry, "attitude_error", lambda c: other.telemetry.channel(c.name))
    r = fused(mixed)
    assert r.settings["loop"] == "measured" and r.doubts.has(fuse.LOOP_NOT_USED)
    assert coverage(r, flight.truth)[1] < 9e-4
    with_it = fused(mixed, loop="modelled")
    assert with_it.doubts.has(innovations.UNEXPLAINED)


def test_wheels_read_at_instants_of_their_own():
    """The model carries each wheel's samples to common instants."""
    flight = flown("profile-2", seed=1, telemetry={"wheel_rate": "1 s"})
    phases = {"RWA1": 0, "RWA2": 1, "RWA4": 3}
    r = fused(changed(flight.telemetry, "wheel_rate", lambda c: c.where(slice(phases[c.member], None, 4))))
    assert r.doubts.has(gather.WHEELS_CARRIED)
    inside, rms = coverage(r, flight.truth)
    assert inside > 0.9 and rms < 5e-4


def test_priors_and_considered_quantities_can_be_chosen():
    flight = flown("profile-1", seed=1)
    sigma = {}
    for prior in ("edges", "matern", "wiener"):
        r = fused(flight.telemetry, prior=prior)
        assert r.settings["prior"] == prior
        sigma[prior] = np.median(r.torque_sigma_Nm[:, 1])
        assert coverage(r, flight.truth)[0] > 0.9
    assert sigma["edges"] < sigma["matern"]
    exact = fused(flight.telemetry, considered=dict.fromkeys(("inertia", "spin_inertia", "kp", "kd", "delay_s"), 0.0))
    vague = fused(flight.telemetry, considered={"inertia": 0.1, "spin_inertia": 0.05})
    assert not exact.settings["considered"]["y"]
    assert vague.torque_sigma_Nm[:, 1].mean() > 1.2 * exact.torque_sigma_Nm[:, 1].mean()
    for how in ({"prior": "magic"}, {"loop": "open"}, {"considered": {"mass": 0.1}}, {"considered": {"kp": -1.0}},
                {"method": "momentum", "prior": "edges"}):  # fmt: skip
        with pytest.raises(BadInput):
            fused(flight.telemetry, **how)


def test_a_long_quiet_record_is_quiet():
    flight = flown("quiet", seed=1, duration="7000 s", telemetry={"attitude_error": "4 s"})
    r = fused(flight.telemetry)
    assert r.settings["prior"] == "edges"
    assert np.sqrt(np.mean(r.torque_Nm[:, 1] ** 2)) < 1e-4


@pytest.mark.slow
def test_a_peak_has_a_sigma_that_holds():
    pulls = []
    for seed in range(4):
        flight = flown("profile-2", seed=seed)
        r = fused(flight.telemetry)
        for t, v, _ in flight.truth.peaks:
            p = r.peak(t, 8.0, "y")
            pulls.append((p.torque_Nm - v) / p.torque_sigma_Nm)
            assert p.torque_sigma_Nm < 0.06 * abs(v)
            assert p.torque_ci95_Nm[0] < p.torque_Nm < p.torque_ci95_Nm[1]
    assert np.abs(pulls).max() < 4 and abs(np.mean(np.array(pulls) * np.tile([1, -1], 12))) < 1


def test_the_default_falls_back_to_momentum_where_fused_cannot_be_used():
    tlm = flown("profile-1", seed=1).telemetry
    wheels = only(tlm, "wheel_rate")
    r = asflown.torque(wheels, CASSINI, axis="y")
    (doubt,) = r.doubts.of(CANNOT_FUSE).about(method="momentum")
    assert r.method == "momentum" and doubt.about["why"].startswith("body_rate_y: ")
    r = asflown.torque(only(tlm, "attitude_error"), CASSINI, axis="y")
    assert r.method == "transfer" and r.doubts.of(CANNOT_FUSE).about(method="transfer")
    with pytest.raises(BadInput, match="body_rate"):
        fused(wheels)
    assert asflown.torque(tlm, CASSINI, axis="y", window_s=40).method == "momentum"
    assert asflown.torque(tlm, CASSINI, axis="y", variant="printed").method == "momentum"


@pytest.mark.slow
def test_recovery_in_a_slew_the_actuators_are_taken_as_measured():
    flight = flown("slews", seed=1)
    r = fused(flight.telemetry, axis="all")
    assert r.settings["loop"] == "measured" and "slews" in r.doubts.of(gather.LOOP_MEASURED)[0].about["why"]
    assert np.sqrt(np.mean(r.torque_Nm**2)) < 3e-3  # N m; the wheels pass hundreds of times that
    with pytest.raises(BadInput, match="slews"):
        fused(flight.telemetry, loop="modelled")


def test_a_silent_channel_a_short_record_and_the_printed_variant_are_refused():
    tlm = flown("profile-1", seed=1).telemetry
    with pytest.raises(BadInput, match="never changes"):
        fused(scaled(tlm, "attitude_error_y", 0))
    with pytest.raises(BadInput, match="fewer than 25"):
        fused(tlm.between(0, 60))
    with pytest.raises(BadInput, match="in no paper"):
        fused(tlm, variant="printed")
