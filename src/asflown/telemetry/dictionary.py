"""Channel dictionaries: columns of any table renamed, scaled and converted to the conventions used here.

A dictionary is TOML; unknown keys are refused, and columns it does not mention are ignored.

    [time]                       column, or columns (added, each in its unit of ``units``, or joined with a blank), or rate = "4 Hz"
                                 where there is none; format ("s", "ms", "utc", "gps s", "et s", "unix s", "mjd", "jd", or a strptime
                                 pattern), scale, epoch (UTC, for elapsed times), cadence = "0.25 s" where stamps are coarser than
                                 the samples, labels = [further time columns, kept as written]
    [[channel]]                  column, name, unit; scale and offset: value = (cell * scale + offset) [unit];
                                 count = "0.4 rpm": the size of one count (with unit = "count" cells are counts);
                                 wrap = "65536 count" or "360 deg": the modulus at which cells wrap;
                                 fill = [-9999]: cells that mean 'no value'; valid = ["-6000 rpm", "6000 rpm"]: the range of measurements
    [quaternion]                 columns (4), order, handedness, direction, frame, scale
    [euler]                      columns (3), order ("ZYX": intrinsic, "zyx": extrinsic), unit, direction, frame
    [orbit]                      position (3 columns), position_unit, velocity (3 columns), velocity_unit
    [long]                       channel, value (columns); the [[channel]] columns are then names in the first
    [notes]                      free text

The quaternion.  ``order`` says where the scalar stands.  ``handedness`` says whose formula makes the matrix
R(q): Hamilton's (i j = k, R(q) v = q v q*) or JPL's (i j = -k, the transpose of Hamilton's for the same
numbers).  ``direction`` says what that R(q) does to components: "body-to-frame" takes those in body axes to
those in the frame, "frame-to-body" the reverse.  ``frame`` is "inertial", or "lvlh" (z to the planet, y against
the orbit normal, x along the velocity), whose turning with the orbit is then removed.
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..kit.config import document
from ..kit.errors import BadInput, some_of
from ..kit.quantities import is_unit, quantity, si_factor
from ..kit.reading import reading
from ..kit.rotations import euler, lvlh_to_inertial, quaternion, rotation
from ..kit.timeline import NS
from .assemble import Clock, Part, Read, Use, assembled
from .channels import AXES, kind_of, split_header, to_si
from .findings import Finding
from .tables import Table, divided, numbers_of
from .telemetry import Channel
from .times import Scale, part_unit, scale_called

if TYPE_CHECKING:
    from .text import TextFile


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class TimeColumn(_Part):
    column: str | None = None
    columns: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    rate: str = ""
    format: str = "s"
    scale: float = Field(1.0, gt=0, allow_inf_nan=False)
    epoch: str | None = None
    cadence: str = ""
    labels: tuple[str, ...] = ()

    @property
    def named(self) -> tuple[str, ...]:
        """Its columns."""
        return self.columns or (() if self.column is None else (self.column,))

    def clock(self, at: dict[str, int]) -> Clock:
        """How the times of a table are written, whose columns stand where ``at`` says."""
        scale = scale_called(self.format) or Scale("")
        return Clock(
            tuple(at[c] for c in self.named),
            scale,
            self.units,
            Decimal(repr(self.scale)) if self.scale != 1 else Decimal(1),
            round(quantity(self.cadence, "s") * NS) if self.cadence else 0,
            quantity(self.rate, "Hz") if self.rate else 0.0,
        )


class ChannelEntry(_Part):
    column: str
    name: str
    unit: str = ""
    scale: float = Field(1.0, allow_inf_nan=False)
    offset: float = Field(0.0, allow_inf_nan=False)
    count: str = ""
    wrap: str = ""
    fill: tuple[float, ...] = ()
    valid: tuple[str, ...] = Field((), max_length=2)
    note: str = ""


_Columns4 = Annotated[tuple[str, ...], Field(min_length=4, max_length=4)]
_Columns3 = Annotated[tuple[str, ...], Field(min_length=3, max_length=3)]


class QuaternionEntry(_Part):
    columns: _Columns4
    order: Literal["scalar-first", "scalar-last"]
    handedness: Literal["hamilton", "jpl"] = "hamilton"
    direction: Literal["body-to-frame", "frame-to-body"]
    frame: Literal["inertial", "lvlh"] = "inertial"
    scale: float = Field(1.0, gt=0, allow_inf_nan=False)

    def house(self, q: np.ndarray, *, turned: bool = False, reordered: bool = False) -> np.ndarray:
        """Columns as written, (N, 4), to scalar-first Hamilton, body to frame; or under another reading."""
        q = q * self.scale
        last = (self.order == "scalar-last") != reordered
        q = np.roll(q, 1, axis=1) if last else q
        # JPL's matrix is the transpose of Hamilton's: it undoes one reversal
        conjugate = (self.direction == "frame-to-body") != (self.handedness == "jpl")
        return q * (np.array([1, -1, -1, -1]) if conjugate != turned else 1)


class EulerEntry(_Part):
    """Attitude as three rotations about axes, in the order written; capitals: each about the axes as turned before."""

    columns: _Columns3
    order: Annotated[str, Field(pattern=r"^(?:[XYZ]{3}|[xyz]{3})$")]
    unit: str
    direction: Literal["body-to-frame", "frame-to-body"]
    frame: Literal["inertial", "lvlh"] = "inertial"
    scale: float = 1.0

    def house(self, angles: np.ndarray, *, turned: bool = False, reordered: bool = False) -> np.ndarray:
        """Angles as written, (N, 3), to scalar-first Hamilton quaternions, body to frame; or under another reading."""
        order = self.order.swapcase() if reordered else self.order
        q = quaternion(euler(order, angles * si_factor(self.unit, "rad")))
        return q * (np.array([1, -1, -1, -1]) if (self.direction == "frame-to-body") != turned else 1)


class OrbitEntry(_Part):
    position: _Columns3
    position_unit: str
    velocity: _Columns3
    velocity_unit: str


class LongEntry(_Part):
    channel: str
    value: str


class ChannelDictionary(_Part):
    """The meaning of the columns of one kind of file."""

    time: TimeColumn
    channel: tuple[ChannelEntry, ...] = ()
    quaternion: QuaternionEntry | None = None
    euler: EulerEntry | None = None
    orbit: OrbitEntry | None = None
    long: LongEntry | None = None
    notes: dict[str, str] = Field(default_factory=dict)

    @property
    def attitude(self) -> QuaternionEntry | EulerEntry | None:
        return self.quaternion or self.euler


def load_dictionary(path) -> ChannelDictionary:
    """Read and check a dictionary, from a file or a dict of its keys.  Raises BadInput for a missing file, an unknown key, name or unit."""
    remedy = "docs/telemetry.md lists the keys of a channel dictionary."
    hint = "Give a TOML file; examples/ holds some."
    entry, name = document(ChannelDictionary, path, "channels", "channel dictionary", hint, remedy)
    with reading(name, remedy):
        _check(entry)
    return entry


def _check(entry: ChannelDictionary) -> None:
    """Checks beyond the types: names, units, and nothing mapped twice."""
    columns = [c.column for c in entry.channel]
    names = [c.name for c in entry.channel]
    _check_time(entry.time)
    if entry.quaternion and entry.euler:
        raise BadInput("the attitude is mapped twice, in [quaternion] and [euler]", remedy="Map it once.")
    if entry.attitude:
        columns += entry.attitude.columns
        names += [f"quaternion_{m}" for m in "wxyz"]
    if entry.orbit:
        columns += [*entry.orbit.position, *entry.orbit.velocity]
        names += [f"orbit_{p}_{a}" for p in ("position", "velocity") for a in AXES]
    if not columns:
        raise BadInput("the dictionary maps no column", remedy="Add [[channel]] entries with column, name and unit.")
    for what, those in (("column", columns), ("channel", names)):
        twice = sorted({t for t in those if those.count(t) > 1})
        if twice:
            raise BadInput(f"a {what} is mapped twice: {some_of(twice)}", remedy="Map it once.")
    if entry.euler:
        si_factor(entry.euler.unit, "rad")
    if entry.attitude and entry.attitude.frame == "lvlh" and entry.orbit is None:
        raise BadInput("an attitude in LVLH needs the orbit", remedy="Add [orbit] with position and velocity columns.")
    for use in _uses(entry, {c: 0 for c in columns}):
        to_si(use.name, use.unit)


def _check_time(time: TimeColumn) -> None:
    """One way of telling the time, in a known form."""
    if sum((time.column is not None, bool(time.columns), bool(time.rate))) != 1:
        raise BadInput(
            "[time] needs one of column, columns and rate",
            remedy='Write column = "T", columns = ["WEEK", "TOW"], or rate = "4 Hz" where the file has no times.',
        )
    if scale_called(time.format) is None:
        raise BadInput(
            f"the time format {time.format[:60]!r} is not known",
            remedy="Write one of s, ms, us, ns, min, h, d, utc, gps s, et s, unix s, unix ms, mjd, jd, or a pattern as '%d.%m.%Y %H:%M:%S'.",
        )
    unknown = [u for u in time.units if part_unit(u) is None]
    if unknown or (time.units and len(time.units) != len(time.columns)):
        raise BadInput(
            "units under [time] must give a unit of time for each of columns",
            remedy="Write s, ms, us, ns, min, h, d, week, or a multiple as '1e-9 s' for each.",
        )
    for text, unit in ((time.cadence, "s"), (time.rate, "Hz")):
        if text and not quantity(text, unit) > 0:
            raise BadInput(f"{text!r} under [time] must be positive", remedy=f'Write it as in "0.25 {unit}".')


def _uses(entry: ChannelDictionary, at: dict[str, int]) -> list[Use]:
    """The columns present in one table, as channels in their units."""
    uses = []
    for c in entry.channel:
        if c.column not in at:
            continue
        unit, scale, offset, size = c.unit, c.scale, c.offset, 0.0
        si = kind_of(c.name).unit
        if c.count:
            size = quantity(c.count, si)
        if c.unit == "count" and si != "":
            if not size:
                raise BadInput(
                    "cells in counts need the size of one count",
                    channel=c.name,
                    remedy='Add count = "0.4 rpm", with a unit.',
                )
            unit, scale, offset = si, scale * size, offset * size
        wrap = 0.0
        if c.wrap:
            number, _, wrap_unit = c.wrap.strip().partition(" ")
            # a modulus in counts is one of cells: it scales as they do
            counts = wrap_unit.strip() in ("count", "counts")
            wrap = abs(scale) * to_si(c.name, unit)[0] * quantity(number, "") if counts else quantity(c.wrap, si)
            if not wrap > 0:
                raise BadInput(
                    "the modulus of a wrap must be positive",
                    channel=c.name,
                    remedy='Write wrap = "65536 count" or "360 deg".',
                )
        uses.append(Use(at[c.column], c.name, unit, scale, offset, size, wrap, c.fill, _range(c, si)))
    if entry.orbit:
        for stem, columns, unit in (
            ("orbit_position", entry.orbit.position, entry.orbit.position_unit),
            ("orbit_velocity", entry.orbit.velocity, entry.orbit.velocity_unit),
        ):
            uses += [Use(at[c], f"{stem}_{a}", unit) for c, a in zip(columns, AXES, strict=True) if c in at]
    return uses


def _range(entry: ChannelEntry, si: str) -> tuple[float, float] | None:
    """The range of measurements, SI."""
    if not entry.valid:
        return None
    if len(entry.valid) == 2:
        low, high = (quantity(text, si) for text in entry.valid)
        if low < high:
            return low, high
    raise BadInput(
        "valid needs two values, the lower first", channel=entry.name, remedy='Write valid = ["-6000 rpm", "6000 rpm"].'
    )


def translated(tables: list[Table] | list[TextFile], entry: ChannelDictionary) -> Read:
    """The tables' columns as channels in house names, units and conventions.

    Raises BadInput for a column of the dictionary that no table has."""
    if entry.long:
        tables = [part for t in tables for part in _divided(t.whole(), entry.time, entry.long)]
    missing = _wanted(entry) - {n for t in tables for n in _columns_of(t)}
    if missing:
        there = dict.fromkeys(h for t in tables for h in t.headings)
        raise BadInput(
            f"columns of the dictionary are not in the file: {some_of(sorted(missing))}",
            remedy=f"The file's columns: {some_of(there)}.",
        )
    parts: list[Part] = []
    ignored: list[str] = []
    for table in tables:
        at = _columns_of(table)
        if not all(c in at for c in entry.time.named):
            continue
        clocks = [at[c] for c in entry.time.labels if c in at]
        attitude = [at[c] for c in entry.attitude.columns if c in at] if entry.attitude else []
        parts.append(Part(table, entry.time.clock(at), _uses(entry, at), clocks).parsed(attitude))
        known = _wanted(entry)
        ignored += [h for h in table.headings if not {h, _bare(h)} & known]
    elapsed = all(not p.clock.scale.dated for p in parts)
    read = assembled(parts, entry.time.epoch if elapsed else None, alone=entry.attitude is None)
    if entry.attitude:
        _add_attitude(read, parts, entry.attitude)
    read.findings += [f for t in tables for f in _contradicted(t, entry, read.epoch_ns)]
    if ignored:
        detail = f"columns the dictionary does not mention: {some_of(dict.fromkeys(ignored))}"
        read.findings.append(Finding("", "ignored", len(set(ignored)), read.epoch_ns, detail))
    return read


def _contradicted(table: Table | TextFile, entry: ChannelDictionary, epoch_ns: int) -> list[Finding]:
    """Columns whose heading names another unit than the dictionary, which scales them by nothing else."""
    split = {h: split_header(h) or (h, None) for h in table.headings}
    headed = {h: unit for h, (_, unit) in split.items()} | {
        name: unit for name, unit in split.values() if unit is not None
    }
    found = []
    for c in entry.channel:
        unit = headed.get(c.column)
        if unit and c.scale == 1 and c.offset == 0 and not c.count and is_unit(unit) and _differ(c.name, unit, c.unit):
            detail = f"the heading of {c.column!r} says [{unit}], the channel dictionary [{c.unit}]; the dictionary was followed"
            found.append(Finding(c.name, "unit", 1, epoch_ns, detail))
    time, scale = entry.time, scale_called(entry.time.format)
    heading = scale_called(headed.get(time.column or "") or "")
    if (
        scale is not None
        and heading is not None
        and time.scale == 1
        and (heading.unit != scale.unit or (heading.dated and heading != scale))
    ):
        detail = f"the heading of {time.column!r} says [{heading.unit if heading.numeric else heading.kind}], the channel dictionary {time.format!r}; the dictionary was followed"
        found.append(Finding("", "unit", 1, epoch_ns, detail))
    return found


def _differ(name: str, one: str, other: str) -> bool:
    try:
        return to_si(name, one) != to_si(name, other)
    except BadInput:
        return True


def _wanted(entry: ChannelDictionary) -> set[str]:
    wanted = {c.column for c in entry.channel} | {*entry.time.named, *entry.time.labels}
    if entry.attitude:
        wanted |= set(entry.attitude.columns)
    if entry.orbit:
        wanted |= {*entry.orbit.position, *entry.orbit.velocity}
    return wanted


def _columns_of(table: Table | TextFile) -> dict[str, int]:
    """Where each column stands, by its heading as written or without its unit."""
    bare = {_bare(h): j for j, h in enumerate(table.headings)}
    return bare | {h: j for j, h in enumerate(table.headings)}


def _bare(heading: str) -> str:
    return (split_header(heading) or (heading,))[0]


def _divided(table: Table, time: TimeColumn, long: LongEntry) -> list[Table]:
    at = _columns_of(table)
    if len(time.named) != 1:
        raise BadInput("a long table needs one time column", remedy="Give column under [time].")
    absent = [c for c in (time.named[0], long.channel, long.value) if c not in at]
    if absent:
        raise BadInput(
            f"columns of the dictionary are not in the file: {some_of(absent)}",
            remedy=f"The file's columns: {some_of(table.headings)}.",
        )
    return divided(table, at[time.named[0]], at[long.channel], at[long.value], None)


# ---- the attitude -------------------------------------------------------------------------------


def _add_attitude(read: Read, parts: list[Part], said: QuaternionEntry | EulerEntry) -> None:
    """The attitude in house convention, and what it would be under the other readings (for ``attitude``)."""
    tai_ns, q = _raw(read, parts, said)
    frame = None
    if said.frame == "lvlh":
        known, frame = _frame_at(read.channels, tai_ns)
        if not known.all():
            first = int(tai_ns[~known][0])
            read.findings.append(
                Finding(
                    "quaternion_w",
                    "orbit",
                    int((~known).sum()),
                    first,
                    "quaternions at times without orbit data, left out",
                )
            )
        if not known.any():
            raise BadInput(
                "orbit and quaternion are never known at the same time", channel="quaternion", remedy="Check [orbit]."
            )
        tai_ns, q = tai_ns[known], q[known]

    def inertial(**other):
        house = said.house(q, **other)
        return house if frame is None else quaternion(frame * rotation(house)) * np.linalg.norm(house, axis=1)[:, None]

    house = inertial()
    for j, m in enumerate("wxyz"):
        read.channels[f"quaternion_{m}"] = Channel(f"quaternion_{m}", tai_ns, house[:, j], np.ones(len(q), bool))
    other_way = "frame-to-body" if said.direction == "body-to-frame" else "body-to-frame"
    if isinstance(said, EulerEntry):
        other_order = said.order.swapcase()
    else:
        other_order = "scalar-last" if said.order == "scalar-first" else "scalar-first"
    read.readings = {
        f'direction = "{other_way}"': (tai_ns, inertial(turned=True)),
        f'order = "{other_order}"': (tai_ns, inertial(reordered=True)),
        f'direction = "{other_way}" and order = "{other_order}"': (tai_ns, inertial(turned=True, reordered=True)),
    }


def _raw(read: Read, parts: list[Part], said: QuaternionEntry | EulerEntry) -> tuple[np.ndarray, np.ndarray]:
    """Instants at which all its columns were sampled, and their numbers as written."""
    names, found = said.columns, {}
    for part, tai_ns in zip(parts, read.row_times_ns, strict=True):
        table = part.table.whole()
        at = _columns_of(table)
        for c in names:
            if c not in at:
                continue
            rows, values, _ = numbers_of(table, at[c], c)
            found[c] = (tai_ns[rows], values)
    columns = [found[c] for c in names]
    common = columns[0][0]
    for t, _ in columns[1:]:
        common = np.intersect1d(common, t)
    if len(common) == 0:
        raise BadInput(
            "the columns of the attitude have no common sample",
            channel="quaternion",
            remedy="Check [quaternion] or [euler].",
        )
    # file order is kept, so that disorder and duplicates are seen by the screening
    kept = [(t[np.isin(t, common)], v[np.isin(t, common)]) for t, v in columns]
    if any(len(t) != len(kept[0][0]) or (t != kept[0][0]).any() for t, _ in kept):
        once = [np.unique(t, return_index=True) for t, _ in kept]
        return once[0][0], np.stack([v[i] for (_, i), (_, v) in zip(once, kept, strict=True)], axis=1)
    q = np.stack([v for _, v in kept], axis=1)
    if isinstance(said, EulerEntry):
        return kept[0][0], q
    whole = np.linalg.norm(q, axis=1) * said.scale > 0.5  # a quaternion of zeros is an unfilled packet
    if not whole.all():
        first = int(kept[0][0][~whole][0])
        read.findings.append(
            Finding("quaternion_w", "norm", int((~whole).sum()), first, "quaternions of zeros, left out")
        )
    if not whole.any():
        raise BadInput("every quaternion is zero", channel="quaternion", remedy="Check [quaternion].")
    return kept[0][0][whole], q[whole]


#: Orbit angle between known positions: a cubic with given slopes errs by (angle)^4 / 384, here 3e-7.
_WIDEST_STEP_RAD = 0.1


def _moves_as_it_says(t, r, v) -> np.ndarray:
    """Samples whose position agrees with its neighbours' and the velocity to 5 %; others have a wrong time."""
    dt = np.diff(t)[:, None]
    miss = np.linalg.norm(np.diff(r, axis=0) - dt * (v[:-1] + v[1:]) / 2, axis=1)
    way = dt[:, 0] * np.linalg.norm(v[1:], axis=1)
    far = np.linalg.norm(np.diff(r, axis=0), axis=1) > 0.5 * np.linalg.norm(
        r[1:], axis=1
    )  # too far apart to be tested by a chord
    fits = np.concatenate(([True], (miss < 0.05 * way) | far, [True]))
    return fits[:-1] & fits[1:]


