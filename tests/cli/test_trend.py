"""`asflown trend` and `report`: the JSON that scripts rely on, exit codes, and one clear error for what cannot be."""

import json
from dataclasses import replace

import pytest

from asflown.trends.store.store import TrendStore
from flights import flown, saved
from trends.histories import history

from .program import run


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("trend") / "trends.db"
    with TrendStore.open(path) as trends:
        trends.add(history(change=0.3, seed=1, curves=True))
    return path


@pytest.fixture(scope="module")
def alarming(tmp_path_factory):
    path = tmp_path_factory.mktemp("trend") / "trends.db"
    entries = [
        replace(e, values=(replace(e.values[0], value=1.6 * e.values[0].value), *e.values[1:]))
        if e.event == "deploy-2015-09-29" else e
        for e in history(seed=1)
    ]  # fmt: skip
    with TrendStore.open(path) as trends:
        trends.add(entries)
    return path


@pytest.fixture(scope="module")
def added(tmp_path_factory):
    """A list of two actuations, one flown, and the store they were added to."""
    folder = tmp_path_factory.mktemp("flown")
    saved(flown("cover-deploy", seed=2).telemetry, folder, "flight.csv")
    (folder / "events.toml").write_text(
        '[[event]]\nid = "one"\nkind = "deploy"\nfile = "flight.csv"\nmotor_on_s = 60\nmotor_off_s = 420\n\n'
        '[[event]]\nid = "before"\nkind = "stow"\ndate = "2015-07-14"\n'
    )
    return folder, run(
        "trend", "add", folder / "events.toml", "--store", folder / "t.db", "--craft", "cassini", "--json"
    )


def test_add_keeps_and_says_what(added):
    folder, done = added
    assert done.code == 0, done.err
    added = {a["event"]: a for a in done.record["added"]}
    assert added["one"]["revision"] == 1 and added["one"]["figures"] > 20 and added["before"]["figures"] == 0
    assert added["one"]["date"].startswith("2015-09-29") and done.record["provenance"]["inputs"]
    again = run("trend", "add", folder / "events.toml", "--store", folder / "t.db", "--only", "before", "--json").record
    assert [a["revision"] for a in again["added"]] == [2]
    with TrendStore.open(folder / "t.db", create=False) as trends:
        (kept,) = trends.entries(event="one")
    assert (
        kept.provenance["cycles_allowed"] == 20
        and kept.provenance["inputs"][0]["sha256"]
        and kept.provenance["versions"]["asflown"]
    )
    listed = run("trend", "list", "--store", folder / "t.db", "--json").record
    assert [(e["event"], e["days_since_last"]) for e in listed["events"]] == [("before", None), ("one", 77)]
    with_value = run("trend", "list", "--store", folder / "t.db", "--figure", "angular_impulse", "--json").record[
        "events"
    ]
    assert with_value[0]["value"] is None and with_value[1]["value"] < -0.2


def test_show_has_the_keys_that_were_promised(store):
    done = run("trend", "show", "--store", store, "--figure", "angular_impulse", "--json")
    record = done.record
    assert done.code == 0 and record["figure"] == "angular_impulse"
    assert set(record["rows"][0]) == {"event", "date", "value", "sigma"} and len(record["rows"]) == 13
    low, high = record["change_percent_ci95"]
    assert low < record["change_percent"] < high and record["p_value"] < 0.05 and record["slope_per_year"] < 0
    assert len(run("trend", "show", "--store", store, "--json").record["figures"]) == 3


def test_show_draws(store, tmp_path):
    done = run(
        "trend",
        "show",
        "--store",
        store,
        "--figure",
        "peak_positive",
        "--limit",
        "peak_positive=0.02 N m",
        "--plot",
        tmp_path / "p.svg",
    )
    assert done.code == 0 and "<svg" in (tmp_path / "p.svg").read_text() and "change" in done.out


