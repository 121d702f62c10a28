"""Run-downs that the user names: of a whole window, of a span, or listed in a file."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...kit.errors import BadInput, some_of
from ...kit.reading import csv_rows, plain_number, read_text
from ...kit.timeline import utc_to_tai_ns

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from ...telemetry.telemetry import Telemetry

_FORMS = 'Name wheels as in "RW1,RW2", a span in seconds as in "RW3:60-240", or a CSV file with the columns wheel, start, stop.'
_SPAN = re.compile(r"(?P<wheel>.+):(?P<start>[\d.]+)-(?P<stop>[\d.]+)")


@dataclass(frozen=True)
class NamedRunDown:
    """A wheel whose motor is off from ``start`` to ``stop``: seconds from the epoch, or UTC; None for the whole window.

    ``file``, ``line``: where it is listed."""

    wheel: str
    start: str | float | None = None
    stop: str | float | None = None
    file: str | None = field(default=None, compare=False)
    line: int | None = field(default=None, compare=False)

    def refused(self, what: str, remedy: str = _FORMS) -> BadInput:
        """The error that this run-down is, with its place in its list."""
        return BadInput(what, file=self.file, line=self.line, remedy=remedy)

    def span(self, telemetry: Telemetry) -> tuple[int, int]:
        """Its span in a record. [ns TAI]

        Raises BadInput for a time that cannot be read, and one that ends before it starts."""
        first, last = telemetry.span()
        try:
            a = first if self.start is None else telemetry.moment(self.start)
            b = last if self.stop is None else telemetry.moment(self.stop)
        except BadInput as why:
            raise why if self.file is None else self.refused(why.what, why.remedy) from why
        if b <= a:
            raise self.refused(f"a run-down of wheel {self.wheel} ends before it starts")
        return a, b

    @property
    def is_dated(self) -> bool:
        """Whether its times are UTC."""
        return self.start is not None and not _is_number(self.start)


def _is_number(text: str | float) -> bool:
    try:
        return math.isfinite(plain_number(text) if isinstance(text, str) else text)
    except ValueError:
        return False


def named_run_downs(words: Iterable[str | NamedRunDown]) -> tuple[NamedRunDown, ...]:
    """What the user names: wheels, spans and CSV files, as words.  Raises BadInput for anything else."""
    found: list[NamedRunDown] = []
    for word in words:
        if isinstance(word, NamedRunDown):
            found.append(word)
        elif word.lower().endswith(".csv"):
            found += _listed(word)
        else:
            found += [_one(part.strip()) for part in word.split(",")]
    return tuple(dict.fromkeys(found))


def _one(word: str) -> NamedRunDown:
    if not word:
        raise BadInput("a run-down is named without a wheel", remedy=_FORMS)
    if ":" not in word:
        return NamedRunDown(word)
    match = _SPAN.fullmatch(word)
    try:
        start, stop = (float(match[n]) for n in ("start", "stop"))  # type: ignore[index]
    except (TypeError, ValueError):
        raise BadInput(f"the run-down {word!r} is not a wheel and two times", remedy=_FORMS) from None
    if not start < stop:
        raise BadInput(f"the run-down {word!r} ends before it starts", remedy=_FORMS)
    return NamedRunDown(match["wheel"], start, stop)  # type: ignore[index]


def _listed(path: str) -> list[NamedRunDown]:
    """Rows of a CSV file; times are seconds from the epoch or UTC."""
    rows = csv_rows(read_text(path, "list of run-downs", _FORMS), path, _FORMS)
    heads = [h.strip() for h in rows[0][1]] if rows else []
    found = []
    for number, cells in rows[1:]:
        row = dict(zip(heads, cells, strict=False))
        wheel, start, stop = ((row.get(n) or "").strip() for n in ("wheel", "start", "stop"))
        if not (wheel and start and stop):
            raise BadInput("a run-down lacks its wheel, start or stop", file=path, line=number, remedy=_FORMS)
        found.append(NamedRunDown(wheel, start, stop, path, number))
    if not found:
        raise BadInput("this list of run-downs is empty", file=path, remedy=_FORMS)
    return found


def spans_of(named: Iterable[NamedRunDown], telemetry: Telemetry) -> dict[str, tuple[tuple[float, float], ...]]:
    """Of each wheel the spans [s] that are named and lie in this telemetry."""
    first, last = telemetry.span()
    spans: dict[str, list[tuple[float, float]]] = {}
    for n in named:
        a, b = n.span(telemetry)
        if a <= last and b >= first:
            start, stop = (float(telemetry.seconds(x)) for x in (max(a, first), min(b, last)))
            spans.setdefault(n.wheel, []).append((start, stop))
    return {wheel: tuple(sorted(of_it)) for wheel, of_it in spans.items()}


def check_named(named: Iterable[NamedRunDown], wheels: Collection[str]) -> None:
    """Raises BadInput for a listed run-down of a wheel that the craft does not have, and for one that ends before it starts."""
    for n in named:
        if n.file is None:
            continue
        if n.wheel not in wheels:
            raise n.refused(f"the craft has no wheel {n.wheel!r}", f"Its wheels: {some_of(wheels)}.")
        try:
            a, b = (float(x) if _is_number(x) else utc_to_tai_ns(str(x)) for x in (n.start, n.stop))  # type: ignore[arg-type]
        except BadInput as why:
            raise n.refused(why.what, why.remedy) from why
        if _is_number(n.start) != _is_number(n.stop):  # type: ignore[arg-type]
            raise n.refused("a run-down starts in seconds and stops in UTC, or the other way round")
        if b <= a:
            raise n.refused(f"a run-down of wheel {n.wheel} ends before it starts")


def most_at_once(spans: dict[str, tuple[tuple[float, float], ...]]) -> tuple[list[str], float, float]:
    """Wheels of the most that coast at one time, and when that begins and ends [s]."""
    most: tuple[list[str], float, float] = ([], 0.0, 0.0)
    for of_it in spans.values():
        for start, _ in of_it:
            beside = [(n, b) for n, others in spans.items() for a, b in others if a <= start < b]
            names = list(dict.fromkeys(n for n, _ in beside))
            if len(names) > len(most[0]):
                most = (names, start, min(b for _, b in beside))
    return most
