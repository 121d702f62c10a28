"""The program as a hostile but fair user meets it: one clear error, exit code 2, nothing else, nothing left behind."""

import gzip
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from asflown.kit.rotations import rotation
from cli.program import complaint, csv_text, flight, run
from flights import conjugated, flown, saved, scaled, written

GOOD = csv_text(flight())
LINES = GOOD.splitlines()  # comment, header, then a row each 4 s
JUNK = np.random.default_rng(7).bytes(4000)


def lines(*picked) -> str:
    return "\n".join(picked) + "\n"


def renamed(old: str, new: str) -> str:
    assert old in LINES[1]
    return GOOD.replace(old, new, 1)


def cell(row: int, column: int, text: str) -> str:
    """The table with one cell replaced; ``row`` is the line in the file, from 1."""
    changed = LINES[row - 1].split(",")
    changed[column] = text
    return lines(*LINES[: row - 1], ",".join(changed), *LINES[row:])


def column(index: int, change) -> str:
    rows = [r.split(",") for r in LINES[2:]]
    for r in rows:
        r[index] = change(r[index])
    return lines(*LINES[:2], *map(",".join, rows))


#: What is wrong -> the file's content, and what the complaint must say.
TABLES = {
    "empty": ("", ["is empty"]),
    "blank lines": ("\n  \n\n", ["is empty"]),
    "only a comment": (lines(LINES[0]), ["no header line"]),
    "header only": (lines(*LINES[:2]), ["no rows"]),
    "no time column": (lines(*(r.partition(",")[2] for r in LINES[1:])), ["no time column", "time [s]"]),
    "time without a unit": (renamed("time [s]", "time"), ["no time column", "time [utc]"]),
    "unknown time scale": (renamed("time [s]", "time [sols]"), ["[sols]"]),
    "header without a unit": (renamed("body_rate_x [rad/s]", "body_rate_x"), ["body_rate_x", "no unit"]),
    "no heading": (renamed("body_rate_x [rad/s]", ""), ["column 5"]),
    "unknown unit": (renamed("body_rate_x [rad/s]", "body_rate_x [furlong]"), ["channel body_rate_x", "[furlong]"]),
    "unit of another kind": (renamed("body_rate_x [rad/s]", "body_rate_x [m/s]"), ["body_rate_x", "[m/s]", "[rad/s]"]),
    "unknown channel": (renamed("body_rate_x", "body_rat_x"), ["body_rat_x", "body_rate_x"]),
    "column named twice": (renamed("body_rate_y", "body_rate_x"), ["twice", "body_rate_x"]),
    "channel in two units": (renamed("body_rate_y [rad/s]", "body_rate_x [mrad/s]"), ["two columns", "body_rate_x"]),
    "a cell too many": (lines(*LINES[:49], LINES[49] + ",1", *LINES[50:]), ["line 50", "11 cells"]),
    "a cell too few": (lines(*LINES[:49], LINES[49].rpartition(",")[0], *LINES[50:]), ["line 50", "9 cells"]),
    "not a number": (cell(41, 3, "abc"), ["line 41", "wheel_rate_RWA4", "'abc'"]),
    "infinite": (cell(41, 3, "inf"), ["line 41", "wheel_rate_RWA4", "not finite"]),
    "beyond float64": (cell(41, 3, "1e999"), ["line 41", "wheel_rate_RWA4"]),
    "beyond belief": (cell(41, 3, "1e200"), ["line 41", "wheel_rate_RWA4", "too large"]),
    "channel all blank": (column(4, lambda c: ""), ["body_rate_x", "no value"]),
    "blank time": (cell(41, 0, ""), ["line 41", "time [s]"]),
    "time in words": (cell(41, 0, "noon"), ["line 41", "'noon'"]),
    "time beyond the calendar": (cell(123, 0, "1e300"), ["line 123", "1e300"]),
    "time backwards": (lines(*LINES[:2], *LINES[:1:-1]), ["backwards", "476 s", "Divide"]),
    "clock reset": (lines(*LINES[:2], *LINES[60:], *LINES[2:60]), ["backwards", "at 0 s", "reset"]),
    "time stands still": (column(0, lambda c: "5.0"), ["same time", "121 rows"]),
    "an epoch that is no date": (GOOD.replace("2015-09-29", "2015-19-29"), ["2015-19-29"]),
    "an epoch long ago": (GOOD.replace("2015-09-29", "0001-09-29"), ["0001-09-29"]),
    "numbers under utc": (renamed("time [s]", "time [utc]"), ["line 3", "time [utc]"]),
    "open quote": (cell(41, 3, '"1.0'), ["line 41", "quotation"]),
    "binary junk": (JUNK, ["not a text table"]),
    "gzip cut short": (gzip.compress(GOOD.encode())[:-2000], ["gzip", "truncated"]),
    "gzip header only": (gzip.compress(GOOD.encode())[:5], ["gzip", "truncated"]),
    "gzip of nothing": (gzip.compress(b""), ["is empty"]),
    "Parquet in name only": (b"PAR1" + JUNK, ["Parquet"]),
    "HDF5 in name only": (b"\x89HDF\r\n\x1a\n" + JUNK, ["HDF5"]),
    "NetCDF in name only": (b"CDF\x01" + JUNK, ["NetCDF"]),
    "a very long name": (renamed("body_rate_x", "x" * 5000), ["Rename"]),
    "very many unknown channels": (lines(",".join(["time [s]", *(f"bad_{i} [s]" for i in range(4000))]), "0" + ",0" * 4000), ["bad_0"]),
}  # fmt: skip


