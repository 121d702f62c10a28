"""`asflown telemetry check` and `names`, and the recordings of real spacecraft with the shipped dictionaries."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from asflown.cli.telemetry import app
from asflown.kit.errors import BadInput
from asflown.kit.rotations import rates_between
from asflown.telemetry.attitude import together
from flights import inspiresat1, iss, saved, telemetry_of, written
from telemetry.signals import noise

T = np.arange(0.0, 1000.0, 2.0)


def run(*words):
    return CliRunner().invoke(app, [str(w) for w in words])


@pytest.fixture
def table(tmp_path):
    x = np.rint(noise(500, 1e-5) / 1e-7) * 1e-7
    keep = np.ones(500, bool)
    keep[100:120] = False
    tlm = telemetry_of(body_rate_x=(T[keep], x[keep]), control_mode=(T[:3], np.array(["A", "A", "B"])))
    return saved(tlm, tmp_path)


def test_check_prints_a_line_a_channel(table):
    r = run("check", table)
    assert r.exit_code == 0
    assert "epoch 2015-09-29T00:00:00 UTC" in r.stdout and "nothing suspicious" in r.stdout
    line = next(li for li in r.stdout.splitlines() if li.startswith("body_rate_x")).split()
    assert line[1:] == ["rad/s", "480", "2", "0", "998", "·", "1", "42", "s", "1e-07", line[-1]]
    assert max(map(len, r.stdout.splitlines()[1:])) <= 120


def test_check_as_json(table):
    r = run("check", table, "--json")
    record = json.loads(r.stdout)
    assert record["command"] == "telemetry check" and record["epoch"] == "2015-09-29T00:00:00 UTC"
    c = record["channels"][0]
    assert (c["name"], c["unit"], c["samples"], c["cadence_s"], c["gaps"]) == ("body_rate_x", "rad/s", 480, 2.0, 1)
    assert c["gap_list"] == [{"start_s": 198.0, "stop_s": 240.0}]
    assert c["quantisation"] == pytest.approx(1e-7) and c["noise"] == pytest.approx(1e-5, rel=0.2)
    assert record["channels"][1]["noise"] is None
    assert len(record["provenance"]["inputs"][0]["sha256"]) == 64


def test_check_window_exclusion_and_exit_codes(table, tmp_path):
    spans = written(tmp_path, "start,stop,channel,reason\n0,50,*,warming up\n", "x.csv")
    record = json.loads(run("check", table, "--exclude", spans, "--stop", "100", "--json").stdout)
    assert record["channels"][0]["samples"] == 51 and record["channels"][0]["unused"] == 26
    x = noise(500, 1e-5)
    x[200] = 0.1
    r = run("check", saved(telemetry_of(body_rate_x=(T, x)), tmp_path, "spike.csv"))
    assert r.exit_code == 3 and "spike 1" in r.stdout
    rpm = saved(telemetry_of(wheel_rate_RWA1=(T, 600 + noise(500))), tmp_path, "rpm.csv")
    assert run("check", rpm).exit_code == 0
    r = run("check", rpm, "--craft", "cassini")
    assert r.exit_code == 3 and "DOUBT! wheel_rate_RWA1" in r.stdout
    assert isinstance(run("check", tmp_path / "none.csv").exception, BadInput)


def test_names_lists_every_kind():
    from asflown.telemetry.channels import KINDS

    r = run("names")
    assert r.exit_code == 0 and len(r.stdout.splitlines()) == len(KINDS)
    assert len(json.loads(run("names", "--json").stdout)["names"]) == len(KINDS)


def test_real_inspiresat1_comes_in_clean():
    t = inspiresat1()
    assert t.members("wheel_rate") == ["1", "2", "3"] and t.has_axes("body_rate")
    assert t.epoch_label.startswith("2023-08-11") and t.doubts == ()
    assert all(len(c.values) == 476 and c.valid.all() for c in t.channels.values())  # kicks of sticking wheels stay
    assert np.median(t.channel("body_rate_z").values) == pytest.approx(-0.007, abs=2e-4)  # rad/s, its README


def test_real_iss_attitude_turns_as_its_gyros_say():
    station = iss()
    assert station.epoch_label == "2018-10-12T04:59:15 UTC" and station.doubts == ()
    at, q = together(station, [f"quaternion_{m}" for m in "wxyz"])
    mid, rate = rates_between((at - at[0]) / 1e9, q)
    w_at, w = together(station, [f"body_rate_{a}" for a in "xyz"])
    inside = np.isin((mid * 1e9).astype(np.int64) + at[0] - 500_000_000, w_at)
    there = np.interp(mid[inside], (w_at - at[0]) / 1e9, w[:, 1])
    assert np.median(np.abs(rate[inside, 1] - there)) < 5e-6  # rad/s, of 1.1e-3


def test_real_iss_gaps_are_kept():
    station = iss()
    c = station.channel("control_torque_x")
    assert len(c.values) == 39271 and c.cadence_ns == 10**9
    assert sum(f.what == "gap" and f.channel == c.name and f.count == 45 for f in station.findings) == 1
    unused = sum(int((~c.valid).sum()) for c in station.channels.values())
    assert unused < 10
