"""The trend store: results of every actuation, kept for years and never changed."""

from __future__ import annotations

import io
import re
import threading
import zipfile
import zlib
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from sqlalchemy import Connection, Engine, exists, func, insert, inspect, select, text

from ...kit.doubts import Doubts, doubt_from
from ...kit.errors import BadInput, some_of
from ...kit.plain import finite, plain
from ..entry import Curve, Entry, Value
from .place import label, plainly, reach, switch_to_wal, url_of, wait_for_turn
from .schema import CURVE, ENTRY, HEAD, VALUE, VERSION_TABLE

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from sqlalchemy.engine import URL

#: alembic keeps its context in module globals.
_MIGRATING = threading.Lock()
_ALEMBIC = "asflown.trends.store:migrations"
_DATE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d")


class TrendStore:
    """Entries in SQLite or PostgreSQL.  It only grows: an event analysed again gets a further revision."""

    def __init__(self, url: URL, reading: Engine, writing: Engine):
        self._url, self._reading, self._writing = url, reading, writing

    @classmethod
    def open(cls, url: str | Path, *, create: bool = True) -> TrendStore:
        """Open a store, and bring its schema up to date.

        Parameters
        ----------
        url : str or Path
            A path (SQLite), sqlite:///FILE or postgresql://USER@HOST/DATABASE.
        create : bool
            True: create the store where there is none, and require that it can be written.  False: for reading; the store
            must exist, and nothing is written where its schema is current.

        Returns
        -------
        TrendStore
            A context manager; ``close`` it, or use ``with``.

        Raises
        ------
        BadInput
            Where there is no store, it cannot be reached or used, or (``create``) cannot be written.
        """
        place = url_of(url)
        with plainly(place):
            store = cls(place, *reach(place, create=create))
        try:
            with plainly(place):
                with store._reading.connect() as connection:
                    version = store._version(connection)
                if version != HEAD:
                    store._migrate(version, create=create)
                elif create:
                    store._check_writable()
        except BaseException:
            store.close()
            raise
        return store

    def close(self) -> None:
        self._reading.dispose()

    def __enter__(self) -> TrendStore:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def __str__(self) -> str:
        return label(self._url)

    def add(self, entries: Entry | Iterable[Entry]) -> list[Entry]:
        """Add entries; an event that is there already gets a further revision.

        Each entry is stored completely or not at all, and is on the disk before the next is begun.

        Parameters
        ----------
        entries : Entry or iterable of Entry
            Values that are not finite are stored as None.

        Returns
        -------
        list of Entry
            The same, with their ``revision`` and ``added`` (UTC).

        Raises
        ------
        BadInput
            Before anything is stored, where an entry contradicts itself; and where the store cannot be written.
        """
        ready = [_ready(e) for e in ([entries] if isinstance(entries, Entry) else entries)]
        with plainly(self._url):
            return [self._add(e) for e in ready]

    def entries(
        self,
        craft: str | None = None,
        *,
        kind: str | None = None,
        event: str | None = None,
        revisions: Literal["latest", "all"] = "latest",
        curves: bool = False,
    ) -> list[Entry]:
        """Entries in order of date, event and revision.

        Parameters
        ----------
        craft, kind, event : str, optional
            Only entries of this craft, kind and event.  The kind is that of the chosen revisions.
        revisions : {'latest', 'all'}
            The latest of every event, or all.
        curves : bool
            Whether to read the curves as well.

        Returns
        -------
        list of Entry
            An event without telemetry has no values.

        Raises
        ------
        BadInput
            Where the store cannot be read or a curve is damaged.
        ValueError
            For another value of ``revisions``.
        """
        query = select(ENTRY)
        for column, wanted in ((ENTRY.c.craft, craft), (ENTRY.c.kind, kind), (ENTRY.c.event, event)):
            if wanted is not None:
                query = query.where(column == wanted)
        if revisions == "latest":
            later = ENTRY.alias("later")
            same = (later.c.craft == ENTRY.c.craft) & (later.c.event == ENTRY.c.event)
            query = query.where(~exists().where(same & (later.c.revision > ENTRY.c.revision)))
        elif revisions != "all":
            raise ValueError(f"revisions is 'latest' or 'all', not {revisions!r}")
        chosen = query.with_only_columns(ENTRY.c.id)
        with plainly(self._url), self._reading.connect() as connection:
            rows = connection.execute(query).all()
            values: dict[int, list[Value]] = {row.id: [] for row in rows}
            for v in connection.execute(_of(VALUE, chosen)):
                values[v.entry_id].append(Value(v.figure, v.basis, v.value, v.sigma, v.unit))
            drawn: dict[int, list[Curve]] = {row.id: [] for row in rows}
            for c in connection.execute(_of(CURVE, chosen)) if curves else ():
                drawn[c.entry_id].append(self._curve(c))
        found = [
            Entry(
                r.craft, r.event, r.kind, r.date, r.motor, r.note, tuple(values[r.id]), tuple(drawn[r.id]),
                _doubts(r), r.provenance, r.revision, r.added,
            ) for r in rows
        ]  # fmt: skip
        # Sorted here and not in the database, whose collation depends on its set-up.
        return sorted(found, key=lambda e: (e.date, e.event, e.revision, e.craft))

    def crafts(self) -> list[str]:
        """Names of the crafts with entries."""
        with plainly(self._url), self._reading.connect() as connection:
            return sorted(connection.scalars(select(ENTRY.c.craft).distinct()))

    def _add(self, entry: Entry) -> Entry:
        with self._writing.begin() as connection:
            wait_for_turn(connection)
            same = (ENTRY.c.craft == entry.craft) & (ENTRY.c.event == entry.event)
            last = connection.scalar(select(func.max(ENTRY.c.revision)).where(same))
            added = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
            entry = replace(entry, revision=(last or 0) + 1, added=added)
            row = {c.name: getattr(entry, c.name) for c in ENTRY.c if c.name not in ("id", "doubts", "doubts_detail")}
            row |= plain(entry.doubts.record())
            (key,) = connection.execute(insert(ENTRY).values(row)).inserted_primary_key or ()
            if entry.values:
                rows = [{"entry_id": key, "place": i, **vars(v)} for i, v in enumerate(entry.values)]
                connection.execute(insert(VALUE), rows)
            for i, c in enumerate(entry.curves):
                of_curve = {"entry_id": key, "place": i, "name": c.name, "unit": c.unit, "data": _packed(c)}
                connection.execute(insert(CURVE).values(of_curve))
        return entry

    def _version(self, connection: Connection) -> str | None:
        """The schema's version; None where the database is empty."""
        tables = inspect(connection).get_table_names()
        if VERSION_TABLE in tables:
            return connection.scalar(text(f"SELECT version_num FROM {VERSION_TABLE}")) or "none"
        if tables:
            raise BadInput(
                f"a database, but not a trend store: its tables are {some_of(tables, 5)}",
                file=self,
                remedy="Name an empty database (or schema) or a new file.",
            )
        return None

    def _migrate(self, version: str | None, *, create: bool) -> None:
        if version is None and not create:
            raise BadInput("there is no trend store", file=self, remedy="`asflown trend add` makes one.")
        from alembic import command
        from alembic.config import Config
        from alembic.script import ScriptDirectory

        config = Config()
        config.set_main_option("script_location", _ALEMBIC)
        known = {r.revision for r in ScriptDirectory.from_config(config).walk_revisions()}
        if version is not None and version not in known:
            raise BadInput(
                f"written by a newer asflown: its schema is {version}, this one knows {HEAD}",
                file=self,
                remedy="Upgrade asflown.",
            )
        if version is None and self._url.drivername == "sqlite":
            switch_to_wal(self._writing)
        with _MIGRATING, self._writing.begin() as connection:
            wait_for_turn(connection)
            config.attributes.update(connection=connection, version_table=VERSION_TABLE)
            command.upgrade(config, "head")  # does nothing where another process has done it

    def _check_writable(self) -> None:
        if self._url.drivername == "sqlite":  # reach() has looked; a copy by VACUUM INTO has lost its WAL mode
            switch_to_wal(self._writing)
            return
        with self._writing.connect() as connection:
            may = connection.scalar(select(func.has_table_privilege("entry", "INSERT")))
            if not may or connection.scalar(text("SHOW transaction_read_only")) == "on":
                raise BadInput("can be read but not written", file=self, remedy="Ask for the right to insert into it.")

    def _curve(self, row) -> Curve:
        try:
            with np.load(io.BytesIO(row.data), allow_pickle=False) as arrays:
                return Curve(row.name, row.unit, arrays["time_s"], arrays["values"], arrays.get("sigma"))
        except (ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
            raise BadInput(
                f"curve {row.name!r} is damaged", file=self, remedy="Restore the store from a backup."
            ) from None


def _doubts(row) -> Doubts:
    """Doubts of a kept entry; those of earlier versions are sentences of unknown kind."""
    return Doubts(row.doubts if row.doubts_detail is None else map(doubt_from, row.doubts_detail))


def _of(table, chosen):
    return select(table).where(table.c.entry_id.in_(chosen)).order_by(table.c.entry_id, table.c.place)


def _packed(curve: Curve) -> bytes:
    """An .npz file: self-describing, compressed, and exact for float64."""
    given = {"time_s": curve.time_s, "values": curve.values, "sigma": curve.sigma}
    arrays: dict[str, Any] = {k: np.asarray(a, "<f8") for k, a in given.items() if a is not None}
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _ready(entry: Entry) -> Entry:
    """The entry as it will be kept.  Raises BadInput where it contradicts itself or cannot be stored."""
    where = f"entry {entry.event!r} of {entry.craft!r}"
    names = [f"figure {v.figure} ({v.basis})" for v in entry.values] + [f"curve {c.name}" for c in entry.curves]
    twice = next((n for n in names if names.count(n) > 1), None)
    if twice is not None:
        raise BadInput(f"{where} has the {twice} twice", remedy="Give each once.")
    for c in entry.curves:
        shapes = {np.shape(a) for a in (c.time_s, c.values, c.sigma) if a is not None}
        if len(shapes) > 1 or len(next(iter(shapes))) != 1:
            raise BadInput(
                f"{where}: the arrays of curve {c.name!r} differ in shape", remedy="Give time, values and sigma (N,)."
            )
    texts = [entry.craft, entry.event, entry.kind, entry.date, entry.motor or "", entry.note, *entry.doubts.sentences()]
    texts += [t for v in entry.values for t in (v.figure, v.basis, v.unit)]
    texts += [t for c in entry.curves for t in (c.name, c.unit)]
    if any("\0" in t or t.encode(errors="ignore").decode() != t for t in texts):
        raise BadInput(
            f"{where} has text that a database cannot store (NUL or an unpaired surrogate)", remedy="Remove it."
        )
    if not (entry.craft and entry.event):
        raise BadInput("an entry without craft or event", remedy="Name both.")
    if not _DATE.fullmatch(entry.date):  # entries are sorted by it
        raise BadInput(f"{where} has the date {entry.date!r}", remedy="Give it in UTC, as 2015-09-29T00:00:00.")
    values = tuple(replace(v, value=finite(v.value), sigma=finite(v.sigma)) for v in entry.values)
    return replace(entry, values=values, doubts=Doubts(entry.doubts), provenance=plain(entry.provenance))
