"""Faults of received telemetry, by kind: what must not be used is left out and told, what is sound is kept."""

import numpy as np
import pytest

from asflown.kit.timeline import NS
from asflown.telemetry.channels import to_si
from asflown.telemetry.findings import NO_SIGN
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


@pytest.mark.parametrize("unit", ["rpm", "deg/s"])
@pytest.mark.parametrize("rows", [slice(0, 1), slice(0, 3), slice(N - 4, N)])
@pytest.mark.parametrize("value", [-9999.0, 32767.0, 999.99])
def test_law_fill_values_as_they_were_written_are_known_at_the_ends(unit, rows, value):
    values = hold()
    for name in ("wheel_rate_2",) if unit == "rpm" else ("body_rate_y",):
        factor, _ = to_si(name, unit)
        values[name][rows] = value * factor
    t = screened(values, unit_given=unit)
    assert found(t, "fill") == rows.stop - rows.start and needs_a_look(t)


@pytest.mark.parametrize("rows", [slice(0, 1), slice(0, 3), slice(300, 304), slice(N - 2, N)])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_law_a_packet_of_one_value_is_left_out(rows, value):
    values = hold()
    for k in (1, 2, 3):
        values[f"wheel_rate_{k}"][rows] = value
    t = screened(values)
    assert all((~t.channels[f"wheel_rate_{k}"].valid).sum() == rows.stop - rows.start for k in (1, 2, 3))
    assert all(t.channels[f"body_rate_{a}"].valid.all() for a in "xyz")


def test_law_a_counter_that_goes_on_was_not_reset():
    counts = np.cumsum(np.arange(N) % 20 == 0) * 0.125 + 1000
    for value in (0.0, -9999.0, 65535.0):
        broken = counts.copy()
        broken[200:204] = value
        t = screened({"on_time_Z1": broken})
        assert found(t, "fill") == 4 and found(t, "fall") == 0
    reset = np.where(np.arange(N) < 300, counts, counts - counts[300])
    assert found(screened({"on_time_Z1": reset}), "fall") == 1


@pytest.mark.parametrize("offset_s", [600, -600, 1200, 18])
def test_law_samples_stamped_wrongly_where_they_are_missing_are_strays(offset_s):
    tai_ns = np.arange(N) * NS
    tai_ns[200:204] += offset_s * NS
    t = screened(hold(), tai_ns)
    assert found(t, "stray") == 4 and found(t, "conflict") == 0


def test_law_a_clock_that_was_not_set_yet_says_an_old_date():
    tai_ns = np.arange(N) * NS + 50 * 365 * 86_400 * NS // 2
    tai_ns[:30] = np.arange(30) * NS
    assert found(screened(hold(), tai_ns), "stray") == 30


@pytest.mark.parametrize("digits", [3, 4, 12])
def test_law_copies_over_two_links_are_told_in_every_channel(digits):
    once = hold()
    tai_ns = np.repeat(np.arange(N) * NS, 2)
    tai_ns[1::2] += 20_000_000
    twice = {n: np.column_stack([v, [float(f"{x:.{digits}g}") for x in v]]).ravel() for n, v in once.items()}
    t = screened(twice, tai_ns)
    assert all(len(c.values) == N for c in t.channels.values())


@pytest.mark.parametrize("modulus", [25.6, 204.8, 6553.6])
def test_law_wraps_of_any_width_are_told(modulus):
    values = hold()
    cross = np.linspace(5, -5, N) + 0.05 * np.sin(np.arange(N) / 7)
    values["wheel_rate_2"] = np.mod(np.rint(cross / 0.05) * 0.05, modulus)
    assert found(screened(values), "fall") >= 1


def test_law_coarse_wheels_do_not_wrap():
    values = hold(noise=0.02)
    for step in (0.1, 0.5, 1.0):
        assert found(screened({n: np.rint(v / step) * step for n, v in values.items() if n.startswith("wheel")}), "fall") == 0  # fmt: skip


def test_law_a_tachometer_without_sign_is_told_by_its_fold():
    values = hold()
    cross = np.linspace(5, -5, N) + 0.05 * np.sin(np.arange(N) / 7)
    values["wheel_rate_2"] = np.abs(cross)
    assert screened(values).doubts.of(NO_SIGN)
    for sound in (cross, 5 + np.abs(cross), 3 + 2 * np.sin(np.arange(N) / 60)):
        values["wheel_rate_2"] = sound
        assert not screened(values).doubts.of(NO_SIGN)
