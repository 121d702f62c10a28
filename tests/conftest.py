"""Shared by all tests: where recordings of real spacecraft may lie, and how to run the program."""

import os
from pathlib import Path

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # read when numpy loads: workers' threads fight for the cores
    os.environ.setdefault(name, "1")

ROOT = Path(__file__).resolve().parents[1]


def flight_data(relative: str) -> Path:
    """A recording outside the project; the test is skipped where it is not there."""
    folder = Path(os.environ.get("ASFLOWN_FLIGHT_DATA", ROOT.parent / "shared" / "data"))
    path = folder / relative
    if not path.exists():
        pytest.skip(f"flight recording {relative} not found (set ASFLOWN_FLIGHT_DATA)")
    return path
