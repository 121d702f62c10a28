"""--craft has no default: it is named, or a project file names it; what a project file says and what it must not."""

import hashlib
from pathlib import Path

import pytest

from cli.program import complaint, csv_text, flight, run


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with a flight, inside the project's."""
    work = tmp_path / "project" / "2015" / "deploy"
    work.mkdir(parents=True)
    (work / "t.csv").write_text(csv_text(flight()))
    monkeypatch.chdir(work)
    return work


def project(folder: Path, text: str) -> Path:
    path = folder.parents[1] / "asflown.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "words",
    [
        ["torque", "t.csv"],
        ["wheels", "t.csv"],
        ["external-torque", "t.csv"],
        ["leak", "t.csv"],
        ["thrust", "t.csv"],
        ["inertia", "t.csv"],
        ["inertia", "plan"],
        ["inertia", "history"],
        ["jets", "t.csv", "--flyby", "E3", "--closest-approach", "200"],
        ["density", "t.csv", "--flyby", "E3", "--closest-approach", "200"],
        ["budget", "profile-1"],
        ["tune"],
        ["trend", "add", "t.csv", "--store", "new.db"],
        ["gates", "m.csv", "--store", "new.db"],
    ],
    ids=" ".join,
)
def test_law_no_craft_is_taken_for_granted(words, folder):
    said = complaint(*words, craft=None)
    assert "no craft is named" in said
    assert "--craft" in said and "asflown.toml" in said and "craft new" in said
    assert complaint(*words, "--json", craft=None) == said
    assert not Path("new.db").exists()


def test_verbs_that_need_no_craft_ask_for_none(folder):
    assert run("telemetry", "check", "t.csv", craft=None).code == 0
    assert run("inertia", "history", "--store", "i.db").code == 0
    for words in (
        ["trend", "list", "--store", "i.db"],
        ["trend", "show", "--store", "i.db", "--kind", "inertia"],
        ["report", "i.db", "--out", "r.html"],
        ["craft", "list"],
        ["gates", "history"],
        ["gates", "simulate", "--by", "rcs/2012-1", "--out", "m.csv"],
        ["gates", "m.csv"],
    ):
        done = run(*words, craft=None)
        assert done.code == 0 and done.err.count("error") == 0, words


def test_a_project_file_names_the_craft_and_stands_in_the_provenance(folder):
    path = project(folder, 'craft = "cassini@001-rounded"\n')
    done = run("torque", "t.csv", "--method", "momentum", "--json", craft=None)
    told = done.record["provenance"]
    assert told["options"]["craft"] == "cassini@001-rounded"
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert {"file": str(path), "sha256": digest} in told["inputs"]


def test_the_command_line_wins_over_the_project_file(folder):
    project(folder, 'craft = "iss"\n')
    told = run("telemetry", "check", "t.csv", "--craft", "cassini", "--json").record["provenance"]
    assert told["options"]["craft"] == "cassini"
    assert [Path(i["file"]).name for i in told["inputs"]] == ["t.csv"]


def test_paths_count_from_the_project_files_folder(folder):
    own = folder.parents[1] / "crafts" / "own.toml"
    own.parent.mkdir()
    own.write_text((Path(__file__).parents[2] / "src/asflown/craft/profiles/cassini.toml").read_text())
    project(folder, 'craft = "crafts/own.toml"\nstore = "kept.db"\n[defaults.torque]\nout = "torque.csv"\n')
    assert run("torque", "t.csv", "--method", "momentum", craft=None).code == 0
    assert (folder.parents[1] / "torque.csv").is_file()
    assert run("inertia", "history", "--store", folder.parents[1] / "kept.db").code == 0
    assert run("trend", "list", craft=None).out.strip()


def test_defaults_for_all_verbs_and_for_one(folder):
    project(
        folder,
        'craft = "cassini"\n[defaults]\nstart = 100\naxis = "y"\n[defaults.torque]\nmethod = "momentum"\nstart = 60\n',
    )
    record = run("torque", "t.csv", "--json", craft=None).record
    assert "momentum" in record["provenance"]["options"]["method"]
    assert record["provenance"]["options"]["start"] == "60" and record["provenance"]["options"]["axis"] == "y"
    record = run("external-torque", "t.csv", "--json", craft=None).record
    assert record["provenance"]["options"]["start"] == "100"


def test_a_store_in_the_project_file_keeps_nothing_by_itself(folder):
    project(folder, 'craft = "cassini"\nstore = "kept.db"\n')
    assert run("inertia", "history", craft=None).code == 0
    assert not list(folder.parents[1].glob("kept.db*"))


def test_the_scenarios_craft_and_a_stores_crafts_are_not_the_projects(folder):
    project(folder, 'craft = "iss"\nstore = "kept.db"\n')
    assert run("inertia", "history", "--craft", "cassini", "--store", folder.parents[1] / "kept.db").code == 0
    assert run("trend", "show", "--kind", "inertia", craft=None).code == 0
    done = run("simulate", "quiet", "--out", "q", "--set", "duration=60 s", "--json", craft=None)
    assert done.code == 0 and done.record["provenance"]["options"]["craft"] is None


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("craft = 3", "craft"),
        ("ship = 'cassini'", "ship"),
        ("[defaults]\nstrat = 3", "'strat'"),
        ("[defaults.torqe]\nstart = 3", "torqe"),
        ("[defaults.torque]\nrun-down = 'A'", "'run-down'"),
        ("craft = ", "not a TOML file"),
        ("craft = 'cassinni'", "cassinni"),
        ("channels = 'none.toml'\ncraft = 'cassini'", "none.toml"),
    ],
)
def test_a_wrong_project_file_is_one_complaint(text, word, folder):
    project(folder, text)
    assert word in complaint("torque", "t.csv", craft=None)