@pytest.fixture
def good(tmp_path) -> Path:
    return written(tmp_path, GOOD, "good.csv")


@pytest.mark.parametrize("case", TABLES)
def test_a_bad_table_is_refused_by_every_verb_that_reads_one(case, tmp_path):
    content, words = TABLES[case]
    path = written(tmp_path, content)
    out, plot = tmp_path / "out.csv", tmp_path / "out.svg"
    said = complaint("torque", path, "--out", out, "--plot", plot)
    assert said == complaint("torque", path, "--json") == complaint("telemetry", "check", path, "--json")
    assert said == complaint("telemetry", "check", path)
    assert str(path) in said.splitlines()[0]
    for word in words:
        assert word in said
    assert os.listdir(tmp_path) == ["t.csv"]


def test_no_file_and_a_directory(tmp_path):
    for verb in (["torque"], ["telemetry", "check"]):
        assert "no such file" in complaint(*verb, tmp_path / "none.csv")
        assert "directory" in complaint(*verb, tmp_path)
        assert "cannot be opened" in complaint(*verb, "x" * 400)
    assert "directory" in complaint("torque", tmp_path, "--json")


#: Tables that can be read, and hold too little for a torque.
TOO_LITTLE = {
    "one sample": (lines(*LINES[:3]), "too few usable samples (1)"),
    "two samples": (lines(*LINES[:4]), "shorter than the window"),
    "half a minute": (lines(*LINES[:10]), "28 s, shorter than the window"),
    "a wheel the craft does not have": (renamed("RWA4", "RWA9"), "RWA1, RWA2, RWA3, RWA4"),
    "a wheel missing": (lines(*(",".join(r.split(",")[:3] + r.split(",")[4:]) for r in LINES[1:])), "wheel_rate_RWA4"),
    "nothing to work with": (lines("time [s],tank_pressure [Pa]", "0,1e5", "4,1e5"), "wheel"),
}


@pytest.mark.parametrize("case", TOO_LITTLE)
def test_a_table_that_holds_too_little(case, tmp_path):
    content, words = TOO_LITTLE[case]
    path = written(tmp_path, content)
    said = complaint("torque", path, "--out", tmp_path / "out.csv")
    assert words in said and str(path) in said.splitlines()[0]
    assert said == complaint("torque", path, "--json")
    for method in (["--variant", "printed"], ["--method", "transfer"], ["--method", "polynomial"]):
        done = run("torque", path, *method)
        assert done.code == 0 or str(path) in complaint("torque", path, *method)
    assert run("telemetry", "check", path).code == 0
    assert os.listdir(tmp_path) == ["t.csv"]


