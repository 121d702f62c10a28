"""The verb `gates` as a user meets it."""

import json

import pytest

from asflown.maneuvers.history import past_model
from asflown.maneuvers.write import maneuver_text
from asflown.sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute
from cli.program import complaint, run

#: Keys that are promised.
PART = {
    "magnitude": {"fixed_mps", "proportional", "bias_fixed_mps", "bias_proportional"},
    "pointing": {"fixed_mps", "proportional_rad", "bias_fixed_mps", "bias_proportional_rad"},
}


def kinds(record) -> set[str]:
    """Ids of the doubts in a record."""
    return {d["kind"] for d in record["doubts_detail"]}


@pytest.fixture(scope="module")
def rcs(tmp_path_factory):
    path = tmp_path_factory.mktemp("gates") / "rcs.csv"
    path.write_text(maneuver_text(execute(past_model("rcs/2012-1").model, RCS_SET, 1)))
    return path


def test_the_record_has_the_promised_keys(rcs):
    record = run("gates", rcs, "--json").record
    assert record["command"] == "gates" and (record["engine"], record["count"]) == ("rcs", 49)
    for part, keys in PART.items():
        assert set(record[part]) >= keys | {"ci95", "fixed_ci95_mps"} and set(record[part]["ci95"]) == keys
        assert record[part]["fixed_ci95_mps"] == record[part]["ci95"]["fixed_mps"]
    assert [len(record["pointing"][k]) for k in ("bias_fixed_mps", "bias_proportional_rad")] == [2, 2]
    assert [len(i) for i in record["pointing"]["ci95"]["bias_fixed_mps"]] == [2, 2]
    assert set(record) >= {"at_bound", "log_likelihood", "doubts", "provenance"}
    assert record["provenance"]["inputs"][0]["file"] == str(rcs)


def test_fit_may_be_left_out_and_options_may_come_first(rcs):
    first = run("gates", rcs, "--json").record
    assert run("gates", "fit", rcs, "--json").record == first
    assert run("gates", "--json", rcs).record == first


def test_several_engines(rcs, tmp_path):
    both = tmp_path / "both.csv"
    main = maneuver_text(execute(past_model("main/2012-1").model, MAIN_ENGINE_SET, 1))
    both.write_text(rcs.read_text() + main.partition("\n")[2])
    assert "several engines" in complaint("gates", both)
    assert run("gates", both, "--engine", "main-engine", "--json").record["count"] == 48


@pytest.mark.parametrize(
    "hold, key, value",
    [
        ("pointing_fixed=0 mm/s", "fixed_mps", 0.0), ("pointing_fixed=pre-launch", "fixed_mps", 3.5e-3),
        ("pointing_proportional=4.5 mrad", "proportional_rad", 4.5e-3), ("pointing=2000", "proportional_rad", 12e-3),
    ],
)  # fmt: skip
def test_a_term_is_held_by_value_or_by_model(hold, key, value, rcs):
    record = run("gates", rcs, "--hold", hold, "--json").record
    assert record["pointing"][key] == pytest.approx(value) and record["pointing"]["ci95"][key] is None


@pytest.mark.parametrize(
    "words",
    [
        ["--hold", "pointing"], ["--hold", "size=1 mm/s"], ["--hold", "pointing_fixed=1 mrad"], ["--hold", "pointing=1999"], ["--prior", "1999"],
        ["--prior", "2012-1", "--prior-width", "0"], ["--without", "nobody"], ["--model", "biased"], ["--likelihood", "huber"], ["--engine", "ion"],
    ],
)  # fmt: skip
def test_bad_options_are_complained_of(words, rcs):
    complaint("gates", rcs, *words)


