"""Faults of received telemetry, by kind: what must not be used is left out and told, what is sound is kept."""

import numpy as np
import pytest

from asflown.kit.timeline import NS
from asflown.telemetry.screening import needs_a_look, screen
from asflown.telemetry.telemetry import Channel, Telemetry

N = 600


def hold(seed=1, noise=0.01) -> dict[str, np.ndarray]:
    """Three wheels and three rates of a quiet hold."""
    rng = np.random.default_rng(seed)
    t = np.arange(N)
    wheels = {
        f"wheel_rate_{k}": w + 0.3 * np.sin(t / 40 + k) + rng.normal(0, noise, N)
        for k, w in enumerate((120.0, -90.0, 150.0), 1)
    }
    return wheels | {f"body_rate_{a}": rng.normal(0, 3e-6, N) for a in "xyz"}


def screened(values: dict[str, np.ndarray], tai_ns=None, craft=None, **channel):
    tai_ns = np.arange(N) * NS if tai_ns is None else tai_ns
    channels = {
        n: Channel(n, tai_ns, np.asarray(v, float), np.ones(len(v), bool), **channel) for n, v in values.items()
    }
    return screen(Telemetry(channels, 0), craft)


def found(telemetry, what: str) -> int:
    return sum(f.count for f in telemetry.findings if f.what == what)


@pytest.mark.parametrize("value", [-9999.0, 32767.0, -1e31, 9.969209968386869e36, 1e20, 4321.5])
@pytest.mark.parametrize("length", [2, 3, 9])
def test_law_fill_values_are_left_out_whatever_their_runs(value, length):
    values = hold()
    for start in (200, 407):
        for v in values.values():
            v[start : start + length] = value
    t = screened(values)
    assert found(t, "fill") == 2 * length * len(values) and needs_a_look(t)
    for c in t.channels.values():
        assert (~c.valid).sum() == 2 * length and not c.valid[200 : 200 + length].any()


def test_law_rows_of_zeros_are_unfilled_packets():
    values = hold()
    for v in values.values():
        v[100:103] = 0.0
        v[333] = 0.0
    t = screened(values)
    assert found(t, "fill") == 4
    assert all((~c.valid).sum() == 4 for c in t.channels.values())


def test_law_a_wheel_at_rest_is_no_fill_value():
    values = hold()
    ramp = np.clip(np.concatenate((np.linspace(120, 0, 150), np.zeros(300), np.linspace(0, 120, 150))), 0, None)
    values["wheel_rate_1"] = np.round(ramp, 2)
    t = screened(values)
    assert found(t, "fill") == 0 and t.channels["wheel_rate_1"].valid.all()


