"""Good input in every form the program promises to take, and what it says about it."""

import gzip
import json
import subprocess
import sys

import numpy as np
import pytest

from asflown.kit.timeline import gps_to_tai_ns, utc_label, utc_to_tai_ns
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.text import read_csv
from asflown.telemetry.write import write_table
from cli.program import T, csv_text, flight, run
from flights import flown, saved, written

KEYS = {"command", "craft", "method", "variant", "axis", "epoch", "time_s", "torque_Nm", "sigma_Nm", "momentum_Nms",
        "peaks", "doubts", "provenance"}  # fmt: skip
EPOCH_NS = int(utc_to_tai_ns("2015-09-29T00:00:00"))


@pytest.fixture
def good(tmp_path):
    return written(tmp_path, csv_text(flight()))


#: Of the methods, the one without a fit: for what does not depend on the method.
QUICK = ("--method", "momentum")


def torque(path, *options) -> dict:
    done = run("torque", path, "--json", *options)
    assert done.code == 0, done.err
    assert done.err == ""
    return done.record


def finite(values) -> np.ndarray:
    """As an array; None becomes NaN."""
    return np.array(values, float)


@pytest.mark.parametrize(
    "options",
    [
        ["--method", m, "--variant", v]
        for m, v in (
            ("momentum", "corrected"),
            ("momentum", "printed"),
            ("transfer", "corrected"),
            ("transfer", "printed"),
            ("polynomial", "corrected"),
            ("fused", "corrected"),
        )
    ],
)
def test_one_json_object_with_the_promised_keys(options, good):
    record = torque(good, "--axis", "y", *options)
    assert set(record) >= KEYS
    assert (record["command"], record["craft"], record["axis"]) == ("torque", "cassini", "y")
    assert (record["method"], record["variant"]) == (options[1], options[3])
    assert record["epoch"] == "2015-09-29T00:00:00 UTC"
    torque_y = finite(record["torque_Nm"])
    assert torque_y.shape == finite(record["time_s"]).shape and np.isfinite(torque_y).all()
    assert record["sigma_Nm"] is None or finite(record["sigma_Nm"]).shape == torque_y.shape
    with_sigma = {"torque_sigma_Nm", "torque_ci95_Nm", "sigma_Nm", "interval_95_Nm"} if options[1] == "fused" else set()
    assert all(set(p) == {"time_s", "torque_Nm"} | with_sigma for p in record["peaks"])
    largest = max(record["peaks"], key=lambda p: abs(p["torque_Nm"]))
    assert largest["torque_Nm"] > 0 and abs(largest["time_s"] - 240) < 10  # s
    assert all(isinstance(d, str) for d in record["doubts"])
    assert len(record["provenance"]["inputs"][0]["sha256"]) == 64


def test_all_axes_are_rows_of_three(good):
    record = torque(good, *QUICK)
    assert record["axis"] == "all"
    for key in ("torque_Nm", "sigma_Nm", "momentum_Nms"):
        assert finite(record[key]).shape == (481, 3)
    assert {p["axis"] for p in record["peaks"]} == {"y"}
    assert finite(record["torque_Nm"])[:, 1].tolist() == torque(good, "--axis", "y", *QUICK)["torque_Nm"]


def test_fused_adds_bands_and_an_impulse_with_its_sigma(good):
    record = torque(good, "--axis", "y", "--impulse", "180,300", "--consider", "inertia=0.02,spin_inertia=0")
    for share in ("68", "95"):
        band = record[f"band_{share}_Nm"]
        assert np.all(finite(band["low"]) <= finite(band["high"])) and len(band["low"]) == 481
    (found,) = record["impulses"]
    assert (found["start_s"], found["stop_s"], found["axis"]) == (180, 300, "y")
    # the pulse: 0.02 N m at its peak, 40 s up and down
    assert abs(found["impulse_Nms"] - 0.8) < 4 * found["sigma_Nms"] + 0.02 and 0 < found["sigma_Nms"] < 0.1
    assert "spin_inertia" not in record["settings"]["considered"]["y"]
    assert record["provenance"]["options"]["consider"] == "inertia=0.02,spin_inertia=0"
    assert "impulse y from 180 to 300 s" in run("torque", good, "--axis", "y", "--impulse", "180,300").out


