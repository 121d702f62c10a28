"""The world around the program: names that are no patterns, terminals, closed and full streams, caches, Ctrl-C, pipes."""

import io
import os
import re
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

from asflown.cli.output import Shown
from asflown.kit.errors import BadInput
from asflown.kit.escapes import encodable, on_one_line, visible
from asflown.kit.kernel_cache import compiled
from asflown.kit.reading import read_bytes
from asflown.plots.figure import as_written, new_figure, save
from asflown.telemetry.load import load_telemetry
from cli.program import complaint, csv_text, flight, run

PROGRAM = [sys.executable, "-c", "from asflown.cli.start import main; main()"]


def parquet(place, scale: float) -> None:
    import duckdb

    place.parent.mkdir(exist_ok=True)
    with duckdb.connect() as db:
        target = str(place).replace("'", "''")
        db.execute(
            f"""COPY (SELECT range * 2.0 AS "time [s]", range * {scale} AS "body_rate_x [rad/s]" FROM range(20)) TO '{target}' (FORMAT parquet)"""
        )


def test_a_name_is_not_a_pattern(tmp_path):
    parquet(tmp_path / "a1.parquet", 1e-6)
    parquet(tmp_path / "a[1].parquet", 1e-5)
    parquet(tmp_path / "date=2015-09-29" / "a*.parquet", 1e-5)
    for name in ("a[1].parquet", "date=2015-09-29/a*.parquet"):
        read = load_telemetry(tmp_path / name)
        assert set(read.channels) == {"body_rate_x"} and read.channels["body_rate_x"].values[1] == pytest.approx(1e-5)


def test_control_characters_are_shown_and_formulas_are_text(tmp_path):
    assert visible("\x1b[2J\u202e\x9b\t\n") == "\\x1b[2J\\u202e\\x9b\\t\n" and on_one_line("a\nb") == "a\\nb"
    name = "bad\x1b[2Jname.csv"
    for said in (complaint("torque", name), complaint("torque", tmp_path, "--craft", "x\x07\n\x1b]0;y")):
        assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f]", said)
    stream = io.StringIO()
    print("id \x1b[31m\r", file=Shown(stream))
    assert stream.getvalue() == "id \\x1b[31m\\r\n"
    figure, (ax,) = new_figure()
    ax.set_title(r"$\frac$ \x1b \x1b[0m".replace(r"\x1b", "\x1b"))
    ax.set_xticks([0, 1], [r"$\frac$", "$a_"])
    ax.plot([0, 1], [1, 2], label=r"$\undefined{")
    ax.legend()
    save(figure, tmp_path / "f.svg")
    drawn = (tmp_path / "f.svg").read_text()
    assert r"$\frac$" in drawn and "\x1b" not in drawn
    as_written(ax)  # twice does no harm


@pytest.mark.slow
def test_an_id_of_a_store_may_hold_a_formula(tmp_path):
    from asflown.maneuvers.history import past_model
    from asflown.maneuvers.write import maneuver_text
    from asflown.sim.maneuver_sets import RCS_SET, execute

    text = maneuver_text(execute(past_model("rcs/2012-1").model, RCS_SET, 1))
    rows = text.splitlines()
    rows[1] = rf"$\frac$<b>\x{rows[1][rows[1].index(',') :]}"
    burns = tmp_path / "m.csv"
    burns.write_text("\n".join(rows) + "\n")
    done = run("gates", burns, "--report", tmp_path / "r.html", "--plot-dir", tmp_path / "p")
    assert done.code == 0 and "$\\frac$<b>" not in (tmp_path / "r.html").read_text()


def test_a_terminal_that_lacks_signs_gets_them_in_ascii():
    assert encodable("1.2 ± 0.3 µN·m — ü", "ascii") == "1.2 +/- 0.3 uN|m \\u2014 \\xfc"
    assert encodable("±", "utf-8") == encodable("±", None) == "±"


def started(words, cwd, **how) -> subprocess.CompletedProcess:
    quiet = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | how
    environment = os.environ | how.pop("env", {})
    quiet.pop("env", None)
    return subprocess.run([*PROGRAM, *words], cwd=cwd, check=False, text=True, env=environment, **quiet)


