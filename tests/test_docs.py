"""The pages against the code: names, keys and numbers that a reader may rely on."""

import re
import shlex
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from asflown.craft.model import Drag
from asflown.sim import scenario
from asflown.sim.mission import mission
from asflown.telemetry import dictionary
from asflown.telemetry.channels import KINDS
from cli.program import run

DOCS = Path(__file__).resolve().parents[1] / "docs"
MEMBERS = {"axis": r"_x\|y\|z", "component": r"_w\|x\|y\|z", "wheel": "_<WHEEL>", "thruster": "_<THRUSTER>",
           "mechanism": "[_<MECHANISM>]", "none": ""}  # fmt: skip


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def section(text: str, heading: str) -> str:
    return text.split(f"\n## {heading}\n")[1].split("\n## ")[0]


def keys_in(text: str) -> set[str]:
    """Words in code marks in the key column (the second) of the tables."""
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("|")]
    return {k for cells in rows if len(cells) > 2 for k in re.findall(r"`([a-z_][a-z0-9_]*)`", cells[1])}


def code_blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def test_telemetry_page_lists_every_channel_kind():
    """On a failure: this is the table to paste."""
    rows = []
    for k in KINDS:
        unit = "word" if k.behaves == "state" else (k.unit or "[]")
        limit = "" if k.plausible is None else f"{k.plausible:g}"
        rows.append(f"| `{k.stem}{MEMBERS[k.member]}` | {unit} | {k.meaning} | {limit} | {k.mistaken_for} |")
    written = [x for x in section(page("telemetry.md"), "The names").splitlines() if x.startswith("| `")]
    assert written == rows


def test_telemetry_page_lists_every_key_of_a_channel_dictionary():
    models = (dictionary.TimeColumn, dictionary.ChannelEntry, dictionary.QuaternionEntry, dictionary.OrbitEntry,
              dictionary.LongEntry)  # fmt: skip
    assert keys_in(section(page("telemetry.md"), "A channel dictionary")) == {k for m in models for k in m.model_fields}


def test_telemetry_pages_examples_are_read(tmp_path):
    from asflown.telemetry.load import load_telemetry

    text = page("telemetry.md")
    (tmp_path / "own.csv").write_text(code_blocks(section(text, "A table that describes itself"), "")[0])
    t = load_telemetry(tmp_path / "own.csv")
    assert set(t.channels) == {"wheel_rate_RWA1", "body_rate_y", "attitude_error_y", "motor_on"}
    assert len(t.channel("attitude_error_y").values) == 3 and len(t.channel("body_rate_y").values) == 2

    (tmp_path / "dict.toml").write_text(code_blocks(text, "toml")[0])
    (tmp_path / "counts.csv").write_text(
        "SCET,WHL1,GYR_Y,Q1,Q2,Q3,Q4\n"
        + "".join(f"2015-272T00:00:{4 * i:02d},{15000 + i},{i + 2},0,0,0,1\n" for i in range(5))
    )
    t = load_telemetry(tmp_path / "counts.csv", channels=tmp_path / "dict.toml")
    assert t.channel("wheel_rate_RWA1").values[0] == pytest.approx(600 * 3.14159265 / 30)
    assert t.channel("body_rate_y").values[0] == 0 and t.channel("quaternion_w").values[0] == 1

    exclusions = code_blocks(section(text, "Exclusions"), "")[0]
    assert exclusions.splitlines()[0] == "start,stop,channel,reason"