def test_comparison_is_in_the_same_object(good):
    record = run("torque", good, "--json", "--axis", "y", "--compare").record
    assert len(record["comparison"]) >= 4


def test_window_in_seconds_and_in_utc_counts_from_the_epoch(good):
    a = torque(good, "--axis", "y", "--start", "100", "--stop", "400", *QUICK)
    b = torque(good, "--axis", "y", "--start", "2015-09-29T00:01:40", "--stop", "2015-272T00:06:40", *QUICK)
    assert a["time_s"] == b["time_s"] and a["time_s"][0] == 100 and a["time_s"][-1] == 400
    assert a["torque_Nm"] == b["torque_Nm"] and a["epoch"] == "2015-09-29T00:00:00 UTC"


def retimed(heading: str, labels) -> dict:
    table = flight()
    del table["time [s]"]
    return {heading: labels, **table}


def test_the_time_column_may_be_utc_gps_or_seconds(good, tmp_path):
    base = torque(good, "--axis", "y", *QUICK)
    utc = [utc_label(EPOCH_NS + int(t) * 10**9) + "Z" for t in T]
    forms = {
        "utc.csv": csv_text(retimed("time [utc]", utc), None),
        "doy.csv": csv_text(retimed("time [utc]", ["2015-272T" + u[11:] for u in utc]), None),
        "gps.csv": csv_text(retimed("time [gps s]", T + (EPOCH_NS - int(gps_to_tai_ns(0.0))) / 1e9), None),
    }
    for name, text in forms.items():
        record = torque(written(tmp_path, text, name), "--axis", "y", *QUICK)
        assert record["epoch"] == base["epoch"] and record["time_s"] == base["time_s"], name
        assert np.allclose(record["torque_Nm"], base["torque_Nm"], rtol=0, atol=1e-12), name


def test_gzip_parquet_line_ends_delimiters_and_a_byte_order_mark_change_nothing(good, tmp_path):
    base = torque(good, *QUICK)
    text = good.read_text()
    write_table(load_telemetry(good), tmp_path / "t.parquet")
    copies = [
        written(tmp_path, gzip.compress(text.encode()), "t.csv.gz"),
        written(tmp_path, text.replace("\n", "\r\n"), "dos.csv"),
        written(tmp_path, text.replace("\n", "\r"), "mac.csv"),
        written(tmp_path, "\ufeff" + text, "bom.csv"),
        written(tmp_path, text.replace("\n", ",\n").replace("UTC,", "UTC"), "commas.csv"),
        written(tmp_path, text.replace(",", ";"), "semicolons.csv"),
        written(tmp_path, text.replace(",", ";").replace(".", ","), "decimals.csv"),
        written(tmp_path, text.replace(",", "\t"), "tabs.csv"),
        written(tmp_path, text.encode("utf-16"), "wide.csv"),
        tmp_path / "t.parquet",
    ]
    for path in copies:
        record = torque(path, *QUICK)
        assert record["torque_Nm"] == base["torque_Nm"] and record["doubts"] == base["doubts"], path.name


def test_csv_written_by_numpy_and_parquet_by_duckdb_agree(tmp_path):
    import duckdb

    table = flight()
    path = tmp_path / "np.csv"
    np.savetxt(
        path, np.column_stack(list(table.values())), delimiter=",", header=",".join(table), comments="", fmt="%.17g"
    )
    with duckdb.connect() as db:
        db.execute(
            f"COPY (SELECT * FROM read_csv('{path}', header = true)) TO '{tmp_path / 'np.parquet'}' (FORMAT parquet)"
        )
    a, b = torque(path, *QUICK), torque(tmp_path / "np.parquet", *QUICK)
    assert a["torque_Nm"] == b["torque_Nm"] and a["time_s"] == b["time_s"] and a["doubts"] == b["doubts"]
    assert a["epoch"] == "not given" and any("no epoch" in d for d in a["doubts"])