#: Options that cannot be, and what the complaint must say.
OPTIONS = {
    "five inertia elements": (["--inertia", "1,2,3,4,5"], ["--inertia", "6 numbers"]),
    "inertia in words": (["--inertia", "a,b,c,d,e,f"], ["--inertia"]),
    "inertia not a number": (["--inertia", "1,2,2,0,0,nan"], ["--inertia"]),
    "inertia too large": (["--inertia", "1e300,1e300,1e300,0,0,0"], ["--inertia"]),
    "negative moment": (["--inertia", "-1,2,2,0,0,0"], ["no rigid body"]),
    "triangle violated": (["--inertia", "1,1,5,0,0,0"], ["no rigid body", "sum of the other two"]),
    "not positive definite": (["--inertia", "5,5,5,9,0,0"], ["no rigid body"]),
    "inertia without a value": (["--inertia"], ["--inertia", "asflown torque --help"]),
    "two coordinates": (["--cm", "1,2"], ["--cm", "3 numbers"]),
    "centre of mass in words": (["--cm", "x,y,z"], ["--cm"]),
    "start in words": (["--start", "noon"], ["'noon'"]),
    "start not a number": (["--start", "nan"], ["'nan'"]),
    "start beyond time": (["--start", "1e300"], ["1e300"]),
    "start in month 13": (["--start", "2015-13-01T00:00:00"], ["2015-13-01"]),
    "start after stop": (["--start", "300", "--stop", "200"], ["before it starts", "200 s", "300 s"]),
    "start is stop": (["--start", "300", "--stop", "300"], ["before it starts"]),
    "after the data": (["--start", "10000"], ["no data after 10000 s", "480 s"]),
    "before the data": (["--stop", "2015-09-28T00:00:00"], ["no data before", "2015-09-28"]),
    "outside the data": (["--start", "1000", "--stop", "2000"], ["no data from 1000 s", "480 s"]),
    "between two samples": (["--start", "201", "--stop", "203"], ["no sample"]),
    "window shorter than the fit": (["--start", "200", "--stop", "230"], ["shorter than the window", "channel"]),
    "axis w": (["--axis", "w"], ["'w'", "x, y, z, all"]),
    "method": (["--method", "magic"], ["'magic'", "momentum, transfer"]),
    "variant": (["--variant", "best"], ["'best'", "corrected, printed"]),
    "model": (["--method", "transfer", "--model", "huge"], ["'huge'", "low, hankel, full"]),
    "a model the method does not have": (["--model", "low"], ["--model"]),
    "printed and full": (["--method", "transfer", "--variant", "printed", "--model", "full"], ["full"]),
    "order": (["--order", "7"], ["7", "6, 12, 15, 18"]),
    "order in words": (["--order", "x"], ["--order"]),
    "window of nothing": (["--window", "0"], ["0.0 s", "positive"]),
    "window not a number": (["--window", "nan"], ["nan"]),
    "window longer than the record": (["--window", "1000"], ["480 s, shorter than the window of 1000 s"]),
    "window where there is none": (["--window", "30", "--variant", "printed"], ["--window"]),
    "prior": (["--prior", "magic"], ["'magic'", "edges, matern, wiener"]),
    "loop": (["--loop", "open"], ["'open'", "modelled, measured"]),
    "a prior the method does not have": (["--method", "momentum", "--prior", "edges"], ["momentum", "--method fused"]),
    "considered without a number": (["--consider", "inertia"], ["--consider", "inertia=0.03"]),
    "considered in words": (["--consider", "inertia=much"], ["inertia=much"]),
    "considered what is not": (["--consider", "mass=0.1"], ["'mass'", "inertia, spin_inertia"]),
    "considered beyond reason": (["--consider", "inertia=2"], ["2.0", "share"]),
    "considered not a number": (["--consider", "kp=nan"], ["nan", "kp"]),
    "impulse of one time": (["--impulse", "60"], ["--impulse", "480"]),
    "impulse in words": (["--impulse", "a,b"], ["--impulse", "numbers"]),
    "impulse backwards": (["--impulse", "141,60"], ["earlier first"]),
    "impulse outside": (["--impulse", "60,1000"], ["480"]),
    "fused and printed": (["--method", "fused", "--variant", "printed"], ["no paper"]),
    "mechanism": (["--moving", "boom"], ["'boom'", "cover"]),
    "option": (["--bogus"], ["--bogus", "asflown torque --help"]),
    "a second file": (["more.csv"], ["more.csv"]),
    "craft": (["--craft", "voyager"], ["'voyager'", "cassini, inspiresat1, iss"]),
    "craft without a wheel controller": (["--craft", "iss", "--method", "transfer"], ["iss", "wheel"]),
    "craft file missing": (["--craft", "none.toml"], ["none.toml", "no such craft file"]),
    "alternative": (["--craft", "cassini@none"], ["'none'", "001-rounded"]),
    "plot suffix": (["--plot", "x.bmp"], [".bmp", ".svg"]),
    "plot without a suffix": (["--plot", "x"], ["suffix"]),
    "out is a directory": (["--out", "."], ["directory"]),
    "out is a device": (["--out", os.devnull], ["not a plain file"]),
    "out where no file can be": (["--out", "good.csv/x.csv"], ["good.csv", "folder"]),
    "plot where no file can be": (["--plot", "good.csv/x.svg", "--out", "out.csv"], ["good.csv", "folder"]),
    "out is fine, plot is not": (["--out", "out.csv", "--plot", "x.bmp"], [".bmp"]),
    "dictionary missing": (["--channels", "none.toml"], ["none.toml"]),
    "dictionary is a directory": (["--channels", "."], ["directory"]),
    "exclusions missing": (["--exclude", "none.csv"], ["none.csv"]),
    "exclusions are a directory": (["--exclude", "."], ["directory"]),
}  # fmt: skip