def test_simulator_page_lists_every_scenario_key():
    models = (scenario.Scenario, scenario.Triangles, scenario.Constant, scenario.Table, scenario.Plume, scenario.Passage, scenario.Slew,
              scenario.Coast, scenario.DragSpike, scenario.CoverMotion, scenario.Controller, scenario.Sampling, scenario.Gap,
              scenario.ThrusterUse, scenario.CatalystBeds, scenario.ThrusterFault, scenario.WheelBias, scenario.Burn,
              scenario.ThrusterControl, scenario.BranchSwap, scenario.OrbitFlown, scenario.Environment, scenario.Pointing,
              scenario.Unloading, scenario.Sensors, scenario.NullSpace, scenario.DragGrowth, Drag)  # fmt: skip
    tables = {
        "slews",
        "coasts",
        "drag_spikes",
        "cover",
        "controller",
        "telemetry",
        "gaps",
        "flyby",
        "thrusters",
        "catalyst_beds",
        "thruster_faults",
        "thruster_control",
        "branch_swaps",
        "wheel_biases",
        "burns",
        "orbit",
        "environment",
        "pointings",
        "unloading",
        "sensors",
        "null_space",
        "drag_growth",
        "wheel_drag",
    }  # named in the first column
    fields = {k for m in models for k in m.model_fields} - tables
    text = section(page("simulator.md"), "Scenario keys")
    assert keys_in(text) == fields
    assert all(re.search(rf"\[[a-z.\[]*{t}[\].]", text) for t in tables | {"torques"})


def test_simulator_page_lists_every_mission_key():
    models = (mission.Mission, mission.Ageing, mission.Scatter, mission.Cold, mission.Fault, mission.Motion, mission.CraftMass,
              mission.Actuation)  # fmt: skip
    tables = {"ageing", "scatter", "cold", "faults", "motions", "craft_mass", "events"}  # named in the first column
    text = section(page("simulator.md"), "Missions")
    assert keys_in(text) == {k for m in models for k in m.model_fields} - tables
    assert all(re.search(rf"\[{t}[\].]", text) for t in tables)


def test_simulator_page_lists_the_shipped_scenarios_and_its_example_flies(tmp_path):
    text = page("simulator.md")
    listed = re.findall(r"^\| `([a-z0-9-]+)`", section(text, "Shipped scenarios"), re.M)
    assert sorted(listed) == scenario.shipped_scenarios()
    example = code_blocks(text, "toml")[0]
    assert tomllib.loads(example)
    (tmp_path / "mine.toml").write_text(example)
    assert scenario.load_scenario(tmp_path / "mine.toml").telemetry.dropout == 0.05


def test_simulator_page_gives_the_noise_table():
    from asflown.sim.flight.sensors import NOISE

    rows = [[c.strip() for c in x.split("|")[2:-1]] for x in section(page("simulator.md"), "Noise").splitlines()
            if x.startswith("| ")][1:]  # fmt: skip
    for column, name in enumerate(("half", "nominal", "double")):
        n = NOISE[name]
        values = (1e6 * n.attitude_white_rad, 1e6 * n.attitude_coloured_rad, 1e6 * n.gyro_rad_s, n.wheel_rad_s)
        assert [float(r[column]) for r in rows] == pytest.approx(values)


def test_store_page_lists_every_table_and_column():
    from asflown.trends.store.schema import METADATA

    rows = [x.split(" | ") for x in section(page("store.md"), "What is kept").splitlines() if x.startswith("| `")]
    listed = {name.strip("| `"): set(re.findall(r"`(\w+)`", columns)) for name, _, columns in rows}
    assert set(listed) == set(METADATA.tables)
    for name, table in METADATA.tables.items():
        assert {c.name for c in table.columns} - {"id", "entry_id", "place"} <= listed[name]


def test_every_picture_and_page_linked_is_there_and_small():
    for file in DOCS.rglob("*.md"):
        for target in re.findall(r"\]\(([^)#:]+)\)", file.read_text(encoding="utf-8")):
            path = file.parent / target
            assert path.is_file(), f"{file.name} links to {target}"
            if path.suffix in (".png", ".svg"):
                assert path.stat().st_size < 150_000, target


@pytest.mark.parametrize("name", ["doubts.md", "architecture.md", "cli.md"])
def test_pages_made_from_the_program_are_current(name):
    """On a failure: python docs/pages.py, and read the difference."""
    sys.path.insert(0, str(DOCS))
    try:
        import pages
    finally:
        sys.path.remove(str(DOCS))
    assert page(name) == pages.PAGES[name]()