def test_short_runs_are_bridged_and_long_gaps_are_null_and_reported(tmp_path):
    bridged, broken = flight(), flight()
    for name in bridged:
        if name != "time [s]":
            bridged[name][30:35] = np.nan
            broken[name][30:38] = np.nan  # 120 s to 148 s
    path = written(tmp_path, csv_text(bridged), "a.csv")
    assert np.isfinite(finite(torque(path, "--method", "momentum")["torque_Nm"])).all()
    path = written(tmp_path, csv_text(broken), "b.csv")
    rows_left_out = {k: np.delete(v, slice(30, 38)) for k, v in flight().items()}
    other = written(tmp_path, csv_text(rows_left_out), "c.csv")
    for options in (["--method", "momentum"], ["--variant", "printed"], ["--method", "transfer"], ["--method", "transfer", "--variant", "printed"],
                    ["--method", "polynomial"]):  # fmt: skip
        record = torque(path, "--axis", "y", *options)
        time_s, values = finite(record["time_s"]), finite(record["torque_Nm"])
        null = time_s[np.isnan(values)]
        assert null.min() >= 114 and null.max() <= 152 and len(null) >= 35, options
        assert any("116-152 s" in d for d in record["doubts"]), options
        assert torque(other, "--axis", "y", *options)["torque_Nm"] == record["torque_Nm"]


def test_the_csv_it_writes_is_a_table_that_reads_back(good, tmp_path):
    done = run("torque", good, "--json", "--out", tmp_path / "new" / "t.csv", "--plot", tmp_path / "t.svg")
    assert done.code == 0 and done.err.count("wrote") == 2
    table = read_csv((tmp_path / "new" / "t.csv").read_bytes())
    assert table.epoch == "2015-09-29T00:00:00 UTC"
    assert table.headings[:4] == ("time [s]", *(f"disturbance_torque_{a} [N m]" for a in "xyz"))
    assert [float(v) for v in table.columns[2]] == [row[1] for row in done.record["torque_Nm"]]
    assert (tmp_path / "t.svg").read_text().startswith("<?xml")


def test_wheels_alone_are_enough(tmp_path):
    table = {k: v for k, v in flight().items() if "wheel" in k or "time" in k}
    record = torque(written(tmp_path, csv_text(table)), "--axis", "y")
    assert any("no body rates" in d for d in record["doubts"])


def test_the_wheel_set_follows_the_date(tmp_path):
    path = written(tmp_path, csv_text(flight(wheels=("RWA1", "RWA2", "RWA3")), "2001-01-05T00:00:00 UTC"))
    assert torque(path, "--axis", "y")["settings"]["wheels"] == ["RWA1", "RWA2", "RWA3"]


def cube(names: str) -> str:
    s = 1 / np.sqrt(3)
    text = 'name = "cube"\n[[mass_properties]]\ndate = "2015-01-01"\npiece = "all"\ninertia = "10 12 8 0 0 0 kg m2"\n'
    for name, (x, y) in zip("ABCD", ((1, 1), (-1, 1), (-1, -1), (1, -1)), strict=True):
        if name in names:
            text += f'[[wheels]]\nname = "{name}"\naxis = "{x * s:.15f} {y * s:.15f} {s:.15f}"\nspin_inertia = "0.01 kg m2"\n'
    return text


@pytest.mark.parametrize("names", ["ABCD", "AB"])
def test_a_craft_of_ones_own_with_any_number_of_wheels(names, tmp_path):
    """All wheels speed up together about the pyramid's axis: the torque is what they take, no more."""
    push = 2e-4 * np.clip(1 - np.abs(T - 240) / 100, 0, None)  # rad/s^2 of every wheel
    table = {"time [s]": T} | {f"wheel_rate_{n} [rad/s]": 100 + np.cumsum(push) * 4.0 for n in names}
    table |= {f"body_rate_{a} [rad/s]": np.zeros(T.size) for a in "xyz"}
    craft = written(tmp_path, cube(names), "cube.toml")
    record = torque(written(tmp_path, csv_text(table)), "--craft", craft, "--axis", "z")
    peak = max(record["peaks"], key=lambda p: p["torque_Nm"])
    assert peak["torque_Nm"] == pytest.approx(0.01 * len(names) / np.sqrt(3) * 2e-4, rel=0.1)
    assert record["craft"] == "cube"


