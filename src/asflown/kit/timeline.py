"""Time: an axis of int64 nanoseconds TAI, and UTC labels.

Scales and leap seconds are ERFA's (its built-in table, never a download).  UTC exists only at
the edge; inside, a day with a leap second has 86,401 seconds and intervals come out right.
"""

from __future__ import annotations

import re
import warnings
from calendar import isleap
from datetime import date
from itertools import pairwise
from typing import Any

import numpy as np

from .errors import BadInput

NS = 1_000_000_000
_DAY_NS = 86_400 * NS
_DAY_2000 = 10_957  # days from 1970-01-01 to 2000-01-01, the origin of the axis
_ORDINAL_1970 = date(1970, 1, 1).toordinal()
_JD_ORIGIN = 2451544.5  # 2000-01-01 00:00 TAI
_MOST_DAYS = 92_000  # either way: 1748 to 2251; int64 nanoseconds end in 2292
#: UTC begins in 1960; the axis ends in 2251.
YEARS = range(1960, 2250)

#: UTC as text: date (2015-09-29, 2015/09/29, 29-Sep-2015, 2015 SEP 29, 20150929, 2015-272, 2015:272), time of day, and what says that it
#: is UTC or how far off.
_UTC = re.compile(
    r"(?:(?P<year>\d{4})(?:-(?P<month>\d\d?)-(?P<day>\d\d?)|/(?P<month2>\d\d?)/(?P<day2>\d\d?)|[-:/ ]?(?P<of_year>\d{3})"
    r"|[- ](?P<called>[A-Za-z]{3,9})[- ](?P<day3>\d\d?))|(?P<day4>\d\d?)[- ](?P<called2>[A-Za-z]{3,9})[- ](?P<year2>\d{4})"
    r"|(?P<year3>\d{4})(?P<month3>\d\d)(?P<day5>\d\d))"
    r"(?:(?:[Tt _]|//?|:|(?<=\d{3})-)(?:(?P<hour>\d\d?):(?P<minute>\d\d?)(?::(?P<second>\d\d?)(?:[.,](?P<rest>\d{0,20}))?)?"
    r"|(?P<hour2>\d\d)(?P<minute2>\d\d)(?P<second2>\d\d)(?:[.,](?P<rest2>\d{0,20}))?))?"
    r" ?(?P<zone>[Zz]|UTC|GMT|[+-]\d\d:?\d\d|[+-]\d\d)?",
    re.ASCII,
)
_MONTHS = (
    "january",
    "february",
    "march",
    "april",
    "may",
    "june",
    "july",
    "august",
    "september",
    "october",
    "november",
    "december",
)
_LONGEST_STAMP = 64
_REMEDY = "Write UTC as 2015-09-29T00:00:00 or, by day of year, 2015-272T00:00:00."


def utc_to_tai_ns(stamps) -> Any:
    """UTC labels to int64 ns TAI, exact to the nanosecond.

    ISO 8601 (2015-09-29T00:00:00), also 2015/09/29, or day of year (2015-272T00:00:00), with a trailing Z, ' UTC' or an
    offset (+02:00), which is taken off.  24:00:00 is midnight of the next day; 23:59:60 exists on days that end with a leap second.
    Raises BadInput, naming the first stamp it cannot read."""
    one = isinstance(stamps, str)
    read = [_posix_ns(s) for s in ([stamps] if one else stamps)]
    posix, leap = np.array([r[0] for r in read], np.int64), np.array([r[1] for r in read], bool)
    ns = posix_to_tai_ns(posix) - NS * leap  # 23:59:60 was counted as 00:00:00
    return int(ns[0]) if one else ns


def utc_to_posix_ns(stamp: str) -> int:
    """A UTC label as nanoseconds since 1970 that skip leap seconds."""
    return _posix_ns(stamp)[0]


