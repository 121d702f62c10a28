"""Units at the border."""

import math

import pytest

from asflown.kit.errors import BadInput
from asflown.kit.quantities import numbers, plain_numbers, quantity, si_factor


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.16138 kg m2", "kg m2", 0.16138),
        ("5 ms", "s", 0.005),
        ("1800 rpm", "rad/s", 60 * math.pi),
        ("32.75 deg", "rad", math.radians(32.75)),
        ("2.0202 mm/s", "m/s", 2.0202e-3),
        ("-1.5e-2 N m", "N m", -0.015),
    ],
)
def test_values_with_units_become_si(text, unit, value):
    assert quantity(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit"), [("5", "s"), ("5 kg", "s"), ("five s", "s"), ("5 blorg", "s"), (5, "s"), ("1 Hz", "rad/s")]
)
def test_a_wrong_or_missing_unit_is_refused(text, unit):
    with pytest.raises(BadInput):
        quantity(text, unit)


def test_vectors_share_one_unit():
    assert numbers("1.234 1.580, 3.019 m", "m", 3) == (1.234, 1.580, 3.019)
    with pytest.raises(BadInput):
        numbers("1 2 m", "m", 3)


def test_command_line_numbers_must_be_finite_and_complete():
    assert plain_numbers("1, 2,3", 3, "--cm") == (1.0, 2.0, 3.0)
    for bad in ("1,2", "1,2,nan", "a,b,c", "1,2,inf"):
        with pytest.raises(BadInput):
            plain_numbers(bad, 3, "--cm")


def test_the_radian_is_not_dropped():
    assert si_factor("mrad", "rad") == 1e-3
    with pytest.raises(BadInput):
        si_factor("m", "rad")


@pytest.mark.parametrize("unit", ["1e400 rad/s", "1e400rad/s"])
def test_a_unit_without_size_is_refused(unit):
    with pytest.raises(BadInput, match="has no size"):
        si_factor(unit, "rad/s")


def test_law_factors_kept_at_hand_are_astropys():
    from asflown.kit.quantities import _COMMON, parse_unit

    for (text, expected), factor in _COMMON.items():
        assert factor == pytest.approx(parse_unit(text).to(parse_unit(expected)), rel=4e-16), text
