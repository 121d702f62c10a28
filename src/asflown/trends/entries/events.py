"""Actuations: which, when, and where their telemetry is; listed by hand or found from the motor's current."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ...kit.config import toml_table, validated
from ...kit.errors import BadInput, some_of
from ...kit.reading import csv_rows, plain_number, read_bytes, read_text
from ...kit.timeline import NS, utc_label, utc_to_tai_ns

if TYPE_CHECKING:
    from ...telemetry.telemetry import Channel, Telemetry

#: A motor counts as running above this share of its largest current, and as stalled above the middle of the two levels.
_RUNNING = 0.3
#: Smallest relative rise of the running current to a stall.
_STALL_RISE = 0.15
#: Span kept of a record around a found actuation. [s]
_MARGIN_S = 60.0

_REMEDY = (
    "An event has id, kind (deploy or stow) and date, and with telemetry file, motor_on_s and motor_off_s "
    "(seconds from the file's epoch); motor, note, start_s and stop_s if wanted. See docs/trends.md."
)


class _Row(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str = Field(min_length=1)
    kind: Literal["deploy", "stow"]
    file: str | None = None
    motor_on_s: float | None = Field(default=None, allow_inf_nan=False)
    motor_off_s: float | None = Field(default=None, allow_inf_nan=False)
    start_s: float | None = Field(default=None, allow_inf_nan=False)
    stop_s: float | None = Field(default=None, allow_inf_nan=False)
    motor: str | None = None
    date: str | None = None
    note: str = ""


class _List(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    event: tuple[_Row, ...] = Field(min_length=1)


@dataclass(frozen=True)
class Event:
    """One actuation.  Times count in seconds from the file's epoch; without ``file`` only its date counts.

    ``motor_on_sigma_s``: zero where the command's time is known."""

    id: str
    kind: str
    date: str | None = None  # UTC
    file: Path | None = None
    motor_on_s: float = math.nan
    motor_off_s: float = math.nan
    start_s: float | None = None
    stop_s: float | None = None
    motor: str | None = None
    note: str = ""
    motor_on_sigma_s: float = 0.0


def load_events(path: str | Path) -> list[Event]:
    """Events of a list, TOML ([[event]]) or CSV, in order of the file.

    Raises BadInput for an unreadable list, unknown keys, a repeated id, an event with neither file nor date, times
    out of order, and files that do not exist: a list with an error is not analysed at all."""
    path = Path(path)
    what = "event list", "Give an event list (TOML or CSV). " + _REMEDY
    if path.suffix.lower() == ".csv":
        table: dict = {"event": _csv_rows(read_text(path, *what), path)}
    else:
        table = toml_table(read_bytes(path, *what), path)
    rows = validated(_List, table, path, _REMEDY).event
    seen: set[str] = set()
    for row in rows:
        if row.id in seen:
            raise BadInput(f"two events have the id {row.id!r}", file=path, remedy="Give every event a unique id.")
        seen.add(row.id)
    return [_checked(row, path) for row in rows]


def is_event_list(path: str | Path) -> bool:
    """Whether a file lists events, rather than being telemetry itself."""
    path = Path(path)
    if path.suffix.lower() == ".toml":
        return True
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with open(path, "rb") as file:
        head = next((line for line in file if line.strip() and not line.lstrip().startswith(b"#")), b"")
    return {b"id", b"kind"} <= {cell.strip() for cell in head.split(b",")}


def _csv_rows(text: str, path: Path) -> list[dict]:
    numbered = csv_rows(text, path, _REMEDY)
    heads = [h.strip() for h in numbered[0][1]] if numbered else []
    if twice := {h for h in heads if heads.count(h) > 1}:
        raise BadInput(f"the header names a column twice: {some_of(sorted(twice))}", file=path, remedy=_REMEDY)
    rows = []
    for number, cells in numbered[1:]:
        if len(cells) != len(heads):
            raise BadInput(
                "this row and the header differ in the number of cells", file=path, line=number, remedy=_REMEDY
            )
        row: dict = {k: v.strip() for k, v in zip(heads, cells, strict=True) if v.strip() != ""}
        for name in ("motor_on_s", "motor_off_s", "start_s", "stop_s"):
            if name in row:
                try:
                    row[name] = plain_number(row[name])
                except ValueError:
                    raise BadInput(
                        f"{name} {row[name]!r} is not a number", file=path, line=number, remedy=_REMEDY
                    ) from None
        rows.append(row)
    return rows