@pytest.mark.slow
def test_streams_that_fail_end_in_a_sentence(tmp_path):
    with open("/dev/full", "w") as full:
        done = started(["telemetry", "names"], tmp_path, stdout=full)
        assert done.returncode == 2 and done.stderr.startswith("error: standard output cannot be written")
    closed = f"{sys.executable} -c 'from asflown.cli.start import main; main()' telemetry names"
    for words, code in ((f"{closed} >&-", 0), (f"{closed} 2>&- >/dev/null", 0), (f"{closed} | head -1", 0)):
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", words], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == code and "Traceback" not in done.stderr and done.stderr == "", (words, done)
    done = started(["craft", "show", "cassini"], tmp_path, env={"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0 and done.stderr == ""


@pytest.mark.slow
def test_ctrl_c_ends_the_program_quietly(tmp_path):
    for wait_s in (0.15, 1.5):
        program = subprocess.Popen([*PROGRAM, "simulate", "cassini-mission", "--out", "m"], cwd=tmp_path,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
        time.sleep(wait_s)
        while (
            program.poll() is None
        ):  # one that falls into an import's own clean-up may be lost: a person presses again
            program.send_signal(signal.SIGINT)
            time.sleep(0.5)
        _, err = program.communicate(timeout=60)
        # within the first tenths Python itself is still starting, and answers in its own way
        assert wait_s < 1 or (program.returncode == 130 and "Traceback" not in err)
    assert not any(p.is_file() for p in tmp_path.rglob("*"))


def test_kernels_without_a_cache_or_with_a_damaged_one(tmp_path, monkeypatch):
    space: dict = {}
    exec(compile("def twice(x):\n    return 2 * x\n", "<no file>", "exec"), space)  # numba finds no place to cache it
    assert compiled(space["twice"])(2) == 4
    source = textwrap.dedent("""
        def thrice(x):
            return 3 * x
    """)
    (tmp_path / "made.py").write_text(source)
    monkeypatch.syspath_prepend(str(tmp_path))
    from numba import config

    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    import made

    assert compiled(made.thrice)(2) == 6
    kept = [p for p in (tmp_path / "cache").rglob("*") if p.is_file()]
    assert kept
    for path in kept:
        path.write_bytes(path.read_bytes()[:20])
    assert compiled(made.thrice)(2) == 6  # and the cache is whole again
    assert all(p.stat().st_size > 20 for p in (tmp_path / "cache").rglob("*.nbi"))


def test_what_has_no_end_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for place in ("/dev/zero", str(tmp_path / "pipe.toml")):
        with pytest.raises(BadInput, match="not a plain file"):
            read_bytes(place, "file", "Give a file.")
    good = tmp_path / "t.csv"
    good.write_text(csv_text(flight()))
    for option in ("--craft", "--channels", "--exclude"):
        assert "plain file" in complaint("torque", good, option, tmp_path / "pipe.toml")
    for verb in (["gates"], ["craft", "check"], ["torque"], ["telemetry", "check"]):
        assert "plain file" in complaint(*verb, tmp_path / "pipe.toml")


def test_sizes_are_checked_before_they_are_allocated(tmp_path):
    import h5py

    with h5py.File(tmp_path / "t.h5", "w") as file:
        for name in ("time", "body_rate_x"):
            file.create_dataset(name, (150_000_000,), "f8", chunks=(1_000_000,))
    assert (tmp_path / "t.h5").stat().st_size < 50_000
    with pytest.raises(BadInput, match="too little to hold them"):
        load_telemetry(tmp_path / "t.h5")


def test_passwords_stay_out_of_messages():
    said = complaint("trend", "list", "--store", "postgresql://me:s3cret@127.0.0.1:9/none")
    assert "s3cret" not in said


# ---- --strict and --accept ---------------------------------------------------------------------


@pytest.fixture
def doubted(tmp_path):
    """Wheels in rpm labelled rad/s: a suspect doubt of every result that uses them."""
    table = {n: v * 30 / np.pi if n.startswith("wheel_rate") else v for n, v in flight().items()}
    path = tmp_path / "t.csv"
    path.write_text(csv_text(table))
    return path


def test_strict_makes_a_suspect_doubt_exit_3_and_accept_takes_it_off(doubted):
    words = ("torque", doubted, "--method", "momentum", "--json")
    plain = run(*words)
    graves = sorted({d["kind"] for d in plain.record["doubts_detail"] if d["severity"] in ("suspect", "void")})
    assert plain.code == 0 and graves
    assert run(*words, "--strict").code == 3
    accepted = [w for kind in graves for w in ("--accept", kind)]
    done = run(*words, "--strict", *accepted)
    assert done.code == 0 and not {d["kind"] for d in done.record["doubts_detail"]} & set(graves)
    options = done.record["provenance"]["options"]
    assert options["accept"] == graves and len(options["accepted"]) >= len(graves)
    assert "ACCEPTED" in run(*words[:-1], *accepted).out


def test_a_kind_that_does_not_exist_is_refused(doubted):
    said = complaint("torque", doubted, "--accept", "telemetry.implausble")
    assert "no such kind" in said and "Did you mean telemetry.implausible" in said


def test_every_verb_takes_strict_and_accept():
    from typer.main import get_command

    from asflown.cli.main import app

    def verbs(group):
        for command in group.commands.values():
            yield from verbs(command) if hasattr(command, "commands") else [command]

    for command in verbs(get_command(app)):
        names = {p.name for p in command.params}
        assert {"strict", "accept"} <= names, command.name
        assert ("force" in names) == bool(names & {"out", "table", "plot", "plot_dir", "report", "folder"}), (
            command.name
        )


@pytest.mark.slow
def test_nearly_every_kind_is_found_without_importing_it():
    from asflown.cli.verb import known_kinds
    from asflown.kit.doubts import kinds

    assert set(known_kinds()) <= set(known_kinds(imported=True)) == set(kinds())
    assert len(known_kinds()) > 0.9 * len(kinds())  # the rest are made in loops
