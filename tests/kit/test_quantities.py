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


@pytest.mark.parametrize(
    ("written", "expected", "factor"),
    [
        ("DEG/S", "rad/s", math.pi / 180), ("degrees per second", "rad/s", math.pi / 180), ("rad·s⁻¹", "rad/s", 1), ("RAD/S", "rad/s", 1),
        ("rps", "rad/s", 2 * math.pi), ("krpm", "rad/s", 100 * math.pi / 3), ("revolutions/min", "rad/s", math.pi / 30),
        ('"', "rad", math.pi / 648_000), ("arc-sec", "rad", math.pi / 648_000), ("N-m", "N m", 1), ("mN·m", "N m", 1e-3),
        ("in-lb", "N m", 0.1129848), ("oz-in", "N m", 0.00706155), ("kg·m²/s", "N m s", 1), ("ft-lb-s", "N m s", 1.355818),
        ("Nm s", "N m s", 1), ("A·m²", "A m2", 1), ("Bar", "Pa", 1e5), ("milliamps", "A", 1e-3), ("KM/S", "m/s", 1e3), ("N/A", "", 1),
    ],
)  # fmt: skip
def test_published_units_as_people_spell_them(written, expected, factor):
    assert si_factor(written, expected) == pytest.approx(factor, rel=1e-6)


@pytest.mark.parametrize(
    ("written", "expected"), [("nm", "N m"), ("S", "s"), ("psig", "Pa"), ("rad/s/s", "rad/s"), ("r/s", "rad/s")]
)
def test_units_that_mean_something_else_are_refused(written, expected):
    with pytest.raises(BadInput):
        si_factor(written, expected)
