"""Units: text with a unit becomes a plain SI number.

Inside asflown every number is SI with radians; only this module knows other units.  Unit parsing
and factors are astropy's, with ``rpm``, gauss, common spellings and dimensionless ``[]`` added.
"""

from __future__ import annotations

import difflib
import math
import re
from functools import cache

from .errors import BadInput, some_of

#: No measured size is beyond it, and squares and products of such numbers do not overflow.
_LARGEST = 1e60

_NUMBER = re.compile(r"[-+]?(?:\d{1,400}\.?\d{0,400}|\.\d{1,400})(?:[eE][-+]?\d{1,5})?", re.ASCII)
_LONGEST = 2_000_000  # characters of a quantity

#: Units as people write them -> as astropy does.
_WRITTEN = {
    "RPM": "rpm", "Rpm": "rpm", "rev/min": "rpm", "r/min": "rpm", "dps": "deg/s", "°": "deg", "°/s": "deg/s", "Nm": "N m",
    "mNm": "mN m", "uNm": "uN m", "µNm": "uN m", "μNm": "uN m", "nNm": "nN m", "Nms": "N m s", "mNms": "mN m s", "uNms": "uN m s",
    "Nm/A": "N m / A", "mNm/A": "mN m / A", "Am2": "A m2", "Am^2": "A m2", "mAm2": "mA m2", "gauss": "G", "Gauss": "G", "in": "inch",
    "lbs": "lb", "psia": "psi", "kgm2": "kg m2", "kgm^2": "kg m2", "kg*m^2": "kg m2", "ft/sec": "ft/s",
}  # fmt: skip
_WORDS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "usec": "us", "degree": "deg", "degrees": "deg",
    "radian": "rad", "radians": "rad", "rads": "rad", "minute": "min", "minutes": "min", "hour": "h", "hours": "h", "hr": "h",
    "volt": "V", "volts": "V", "amp": "A", "amps": "A", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
}  # fmt: skip
_KNOWN = (
    "rad/s", "deg/s", "rpm", "mrad", "urad", "rad", "deg", "arcsec", "N m", "mN m", "uN m", "N m s", "mN m s", "kg m2", "N", "mN", "s", "ms",
    "km", "m", "km/s", "m/s", "mm/s", "T", "nT", "uT", "A", "mA", "A m2", "Pa", "kPa", "psi", "bar", "deg_C", "K", "Hz", "kg", "V", "%", "count",
)  # fmt: skip


@cache
def _units():
    import astropy.units as u
    from astropy.units import imperial

    rpm = u.def_unit("rpm", 2 * 3.141592653589793 / 60 * u.rad / u.s)
    rev = u.def_unit(["rev", "turn"], 2 * 3.141592653589793 * u.rad)
    percent = u.def_unit("%", 0.01 * u.dimensionless_unscaled)
    gauss = [u.def_unit("G", 1e-4 * u.T), u.def_unit("mG", 1e-7 * u.T)]
    u.add_enabled_units(
        [rpm, rev, percent, *gauss, imperial.ft, imperial.inch, imperial.lb, imperial.lbf, imperial.psi]
    )
    return u


@cache
def parse_unit(text: str):
    """The astropy unit that ``text`` names, also as people write it (RPM, deg/sec, Nms).  Raises BadInput for a unit it does not know."""
    u = _units()
    name = text.strip()
    if name in ("", "1", "-", "none", "count", "counts"):
        return u.dimensionless_unscaled
    plain = _WRITTEN.get(name) or re.sub(r"[A-Za-z]{1,20}", lambda word: _WORDS.get(word[0], word[0]), name[:200])
    for tried in (plain, re.sub(r"(?<=[a-zA-Z])(-?\d)", r"**\1", plain)):  # "kg m2": an exponent without its caret
        try:
            return u.Unit(tried)
        except (ValueError, TypeError, ZeroDivisionError, OverflowError, RecursionError):
            continue
    near = difflib.get_close_matches(name, _KNOWN, 3, 0.6)
    raise BadInput(
        f"the unit [{name[:60]}] is not known",
        remedy=(f"Did you mean {some_of(near)}? " if near else "")
        + "Write units as in [rad/s], [rpm], [mrad], [deg/s], [N m], [N m s], [kg m2], [s]; [] is dimensionless.",
    )


