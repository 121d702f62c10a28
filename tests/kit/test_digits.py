"""Numbers as text: to the digits that the sigma allows."""

import math

import pytest

from asflown.kit.digits import interval, plus_minus, scaled_unit
from asflown.kit.table import Table


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [
        (2.0134, 0.0123, "2.013 ± 0.012"),
        (-0.29184, 0.0037, "-0.2918 ± 0.0037"),
        (1234.5, 56.7, "1234 ± 57"),
        (7.5e-9, 1e-10, "7.5e-09 ± 1e-10"),
        (3.14159, None, "3.142"),
        (3.14159, 0.0, "3.142"),
        (3.14159, math.nan, "3.142"),
        (math.nan, 0.1, "unknown"),
    ],
)
def test_value_and_sigma(value, sigma, text):
    assert plus_minus(value, sigma) == text


@pytest.mark.parametrize(
    ("value", "sigma", "unit", "text"),
    [
        (3.12e-5, 1.4e-6, "N m", "31.2 ± 1.4 µN m"),
        (0.0, 2e-4, "rad", "0 ± 200 µrad"),
        (8655.0, 12.0, "kg m2", "8655 ± 12 kg m2"),
        (0.75, 0.01, "N", "750 ± 10 mN"),
    ],
)
def test_a_unit_scaled_to_the_number(value, sigma, unit, text):
    assert plus_minus(value, sigma, unit) == text


@pytest.mark.parametrize("size", [3e-14, 2e-9, 5e-4, 0.2, 1.0, 8e3, 3e7])
def test_law_scaling_changes_no_value(size):
    factor, label = scaled_unit(size, "N m")
    assert label.endswith("N m") and 1e-3 * size <= factor * size
    prefix = label.removesuffix("N m")
    assert factor * {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}[prefix] == pytest.approx(
        1
    )


def test_intervals_say_an_open_end():
    assert interval(-1.234, 5.678) == "-1.23 to 5.68" and interval(None, 2.0) == "below 2"
    assert interval(1.0, None) == "above 1" and interval(None, None) == "unlimited"


def test_a_table_is_aligned_text_and_escaped_html():
    table = Table("Title <1>", (("x", "1.0 ± 0.1"), ("long name", "10 ± 1")), ("axis", "value"), ("a & b",))
    assert str(table).splitlines() == [
        "Title <1>",
        "  axis            value",
        "  x           1.0 ± 0.1",
        "  long name      10 ± 1",
        "  a & b",
    ]
    html = table.html()
    assert "Title &lt;1&gt;" in html and "a &amp; b" in html and html.count("<tr>") == 3
