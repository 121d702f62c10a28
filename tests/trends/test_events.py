"""Event lists and actuations found in telemetry: good ones read, bad ones refused with one clear error."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from asflown.kit.errors import BadInput
from asflown.trends.entries.events import find_events, is_event_list, load_events, stall
from flights import flown, written

TOML = """
[[event]]
id = "a"
kind = "deploy"
file = "a.csv"
motor_on_s = 60
motor_off_s = 420.0
date = "2015-09-29"

[[event]]
id = "b"
kind = "stow"
date = "2015-273T00:00:00"
note = "only its date"
"""
CSV = """# a list
id,kind,file,motor_on_s,motor_off_s,date,note
a,deploy,a.csv,60,420,2015-09-29,
b,stow,,,,2015-09-30,only its date
"""


def listed(tmp_path, text, name="events.toml"):
    (tmp_path / "a.csv").write_text("time [s]\n")
    return written(tmp_path, text, name)


def test_law_toml_and_csv_say_the_same(tmp_path):
    by_toml, by_csv = load_events(listed(tmp_path, TOML)), load_events(listed(tmp_path, CSV, "events.csv"))
    assert by_toml[0] == by_csv[0]
    assert by_toml[0].file == tmp_path / "a.csv"
    assert [e.date for e in by_toml] == [e.date for e in by_csv] == ["2015-09-29T00:00:00", "2015-09-30T00:00:00"]
    assert by_toml[1].file is None and by_csv[1].note == "only its date"
    assert is_event_list(tmp_path / "events.toml") and is_event_list(tmp_path / "events.csv")
    assert not is_event_list(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (('id = "b"', 'id = "a"'), "two events have the id 'a'"),
        (('kind = "stow"', 'kind = "slew"'), "kind"),
        (('note = "only its date"', "color = 1"), "unknown key"),
        (('file = "a.csv"', 'file = "missing.csv"'), "missing.csv does not exist"),
        (("motor_on_s = 60\n", ""), "needs motor_on_s and motor_off_s"),
        (("motor_on_s = 60", "motor_on_s = 500"), "is before motor_on_s"),
        (("motor_on_s = 60", "motor_on_s = nan"), "motor_on_s"),
        (('date = "2015-273T00:00:00"', ""), "an event without a file needs a date"),
        (('"2015-273T00:00:00"', '"yesterday"'), "not a time"),
        (("[[event]]", "[[event"), "not a TOML file"),
    ],
)
def test_bad_lists_are_refused(tmp_path, change, says):
    path = listed(tmp_path, TOML.replace(*change))
    with pytest.raises(BadInput, match=says) as why:
        load_events(path)
    assert why.value.file == str(path)


def test_bad_csv_rows_name_their_line(tmp_path):
    with pytest.raises(BadInput, match="not a number") as why:
        load_events(listed(tmp_path, CSV.replace("a.csv,60,", "a.csv,soon,"), "events.csv"))
    assert why.value.line == 3  # comments count
    with pytest.raises(BadInput, match="number of cells"):
        load_events(listed(tmp_path, CSV + "c,stow\n", "events.csv"))


@pytest.mark.parametrize("name", ["cover-deploy", "cover-stow"])
def test_recovery_actuations_are_found_from_current_and_angle(name):
    (found,) = find_events(flown(name, noise="none").telemetry)
    assert found.kind == name.removeprefix("cover-")
    reach = found.motor_on_sigma_s * 12**0.5 / 2  # half the sampling interval: the truth lies between two samples
    assert abs(found.motor_on_s - 60) <= reach and reach == pytest.approx(32)
    assert abs(found.motor_off_s - 420) <= 32


def test_recovery_stall_lies_between_two_samples():
    tlm = flown("cover-deploy", noise="none").telemetry
    (found,) = find_events(tlm)
    when, sigma = stall(tlm, found)
    assert abs(found.motor_on_s + when - 234) <= sigma
    assert sigma == pytest.approx(32)  # s, half of 64


def test_a_motor_that_never_runs_is_said():
    quiet = flown("cover-deploy", noise="none").telemetry.between(0, 55)
    with pytest.raises(BadInput, match="no complete actuation"):
        find_events(quiet)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    text=st.sampled_from([TOML, CSV]), at=st.floats(0, 1), cut=st.integers(0, 12),
    put=st.text(st.characters(codec="utf-8"), max_size=8),
)  # fmt: skip
def test_property_a_mutated_list_is_read_or_refused(tmp_path, text, at, cut, put):
    """Whatever is done to a list, there are events or one BadInput; nothing else escapes."""
    k = int(at * len(text))
    path = listed(tmp_path, text[:k] + put + text[k + cut :], "events.csv" if text is CSV else "events.toml")
    try:
        assert all(e.id and e.kind in ("deploy", "stow") for e in load_events(path))
    except BadInput as why:
        assert why.what and why.remedy
