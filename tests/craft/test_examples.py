"""The craft for learning, and the files in examples/ that describe a satellite in low orbit."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.telemetry.load import load_telemetry
from cli.program import run
from conftest import ROOT, flight_data


def test_law_the_wheels_of_the_pyramid_lie_at_its_cant():
    now = load_craft("pyramid").at(None)
    axes = np.array([w.axis for w in now.wheels])
    assert np.linalg.matrix_rank(axes) == 3 and len(axes) == 4
    assert np.degrees(np.arcsin(axes[:, 2])) == pytest.approx(35.2644, abs=1e-3)
    assert np.allclose(axes[:, :2].sum(axis=0), 0)


def test_the_example_craft_and_dictionary_describe_the_recordings(tmp_path):
    source = flight_data("leo/nadir-eclipse.csv.gz")
    table = tmp_path / "nadir.csv"
    with gzip.open(source, "rt") as lines:
        table.write_text("".join(line.replace(";", ",") for _, line in zip(range(600), lines, strict=False)))
    craft = ROOT / "examples" / "kestrel-craft.toml"
    channels = ROOT / "examples" / "kestrel.toml"
    t = load_telemetry(table, channels=channels, craft=load_craft(craft))
    assert t.channel("wheel_rate_RW1").values[0] == pytest.approx(1500 * np.pi / 30)
    assert t.channel("orbit_position_x").values[0] == pytest.approx(6.871e6)
    assert t.channel("magnetic_field_x").values[0] == pytest.approx(23882e-9)
    done = run("telemetry", "check", table, "--channels", channels, "--craft", craft)
    assert done.code == 0, done.out
    done = run("torque", table, "--channels", channels, "--craft", craft, "--method", "momentum")
    assert done.code == 0 and "predicted" in done.out and Path(craft).is_file()
