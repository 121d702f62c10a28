"""Scales that a column of times may be written in, and cells of such a column as ns TAI, exact to the last digit."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from decimal import Context, Decimal, InvalidOperation
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput
from ..kit.quantities import TIME_WORDS
from ..kit.timeline import NS, et_to_tai_ns, gps_to_tai_ns, posix_to_tai_ns, utc_to_tai_ns

if TYPE_CHECKING:
    from collections.abc import Iterable

UNITS_NS = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": NS, "min": 60 * NS, "h": 3_600 * NS, "d": 86_400 * NS}
#: Decimals that numbers of these units may have; beyond the nanosecond they say nothing.
DECIMALS = {"ns": 0, "us": 3, "ms": 6, "s": 9, "min": 11, "h": 13, "d": 14}
#: Scales as people call them.
_KINDS = {
    "utc": "utc", "iso": "utc", "iso8601": "utc", "iso-8601": "utc", "gmt": "utc", "mjd": "mjd", "jd": "jd", "posix": "unix",
}  # fmt: skip
#: Days from the origin of the scale to 1970-01-01.
_DAYS_TO_1970 = {"mjd": Decimal(40_587), "jd": Decimal("2440587.5")}
_LONGEST_NS = 4_000_000_000 * NS  # from any origin; int64 holds it with a margin
_DIGITS = re.compile(r"\s{0,99}[+-]?(?:\d{1,30}\.?\d{0,60}|\.\d{1,60})(?:[eE][+-]?\d{1,2})?\s{0,99}", re.ASCII)
_EXACT = Context(prec=100)
WEEK_S = 604_800


@dataclass(frozen=True)
class Scale:
    """How times are written.

    kind: '' (elapsed), 'utc', 'gps', 'et', 'unix', 'mjd', 'jd' (both UTC) or 'pattern' (UTC by ``pattern``); unit: of the numbers."""

    kind: str
    unit: str = "s"
    pattern: str = ""

    @property
    def dated(self) -> bool:
        return self.kind != ""

    @property
    def numeric(self) -> bool:
        return self.kind not in ("utc", "pattern")

    @property
    def origin(self) -> Decimal:
        """What is taken off a number of this scale, in its unit."""
        return _DAYS_TO_1970.get(self.kind, Decimal(0))

    def tai_ns(self, ns: np.ndarray, origin_ns: int) -> np.ndarray:
        """Numbers of the scale, less its origin, in ns, to ns TAI; ``origin_ns`` is the zero of elapsed times."""
        if self.kind == "gps":
            if len(ns) and 0 <= int(ns.min()) and int(ns.max()) <= WEEK_S * NS:
                raise BadInput(
                    f"the GPS seconds are below {WEEK_S}: they count within a week, and the week is not given",
                    remedy='Give the week too, under [time] of a channel dictionary: columns = ["WEEK", "TOW"], units = ["week", "s"], format = "gps s".',
                )
            return ns + int(gps_to_tai_ns(0.0))
        if self.kind == "et":
            return et_to_tai_ns(ns / NS)
        if self.kind in ("unix", "mjd", "jd"):
            return posix_to_tai_ns(ns)
        return ns + origin_ns


def scale_called(text: str) -> Scale | None:
    """'s', 'ms', 'utc', 'gps s', 'et s', 'unix ms', 'mjd', 'jd', or a strptime pattern such as '%d.%m.%Y %H:%M:%S'; None for another."""
    words = text.split()
    if "%" in text:
        return Scale("pattern", pattern=text)
    if not 1 <= len(words) <= 2:
        return None
    kind, unit = ("", words[0]) if len(words) == 1 else (words[0].lower(), words[1])
    if _KINDS.get(words[0].lower()) in ("utc", "mjd", "jd") and words[1:] in ([], ["d"], ["days"]):
        return Scale(_KINDS[words[0].lower()], "d")
    kind, unit = _KINDS.get(kind, kind), TIME_WORDS.get(unit.lower(), unit)
    return Scale(kind, unit) if kind in ("", "gps", "et", "unix") and unit in UNITS_NS else None


def exact_ns(cells: Iterable | np.ndarray, scale: Scale) -> np.ndarray:
    """Numbers of a scale, less its origin, as ns.  Raises the index of the first cell that is not such a number."""
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "iuf" and not np.ma.is_masked(cells):
        fast = exact_of_numbers(np.asarray(cells), scale)
        if fast is not None:
            return fast
        cells = cells.tolist()
    factor, ns = UNITS_NS[scale.unit], []
    for row, cell in enumerate(cells):
        text = cell if isinstance(cell, str) else repr(cell)
        try:
            if not _DIGITS.fullmatch(text):
                raise InvalidOperation
            value = _EXACT.multiply(Decimal(text.strip()) - scale.origin, factor)
            if not abs(value) < _LONGEST_NS:
                raise InvalidOperation
        except InvalidOperation:
            raise NotATime(row) from None
        ns.append(int(value.to_integral_value()))
    return np.array(ns, np.int64)


def exact_of_numbers(values: np.ndarray, scale: Scale) -> np.ndarray | None:
    """Typed numbers as ns, by the decimals that they were written with; None where they need more care."""
    factor = UNITS_NS[scale.unit]
    for decimals in range(DECIMALS[scale.unit] + 1):
        power = 10**decimals
        few = values[:1000].astype(float)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused below, by its row
            if not (np.rint(few * power) / power == few).all():
                continue
            whole = np.rint(values.astype(float) * power)
        # a decimal of 15 digits and its double are one to one; integers beyond are left to the decimals
        largest = max(float(np.max(whole, initial=0)), -float(np.min(whole, initial=0)))
        if power > factor * 100 or not largest < 9e14 or not (whole / power == values).all():
            continue
        origin = scale.origin * power
        if (
            origin == int(origin)
            and factor % power == 0
            and (largest + float(origin)) * (factor // power) < 2 * _LONGEST_NS
        ):
            ns = whole.astype(np.int64)
            ns -= int(origin)
            ns *= factor // power
            return ns if np.max(np.abs(ns), initial=0) < _LONGEST_NS else None
    return None


def dated_ns(cells: Iterable, scale: Scale) -> np.ndarray:
    """Text cells of scale 'utc' or a pattern as ns TAI.  Raises the index of the first cell that is not such a time."""
    ns = []
    for row, cell in enumerate(cells):
        try:
            if scale.kind == "utc":
                ns.append(utc_to_tai_ns(cell if isinstance(cell, str) else str(cell)))
            else:
                when = datetime.strptime(str(cell).strip(), scale.pattern)  # UTC unless the pattern has %z
                ns.append(utc_to_tai_ns(when.isoformat()))
        except (BadInput, ValueError) as why:
            raise NotATime(row, getattr(why, "what", "")) from None
    return np.array(ns, np.int64)


def is_stamp(cell: object) -> bool:
    """Whether a cell is a date with a time of day, or a date, and no number."""
    try:
        utc_to_tai_ns(str(cell))
    except BadInput:
        return False
    return not str(cell).strip().isdigit()


class NotATime(Exception):
    """A cell that is not a time: its row and, where it is known, why."""

    def __init__(self, row: int, why: str = ""):
        super().__init__(row, why)
        self.row, self.why = row, why


def part_unit(text: str) -> tuple[Decimal, str] | None:
    """The unit of a column that is added to others to make a time, as a multiple of a unit: 'ms', 'week', '1e-9 s'; None for another."""
    if text in UNITS_NS:
        return Decimal(1), text
    if text == "week":
        return Decimal(7), "d"
    number, _, unit = text.strip().partition(" ")
    return (Decimal(number), unit.strip()) if unit.strip() in UNITS_NS and _DIGITS.fullmatch(number) else None


def joined_ns(table, columns, units, factor: Decimal, scale: Scale, origin_ns: int) -> np.ndarray:
    """Times written in several columns, or as a multiple of a unit, as ns TAI.

    Columns of numbers are added, each in its unit; columns of text are joined with a blank.  Raises BadInput for a cell that is no time."""
    parts = [c.tolist() if isinstance(c, np.ndarray) else c for c in (table.columns[j] for j in columns)]
    at = columns[0]
    try:
        if not scale.numeric:
            return dated_ns([" ".join(str(c).strip() for c in row) for row in zip(*parts, strict=True)], scale)
        ns = np.zeros(len(table), np.int64)
        for column, unit, cells in zip(columns, units or [scale.unit] * len(columns), parts, strict=True):
            at = column
            if column in table.instants:  # read already, in the scale's unit and less its origin
                ratio = Fraction(factor)
                whole = table.instants[column].astype(object) * ratio.numerator // ratio.denominator
                ns += whole.astype(np.int64) + int(scale.origin * UNITS_NS[scale.unit])
            elif unit not in UNITS_NS:  # as "week", or "2.3283064365386963e-10 s", a fraction of 2^32
                size, base = part_unit(unit)
                ns += exact_ns(
                    [format(_EXACT.multiply(_decimal(c, i), size), "f") for i, c in enumerate(cells)], Scale("", base)
                )
            elif factor != 1:
                ns += exact_ns(
                    [format(_EXACT.multiply(_decimal(c, i), factor), "f") for i, c in enumerate(cells)], Scale("", unit)
                )
            else:
                ns += exact_ns(cells, Scale("", unit))
        return scale.tai_ns(ns - int(scale.origin * UNITS_NS[scale.unit]), origin_ns)
    except NotATime as why:
        raise BadInput(
            f"{str(table.columns[at][why.row])[:60]!r} in column {table.headings[at]!r} is not a time",
            line=table.line(why.row),
            remedy="Every row needs a time, as [time] of the channel dictionary declares it.",
        ) from None


def _decimal(cell, row: int) -> Decimal:
    text = cell if isinstance(cell, str) else repr(cell)
    if not _DIGITS.fullmatch(text):
        raise NotATime(row)
    return Decimal(text.strip())


def spread(tai_ns: np.ndarray, cadence_ns: int) -> np.ndarray:
    """Instants of samples whose stamps are coarser than their cadence, from their count since the last pause.

    Raises BadInput where stamps and cadence contradict each other."""
    steps = np.diff(tai_ns)
    moved = steps[steps > 0]
    coarse = int(np.median(moved)) if len(moved) else 0
    start = np.concatenate(([0], np.flatnonzero(steps > 1.5 * coarse + cadence_ns) + 1))
    first = np.repeat(start, np.diff(np.concatenate((start, [len(tai_ns)]))))
    even = tai_ns[first] + (np.arange(len(tai_ns)) - first) * cadence_ns
    off = np.abs(even - tai_ns) > coarse + cadence_ns
    if off.any():
        raise BadInput(
            f"the declared cadence of {cadence_ns / NS:g} s contradicts the time stamps from row {int(np.argmax(off)) + 1} on",
            remedy="Correct cadence under [time] of the channel dictionary.",
        )
    return even
