"""Texts as a person reads them, and the same answers as JSON against the shipped schemas.

These guard against change and prove nothing; after a wanted change run ``ASFLOWN_GOLDEN=write pytest tests/golden`` and
read the difference."""

import os
from pathlib import Path

import pytest

from asflown.cli.schemas import file_of, schemas, shipped
from asflown.maneuvers.history import past_model
from asflown.maneuvers.write import maneuver_text
from asflown.sim.maneuver_sets import RCS_SET, execute
from asflown.telemetry.tables import write_table
from cli.program import csv_text, flight, run
from flights import flown

HERE = Path(__file__).parent

TEXTS = {
    "torque": ["torque", "t.csv", "--axis", "y", "--prior", "matern", "--craft", "cassini"],
    "torque-momentum": ["torque", "t.csv", "--axis", "y", "--method", "momentum", "--craft", "cassini"],
    "torque-printed": ["torque", "t.csv", "--axis", "y", "--variant", "printed", "--craft", "cassini"],
    "wheels": ["wheels", "wheel-run-down.csv", "--craft", "cassini"],
    "inertia": ["inertia", "slews.csv", "--method", "axis", "--craft", "cassini"],
    "inertia-plan": ["inertia", "plan", "slews.csv", "--craft", "cassini"],
    "inertia-history": ["inertia", "history", "--craft", "cassini"],
    "external-torque": ["external-torque", "t.csv", "--craft", "cassini"],
    "sources": ["sources", "leo-nadir.csv", "--craft", "pyramid"],
    "leak": ["leak", "t.csv", "--cm", "0,0,1.35", "--stop", "180", "--craft", "cassini"],
    "thrust": ["thrust", "wheel-bias-day28.csv", "--cm", "0,0,1.35", "--method", "printed", "--craft", "cassini"],
    "density": ["density", "t.csv", "--flyby", "E3", "--closest-approach", "200", "--axis", "y", "--arm", "0.9 m",
                "--method", "momentum", "--craft", "cassini"],
    "jets": ["jets", "e3.csv", "--flyby", "E3", "--closest-approach", "2008-03-12T19:06:12", "--method", "momentum", "--craft", "cassini"],
    "telemetry-check": ["telemetry", "check", "t.csv"],
    "telemetry-names": ["telemetry", "names"],
    "craft-show-cassini": ["craft", "show", "cassini", "--at", "2005-02-09"],
    "craft-list": ["craft", "list"],
    "gates": ["gates", "m.csv"],
    "gates-watch": ["gates", "watch", "m.csv", "--from", "rcs-40"],
    "gates-history": ["gates", "history"],
    "trend-list": ["trend", "list", "--store", "inertia.db"],
    "trend-show": ["trend", "show", "--store", "inertia.db", "--kind", "inertia", "--figure", "Ixx"],
    "report": ["report", "inertia.db", "--out", "report.html"],
    "help": ["--help"],
}  # fmt: skip

#: Goldens whose answer is JSON too, by the verb whose schema it must fit.
SCHEMAS = {
    name: next(verb for verb in (" ".join(words[:2]), words[0]) if verb in schemas())
    for name, words in TEXTS.items()
    if name != "help"
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Files that the words name, made where they are asked for."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def made(words):
        for word in words:
            stem, _, kind = word.partition(".")
            if word == "t.csv":
                Path(word).write_text(csv_text(flight()))
            elif word == "m.csv":
                Path(word).write_text(maneuver_text(execute(past_model("rcs/2012-1").model, RCS_SET, 1)))
            elif kind == "db":
                assert run("inertia", "history", "--craft", "cassini", "--store", word).code == 0
            elif kind == "csv":
                write_table(flown(stem).telemetry, Path(word))

    return made


@pytest.mark.parametrize("name", TEXTS)
def test_golden_text(name, folder):
    folder(TEXTS[name])
    done = run(*TEXTS[name])
    assert done.code == 0 and "error" not in done.err
    golden = HERE / f"{name}.txt"
    if os.environ.get("ASFLOWN_GOLDEN") == "write":
        golden.write_text(done.out)
    assert done.out == golden.read_text()
    assert "+-" not in done.out


@pytest.mark.parametrize("name", SCHEMAS)
def test_golden_answer_fits_the_shipped_schema(name, folder):
    import jsonschema

    folder(TEXTS[name])
    done = run(*TEXTS[name], "--json")
    schema = shipped(SCHEMAS[name])
    jsonschema.validate(done.record, schema)
    unknown = set(done.record) - set(schema["properties"])
    assert not unknown, f"keys that {file_of(SCHEMAS[name])} does not describe"


def test_shipped_schemas_are_current():
    """On a failure: python -m asflown.cli.schemas, and read the difference."""
    for verb, schema in schemas().items():
        assert shipped(verb) == schema, verb
