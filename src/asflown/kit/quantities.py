"""Units: text with a unit becomes a plain SI number.

Inside asflown every number is SI with radians; only this module knows other units.  Unit parsing
and factors are astropy's, with ``rpm`` and dimensionless ``[]`` added.
"""

from __future__ import annotations

import math
import re
from functools import cache

from .errors import BadInput

#: No measured size is beyond it, and squares and products of such numbers do not overflow.
_LARGEST = 1e60

_NUMBER = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")


@cache
def _units():
    import astropy.units as u

    rpm = u.def_unit("rpm", 2 * 3.141592653589793 / 60 * u.rad / u.s)
    rev = u.def_unit(["rev", "turn"], 2 * 3.141592653589793 * u.rad)
    percent = u.def_unit("%", 0.01 * u.dimensionless_unscaled)
    u.add_enabled_units([rpm, rev, percent])
    return u


@cache
def parse_unit(text: str):
    """The astropy unit that ``text`` names.  Raises BadInput for a unit it does not know."""
    u = _units()
    name = text.strip()
    if name in ("", "1", "-", "none", "count", "counts"):
        return u.dimensionless_unscaled
    try:
        return u.Unit(name)
    except (ValueError, TypeError):
        pass
    try:  # "kg m2", "rad/s2": an exponent written without its caret
        return u.Unit(re.sub(r"(?<=[a-zA-Z])(-?\d)", r"**\1", name))
    except (ValueError, TypeError) as why:
        raise BadInput(
            f"the unit [{name}] is not known",
            remedy="Write units as in [rad/s], [rpm], [mrad], [deg/s], [N m], [N m s], [kg m2], [s]; [] is dimensionless.",
        ) from why


def is_unit(text: str) -> bool:
    """Whether ``text`` names a unit."""
    try:
        parse_unit(text)
    except BadInput:
        return False
    return True


@cache
def si_factor(text: str, expected: str) -> float:
    """Factor from the unit ``text`` to SI, checked to be of the kind ``expected`` (an SI unit).

    The radian counts as a unit: rad/s is not accepted for Hz.
    """
    got, want = parse_unit(text), parse_unit(expected)
    try:
        factor = float(got.to(want))
    except Exception as why:
        raise BadInput(
            f"the unit [{text}] does not convert to [{expected}]",
            remedy=f"Give a unit that converts to [{expected}].",
        ) from why
    if not 0 < factor < math.inf:  # as of [1e400 rad]
        raise BadInput(f"the unit [{text}] has no size", remedy=f"Give a unit that converts to [{expected}].")
    return factor


def quantity(text: object, expected: str) -> float:
    """'0.16138 kg m2' -> 0.16138, as SI of the kind ``expected``."""
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        if expected == "":
            return float(text)
        raise BadInput(f"{text!r} has no unit", remedy=f'Write the unit in the value, as in "{text} {expected}".')
    match = _NUMBER.match(str(text))
    if not match:
        raise BadInput(f"{text!r} is not a number with a unit", remedy=f'Write it as in "1.5 {expected}".')
    number, unit = match.groups()
    if unit == "" and expected != "":
        raise BadInput(f"{text!r} has no unit", remedy=f'Write the unit in the value, as in "{number} {expected}".')
    return _sensible(float(number) * si_factor(unit, expected), text)


def numbers(text: object, expected: str, count: int) -> tuple[float, ...]:
    """'1.234 1.580 3.019 m' (commas allowed) -> SI numbers."""
    match = re.match(r"^\s*((?:[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?[\s,]*)+)(.*)$", str(text))
    parts = re.split(r"[\s,]+", match.group(1).strip(" ,")) if match else []
    if match is None or len(parts) != count:
        raise BadInput(
            f"{text!r} is not {count} numbers with one unit",
            remedy=f'Write it as in "{" ".join("0" * count)} {expected}".',
        )
    unit = match.group(2).strip()
    if unit == "" and expected != "":
        raise BadInput(f"{text!r} has no unit", remedy=f'End it with the unit, as in "{text} {expected}".')
    factor = si_factor(unit, expected)
    return tuple(_sensible(factor * float(p), text) for p in parts)


def _sensible(value: float, text: object) -> float:
    if not abs(value) < _LARGEST:
        raise BadInput(f"{text!r} is too large for a measurement", remedy="Check its exponent.")
    return value


def plain_numbers(text: str, count: int, what: str) -> tuple[float, ...]:
    """'1,2,3' from the command line, in SI."""
    try:
        values = tuple(float(p) for p in str(text).replace(" ", "").split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(abs(v) < _LARGEST for v in values):  # also NaN
        raise BadInput(f"{what} {text!r} is not {count} numbers", remedy=f"Give {count} numbers separated by commas.")
    return values
