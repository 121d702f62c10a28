"""Doubts: kinds, what they hold, and what code may ask of them.  All tests here are laws of the type."""

import pickle

import pytest

from asflown.kit.doubts import UNTOLD, Doubt, Doubts, Kind, Severity, doubt_from, grouped

LOW = Kind("test.low", Severity.NOTE, "{axis} was chosen")
HIGH = Kind("test.high", Severity.SUSPECT, "{channel} is off by {ratio:.2f} on {date}", "Check {channel}.")


def test_a_doubt_is_a_sentence_with_numbers_and_names_apart():
    d = HIGH(channel="body_rate_x", ratio=1.234, date="2015-09-29")
    assert str(d) == "body_rate_x is off by 1.23 on 2015-09-29" and d.remedy == "Check body_rate_x."
    assert d.numbers == {"ratio": 1.234} and d.about == {"channel": "body_rate_x", "date": "2015-09-29"}
    assert d.is_grave and not LOW(axis="x").is_grave
    assert str(LOW(axis=["x", "z"])) == "x, z was chosen"


def test_a_value_that_the_sentence_needs_must_be_told():
    with pytest.raises(TypeError, match="channel, ratio"):
        HIGH(date="2015-09-29")


def test_two_kinds_cannot_share_an_id():
    with pytest.raises(ValueError, match=r"test\.low"):
        Kind("test.low", Severity.VOID, "something else")
    assert Kind("test.low", Severity.NOTE, "{axis} was chosen") == LOW  # the same again, as on a reload


def test_doubts_keep_order_drop_repeats_and_answer_by_kind():
    a, b = LOW(axis="x"), HIGH(channel="c", ratio=2.0, date="d")
    found = Doubts([a, None, b, a])
    assert list(found) == [a, b] and found.has(HIGH) and list(found.of(LOW)) == [a] and list(found.without(LOW)) == [b]
    assert list(found.about(channel="c")) == [b] and found.worst is Severity.SUSPECT and Doubts().worst is None
    assert list(found.gravest_first) == [b, a]
    again = Doubts([a])
    assert isinstance(found + again, Doubts) and len(found + again) == 2 == len(again + found)
    assert "was chosen" not in found  # words find nothing: ask by kind


def test_a_sentence_without_a_kind_is_untold():
    (d,) = Doubts(["an old store said so"])
    assert d.kind is UNTOLD and str(d) == "an old store said so" and d.severity is Severity.CAUTION


def test_what_passes_a_doubt_on_is_noted_once():
    d = LOW(axis="x").passed_on_by("torque").passed_on_by("density")
    assert d.origin == "torque" and d == LOW(axis="x")


@pytest.mark.parametrize("way", ["pickle", "record"])
def test_a_doubt_comes_back(way):
    d = HIGH(channel="c", ratio=2.0, date="d").passed_on_by("torque")
    again = pickle.loads(pickle.dumps(Doubts([d])))[0] if way == "pickle" else doubt_from(d.record())
    assert again == d and again.origin == "torque" and Doubts([again]).has(HIGH)


def test_a_kind_of_another_version_keeps_sentence_and_severity():
    record = LOW(axis="x").record() | {"kind": "test.gone", "severity": "void"}
    d = doubt_from(record)
    assert str(d) == "x was chosen" and d.severity is Severity.VOID and d.kind.id == "test.gone"


def test_doubts_that_differ_in_numbers_and_dates_group():
    many = [HIGH(channel=c, ratio=float(r), date=f"day {r}") for c, r in (("a", 1), ("a", 2), ("b", 3))]
    assert [(d.about["channel"], n) for d, n in grouped(many)] == [("a", 2), ("b", 1)]
    assert isinstance(many[0], Doubt)


def test_a_doubt_of_one_of_several_records_names_it_and_keeps_its_kind():
    d = LOW(axis="x").of_record("a.csv")
    assert str(d) == "a.csv: x was chosen" and d != LOW(axis="x")
    assert doubt_from(d.record()) == d and Doubts([d, LOW(axis="x").of_record("b.csv")]).about(record="a.csv") == (d,)
