"""What each verb loads: importing these packages is most of a short call, so a verb loads one only where its work needs it."""

import json
import subprocess
import sys

import pytest

from cli.program import csv_text, flight

#: Packages and parts of packages that take a tenth of a second or more to import.
HEAVY = (
    "numba", "scipy.signal", "scipy.stats", "scipy.ndimage", "scipy.interpolate", "scipy.optimize", "scipy.integrate", "astropy", "pandas",
    "xarray", "matplotlib", "duckdb", "sqlalchemy", "rich", "asflown.estimate.fused",
)  # fmt: skip
#: In this order, one after the other: a verb, and what it adds to what those before it have loaded.
MAY_ADD = {
    "--help": set(),
    "torque": set(),  # an error of usage
    "torque t.csv --craft cassini --method nope": set(),
    "gates watch nope.csv --from 1": set(),
    "craft show cassini": set(),
    "telemetry check t.csv": set(),
    "wheels t.csv --craft cassini": {"scipy.optimize"},
    "torque t.csv --craft cassini --method momentum --axis y": {"scipy.interpolate"},
    "external-torque t.csv --craft cassini": {"scipy.integrate"},
}

_RUN = """
import contextlib, io, json, sys
from asflown.cli.main import main
heavy, seen, added = sys.argv[1].split(), set(), {}
for words in json.loads(sys.argv[2]):
    sys.argv = ["asflown", *words.split()]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), contextlib.suppress(SystemExit):
        main()
    here = {h for h in heavy if h in sys.modules}
    added[words], seen = sorted(here - seen), seen | here
print(json.dumps(added))
"""


def test_law_a_verb_loads_no_heavy_package_that_its_work_does_not_need(tmp_path):
    (tmp_path / "t.csv").write_text(csv_text(flight()))
    words = [sys.executable, "-c", _RUN, " ".join(HEAVY), json.dumps(list(MAY_ADD))]
    told = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, check=True).stdout
    added = {verb: set(those) for verb, those in json.loads(told).items()}
    assert {v: a - MAY_ADD[v] for v, a in added.items() if a - MAY_ADD[v]} == {}


@pytest.mark.parametrize("terminal", [True, False])
def test_law_long_work_is_shown_with_the_time_left(terminal, monkeypatch):
    import io
    import time

    from asflown.cli import progress
    from asflown.kit.progress import stage

    class Stream(io.StringIO):
        def isatty(self):
            return terminal

    out, began = Stream(), time.monotonic()
    for name, value in (("_FROM_S", 0.02), ("_EVERY_S", 0.01), ("_LINE_EVERY_S", 0.02)):
        monkeypatch.setattr(progress, name, value)
    with progress.shown(out), stage("reading t.csv", lambda: min(1.0, (time.monotonic() - began) / 0.2)):
        time.sleep(0.15)
    said = out.getvalue()
    assert "reading t.csv [" in said and "s left" in said
    assert said.endswith("\r" if terminal else "\n") and ("\r" in said) == terminal


def test_law_short_work_is_not_shown(capsys):
    from asflown.cli.progress import shown
    from asflown.kit.progress import stage

    with shown(), stage("reading t.csv"):
        pass
    assert capsys.readouterr().err == ""
