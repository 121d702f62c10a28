"""docs/reliability.md: every doubt and every test that it names exists."""

import re

import pytest

from asflown.cli.verb import known_kinds
from conftest import ROOT

PAGE = (ROOT / "docs" / "reliability.md").read_text().partition("Limits are settable")[0]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("|") and not re.match(r"\|(-|\s*fault)", line)
]
TESTS = sorted({name for row in ROWS for name in re.findall(r"`(tests/[^`]+)`", row[2])})


def test_every_row_says_what_is_seen_and_names_a_test():
    assert ROWS
    for row in ROWS:
        assert len(row) == 3 and row[1] and "`tests/" in row[2], row


def test_every_doubt_named_there_exists():
    named = {n for row in ROWS for n in re.findall(r"`([a-z-]+\.[a-z0-9-]+)`", row[1])}
    assert named <= set(known_kinds(imported=True))


@pytest.mark.parametrize("name", TESTS)
def test_every_test_named_there_exists(name):
    file, _, function = name.partition("::")
    assert f"def {function}(" in (ROOT / file).read_text()
