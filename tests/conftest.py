"""Shared by all tests: where recordings of real spacecraft may lie, and how to run the program."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def flight_data(relative: str) -> Path:
    """A recording outside the project; the test is skipped where it is not there."""
    folder = Path(os.environ.get("ASFLOWN_FLIGHT_DATA", ROOT.parent / "shared" / "data"))
    path = folder / relative
    if not path.exists():
        pytest.skip(f"flight recording {relative} not found (set ASFLOWN_FLIGHT_DATA)")
    return path