def _posix_ns(stamp) -> tuple[int, bool]:
    """A UTC label as nanoseconds since 1970 that skip leap seconds, and whether it lies within a leap second."""
    text = str(stamp).strip()
    said = _UTC.fullmatch(text) if len(text) <= _LONGEST_STAMP else None
    if said is None:
        raise _no_time(text)
    year = _year_of(said)
    if year not in YEARS:
        raise _no_time(text, f"the year {year} is outside {YEARS[0]} to {YEARS[-1]}")
    timed = said["hour"] or said["hour2"]
    if not timed and (said["year3"] or (said["zone"] or "Z")[0] in "+-"):
        raise _no_time(text)  # a bare number, or what may be an hour or an offset
    day = _day_of(said, text)
    hour, minute, second = (int(said[part] or said[f"{part}2"] or 0) for part in ("hour", "minute", "second"))
    digits = said["rest"] or said["rest2"]
    rest = round(int(digits) * NS / 10 ** len(digits)) if digits else 0
    offset_s = _offset_s(said["zone"])
    if second == 60 and not ((hour, minute, offset_s) == (23, 59, 0) and _ends_with_leap_second(day)):
        raise _no_time(text, "there is no leap second then")
    midnight = hour == 24 and minute == second == rest == 0
    if not ((hour < 24 or midnight) and minute < 60 and second <= 60 and abs(offset_s) <= 86_400):
        raise _no_time(text, "there is no such time of day")
    seconds = day * 86_400 + hour * 3600 + minute * 60 + second - offset_s
    return seconds * NS + rest, second == 60


def _year_of(said: re.Match) -> int:
    return int(said["year"] or said["year2"] or said["year3"])


def _day_of(said: re.Match, text: str) -> int:
    """Days since 1970-01-01 of the date that was written."""
    year = _year_of(said)
    if said["of_year"]:
        start = date(year, 1, 1).toordinal() - _ORDINAL_1970
        length = 366 if isleap(year) else 365
        if not 1 <= int(said["of_year"]) <= length:
            raise _no_time(text, f"{year} has {length} days")
        return start + int(said["of_year"]) - 1
    day = int(said["day"] or said["day2"] or said["day3"] or said["day4"] or said["day5"])
    called = (said["called"] or said["called2"] or "").lower()
    month = int(said["month"] or said["month2"] or said["month3"] or 0)
    if called:  # 'Sep', 'Sept' and 'September'
        month = 1 + next((k for k, name in enumerate(_MONTHS) if name.startswith(called)), -1)
    try:
        return date(year, month, day).toordinal() - _ORDINAL_1970
    except ValueError:
        raise _no_time(text, "there is no such day") from None


def _offset_s(zone: str | None) -> int:
    if zone is None or zone[0] not in "+-":
        return 0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    return (1 if zone[0] == "+" else -1) * (int(digits[:2]) * 3600 + int(digits[2:]) * 60)


def _no_time(text: str, why: str = "") -> BadInput:
    shown = repr(text) if len(text) <= _LONGEST_STAMP else repr(text[:40] + "…")
    return BadInput(f"{shown} is not a time{f' ({why})' if why else ''}", remedy=_REMEDY)


def _tai_minus_utc_ns(days: np.ndarray) -> np.ndarray:
    """TAI minus UTC at the start of days since 1970-01-01. [ns]

    A date past the last announced leap second gets the last known offset, as every ground system does.
    From 1960 to 1971, when UTC drifted within the day by up to 2.6 ms, the value at its start serves the whole day."""
    import erfa

    dates = np.datetime64("1970-01-01", "D") + days
    years = dates.astype("datetime64[Y]")
    months = dates.astype("datetime64[M]")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        offset = erfa.dat(
            years.astype(int) + 1970,
            (months - years).astype(int) + 1,
            (dates - months).astype(int) + 1,
            0.0,
        )
    return np.rint(np.asarray(offset) * NS).astype(np.int64)


def _ends_with_leap_second(day: int) -> bool:
    offsets = _tai_minus_utc_ns(np.array([day, day + 1]))
    return int(offsets[1] - offsets[0]) == NS