def _frame_at(channels: dict[str, Channel], tai_ns: np.ndarray):
    """LVLH to inertial at the attitude's instants: (known (N,), rotation of the known ones)."""
    from scipy.interpolate import CubicHermiteSpline

    parts = [channels[f"orbit_{p}_{a}"] for p in ("position", "velocity") for a in AXES]
    common = parts[0].tai_ns
    for p in parts[1:]:
        common = np.intersect1d(common, p.tai_ns)
    columns = []
    for p in parts:
        order = np.unique(p.tai_ns, return_index=True)
        columns.append(p.values[order[1][np.isin(order[0], common)]])
    state = np.stack(columns, axis=1)
    fresh = np.concatenate(([True], np.any(np.diff(state, axis=0) != 0, axis=1)))  # a repeated position is stale
    at, state = common[fresh], state[fresh]
    sound = _moves_as_it_says((at - at[:1]) / NS, state[:, :3], state[:, 3:])
    at, r, v = at[sound], state[sound, :3], state[sound, 3:]
    if len(at) < 2:
        raise BadInput(
            "the orbit position does not change as its velocity predicts",
            channel="orbit_position",
            remedy="Check position_unit and velocity_unit in [orbit], and that both are in inertial axes.",
        )
    t0 = at[0]
    after = np.clip(np.searchsorted(at, tai_ns), 1, len(at) - 1)
    step = (at[after] - at[after - 1]) / NS
    turned = step * np.linalg.norm(v[after], axis=1) / np.linalg.norm(r[after], axis=1)
    known = (tai_ns >= at[0]) & (tai_ns <= at[-1]) & (turned < _WIDEST_STEP_RAD)
    if not known.any():
        return known, None
    # slopes: velocity, and the acceleration of a circular orbit
    pull = -r * (np.sum(v**2, axis=1) / np.sum(r**2, axis=1))[:, None]
    x, s = (at - t0) / NS, (tai_ns[known] - t0) / NS
    return known, lvlh_to_inertial(CubicHermiteSpline(x, r, v)(s), CubicHermiteSpline(x, v, pull)(s))