@pytest.mark.parametrize("case", OPTIONS)
def test_a_bad_option_is_refused(case, good, monkeypatch):
    monkeypatch.chdir(good.parent)
    options, words = OPTIONS[case]
    said = complaint("torque", "good.csv", *options)
    assert complaint("torque", "good.csv", "--json", *options) == said
    for word in words:
        assert word in said
    assert os.listdir() == ["good.csv"]


#: Small files that options name -> option, content, what the complaint must say.
FILES = {
    "exclusions with other columns": ("--exclude", "a,b\n1,2\n", ["start, stop, channel, reason"]),
    "exclusion of an unknown channel": ("--exclude", "start,stop,channel,reason\n1,2,foo,x\n", ["'foo'", "wheel_rate_RWA1"]),
    "exclusion backwards": ("--exclude", "start,stop,channel,reason\n20,1,*,x\n", ["line 2", "before it starts"]),
    "exclusion without a reason": ("--exclude", "start,stop,channel,reason\n1,20,*,\n", ["line 2", "reason"]),
    "exclusion at noon": ("--exclude", "start,stop,channel,reason\nnoon,20,*,x\n", ["line 2", "'noon'"]),
    "exclusions cut short": ("--exclude", "start,stop,channel,reason\n1,20\n", ["line 2", "2 cells"]),
    "exclusions in binary": ("--exclude", JUNK, ["text"]),
    "exclusions in an empty file": ("--exclude", "", ["empty"]),
    "dictionary empty": ("--channels", "", ["time"]),
    "dictionary not TOML": ("--channels", "name = ", ["TOML"]),
    "dictionary in binary": ("--channels", JUNK, ["TOML"]),
    "dictionary with an unknown key": ("--channels", 'foo = 1\n[time]\ncolumn = "time [s]"\nformat = "s"\n', ["foo"]),
    "craft empty": ("--craft", "", ["name"]),
    "craft not TOML": ("--craft", "name = ", ["TOML"]),
    "craft in binary": ("--craft", JUNK, ["TOML"]),
    "craft with an unknown key": ("--craft", 'name = "x"\nfoo = 1\n', ["foo", "unknown key"]),
    "craft of other types": ("--craft", 'name = ["x"]\nwheels = 3\n', ["name", "wheels"]),
}  # fmt: skip