def test_watch_leaves_with_three_on_alarm_only(store, alarming):
    quiet = run("trend", "watch", "--store", store, "--json")
    assert (quiet.code, quiet.record["verdict"]) == (0, "watch")
    loud = run("trend", "watch", "--store", alarming, "--json")
    assert (loud.code, loud.record["verdict"]) == (3, "alarm") and "deviates" in loud.record["reasons"][0]
    assert run("trend", "watch", "--store", alarming, "--event", "deploy-2015-07-14").code == 0
    assert run("trend", "watch", "--store", alarming, "--figure", "peak_positive").code == 0
    past = run("trend", "watch", "--store", store, "--limit", "angular_impulse=-0.3 N m", "--json")
    assert past.code == 3 and "exceeds its limit" in " ".join(past.record["reasons"])


def test_compare_finds_the_pairs_and_any_two(store):
    record = run("trend", "compare", "--store", store, "--json").record
    assert [p["rest_days"] for p in record["pairs"]] == [219, 346, 998]
    assert {e["figure"] for e in record["equivalence"]} == {"angular_impulse", "peak_positive", "peak_negative"}
    assert len(record["curves"]["pairs"]) == 3
    two = run("trend", "compare", "deploy-2004-12-09", "deploy-2015-09-29", "--store", store, "--json").record
    assert two["figures"][0]["difference"] < 0 and two["curve_distance"] > 0.05
    assert run("trend", "compare", "--store", store).out.count("cold deploy-") == 3


def test_wheels_are_kept_beside_actuations(added):
    folder, _ = added
    done = run("wheels", folder / "flight.csv", "--store", folder / "t.db", "--json")
    assert done.code == 0 and done.record["command"] == "wheels" and "kept as wheels-2015-09-29, revision 1" in done.err
    shown = run(
        "trend", "show", "--store", folder / "t.db", "--kind", "wheels", "--figure", "revolutions_RWA1", "--json"
    )
    assert shown.record["rows"][0]["value"] > 1000
    report = run("report", folder / "t.db", "--out", folder / "r.html", "--json").record
    assert [k["kind"] for k in report["kinds"]] == ["deploy", "wheels"]


def test_report_writes_a_page_and_its_twin(store, tmp_path):
    done = run("report", store, "--out", tmp_path / "r.html", "--json")
    assert done.code == 0 and done.record["verdict"] == "watch"
    assert json.loads((tmp_path / "r.json").read_text())["kinds"][0]["kind"] == "deploy"
    assert (tmp_path / "r.html").read_text().startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("trend", "show", "--store", "missing.db"), "no trend store"),
        (("trend", "show", "--store", "STORE", "--figure", "speed"), "no figure 'speed'"),
        (("trend", "list", "--store", "STORE", "--figure", "speed"), "no figure 'speed'"),
        (("trend", "show", "--store", "STORE", "--kind", "slew"), "no figures of merit of kind slew"),
        (("trend", "show", "--store", "STORE", "--craft", "iss"), "has no entries of 'iss'"),
        (("trend", "show", "--store", "STORE", "--limit", "angular_impulse=3"), "no unit"),
        (("trend", "show", "--store", "STORE", "--limit", "angular_impulse=3 kg"), "does not convert"),
        (("trend", "show", "--store", "STORE", "--limit", "speed=3 N m"), "does not name a figure"),
        (("trend", "compare", "deploy-2004-12-09", "--store", "STORE"), "needs two events"),
        (("trend", "compare", "deploy-2004-12-09", "x", "--store", "STORE"), "no deploy 'x'"),
        (("trend", "watch", "--store", "STORE", "--event", "x"), "no event 'x'"),
        (("trend", "add", "missing.toml", "--store", "t.db"), "no such event list"),
        (("report", "missing.db", "--out", "r.html"), "no trend store"),
        (("report", "STORE", "--out", "r.pdf"), "a report is an HTML page"),
    ],
)
def test_bad_input_is_one_message_and_two(words, says, store, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run(*(store if w == "STORE" else w for w in words))
    assert done.code == 2 and says in done.err and done.out == ""
    assert done.err.startswith("error: ") and "Traceback" not in done.err
    assert not list(tmp_path.iterdir())
