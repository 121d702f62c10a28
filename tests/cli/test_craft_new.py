"""A craft file to start from, and what a craft can do, verb by verb."""

import json

import numpy as np
import pytest

from asflown.craft.load import load_craft
from cli.program import complaint, csv_text, flight, run


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("options", [[], ["--wheels", "3"], ["--wheels", "4", "--cant", "35.26deg"], ["--wheels", "7"]])
def test_law_a_template_passes_the_check_and_says_what_it_is(options, folder):
    assert run("craft", "new", "mine", *options).code == 0
    done = run("craft", "check", "mine.toml")
    assert done.code == 0 and "placeholders" in done.out and "no [[thrusters]]" in done.out
    wheels = load_craft("mine.toml").at(None).wheels
    assert len(wheels) == int(dict(zip(options[::2], options[1::2], strict=True)).get("--wheels", 3))
    assert np.linalg.matrix_rank([w.axis for w in wheels]) == 3
    if "--cant" in options:
        assert np.degrees(np.arcsin([w.axis[2] for w in wheels])) == pytest.approx(35.26)


def test_law_a_craft_written_as_json_comes_back_the_same(folder):
    (folder / "c.json").write_text(run("craft", "show", "pyramid", "--json").out)
    assert run("craft", "new", "again", "--from-json", "c.json").code == 0
    first, second = load_craft("pyramid").at(None), load_craft("again.toml").at(None)
    assert np.allclose(first.inertia_kgm2, second.inertia_kgm2)
    assert [w.spin_inertia for w in first.wheels] == [w.spin_inertia for w in second.wheels]
    assert np.allclose([w.axis for w in first.wheels], [w.axis for w in second.wheels], atol=1e-9)
    assert "placeholders" not in run("craft", "check", "again.toml").out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["../mine"], "no name"),
        (["mine", "--wheels", "0"], "not possible"),
        (["mine", "--wheels", "4", "--cant", "100 deg"], "beyond 90 deg"),
        (["mine", "--from-json", "none.json"], "no such JSON file"),
        (["mine", "--from-json", "bad.json"], "does not describe"),
        (["mine", "--from-json", "long.json"], "unit vector"),
        (["mine", "--from-json", "inertia.json"], "no rigid body"),
        (["taken"], "already"),
    ],
)
def test_what_cannot_be_a_craft_is_one_complaint(words, said, folder):
    wheel = {"name": "A", "axis": [1, 0, 0], "spin_inertia_kg_m2": 0.1}
    (folder / "bad.json").write_text("[1]")
    (folder / "long.json").write_text(json.dumps({"wheels": [wheel | {"axis": [2, 0, 0]}]}))
    (folder / "inertia.json").write_text(json.dumps({"wheels": [wheel], "inertia_kg_m2": np.diag([1, 1, 9]).tolist()}))
    (folder / "taken.toml").write_text("")
    assert said in complaint("craft", "new", *words)
    assert not (folder / "mine.toml").exists()


def test_craft_check_says_verb_by_verb_what_is_missing(folder):
    verbs = {v["verb"]: v for v in run("craft", "check", "cassini", "--json").record["verbs"]}
    assert all(v["can"] for v in verbs.values())
    (folder / "bare.toml").write_text('name = "bare"\n')
    verbs = {v["verb"]: v for v in run("craft", "check", "bare.toml", "--json").record["verbs"]}
    assert not any(v["can"] for v in verbs.values())
    assert "[[mass_properties]]" in verbs["torque"]["note"] and "[[thrusters]]" in verbs["leak"]["note"]
    (folder / "t.csv").write_text(csv_text(flight()))
    for verb in ("torque", "wheels", "inertia", "external-torque", "leak", "thrust"):
        assert run(verb, "t.csv", "--craft", "bare.toml").code == 2
    assert run("craft", "new", "mine").code == 0
    assert "predicted only, used with 5 %" in run("craft", "check", "mine.toml").out
