"""Texts as a person reads them.  These guard against change and prove nothing; after a wanted change run
``ASFLOWN_GOLDEN=write pytest tests/golden`` and read the difference."""

import os
from pathlib import Path

import pytest

from asflown.maneuvers.history import past_model
from asflown.maneuvers.write import maneuver_text
from asflown.sim.maneuver_sets import RCS_SET, execute
from cli.program import csv_text, flight, run

HERE = Path(__file__).parent

TEXTS = {
    "torque": ["torque", "t.csv", "--axis", "y", "--prior", "matern"],
    "torque-momentum": ["torque", "t.csv", "--axis", "y", "--method", "momentum"],
    "torque-printed": ["torque", "t.csv", "--axis", "y", "--variant", "printed"],
    "leak": ["leak", "t.csv", "--cm", "0,0,1.35", "--stop", "180"],
    "density": ["density", "t.csv", "--flyby", "E3", "--closest-approach", "200", "--axis", "y", "--arm", "0.9 m",
                "--method", "momentum"],
    "telemetry-check": ["telemetry", "check", "t.csv"],
    "craft-show-cassini": ["craft", "show", "cassini", "--at", "2005-02-09"],
    "craft-list": ["craft", "list"],
    "gates": ["gates", "m.csv"],
    "gates-watch": ["gates", "watch", "m.csv", "--from", "rcs-40"],
    "gates-history": ["gates", "history"],
    "help": ["--help"],
}  # fmt: skip


@pytest.mark.parametrize("name", TEXTS)
def test_golden_text(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    Path("t.csv").write_text(csv_text(flight()))
    Path("m.csv").write_text(maneuver_text(execute(past_model("rcs/2012-1").model, RCS_SET, 1)))
    done = run(*TEXTS[name])
    assert done.code == 0 and done.err == ""
    golden = HERE / f"{name}.txt"
    if os.environ.get("ASFLOWN_GOLDEN") == "write":
        golden.write_text(done.out)
    assert done.out == golden.read_text()