#: Factors of units that nearly every file has, so that astropy need not be loaded for them; a test holds them to astropy's.
_COMMON = {
    ("rpm", "rad/s"): 2 * 3.141592653589793 / 60, ("deg/s", "rad/s"): 3.141592653589793 / 180, ("mrad/s", "rad/s"): 1e-3,
    ("urad/s", "rad/s"): 1e-6, ("deg", "rad"): 3.141592653589793 / 180, ("mrad", "rad"): 1e-3, ("urad", "rad"): 1e-6,
    ("arcsec", "rad"): 3.141592653589793 / 648_000, ("ms", "s"): 1e-3, ("min", "s"): 60.0, ("h", "s"): 3600.0, ("mN m", "N m"): 1e-3,
    ("uN m", "N m"): 1e-6, ("mN", "N"): 1e-3, ("km", "m"): 1e3, ("mm", "m"): 1e-3, ("cm", "m"): 1e-2, ("km/s", "m/s"): 1e3,
    ("mm/s", "m/s"): 1e-3, ("nT", "T"): 1e-9, ("uT", "T"): 1e-6, ("mA", "A"): 1e-3, ("kPa", "Pa"): 1e3, ("mHz", "Hz"): 1e-3,
    ("%", ""): 1e-2, ("mrad/s2", "rad/s2"): 1e-3, ("kg/m3", "kg / m3"): 1.0, ("cm/s", "m/s"): 1e-2, ("mN m s", "N m s"): 1e-3,
}  # fmt: skip


def is_unit(text: str) -> bool:
    """Whether ``text`` names a unit."""
    if any(text in pair for pair in _COMMON):
        return True
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
    if text == expected:
        return 1.0
    if (text, expected) in _COMMON:
        return _COMMON[text, expected]
    got, want = parse_unit(text), parse_unit(expected)
    if expected == "N m" and re.search(r"J|eV|erg|cal", text):
        raise BadInput(f"[{text}] is a unit of energy, not of torque", remedy="Write [N m].")
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
        raise BadInput(f"{_shown(text)} has no unit", remedy=_as_in(text, expected))
    written = str(text)[:_LONGEST].strip()
    match = _NUMBER.match(written)
    if not match:
        raise BadInput(f"{_shown(text)} is not a number with a unit", remedy=f'Write it as in "1.5 {expected}".')
    number, unit = match.group(), written[match.end() :].strip()
    if unit == "" and expected != "":
        raise BadInput(f"{_shown(text)} has no unit", remedy=_as_in(number, expected))
    return _sensible(float(number) * si_factor(unit, expected), text)


def _as_in(number: object, expected: str) -> str:
    usual = {"rad": "deg", "rad/s": "deg/s"}.get(expected, expected)
    return f'Write the unit in the value, as in "{number} {usual}".'


def numbers(text: object, expected: str, count: int) -> tuple[float, ...]:
    """'1.234 1.580 3.019 m' (commas allowed) -> SI numbers."""
    rest, parts = str(text)[:_LONGEST].strip(), []
    while match := _NUMBER.match(rest):
        parts.append(match.group())
        rest = rest[match.end() :].lstrip(" \t,")
    if len(parts) != count:
        raise BadInput(
            f"{_shown(text)} is not {count} numbers with one unit",
            remedy=f'Write it as in "{" ".join("0" * count)} {expected}".',
        )
    unit = rest.strip()
    if unit == "" and expected != "":
        raise BadInput(f"{_shown(text)} has no unit", remedy=f'End it with the unit, as in "{text} {expected}".')
    factor = si_factor(unit, expected)
    return tuple(_sensible(factor * float(p), text) for p in parts)


def _shown(text: object) -> str:
    said = repr(text)
    return said if len(said) <= 60 else said[:57] + "…'"


def _sensible(value: float, text: object) -> float:
    if not abs(value) < _LARGEST:
        raise BadInput(f"{_shown(text)} is too large for a measurement", remedy="Check its exponent.")
    return value


def plain_numbers(text: str, count: int, what: str) -> tuple[float, ...]:
    """'1,2,3' from the command line, in SI."""
    try:
        values = tuple(float(p) for p in str(text).replace(" ", "").split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(abs(v) < _LARGEST for v in values):  # also NaN
        raise BadInput(
            f"{what} {_shown(text)} is not {count} numbers", remedy=f"Give {count} numbers separated by commas."
        )
    return values