@pytest.mark.parametrize("case", FILES)
def test_a_bad_file_named_by_an_option_is_refused(case, good):
    option, content, words = FILES[case]
    path = written(good.parent, content, "x.toml")
    said = complaint("torque", good, option, path)
    assert "x.toml" in said.splitlines()[0]
    for word in words:
        assert word in said


def test_all_data_excluded(good):
    spans = written(good.parent, "start,stop,channel,reason\n0,1000,*,all of it\n", "x.csv")
    said = complaint("torque", good, "--exclude", spans)
    assert "too few usable samples (0)" in said and str(good) in said
    assert run("telemetry", "check", good, "--exclude", spans, "--json").code == 0


def test_a_date_where_the_file_has_no_epoch(tmp_path):
    path = written(tmp_path, csv_text(flight(), None))
    assert "no epoch" in complaint("torque", path, "--start", "2015-09-29T00:01:00")


WHEEL = 'name = "x"\n[[wheels]]\nname = "A"\naxis = "1 0 0"\nspin_inertia = "1 kg m2"\n'
CRAFTS = {
    "axis not of length one": (WHEEL.replace("1 0 0", "1 1 0"), "unit vector"),
    "axis of two numbers": (WHEEL.replace("1 0 0", "1 0"), "3 numbers"),
    "unit of another kind": (WHEEL.replace("kg m2", "kg"), "[kg]"),
    "no unit": (WHEEL.replace('"1 kg m2"', "1.0"), "no unit"),
    "negative spin inertia": (WHEEL.replace("1 kg", "-1 kg"), "not positive"),
    "a value too large": (WHEEL.replace("1 kg", "1e300 kg"), "too large"),
    "wheel described twice": (WHEEL + WHEEL.partition("\n")[2], "described twice"),
    "impossible inertia": (
        WHEEL + '[[mass_properties]]\ndate = "2015-01-01"\npiece = "all"\ninertia = "1 1 5 0 0 0 kg m2"\n',
        "no rigid body",
    ),
    "a date that is none": (
        WHEEL + '[[mass_properties]]\ndate = "someday"\npiece = "all"\ninertia = "1 1 1 0 0 0 kg m2"\n',
        "someday",
    ),
}


@pytest.mark.parametrize("case", CRAFTS)
def test_a_bad_craft_file_is_refused(case, tmp_path):
    content, words = CRAFTS[case]
    path = written(tmp_path, content, "x.toml")
    said = complaint("craft", "check", path)
    assert words in said and "x.toml" in said
    assert said == complaint("craft", "show", path) == complaint("craft", "check", path, "--json")


def test_craft_verbs_refuse_what_is_not_there(tmp_path):
    assert "'voyager'" in complaint("craft", "show", "voyager")
    assert "no such craft file" in complaint("craft", "check", tmp_path / "none.toml")
    assert "directory" in complaint("craft", "check", tmp_path)
    for date in ("noon", "", "0001-01-01", "9999-01-01"):
        assert repr(date) in complaint("craft", "show", "cassini", "--at", date)


