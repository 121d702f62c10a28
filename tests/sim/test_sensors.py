"""The instruments: noise of the stated size and colour, sampling, losses."""

import numpy as np
import pytest

from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly
from asflown.sim.flight.sensors import NOISE, stream


def test_published_noise_table():
    n = NOISE["nominal"]
    assert (n.attitude_white_rad, n.attitude_coloured_rad, n.attitude_time_s) == (5e-6, 8e-6, 15.0)
    assert (n.gyro_rad_s, n.wheel_rad_s) == (2e-6, 0.005)
    assert NOISE["half"].wheel_rad_s == 0.0025 and NOISE["double"].attitude_time_s == 15.0


@pytest.fixture(scope="module")
def long_quiet():
    return fly("quiet", changes={"duration": "14400 s", "telemetry": {"body_rate": "1 s"}})


def test_law_estimation_error_has_the_stated_size_and_time_constant(long_quiet):
    """Three axes of four hours hold about 1400 independent spells of 2 x 15 s: sigma to 2 %, 3 sigma 6 %."""
    x = long_quiet.truth.estimation_error_rad[::8]
    variance = np.mean(x**2)
    assert np.sqrt(variance) == pytest.approx(8e-6, rel=0.06)
    for lag in (5, 15, 30):
        assert np.mean(x[:-lag] * x[lag:]) / variance == pytest.approx(np.exp(-lag / 15), abs=0.08)


def test_law_gyro_and_wheel_noise_have_the_stated_size(long_quiet):
    seen = long_quiet.telemetry
    rate = np.concatenate([seen.channel(f"body_rate_{a}").values for a in "xyz"])
    true = long_quiet.truth.body_rate_rad_s[::8].T.ravel()
    assert np.std(rate - true) == pytest.approx(2e-6, rel=0.02)
    wheel = seen.channel("wheel_rate_RWA2").values - long_quiet.truth.wheel_rate_rad_s[::32, 1]
    assert np.std(wheel) == pytest.approx(0.005, rel=0.05)


def test_law_the_telemetry_error_is_command_less_estimate_plus_white_noise():
    flight = fly("quiet", changes={"duration": "7200 s", "telemetry": {"attitude_error": "0.125 s"}})
    e = flight.telemetry.channel("attitude_error_x").values
    true = 2 * flight.truth.attitude[:, 1]  # from the command, which is the identity
    assert np.std(e + true + flight.truth.estimation_error_rad[:, 0]) == pytest.approx(5e-6, rel=0.02)


def test_law_no_noise_means_none():
    flight = fly("quiet", noise="none", changes={"duration": "20 s"})
    for channel in flight.telemetry.channels.values():
        assert np.ptp(channel.values) < 1e-12


def test_law_one_sensor_more_changes_no_other():
    assert np.array_equal(stream(3, "gyro").random(4), stream(3, "gyro").random(4))
    plain = fly("profile-1", changes={"duration": "60 s"}).telemetry
    more = fly(
        "profile-1", changes={"duration": "60 s", "telemetry": {"rate_error": "2 s", "controller_rate_error": "2 s"}}
    ).telemetry
    assert "rate_error_x" in more and "rate_error_x" not in plain
    for name, c in plain.channels.items():
        assert np.array_equal(c.values, more.channel(name).values)


def test_channels_have_the_published_intervals():
    t = fly("cover-deploy").telemetry
    seconds = {n: t.channel(n).cadence_ns / 1e9 for n in t.channels}
    assert {n: s for n, s in seconds.items() if n.endswith("_y") or n[-1] == "1"} == {
        "wheel_rate_RWA1": 4, "body_rate_y": 4, "attitude_error_y": 2, "quaternion_y": 4,
    }  # fmt: skip
    for name in ("cover_angle", "motor_current", "motor_temperature", "motor_on", "microswitch"):
        assert seconds[name] == 64
    assert t.channel("wheel_rate_RWA4").tai_ns[0] == t.epoch_ns


def test_losses_counts_and_phases():
    sent = {
        "dropout": 0.1, "random_phases": True, "quantum": {"wheel_rate": "0.1 rpm", "body_rate": "1 urad/s"},
        "gaps": [{"channel": "wheel_rate_RWA2", "start": "100 s", "stop": "200 s"}, {"start": "300 s", "stop": "320 s"}],
    }  # fmt: skip
    t = fly("quiet", changes={"telemetry": sent}).telemetry
    s = t.seconds(t.channel("wheel_rate_RWA2").tai_ns)
    assert not np.any((s > 100) & (s < 200)) and not np.any((s > 300) & (s < 320))
    whole = t.channel("body_rate_x")
    assert np.abs(np.round(whole.values / 1e-6) - whole.values / 1e-6).max() < 1e-9
    assert whole.count_size == pytest.approx(1e-6)
    assert 80 < len(whole.tai_ns) < 114  # 121 less five in the gap and about a tenth
    phases = {n: t.channel(n).tai_ns[0] % 10**9 for n in t.channels}
    assert len(set(phases.values())) > 1
    assert phases["body_rate_x"] == phases["body_rate_y"]  # one reading of three axes


@pytest.mark.parametrize(
    "sent",
    [{"wheel_rate": "0.01 s"}, {"gaps": [{"channel": "tank_pressure", "start": "1 s", "stop": "2 s"}]},
     {"quantum": {"wheel_speed": "1 rpm"}}, {"quantum": {"wheel_rate": "1 rpm/s"}}, {"dropout": 1.5}],
)  # fmt: skip
def test_sampling_that_cannot_be_is_refused(sent):
    with pytest.raises(BadInput) as why:
        fly("quiet", changes={"duration": "10 s", "telemetry": sent})
    assert len(str(why.value)) < 1400


def test_law_quaternions_carry_the_rate_in_a_slew():
    flight = fly("slews", noise="none", changes={"duration": "400 s", "telemetry": {"quaternion": "1 s"}})
    q = np.column_stack([flight.telemetry.channel(f"quaternion_{m}").values for m in "wxyz"])
    from asflown.kit.rotations import rates_between

    s, w = rates_between(np.arange(len(q), dtype=float), q)
    true = np.column_stack([np.interp(s, flight.truth.time_s, flight.truth.body_rate_rad_s[:, i]) for i in range(3)])
    assert np.abs(w - true).max() < 1e-6
