"""Time: an axis of int64 nanoseconds TAI, and UTC labels.

Scales and leap seconds are astropy's (its bundled table, never a download).  UTC exists only at
the edge; inside, a day with a leap second has 86,401 seconds and intervals come out right.
"""

from __future__ import annotations

import re
import warnings
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from .errors import BadInput

NS = 1_000_000_000
_DAY_NS = 86_400 * NS
_JD_ORIGIN = 2451544.5  # 2000-01-01 00:00 TAI
_MOST_DAYS = 92_000  # either way: 1748 to 2251; int64 nanoseconds end in 2292


@cache
def _astropy_time():
    """astropy.time without network access and without warnings about dates beyond its tables.

    A date past the last announced leap second is converted with the last known offset, as every
    ground system does, until the next one is announced.
    """
    from astropy.utils import iers

    iers.conf.auto_download = False
    iers.conf.auto_max_age = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from astropy.time import Time

        Time("2017-01-01", scale="utc").tai  # noqa: B018  settles the leap-second table
    return Time


def _to_ns(time) -> np.ndarray:
    """int64 ns since 2000-01-01 TAI.  jd1 holds whole or half days: exact to the nanosecond."""
    tai = time.tai
    day, rest = np.asarray(tai.jd1, float), np.asarray(tai.jd2, float)
    if np.any(np.abs(day - _JD_ORIGIN) > _MOST_DAYS):
        raise ValueError("the time is outside the range of int64 nanoseconds")
    return np.rint((day - _JD_ORIGIN) * _DAY_NS).astype(np.int64) + np.rint(rest * _DAY_NS).astype(np.int64)


def _from_ns(tai_ns):
    Time = _astropy_time()
    days, rest = np.divmod(np.asarray(tai_ns, np.int64), _DAY_NS)
    return Time(_JD_ORIGIN + days.astype(float), rest / _DAY_NS, format="jd", scale="tai")


_YDAY = re.compile(r"^(\d{4})-?(\d{3})(?:[T:]|//)")


def utc_to_tai_ns(stamps) -> Any:
    """UTC labels, ISO 8601 or day-of-year (2015-272T00:00:00), to int64 ns TAI.

    Accepts a trailing Z or ' UTC'.  Raises BadInput, naming the first stamp it cannot read.
    """
    Time = _astropy_time()
    one = isinstance(stamps, str)
    texts = [stamps] if one else list(stamps)
    cleaned = []
    for text in texts:
        s = str(text).strip().removesuffix("UTC").strip().removesuffix("Z")
        m = _YDAY.match(s)
        if m:
            s = f"{m.group(1)}:{m.group(2)}:{s[m.end() :]}"
        elif re.fullmatch(r"\d{4}-\d{3}", s):
            s = f"{s[:4]}:{s[5:]}"
        elif len(s) > 10 and s[10] in "tT":
            s = s[:10] + "T" + s[11:]
        cleaned.append(s)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            ns = _to_ns(Time(np.array(cleaned), scale="utc"))
        except Exception:
            ns = np.array([_one_utc(Time, c, t) for c, t in zip(cleaned, texts, strict=True)], np.int64)
    return int(ns[0]) if one else ns


def _one_utc(Time, cleaned, original):
    try:
        return int(_to_ns(Time(cleaned, scale="utc")))
    except Exception as why:
        raise BadInput(
            f"{original!r} is not a time",
            remedy="Write UTC as 2015-09-29T00:00:00 or, by day of year, 2015-272T00:00:00.",
        ) from why


def gps_to_tai_ns(seconds) -> np.ndarray:
    """GPS seconds (continuous since 1980-01-06 UTC, 19 s behind TAI) to ns TAI."""
    return np.rint(np.asarray(seconds, float) * NS).astype(np.int64) + utc_to_tai_ns("1980-01-06T00:00:00")


def et_to_tai_ns(seconds) -> np.ndarray:
    """Ephemeris time (TDB seconds past J2000) to ns TAI; astropy is the authority for TDB."""
    Time = _astropy_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.atleast_1d(_to_ns(Time(2451545.0, np.asarray(seconds, float) / 86_400, format="jd", scale="tdb")))


def utc_label(tai_ns: int, digits: int = 0) -> str:
    """'2015-09-29T00:00:00' (a leap second reads 23:59:60)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        time = _from_ns(np.int64(tai_ns)).utc
        time.precision = digits
        return str(time.isot)


def seconds_since(tai_ns, epoch_ns: int) -> np.ndarray:
    """Elapsed SI seconds, from integers, so that no precision is lost far from the epoch."""
    return (np.asarray(tai_ns, np.int64) - np.int64(epoch_ns)) / NS


def cadence_ns(tai_ns: np.ndarray) -> int:
    """A channel's own cadence: the median step of its samples (0 with fewer than two)."""
    if len(tai_ns) < 2:
        return 0
    return int(np.median(np.diff(tai_ns)))


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