def _checked(row: _Row, path: Path) -> Event:
    def wrong(what: str) -> BadInput:
        return BadInput(f"event {row.id!r}: {what}", file=path, remedy=_REMEDY)

    date = None
    if row.date is not None:
        try:
            date = utc_label(int(utc_to_tai_ns(row.date)))
        except BadInput as why:
            raise wrong(why.what) from None
    file = None
    if row.file is None:
        if date is None:
            raise wrong("an event without a file needs a date")
    else:
        file = path.parent / row.file
        if not file.is_file():
            raise wrong(f"the file {row.file} does not exist in the folder of the list")
        if row.motor_on_s is None or row.motor_off_s is None:
            raise wrong("an event with a file needs motor_on_s and motor_off_s")
        if row.motor_on_s >= row.motor_off_s:
            raise wrong("motor_off_s is before motor_on_s")
    if row.start_s is not None and row.stop_s is not None and not row.start_s < row.stop_s:
        raise wrong("stop_s is before start_s")
    on, off = (math.nan if t is None else t for t in (row.motor_on_s, row.motor_off_s))
    return Event(row.id, row.kind, date, file, on, off, row.start_s, row.stop_s, row.motor, row.note)


def find_events(telemetry: Telemetry, prefix: str = "") -> list[Event]:
    """Actuations of a mechanism in a record, from its motor's current and its angle.

    The current is sampled seldom: the motor came on between two samples, and the middle is used, with the sigma
    of a uniform distribution between them.  Raises BadInput where there is no motor current, or the motor never runs."""
    current = _one_of(telemetry, "motor_current")
    angle = _one_of(telemetry, "cover_angle")
    c, t = current.values, telemetry.seconds(current.tai_ns)
    largest = float(np.max(c, initial=0.0))
    running = c > _RUNNING * largest
    edges = np.flatnonzero(np.diff(np.concatenate([[0], running.astype(int), [0]])))
    events = []
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        if first == 0 or end == len(t):
            continue  # the record does not contain it completely
        before, after = float(t[first - 1]), float(t[first])
        off = 0.5 * float(t[end - 1] + t[end])
        moved = np.interp([before, float(t[end])], telemetry.seconds(angle.tai_ns), angle.values)
        kind = "deploy" if moved[1] > moved[0] else "stow"
        on = 0.5 * (before + after)
        date = utc_label(telemetry.epoch_ns + round(on * NS)) if telemetry.dated else None
        events.append(Event(
            f"{prefix}{kind}-{(date or f'{on:.0f}s')[:10]}", kind, date, Path(telemetry.source), on, off,
            max(before - _MARGIN_S, 0.0), off + _MARGIN_S, current.member or None, "found from the motor's current",
            (after - before) / np.sqrt(12),
        ))  # fmt: skip
    if not events:
        raise BadInput(
            "the record contains no complete actuation: the motor's current does not rise and fall again",
            file=telemetry.source, channel=current.name, remedy="List the events instead. " + _REMEDY,
        )  # fmt: skip
    return events


def stall(telemetry: Telemetry, event: Event) -> tuple[float, float] | None:
    """When the motor stalled, seconds after it came on, and sigma; None where the current shows no jump.

    A running motor that is stopped by its end stop draws more: the time lies between the two samples of the jump,
    and is known only to that interval (cover paper section III: 64 s).  Sigma is half the interval: events sampled at the
    same phase have a common error, so that neighbours may differ by a whole interval by chance."""
    try:
        current = _one_of(telemetry, "motor_current")
    except BadInput:
        return None
    t = telemetry.seconds(current.tai_ns)
    on = (t > event.motor_on_s) & (t < event.motor_off_s)
    t, c = t[on], current.values[on]
    if len(c) < 3:
        return None
    jump = int(np.argmax(np.diff(c)))
    before, after = float(np.median(c[: jump + 1])), float(np.median(c[jump + 1 :]))
    if after < (1 + _STALL_RISE) * before:
        return None
    return 0.5 * float(t[jump] + t[jump + 1]) - event.motor_on_s, 0.5 * float(t[jump + 1] - t[jump])


def _one_of(telemetry: Telemetry, stem: str) -> Channel:
    """The only channel of a family.  Raises BadInput where there is none, or several."""
    found = [c for c in telemetry.channels.values() if c.kind.stem == stem]
    if len(found) != 1:
        what = "is required but is not in the telemetry" if not found else f"occurs {len(found)} times"
        raise BadInput(
            f"the channel {stem} {what}", file=telemetry.source, channel=stem,
            remedy=f"The telemetry contains: {some_of(telemetry.channels)}.",
        )  # fmt: skip
    return found[0].usable