def test_channels_may_be_sampled_at_different_rates_and_phases(tmp_path):
    fine = np.arange(0.0, 480.5, 0.5)
    table = {"time [s]": fine}
    for k, (name, values) in enumerate(list(flight().items())[1:]):
        every, phase = (2, k % 2) if "wheel" in name else (20, 3 * k % 20)  # 1 s, and 10 s
        table[name] = np.full(fine.size, np.nan)
        table[name][phase::every] = np.interp(fine[phase::every], T, values)
    record = torque(written(tmp_path, csv_text(table)), "--axis", "y")
    assert np.isfinite(finite(record["torque_Nm"])).all()
    assert max(p["torque_Nm"] for p in record["peaks"]) == pytest.approx(0.02, rel=0.3)


def test_every_other_verb_prints_one_object_too(good, tmp_path):
    for words in (
        ["telemetry", "check", good],
        ["telemetry", "names"],
        ["craft", "list"],
        ["craft", "show", "cassini", "--at", "2005-02-09"],
        ["craft", "show", "inspiresat1"],
        ["craft", "check", "iss"],
        ["simulate", "quiet", "--out", tmp_path / "sim"],
    ):
        done = run(*words, "--json")
        assert done.code == 0 and done.err == "", words
        assert done.record["command"] == " ".join(w for w in words[:2] if w in ("simulate", "craft", "telemetry", "check", "names", "list", "show"))  # fmt: skip
        assert {"doubts", "provenance"} <= set(done.record)


def test_help_version_and_no_arguments():
    done = run()
    assert done.code == 0 and done.err == "" and done.out == run("--help").out
    assert "Exit codes" in done.out
    for verb in ("torque", "simulate", "demo", "telemetry", "craft"):
        assert f"\n  {verb} " in done.out
        assert run(verb, "--help").code == 0
    assert run("--version").out.startswith("asflown 0.")
    text = run("torque", "--help").out
    for word in ("kg m2", "seconds from the epoch", "UTC", "SVG"):
        assert word in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80


def test_output_into_a_closed_pipe_is_no_error(good):
    program = f"{sys.executable} -c 'from asflown.cli.main import main; main()' torque {good} --craft cassini --method momentum --json | head -c 10"
    done = subprocess.run(["bash", "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout == json.dumps({"command": "torque"})[:10] and done.stderr == ""


def test_a_value_far_beyond_the_others_is_a_spike_not_a_torque(good, tmp_path):
    table = flight()
    table["wheel_rate_RWA4 [rad/s]"][40] = 1e50
    path = written(tmp_path, csv_text(table), "spike.csv")
    done = run("telemetry", "check", path)
    assert done.code == 3 and "spike 1" in done.out
    spiked, clean = (finite(torque(p, "--axis", "y")["torque_Nm"]) for p in (path, good))
    assert np.abs(spiked - clean).max() < 2e-3  # N m


def test_a_dead_sensor_is_told(tmp_path):
    table = flight()
    table["body_rate_x [rad/s]"][:] = 1e-6
    done = run("telemetry", "check", written(tmp_path, csv_text(table)))
    assert done.code == 0 and "body_rate_x: still 121" in done.out


def test_recovery_a_slew_without_a_torque_shows_none_and_accuses_no_sign(tmp_path):
    """Wheels and body trade 15 N m s in a slew; smoothed unlike each other they left 25 mN m at its corners."""
    path = saved(flown("slews", duration="420 s", seed=3).telemetry, tmp_path)
    record = torque(path)
    pulls = finite(record["torque_Nm"]) / finite(record["sigma_Nm"])
    assert np.abs(pulls).max() < 8
    assert np.sqrt(np.mean(pulls**2)) < 1.5
    assert not any("sign" in d for d in record["doubts"])
    assert np.isfinite(finite(torque(path, "--method", "transfer")["torque_Nm"])).all()
