"""Run-downs that the user names: of a whole window, of a span, or listed in a file."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ...kit.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ...telemetry.telemetry import Telemetry

_FORMS = 'Name wheels as in "RW1,RW2", a span in seconds as in "RW3:60-240", or a CSV file with the columns wheel, start, stop.'
_SPAN = re.compile(r"(?P<wheel>.+):(?P<start>[\d.]+)-(?P<stop>[\d.]+)")


class NamedRunDown(NamedTuple):
    """A wheel whose motor is off from ``start`` to ``stop``: seconds from the epoch, or UTC; None for the whole window."""

    wheel: str
    start: str | float | None = None
    stop: str | float | None = None


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
    if not Path(path).is_file():
        raise BadInput("this list of run-downs does not exist", file=path, remedy=_FORMS)
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file, skipinitialspace=True))
    except (UnicodeDecodeError, csv.Error) as why:
        raise BadInput(f"this list of run-downs cannot be read ({why})", file=path, remedy=_FORMS) from why
    found = []
    for number, row in enumerate(rows, start=2):
        wheel, start, stop = ((row.get(n) or "").strip() for n in ("wheel", "start", "stop"))
        if not (wheel and start and stop):
            raise BadInput("a run-down lacks its wheel, start or stop", file=path, line=number, remedy=_FORMS)
        found.append(NamedRunDown(wheel, start, stop))
    if not found:
        raise BadInput("this list of run-downs is empty", file=path, remedy=_FORMS)
    return found


def spans_of(named: Iterable[NamedRunDown], telemetry: Telemetry) -> dict[str, tuple[tuple[float, float], ...]]:
    """Of each wheel the spans [s] that are named and lie in this telemetry."""
    first, last = telemetry.span()
    spans: dict[str, list[tuple[float, float]]] = {}
    for n in named:
        a = first if n.start is None else telemetry.moment(n.start)
        b = last if n.stop is None else telemetry.moment(n.stop)
        if b <= a:
            raise BadInput(f"a run-down of wheel {n.wheel} ends before it starts", remedy=_FORMS)
        if a <= last and b >= first:
            start, stop = (float(telemetry.seconds(x)) for x in (max(a, first), min(b, last)))
            spans.setdefault(n.wheel, []).append((start, stop))
    return {wheel: tuple(sorted(of_it)) for wheel, of_it in spans.items()}