def test_law_a_step_between_two_levels_is_no_fill_value():
    t = screened({"wheel_rate_1": np.repeat([100.0, 600.0], N // 2), "body_rate_x": hold()["body_rate_x"]})
    assert found(t, "fill") == 0


@pytest.mark.parametrize("seed", range(5))
def test_law_sound_channels_keep_every_sample(seed):
    for values in (
        hold(seed),
        {n: np.round(v, 2) for n, v in hold(seed, 0.002).items()},
        {n: np.round(v, 6) for n, v in hold(seed).items()},
    ):
        t = screened(values)
        assert all(c.valid.all() for c in t.channels.values()), [f for f in t.findings]


def test_law_a_sensor_at_the_end_of_its_range_is_doubted():
    rate = 0.05 * np.sin(np.arange(N) / 20) + np.random.default_rng(3).normal(0, 1e-4, N)
    t = screened({"body_rate_x": np.clip(rate, -0.03, 0.03)})
    assert found(t, "saturated") > 100 and needs_a_look(t)
    assert found(screened({"body_rate_x": rate}), "saturated") == 0


def test_law_a_speed_without_sign_is_read_with_it_where_the_wrap_is_declared():
    wheel = 20 * np.sin(np.arange(N) / 60 + 3.5)  # begins negative
    raw = np.mod(np.round(wheel / 0.1), 65_536) * 0.1
    for part in (slice(0, N), slice(200, N)):
        kept = np.arange(N)[part]
        t = screened({"wheel_rate_1": raw[part]}, kept * NS, modulus=6553.6, count_size=0.1)
        assert t.channels["wheel_rate_1"].values == pytest.approx(np.round(wheel / 0.1)[part] * 0.1, abs=1e-6)
        assert t.channels["wheel_rate_1"].valid.all()


def test_law_coarse_counts_are_not_stale():
    rng = np.random.default_rng(5)
    values = {f"body_rate_{a}": 8.7e-6 * np.round(rng.normal(0, 0.6, N) + 0.2) for a in "xyz"}
    t = screened(values)
    assert found(t, "repeat") == 0 and all(c.valid.all() for c in t.channels.values())


def test_law_stale_frames_among_fine_ones_are_left_out():
    values = hold()
    for at in range(50, 550, 50):
        for v in values.values():
            v[at] = v[at - 1]
    t = screened(values)
    assert all((~c.valid).sum() == 10 for c in t.channels.values())


def test_law_samples_stamped_far_off_are_left_out():
    for at, off in ((300, 604_800), (300, -604_800), (0, -53 * 31_557_600)):
        tai_ns = np.arange(N) * NS
        tai_ns[at : at + 3] += off * NS
        t = screened(hold(), tai_ns)
        assert found(t, "stray") == 3 and needs_a_look(t)
        c = t.channels["wheel_rate_1"]
        assert len(c.tai_ns) == N - 3 and np.ptp(c.tai_ns) < N * NS


def test_law_the_samples_lost_to_coarse_stamps_are_counted():
    t = screened(hold(), np.arange(N) // 4 * NS)
    assert found(t, "conflict") == N - N // 4
    assert any("cadence" in f.detail for f in t.findings)


def test_law_packets_over_two_links_count_once():
    values = {n: np.repeat(v, 2) for n, v in hold().items()}
    for v in values.values():
        v[1::2] = v[1::2].astype(np.float32)
    tai_ns = np.repeat(np.arange(N) * NS, 2)
    tai_ns[1::2] += 40_000_000
    t = screened(values, tai_ns)
    assert all(len(c.tai_ns) == N for c in t.channels.values())
    assert found(t, "duplicate") == N * len(values)


def test_law_a_quaternion_that_changes_its_sign_is_one_attitude():
    angle = 0.001 * np.arange(N)
    q = np.stack([np.cos(angle / 2), 0 * angle, np.sin(angle / 2), 0 * angle], axis=1)
    rng = np.random.default_rng(2)
    q *= rng.choice([-1.0, 1.0], N)[:, None]
    t = screened({f"quaternion_{m}": q[:, k] + rng.normal(0, 1e-6, N) for k, m in enumerate("wxyz")})
    assert all(c.valid.all() for c in t.channels.values()) and not needs_a_look(t)


def test_law_a_wheel_beyond_its_limit_is_left_out(tmp_path):
    from types import SimpleNamespace

    values = hold()
    values["wheel_rate_1"][[100, 101]] = [700.0, 701.0]
    t = screened(values, craft=SimpleNamespace(name="c", wheels=[SimpleNamespace(name="1", rate_limit=300.0)]))
    assert not t.channels["wheel_rate_1"].valid[100:102].any() and found(t, "fill") == 2


def test_law_a_tachometer_that_holds_after_the_wheel_stopped_is_left_out():
    rng = np.random.default_rng(4)
    coast = 60 - 0.4 * np.arange(N) + rng.normal(0, 0.02, N)
    coast[120:] = coast[119]
    t = screened({"wheel_rate_1": np.round(coast, 3)})
    assert not t.channels["wheel_rate_1"].valid[121:].any() and t.channels["wheel_rate_1"].valid[:120].all()
