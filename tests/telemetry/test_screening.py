"""Screening finds what was put in, counts it, and leaves genuine motion alone."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.kit.errors import BadInput
from asflown.telemetry.findings import IMPLAUSIBLE
from asflown.telemetry.screening import dropouts, gaps, needs_a_look, quantisation_step, sample_noise, screen, summaries
from flights import CASSINI, EPOCH, telemetry_of
from telemetry.signals import noise

T = np.arange(0.0, 1000.0, 2.0)


def counts(t, channel):
    return {f.what: f.count for f in t.findings if f.channel == channel}


def one(values, name="body_rate_x", at=T):
    return screen(telemetry_of(**{name: (at, values)}))


def test_clean_noise_has_no_findings():
    for seed in range(30):
        t = one(noise(500, 1e-5, seed))
        assert t.findings == () and t.doubts == () and t.channels["body_rate_x"].valid.all()


@pytest.mark.parametrize("ratio", [0.05, 0.3, 1.0, 3.0])
def test_quantised_noise_has_no_findings(ratio):
    q = 1e-5 * ratio
    for seed in range(10):
        assert one(np.rint(noise(500, 1e-5, seed) / q) * q).findings == ()


def test_recovery_spikes_are_found_and_only_they():
    for seed in range(10):
        at = np.random.default_rng(seed).choice(np.arange(2, 498, 5), 6, replace=False)
        x = noise(500, 1e-5, seed)
        x[at] += 1e-3
        t = one(x)
        assert counts(t, "body_rate_x") == {"spike": 6}
        assert np.flatnonzero(~t.channels["body_rate_x"].valid).tolist() == sorted(at)
        assert needs_a_look(t)


@pytest.mark.parametrize("sigma", [0.0, 1e-5])
def test_genuine_motion_is_not_a_spike(sigma):
    t = T[:, None] - 500
    for shape in (
        np.where(t > 0, 1e-2, 0.0),  # a step
        np.where(t > 0, 1e-2 * np.exp(-t / 5), 0.0),  # a kick that dies out in a few samples
        1e-2 * np.maximum(0, 1 - np.abs(t) / 6),  # a triangle of a few samples
        1e-2 * np.exp(-((t / 3) ** 2)),
        np.where(t > 0, 1e-2 * np.exp(-t / 4) * np.cos(t), 0.0),
    ):
        found = one(shape[:, 0] + noise(500, sigma))
        assert found.channels["body_rate_x"].valid.all(), found.findings


def test_duplicates_identical_and_differing_are_told_apart():
    at = np.insert(T, [5, 9], [T[4], T[8]])
    x = np.insert(noise(500, 1e-5), [5, 9], [0.0, 0.0])
    x[5] = x[4]
    t = one(x, at=at)
    assert counts(t, "") == {"duplicate": 1, "conflict": 1}
    c = t.channels["body_rate_x"]
    assert len(c.values) == 500 and (np.diff(c.tai_ns) > 0).all()
    assert (c.values == noise(500, 1e-5)).all()


def test_a_few_late_samples_are_sorted():
    x, order = noise(500, 1e-5), np.arange(500)
    order[[10, 11, 200, 202]] = order[[11, 10, 202, 200]]
    t = one(x[order], at=T[order])
    assert counts(t, "")["disorder"] in (2, 3)
    assert (t.channels["body_rate_x"].values == x).all()


@pytest.mark.parametrize(
    "order", [np.arange(500)[::-1], np.r_[0:300, 100:300], np.r_[400:500, 0:400], np.array([1, 0])]
)
def test_a_clock_that_runs_backwards_is_refused(order):
    with pytest.raises(BadInput, match="time runs backwards") as told:
        one(noise(500)[order], at=T[order])
    assert " s (2015-09-29T" in str(told.value)


def test_dropouts_and_gaps_by_the_channels_own_cadence():
    keep = np.ones(500, bool)
    keep[[10, 11, 50, 100, 101, 102, 103, 104]] = False  # 2, 1 and 5 missing: bridged
    keep[200:206] = False  # 6 missing: a gap
    c = one(noise(500, 1e-5)[keep], at=T[keep]).channels["body_rate_x"]
    assert len(dropouts(c)) == 3
    assert [((a - EPOCH) / 1e9, (b - EPOCH) / 1e9) for a, b in gaps(c)] == [(398.0, 412.0)]
    assert len(c.segments()) == 2


def test_recovery_repeats_are_found_and_only_they():
    x = np.rint(noise(500, 1e-5) / 1e-8) * 1e-8
    for i in (30, 77, 120, 333):
        x[i] = x[i - 1]
    x[401] = x[402] = x[400]
    t = one(x)
    assert counts(t, "body_rate_x") == {"repeat": 6}
    assert np.flatnonzero(~t.channels["body_rate_x"].valid).tolist() == [30, 77, 120, 333, 401, 402]


def test_repeated_frames_are_found():
    x = {f"body_rate_{a}": np.rint(noise(500, 1e-5, k) / 5e-6) * 5e-6 for k, a in enumerate("xyz")}
    x |= {f"wheel_rate_{w}": 60 + noise(500, 0.1, w) for w in (1, 2, 4)}
    for v in x.values():
        v[[100, 300]] = v[[99, 299]]
    t = screen(telemetry_of(**{k: (T, v) for k, v in x.items()}))
    for c in t.channels.values():
        assert not c.valid[[100, 300]].any()
        assert (~c.valid).sum() == 2


@pytest.mark.parametrize("held", [None, 0.0])
def test_stuck_sensor_is_found(held):
    x = noise(500, 1e-5)
    x[300:400] = x[299] if held is None else held
    t = one(x)
    assert counts(t, "body_rate_x")["stuck"] in (99, 100)
    assert not t.channels["body_rate_x"].valid[301:400].any()
    assert needs_a_look(t)


def test_rest_is_not_a_stuck_sensor():
    x = np.where(T < 400, 0.0, 1e-3 * np.sin((T - 400) / 40))
    x[T > 700] = x[T <= 700][-1]
    assert one(x).channels["body_rate_x"].valid.all()  # without noise there is nothing to say
    wheel = np.where(T < 500, 20 + noise(500, 0.1), 0.0)
    assert one(wheel, "wheel_rate_A").channels["wheel_rate_A"].valid.all()  # a wheel switched off
    quiet = np.rint((1e-4 * np.sin(T / 300) + noise(500, 1e-6)) / 1e-5) * 1e-5  # noise well below a step
    assert one(quiet).findings == ()


def test_a_smooth_channel_that_stops_dead_is_told_but_used():
    x = 60 + np.sin(T / 30) + 0.01 * np.sin(T / 3)
    x[200:260] = x[200]
    t = one(x, "wheel_rate_A")
    assert counts(t, "wheel_rate_A") == {"still": 59} and not needs_a_look(t)
    assert t.channels["wheel_rate_A"].valid.all()


def test_declared_wrap_is_undone_in_each_stretch():
    turn = 0.01 * T
    keep = (T < 400) | (T > 450)
    c = telemetry_of(cover_angle=(T[keep], np.mod(turn, 2 * np.pi)[keep])).channels["cover_angle"]
    t = screen(replace(telemetry_of(), channels={"cover_angle": replace(c, modulus=2 * np.pi)}))
    assert counts(t, "cover_angle")["wrap"] == 1
    x = t.channels["cover_angle"].values
    for part in t.channels["cover_angle"].segments():
        assert np.ptp(x[part] - turn[keep][part]) < 1e-12  # continuous inside, turns unknown across the gap


def test_undeclared_wraps_are_suspected():
    t = one(np.mod(np.arange(500) * 7.0, 256), "pulse_count_Z1")
    assert counts(t, "pulse_count_Z1")["fall"] == 13 and needs_a_look(t)
    saw = np.mod(0.05 * T, 12) - 6 + noise(500, 0.001)
    assert "fall" in counts(one(saw, "wheel_rate_A"), "wheel_rate_A")
    assert one(np.where(T > 500, 60.0, 0) + noise(500, 0.01), "wheel_rate_A").findings == ()


def test_quaternion_sign_flips_are_harmless_and_bad_lengths_are_not():
    q = np.tile([0.5, 0.5, -0.5, 0.5], (500, 1)) + noise(2000, 1e-6).reshape(500, 4)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    q[250:] *= -1
    q[400:403] *= -1
    columns = {f"quaternion_{m}": (T, q[:, k]) for k, m in enumerate("wxyz")}
    t = screen(telemetry_of(**columns))
    assert t.findings == () and all(c.valid.all() for c in t.channels.values())
    q[77:80] *= 0.5
    t = screen(telemetry_of(**columns))
    assert counts(t, "quaternion_w")["norm"] == 3
    assert all(np.flatnonzero(~c.valid).tolist() == [77, 78, 79] for c in t.channels.values())


def test_rpm_labelled_rad_per_s_is_doubted():
    rpm = 600 + noise(500, 1)
    assert one(rpm, "wheel_rate_RWA1").doubts == ()  # 600 rad/s is possible for some wheel
    t = screen(telemetry_of(wheel_rate_RWA1=(T, rpm), wheel_rate_RWA2=(T, -rpm)), CASSINI)
    assert len(t.doubts) == 1 and needs_a_look(t)
    assert t.doubts[0].kind == IMPLAUSIBLE and t.doubts[0].about["channels"] == "wheel_rate_RWA1, wheel_rate_RWA2"
    assert "rpm labelled" in str(t.doubts[0])
    assert "unit?" in summaries(t)[0].suspicions
    assert one(2000 + noise(500), "wheel_rate_A").doubts.has(IMPLAUSIBLE)
    assert "mrad" in str(one(noise(500, 0.3), "attitude_error_x").doubts.of(IMPLAUSIBLE)[0])


def test_noise_and_quantisation_are_measured():
    x = 1e-3 * np.sin(T / 50) + noise(500, 1e-5)
    c = one(x).channels["body_rate_x"]
    assert sample_noise(c) == pytest.approx(1e-5, rel=0.15)  # 3 sigma of a median of 500
    for q in (0.4 * 2 * np.pi / 60, 5e-9, 1.0):
        assert quantisation_step(np.rint(noise(500, 30 * q) / q) * q) == pytest.approx(q, rel=1e-6)
    assert quantisation_step(noise(500)) == 0 and quantisation_step(np.ones(9)) == 0


def test_state_channels_pass():
    t = screen(telemetry_of(control_mode=(T, np.array(["RWA", "RCS"] * 250))))
    assert t.findings == () and summaries(t)[0].noise is None