SCENARIO = 'duration = "60 s"\n'
SCENARIOS = {
    "empty": ("", "duration"),
    "unknown key": (SCENARIO + "foo = 1\n", "foo: unknown key"),
    "duration without a unit": ("duration = 60\n", "no unit"),
    "negative duration": (SCENARIO.replace("60", "-60"), "greater than 0"),
    "endless": (SCENARIO.replace("60", "1e12"), "control cycles"),
    "unknown craft": (SCENARIO + 'craft = "voyager"\n', "'voyager'"),
    "unknown wheel": (SCENARIO + '[wheel_rates]\nRWA9 = "10 rpm"\n', "RWA1, RWA2, RWA4"),
    "unknown shape": (SCENARIO + '[[torques]]\nshape = "square"\n', "triangles"),
    "torque table missing": (SCENARIO + '[[torques]]\nshape = "table"\nfile = "none.csv"\n', "none.csv"),
    "no period": (SCENARIO + '[controller]\nperiod = "0 s"\n', "period"),
    "negative interval": (SCENARIO + '[telemetry]\nwheel_rate = "-4 s"\n', "wheel_rate"),
    "epoch": (SCENARIO + 'epoch = "yesterday"\n', "epoch: 'yesterday'"),
    "gap in a channel not sent": (SCENARIO + '[[telemetry.gaps]]\nchannel = "foo"\nstart = "0 s"\nstop = "9 s"\n', "'foo'"),
    "nothing sent": (
        SCENARIO + "[telemetry]\n" + "".join(f'{s} = "0 s"\n' for s in ("wheel_rate", "body_rate", "attitude_error", "quaternion")),
        "no telemetry",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", SCENARIOS)
def test_a_bad_scenario_is_refused(case, tmp_path):
    content, words = SCENARIOS[case]
    path = written(tmp_path, content, "x.toml")
    said = complaint("simulate", path, "--out", tmp_path / "out")
    assert words in said
    assert said == complaint("simulate", path, "--out", tmp_path / "out", "--json")
    assert os.listdir(tmp_path) == ["x.toml"]


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--noise", "loud"], "noise"),
        (["--seed", "-1"], "--seed"),
        (["--seed", "x"], "--seed"),
        (["--craft", "iss"], "iss"),
        (["--craft", "voyager"], "voyager"),
        (["--inertia", "1,2,3"], "--inertia"),
        (["--inertia", "1,1,5,0,0,0"], "no rigid body"),
        ([], "folder"),
    ],
)
def test_a_flight_is_refused_before_it_is_flown(options, word, tmp_path):
    taken = written(tmp_path, "", "taken")
    assert word in complaint("simulate", "quiet", "--out", tmp_path / "out" if options else taken / "out", *options)
    assert os.listdir(tmp_path) == ["taken"]


def test_usage():
    assert "'nope'" in complaint("simulate", "nope", "--out", "x")
    assert "asflown simulate --help" in complaint("simulate", "quiet")
    assert "asflown telemetry --help" in complaint("telemetry", "bogus")
    assert "asflown craft --help" in complaint("craft")
    assert "asflown telemetry check --help" in complaint("telemetry", "check")
    assert "asflown --help" in complaint("bogus")
    assert "asflown torque --help" in complaint("torque")


# ---- what is refused or doubted only because of what the data say ----------------------------------


@pytest.fixture
def slew():
    """A flight with a slew, cut short."""
    return flown("slews", duration="420 s").telemetry


def test_a_quaternion_of_the_wrong_direction_is_refused_in_a_slew(slew, tmp_path):
    assert run("telemetry", "check", saved(slew, tmp_path, "right.csv")).code == 0
    wrong = saved(conjugated(slew), tmp_path, "wrong.csv")
    for verb in (["torque"], ["telemetry", "check"], ["torque", "--json"]):
        said = complaint(*verb, wrong)
        assert "conjugate" in said and "wrong.csv" in said and "negate" in said


def test_q_and_minus_q_are_the_same_attitude(slew, tmp_path):
    q = np.stack([slew.channels[f"quaternion_{m}"].values for m in "wxyz"], axis=1)
    assert np.allclose(rotation(q).as_matrix(), rotation(-q).as_matrix())
    flipped = scaled(slew, "quaternion", np.where(np.arange(len(q)) % 2 == 0, -1, 1))
    done = run("torque", saved(flipped, tmp_path))
    assert done.code == 0 and "quaternion" not in done.out


def test_rpm_labelled_rad_per_s_is_a_doubt(tmp_path):
    table = flight()
    for name in table:
        if name.startswith("wheel_rate"):
            table[name] = table[name] * 30 / np.pi
    path = written(tmp_path, csv_text(table))
    done = run("torque", path, "--json")
    assert done.code == 0
    assert any("rpm labelled rad/s" in d for d in done.record["doubts"])
    assert run("telemetry", "check", path, "--craft", "cassini").code == 3


# ---- in a process of its own ------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["torque", "none.csv"], ["torque"], ["simulate", "quiet", "--out", "taken/out"]])
def test_the_program_itself_complains_once(words, tmp_path):
    written(tmp_path, "", "taken")
    program = [sys.executable, "-c", "from asflown.cli.main import main; main()"]
    done = subprocess.run([*program, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("error: ") and "Traceback" not in done.stderr