def test_five_rows_answer_with_doubts_and_no_numbers(tmp_path):
    """Pairs of dV wanted and had, as press notes give them (numbers made up): magnitudes only, no tracking sigma known."""
    path = tmp_path / "five.csv"
    path.write_text(
        "id,dv [m/s],magnitude_error [mm/s],sigma_magnitude [mm/s]\n"
        "A,2.70,-20,0\nB,5.10,-9,0\nC,11.60,-3,0\nD,36.30,11,0\nE,6.70,8,0\n"
    )
    done = run("gates", path, "--json")
    assert done.code == 0
    record = done.record
    assert all(record["magnitude"][k] is None for k in PART["magnitude"]) and record["pointing"]["fixed_mps"] is None
    assert {"gates.too-few-burns", "maneuvers.no-magnitude-sigma"} <= kinds(record)
    assert "not known" in run("gates", path).out


def test_history_as_json():
    record = run("gates", "history", "--engine", "MEA", "--json").record
    assert [m["engine"] for m in record["models"]] == ["main-engine"] * 6
    assert record["models"][0]["magnitude"]["bias_fixed_mps"] is None
    assert json.dumps(record)
    complaint("gates", "history", "--engine", "ion")


def test_against_patch_figures_and_page(rcs, tmp_path):
    done = run("gates", rcs, "--against", "2012-1", "--patch", "rcs-30", "--removed", "0.8 mm/s, -1.5 %", "--plot-dir", tmp_path / "figures",
               "--report", tmp_path / "page.html", "--json")  # fmt: skip
    assert done.code == 0, done.err
    record = done.record
    assert record["against"]["model"] == "rcs/2012-1" and record["patch"]["removed_proportional"] == pytest.approx(
        -0.015
    )
    assert len(record["influence"]) == 49 and set(record["outliers"][0]) >= {"id", "z", "p"}
    assert len(record["adjusted"]) == 29
    assert len(list((tmp_path / "figures").glob("*.svg"))) == 5
    page = (tmp_path / "page.html").read_text()
    assert (
        page.count("<svg") == 7
        and 'href="http' not in page
        and json.loads((tmp_path / "page.json").read_text())["count"] == 49
    )


