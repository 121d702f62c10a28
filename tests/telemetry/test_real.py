"""Real recordings read by the dictionaries in examples/."""

from pathlib import Path

import numpy as np
import pytest

from asflown import load_telemetry
from conftest import flight_data

EXAMPLES = Path(__file__).parents[2] / "examples"

FILES = {
    "ctim/attitude.csv": ("ctim", 4, 692),
    "iss-tsis1/joined.csv": ("iss-tsis1", 13, 720),
    "iss-clarreo/attitude.csv": ("iss-clarreo", 7, 300),
    "suchai3/s3_20230824.csv": ("suchai3", 6, 3161),
    "suchai3/data_20231113_S3-gyros-13112023.xlsx": ("suchai3", 6, 997),
    "cubesat-bench/step_response.csv": ("cubesat-bench", 3, 1000),
}


@pytest.mark.parametrize("name", FILES)
def test_recovery_a_real_recording_reads_by_its_dictionary(name):
    dictionary, channels, samples = FILES[name]
    if name.endswith("xlsx"):
        pytest.importorskip("openpyxl")
    t = load_telemetry(flight_data(f"real/{name}"), channels=EXAMPLES / f"{dictionary}.toml")
    assert len(t.channels) == channels
    assert {len(c.values) for c in t.channels.values()} == {samples}
    assert all(c.valid.all() for c in t.channels.values())


def test_recovery_a_workbook_and_its_csv_agree():
    pytest.importorskip("openpyxl")
    a, b = (
        load_telemetry(flight_data(f"real/suchai3/{n}"), channels=EXAMPLES / "suchai3.toml")
        for n in ("s3_20231113.csv", "data_20231113_S3-gyros-13112023.xlsx")
    )
    for name, c in a.channels.items():
        assert (c.tai_ns == b.channels[name].tai_ns).all() and np.allclose(
            c.values, b.channels[name].values, rtol=1e-12
        )


def test_recovery_the_low_orbit_export_reads_as_it_is():
    t = load_telemetry(flight_data("leo/nadir-eclipse.csv.gz"), channels=EXAMPLES / "kestrel.toml")
    assert len(t.channels) == 30 and all(len(c.values) == 7201 for c in t.channels.values())
