"""What the program writes: never over an input or another's file, all of it or none, under the user's own rules."""

import json
import os
import stat

import pytest

from asflown.kit.errors import BadInput
from asflown.kit.files import check_output, together, write_text
from asflown.maneuvers.history import past_model
from asflown.maneuvers.write import maneuver_text
from asflown.sim.flight import fly, write_flight
from asflown.sim.maneuver_sets import RCS_SET, execute
from cli.program import complaint, csv_text, flight, run

MOMENTUM = ("--method", "momentum")


@pytest.fixture
def data(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text(csv_text(flight()))
    return path


def test_an_output_never_replaces_its_input(data, monkeypatch):
    before = data.read_bytes()
    monkeypatch.chdir(data.parent)
    os.symlink("t.csv", "link.csv")
    os.link("t.csv", "hard.csv")
    for name in ("t.csv", "./t.csv", "link.csv", "hard.csv"):
        for more in ((), ("--force",)):
            assert "replace an input" in complaint("torque", "t.csv", *MOMENTUM, "--out", name, *more)
    assert data.read_bytes() == before


@pytest.mark.parametrize("option", ["--out", "--plot"])
def test_a_foreign_file_is_replaced_by_force_only(option, data):
    place = data.with_name({"--out": "o.csv", "--plot": "o.svg"}[option])
    place.write_text("notes of mine\n")
    said = complaint("torque", data, *MOMENTUM, option, place)
    assert "did not write it" in said and "--force" in said and place.read_text() == "notes of mine\n"
    assert run("torque", data, *MOMENTUM, option, place, "--force").code == 0
    assert run("torque", data, *MOMENTUM, option, place).code == 0  # its own, from then on


@pytest.mark.parametrize("suffix", [".csv", ".json", ".parquet"])
def test_a_result_is_replaced_by_one_of_its_kind_only(suffix, data):
    place = data.with_name(f"o{suffix}")
    for _ in range(2):
        assert run("torque", data, *MOMENTUM, "--out", place).code == 0
    with pytest.raises(BadInput, match="did not write it"):
        check_output(place, "picture")
    check_output(place, "result TorqueResult")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".svg", ".png", ".pdf"])
def test_a_picture_is_known_again(suffix, data):
    place = data.with_name(f"o{suffix}")
    for _ in range(2):
        assert run("torque", data, *MOMENTUM, "--plot", place).code == 0


def test_out_and_plot_appear_both_or_none(data, monkeypatch):
    from asflown import plots

    def fail(*_):
        raise BadInput("cannot be written (No space left on device)", remedy="Make room.")

    monkeypatch.setattr(plots, "save_figure", fail)
    done = run("torque", data, *MOMENTUM, "--out", data.with_name("o.csv"), "--plot", data.with_name("o.svg"))
    assert done.code != 0 and os.listdir(data.parent) == ["t.csv"]


def test_what_is_written_together_appears_together(tmp_path):
    (tmp_path / "a").write_text("old")
    with pytest.raises(RuntimeError), together():
        write_text(tmp_path / "a", "new")
        write_text(tmp_path / "made" / "for" / "b", "new")
        raise RuntimeError
    assert (tmp_path / "a").read_text() == "old" and os.listdir(tmp_path) == ["a"]
    with together():
        write_text(tmp_path / "a", "new")
        write_text(tmp_path / "made" / "for" / "b", "new")
        assert (tmp_path / "a").read_text() == "old"
    assert (tmp_path / "a").read_text() == (tmp_path / "made" / "for" / "b").read_text() == "new"


def test_links_stay_and_permissions_are_the_users(tmp_path):
    (tmp_path / "far").mkdir()
    os.symlink(tmp_path / "far" / "a.txt", tmp_path / "a.txt")
    old = os.umask(0o027)
    try:
        write_text(tmp_path / "a.txt", "1")
    finally:
        os.umask(old)
    assert os.path.islink(tmp_path / "a.txt") and (tmp_path / "far" / "a.txt").read_text() == "1"
    assert stat.S_IMODE(os.stat(tmp_path / "a.txt").st_mode) == 0o640
    os.chmod(tmp_path / "far" / "a.txt", 0o600)
    write_text(tmp_path / "a.txt", "2")
    assert stat.S_IMODE(os.stat(tmp_path / "a.txt").st_mode) == 0o600
    os.symlink("itself", tmp_path / "itself")
    with pytest.raises(BadInput, match="leads to itself"):
        write_text(tmp_path / "itself", "3")