@pytest.mark.parametrize(
    "words",
    [
        ["--against", "1999"], ["--removed", "1 mm/s"], ["--patch", "nobody"], ["--patch", "rcs-2"], ["--patch", "rcs-20", "--removed", "1 mrad"],
        ["--patch", "rcs-20", "--removed", "1 mm/s, 2 %, 3 %"], ["--report", "page.txt"],
    ],
)  # fmt: skip
def test_bad_judging_options_leave_nothing_behind(words, rcs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    complaint("gates", rcs, "--plot-dir", tmp_path / "figures", *words)
    assert not list(tmp_path.rglob("*.*"))


def test_watch_alarms_with_exit_code_three(tmp_path):
    from asflown.sim.maneuver_sets import a_branch

    path = tmp_path / "a.csv"
    path.write_text(maneuver_text(a_branch(past_model("rcs/2008-01").model, 0.1, 1)))
    done = run("gates", "watch", path, "--json", "--plot-dir", tmp_path / "figures")
    assert done.code == 3 and done.record["first_alarm"] == "OTM-160" and done.record["command"] == "gates watch"
    assert len(list((tmp_path / "figures").glob("*.svg"))) == 2
    quiet = run("gates", "watch", path, "--without", "OTM-160,OTM-166,OTM-169")
    assert quiet.code == 0 and quiet.out.startswith(("PASS", "WATCH"))
    complaint("gates", "watch", path, "--from", "A-2")
    complaint("gates", "watch", path, "--false-alarm", "2")


def test_predict(rcs, tmp_path):
    plan = tmp_path / "plan.csv"
    plan.write_text("id,dv [m/s]\nOTM-400,0.1\nOTM-401,0.5\n")
    record = run("gates", "predict", plan, "--by", "rcs/2012-1", "--json").record
    assert record["burns"][0]["sigma_magnitude_mps"] == pytest.approx(0.64e-3, abs=1e-6)
    assert "gates.outside-sizes" in kinds(record)
    done = run("gates", "predict", plan, "--past", rcs, "--samples", "100", "--out", tmp_path / "draws.csv")
    assert done.code == 0 and len((tmp_path / "draws.csv").read_text().splitlines()) == 201
    for words in (
        [],
        ["--by", "2012-1"],
        ["--by", "rcs/2012-1", "--past", rcs],
        ["--by", "rcs/2012-1", "--samples", "3"],
    ):
        complaint("gates", "predict", plan, *words)
    plan.write_text("id,dv [m/s]\nOTM-400,-0.1\n")
    assert "line 2" in complaint("gates", "predict", plan, "--by", "rcs/2012-1")


def test_simulate_writes_a_table_that_reads_back(tmp_path):
    out = tmp_path / "set.csv"
    record = run("gates", "simulate", "--by", "main/2012-1", "--seed", "3", "--out", out, "--json").record
    assert record["count"] == 48 and record["truth"]["magnitude"]["fixed_mps"] == 3.5e-3
    assert run("gates", out, "--json").record["count"] == 48
    assert run("gates", "simulate", "--count", "60", "--weaker", "20 %", "--seed", "3", "--out", out).code == 0
    assert run("gates", "watch", out).code == 3
    for words in (["--by", "2012-1"], ["--weaker", "2"], ["--weaker", "1 mm/s"]):
        complaint("gates", "simulate", "--out", out, *words)
    complaint("gates", "simulate", "--out", tmp_path)


def test_an_earlier_fit_is_a_model_like_those_of_the_history(rcs, tmp_path):
    """Prior, judge, held term and source of predictions; biases stay only where the fit was mean-aware."""
    fit, aware, plan = tmp_path / "epoch-1.json", tmp_path / "aware.json", tmp_path / "plan.csv"
    fit.write_text(run("gates", rcs, "--json").out)
    aware.write_text(run("gates", rcs, "--model", "mean-aware", "--json").out)
    made = json.loads(fit.read_text())
    record = run("gates", rcs, "--prior", fit, "--against", fit, "--hold", f"pointing_fixed={fit}", "--json").record
    assert record["against"]["model"] == "epoch-1" and record["pointing"]["fixed_mps"] == made["pointing"]["fixed_mps"]
    assert "gates.prior-used" in kinds(record)
    assert str(fit) in [i["file"] for i in record["provenance"]["inputs"]]
    assert run("gates", "watch", rcs, "--against", aware, "--json").record["against"] == "aware"
    plan.write_text("id,dv [m/s]\nnext,0.2\n")
    for model, mean in (
        (fit, 0.0),
        (aware, made["magnitude"]["bias_fixed_mps"] + 0.2 * made["magnitude"]["bias_proportional"]),
    ):
        burn = run("gates", "predict", plan, "--by", model, "--json").record["burns"][0]
        assert burn["mean_mps"][2] == pytest.approx(mean)
        assert burn["sigma_magnitude_mps"] == pytest.approx(
            (made["magnitude"]["fixed_mps"] ** 2 + (0.2 * made["magnitude"]["proportional"]) ** 2) ** 0.5, rel=1e-6
        )


def test_what_is_no_earlier_fit_is_refused(rcs, tmp_path):
    model = tmp_path / "m.json"
    for text in ("", "[]", "{}", '{"command": "torque"}', '{"command": "gates", "engine": "rcs"}'):
        model.write_text(text)
        assert "record of a fit" in complaint("gates", rcs, "--prior", model)
    record = run("gates", rcs, "--json").record
    model.write_text(json.dumps(record | {"engine": "main-engine"}))
    assert "model of main-engine" in complaint("gates", rcs, "--against", model)
    model.write_text(json.dumps(record | {"pointing": dict.fromkeys(record["pointing"])}))
    assert "whole model" in complaint("gates", rcs, "--against", model)
    assert "no such record of a fit" in complaint("gates", rcs, "--against", tmp_path / "nobody.json")