def posix_to_tai_ns(posix_ns: np.ndarray) -> np.ndarray:
    """UTC as nanoseconds since 1970 that skip leap seconds (POSIX, datetime64, CF calendars), to ns TAI."""
    posix_ns = np.asarray(posix_ns, np.int64)
    if len(posix_ns) == 0:
        return posix_ns
    low, high = (int(x) // _DAY_NS for x in (posix_ns.min(), posix_ns.max()))
    if high - low > 1_000_000:
        raise ValueError("the times are outside the calendar")
    offsets = _tai_minus_utc_ns(np.arange(low, high + 1))
    steps = np.flatnonzero(np.diff(offsets)) + 1
    if len(steps) == 0:
        return posix_ns + (offsets[0] - _DAY_2000 * _DAY_NS)
    return posix_ns + (offsets[posix_ns // _DAY_NS - low] - _DAY_2000 * _DAY_NS)


def tai_to_datetime64(tai_ns: np.ndarray) -> np.ndarray:
    """ns TAI as datetime64[ns] in UTC, which skips leap seconds: an instant within one reads as the next second."""
    posix = np.asarray(tai_ns, np.int64) + _DAY_2000 * _DAY_NS
    if len(posix) == 0:
        return posix.astype("datetime64[ns]")
    guess = posix - _offsets_at(
        posix
    )  # TAI minus UTC is that of the day of UTC: the second look settles instants near midnight
    return (posix - _offsets_at(guess)).astype("datetime64[ns]")


def _offsets_at(posix_ns: np.ndarray) -> np.ndarray:
    days, which = np.unique(posix_ns // _DAY_NS, return_inverse=True)
    return _tai_minus_utc_ns(days)[which]


def gps_to_tai_ns(seconds) -> np.ndarray:
    """GPS seconds (continuous since 1980-01-06 UTC, 19 s behind TAI) to ns TAI."""
    return np.rint(np.asarray(seconds, float) * NS).astype(np.int64) + utc_to_tai_ns("1980-01-06T00:00:00")


def et_to_tai_ns(seconds) -> np.ndarray:
    """Ephemeris time (TDB seconds past J2000) to ns TAI; ERFA is the authority for TDB."""
    import erfa

    days, rest = np.divmod(np.atleast_1d(np.asarray(seconds, float)) / 86_400, 1.0)
    tdb = (2451545.0 + days, rest)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        # the terms in universal time are microseconds: UTC serves, and TDB for TT within it
        utc = erfa.taiutc(*erfa.tttai(*tdb))
        difference = erfa.dtdb(*tdb, np.mod(utc[0] - 0.5 + utc[1], 1.0), 0.0, 0.0, 0.0)
        day, rest = erfa.tttai(*erfa.tdbtt(*tdb, difference))
    if np.any(np.abs(day - _JD_ORIGIN) > _MOST_DAYS):
        raise ValueError("the time is outside the range of int64 nanoseconds")
    whole = np.floor(day - 0.5) + 0.5
    return np.rint((whole - _JD_ORIGIN) * _DAY_NS).astype(np.int64) + np.rint((day - whole + rest) * _DAY_NS).astype(
        np.int64
    )


def utc_label(tai_ns: int, digits: int = 0) -> str:
    """'2015-09-29T00:00:00' (a leap second reads 23:59:60)."""
    import erfa

    day, rest = divmod(int(tai_ns), _DAY_NS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        year, month, day_of, clock = erfa.d2dtf("UTC", digits, *erfa.taiutc(_JD_ORIGIN + day, rest / _DAY_NS))
    label = f"{int(year):04d}-{int(month):02d}-{int(day_of):02d}T{int(clock['h']):02d}:{int(clock['m']):02d}:{int(clock['s']):02d}"
    return f"{label}.{int(clock['f']):0{digits}d}" if digits else label


def seconds_since(tai_ns, epoch_ns: int) -> np.ndarray:
    """Elapsed SI seconds, from integers, so that no precision is lost far from the epoch."""
    return (np.asarray(tai_ns, np.int64) - np.int64(epoch_ns)) / NS


def cadence_ns(tai_ns: np.ndarray) -> int:
    """A channel's own cadence: the median step of its samples (0 with fewer than two)."""
    if len(tai_ns) < 2:
        return 0
    steps = np.diff(tai_ns)
    first = int(steps[0])
    return first if (steps == first).all() else int(np.median(steps))


def runs(known: np.ndarray) -> list[slice]:
    """Stretches over which ``known`` (bool) holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(known).astype(int), [0]])))
    return [slice(a, b) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]


def segments(tai_ns: np.ndarray, missing_bridged: int, cadence: int) -> list[slice]:
    """Stretches without a gap: at most ``missing_bridged`` samples in a row are missing inside one."""
    if len(tai_ns) == 0:
        return []
    breaks = np.flatnonzero(np.diff(tai_ns) > (missing_bridged + 1.5) * max(cadence, 1)) + 1
    edges = [0, *breaks.tolist(), len(tai_ns)]
    return [slice(a, b) for a, b in pairwise(edges)]