def test_the_walk_of_the_architecture_page_exists():
    for module, name in re.findall(r"^\d+\. `([\w.]+)\.(\w+)`", page("architecture.md"), re.M):
        assert hasattr(import_module(f"asflown.{module}"), name), f"{module}.{name}"


def commands(group, words=()):
    """Every command of the program: (words, command)."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*words, name))
        else:
            yield (*words, name), command


def test_every_option_is_documented():
    """Each in its verb's section of docs/cli.md, or among the options that several verbs share."""
    from typer.main import get_command

    from asflown.cli.main import app

    text = page("cli.md")
    shared = text.split("\n## ")[0]
    missing = [
        (" ".join(words), option)
        for words, command in commands(get_command(app))
        for parameter in command.params
        for option in parameter.opts
        if option.startswith("--") and option not in ("--help", "--version")
        and not re.search(rf"{option}\b", section(text, f"asflown {words[0]}") + shared)
    ]  # fmt: skip
    assert not missing


@pytest.mark.parametrize(
    "file", [Path("README.md"), *(p.relative_to(DOCS.parent) for p in sorted(DOCS.rglob("*.md")))], ids=str
)
def test_python_blocks_run(file, tmp_path, monkeypatch):
    """In one namespace a page, in a folder with flight.csv, a simulated deployment, and trends.db."""
    blocks = code_blocks((DOCS.parent / file).read_text(encoding="utf-8"), "python")
    if not blocks:
        pytest.skip("no Python on this page")
    from asflown.telemetry.write import write_table
    from asflown.trends.entries import history_entries
    from asflown.trends.store import TrendStore
    from flights import CASSINI, flown

    write_table(flown("cover-deploy").telemetry, tmp_path / "flight.csv")
    with TrendStore.open(tmp_path / "trends.db") as store:
        store.add(history_entries(CASSINI))
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for block in blocks:
        exec(compile(block, str(file), "exec"), names)


# ---- the how-to pages, run as they stand ----

_FENCE = re.compile(r"```(\w+)(?: (\S+))?\n(.*?)```", re.S)
_DIGITS = re.compile(r"[-+]?\d[\d.,e]*")


def _masked(line: str) -> str:
    """A line of output without its digits and spaces."""
    return " ".join(_DIGITS.sub("#", line).split())


def test_the_own_spacecraft_page_runs_as_it_stands(tmp_path, monkeypatch):
    """Its files are written, its commands run, and the outputs it shows are found, but for digits and lines left out."""
    monkeypatch.chdir(tmp_path)
    told = ""
    for language, name, text in _FENCE.findall(page("howto/own-spacecraft.md")):
        if name:
            (tmp_path / name).write_text(text)
        elif language == "sh":
            told = ""
            for line in text.splitlines():
                done = run(*shlex.split(line)[1:], craft=None)
                assert done.code == 0, f"{line}\n{done.out}{done.err}"
                grave = [x for x in done.out.splitlines() if "DOUBT!" in x and "drag from motor current" not in x]
                assert not grave, f"{line}\n{grave}"
                told += done.out
        else:
            lines = {_masked(line) for line in told.splitlines()}
            missing = [line for line in text.splitlines() if _masked(line) not in lines]
            assert not missing, f"{missing} not in\n{told}"
    assert {"mysat.db", "hold", "slews", "run-downs"} <= {p.name for p in tmp_path.iterdir()}


def test_the_page_on_frames_runs_as_it_stands(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for _, _, text in _FENCE.findall(page("howto/frames.md")):
        exec(text, names)
    assert names["again"].epoch_ns == names["telemetry"].epoch_ns
    assert {n: len(c.values) for n, c in names["again"].channels.items()} == {"wheel_rate_1": 120, "body_rate_x": 120}
    assert len(names["burns"]) == 2