def test_a_flight_replaces_a_flight_whole_and_nothing_else(tmp_path, monkeypatch):
    first = fly("quiet", changes={"duration": "60 s", "settle": "0 s"})
    other = fly("quiet", changes={"duration": "60 s", "settle": "0 s"}, seed=5)
    files = write_flight(first, tmp_path / "f")
    before = {n: p.read_bytes() for n, p in files.items()}
    from asflown.sim.flight import write

    real = write.write_text

    def full(path, text):
        if path.name == "truth.json":
            raise BadInput("cannot be written (No space left on device)", remedy="Make room.")
        real(path, text)

    with monkeypatch.context() as patch:
        patch.setattr(write, "write_text", full)
        with pytest.raises(BadInput):
            write_flight(other, tmp_path / "f")
    assert {n: p.read_bytes() for n, p in files.items()} == before
    write_flight(other, tmp_path / "f")  # a flight of ours, untouched since
    assert files["telemetry"].read_bytes() != before["telemetry"]
    files["telemetry"].write_text("mine now\n")
    assert "did not write it" in complaint("simulate", "quiet", "--out", tmp_path / "f")
    assert files["telemetry"].read_text() == "mine now\n"


def test_a_report_replaces_no_model_and_no_store(tmp_path):
    rcs, model = tmp_path / "rcs.csv", tmp_path / "fit.json"
    rcs.write_text(maneuver_text(execute(past_model("rcs/2012-1").model, RCS_SET, 1)))
    model.write_text(run("gates", rcs, "--json").out)
    before = model.read_bytes()
    assert "fit.json" in complaint(
        "gates", rcs, "--report", tmp_path / "fit.html"
    )  # its twin would take the model's place
    assert "fit.json" in complaint("gates", "watch", rcs, "--against", model, "--plot-dir", model)
    assert model.read_bytes() == before and not (tmp_path / "fit.html").exists()
    store = tmp_path / "st.db"
    dated = tmp_path / "dated.csv"
    assert run("gates", "simulate", "--start", "2010-01-01", "--out", dated).code == 0
    assert run("gates", dated, "--store", store, "--craft", "cassini").code == 0
    before = store.read_bytes()
    assert "did not write it" in complaint("gates", "simulate", "--out", store)
    assert store.read_bytes() == before


FIT = {
    "command": "gates", "model": "zero-mean", "engine": "rcs", "count": 20, "excluded": [], "dv_mps": [0.01, 0.3],
    "magnitude": {"fixed_mps": 1e-3, "proportional": 1e-3, "bias_fixed_mps": None, "bias_proportional": 0.0},
    "pointing": {"fixed_mps": 1e-3, "proportional_rad": 1e-3, "bias_fixed_mps": [0.0, 0.0], "bias_proportional_rad": [None, 0.0]},
}  # fmt: skip


@pytest.mark.parametrize("value", [-1, "0.5", True, None, [1], 1e9, float("nan"), float("inf")])
def test_an_earlier_fit_has_a_schema(value, tmp_path):
    from asflown.maneuvers.earlier import earlier_model

    place = tmp_path / "fit.json"
    place.write_text(json.dumps(FIT))
    assert earlier_model(place, "").model.magnitude_fixed_mps == 1e-3
    place.write_text(json.dumps(FIT | {"magnitude": FIT["magnitude"] | {"fixed_mps": value}}))
    with pytest.raises(BadInput, match=r"fit\.json.*no record of a fit"):
        earlier_model(place, "")
    place.write_text(json.dumps(FIT | {"model": "banana"}))
    with pytest.raises(BadInput, match="model"):
        earlier_model(place, "")
