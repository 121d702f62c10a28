"""Where a trend store lies: a path or a URL, how it is opened, and its error messages."""

from __future__ import annotations

import os
import re
import sqlite3
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, create_engine, event, func, select, text
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError
from sqlalchemy.pool import QueuePool

from ...kit.errors import BadInput
from ...kit.files import check_place

if TYPE_CHECKING:
    from collections.abc import Iterator

#: How long to wait for another process that writes. [s]
BUSY_S = 60.0
#: How long to wait for a server to answer. [s]
CONNECT_S = 10
#: PostgreSQL's advisory lock of everyone who adds or migrates.
_LOCK = int.from_bytes(b"asflown", "big")
_FORMS = "Name a file, sqlite:///FILE or postgresql://USER@HOST/DATABASE."
_POSTGRESQL = ("postgresql", "postgres", "postgresql+psycopg")
#: A URL with a slash lost, as in Path("postgresql://…"): as a path it would become a folder named by the password.
_NEARLY_URL = re.compile(r"(sqlite|postgres(ql)?)(\+\w+)?:(?!//)")
#: Part of SQLite's or PostgreSQL's message -> remedy.
_REMEDIES = {
    "not a database": "Name another file, or a new one: this one is not SQLite.",
    "malformed": "The file is damaged: restore it from a backup.",
    "lock timeout": "Another program holds it: let that finish, then try again.",
    "locked": "Another program holds it: let that finish, then try again.",
    "is full": "Make room on the disk, then try again: nothing of this entry was kept.",
    "readonly": "Copy the store to a place you may write to.",
    "read-only": "Copy the store to a place you may write to.",
    "permission denied": "Ask for the rights to create, read and insert there.",
    "unable to open": "Check the path, and the right to read and write there: SQLite writes further files to the same folder.",
    "no schema has been selected": "Create the schema that search_path names.",
}


def url_of(place: str | Path) -> URL:
    """A bare path means SQLite.  Raises BadInput, which never repeats what may hold a password."""
    name = str(place)
    if not name or name == ":memory:":
        raise BadInput("no path or URL of the trend store is given", remedy=_FORMS)
    if _NEARLY_URL.match(name):
        raise BadInput("this URL lacks its //", remedy=_FORMS)
    if "://" not in name:
        return URL.create("sqlite", database=name)
    scheme = name.split("://")[0]
    try:
        url = make_url(name)
    except (ArgumentError, ValueError):
        raise BadInput(f"a URL that cannot be read ({scheme}://…)", remedy=_FORMS) from None
    if "@" in (url.host or ""):
        raise BadInput(f"a URL that cannot be read ({scheme}://…)", remedy="Write an @ in the password as %40.")
    if scheme in _POSTGRESQL:
        return url.set(drivername="postgresql+psycopg")
    if scheme != "sqlite":
        raise BadInput(f"a trend store cannot be kept in {scheme!r}", remedy=_FORMS)
    if url.database in (None, "", ":memory:") or url.host or url.query:
        raise BadInput(f"{label(url)} names no file", remedy=_FORMS)
    return url


def label(url: URL) -> str:
    """The place in a message: a path, or a URL without password and options."""
    if url.drivername == "sqlite":
        return str(url.database)
    return url.set(drivername="postgresql", password=None, query={}).render_as_string()


def reach(url: URL, *, create: bool) -> tuple[Engine, Engine]:
    """Engines to read and to write with, on one pool.  ``create`` False: the file must be there."""
    return _sqlite(url, create=create) if url.drivername == "sqlite" else _postgresql(url)


@contextmanager
def plainly(url: URL) -> Iterator[None]:
    """Errors of the database, as BadInput."""
    try:
        yield
    except ArgumentError as why:  # of the URL's options
        raise BadInput(f"trend store: {why}", file=label(url), remedy=_FORMS) from None
    except (DBAPIError, sqlite3.Error) as why:
        said = str(getattr(why, "orig", why)).strip().splitlines() or [type(why).__name__]
        what = said[0]
        if url.password:
            what = what.replace(str(url.password), "***")
        remedy = next((r for known, r in _REMEDIES.items() if known in what), None)
        if remedy is None:
            remedy = (
                "Check the path." if url.drivername == "sqlite" else "Check the server, and user, password and database of the URL."
            )  # fmt: skip
        raise BadInput(f"trend store: {what}", file=label(url), remedy=remedy) from None


def switch_to_wal(engine: Engine) -> None:
    """Readers and one writer at once; kept by the file.  Only for a file that is a trend store."""
    raw = engine.raw_connection()
    until = time.monotonic() + BUSY_S
    try:
        while True:
            try:
                raw.cursor().execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.OperationalError as why:  # this pragma does not wait for a lock
                if "locked" not in str(why) or time.monotonic() > until:
                    raise
                time.sleep(0.02)
    finally:
        raw.close()


def wait_for_turn(connection: Connection) -> None:
    """The only writer until the transaction ends; in SQLite BEGIN IMMEDIATE ensures it."""
    if connection.dialect.name == "postgresql":
        connection.execute(text(f"SET LOCAL lock_timeout = '{BUSY_S:g}s'"))
        connection.execute(select(func.pg_advisory_xact_lock(_LOCK)))


def _sqlite(url: URL, *, create: bool) -> tuple[Engine, Engine]:
    path = Path(os.path.realpath(str(url.database)))
    if create:
        check_place(path)
        path.parent.mkdir(parents=True, exist_ok=True)
    elif not os.path.isfile(path):  # unlike Path.is_file, never raises
        raise BadInput("there is no trend store", file=path, remedy="Check the path; `asflown trend add` makes one.")
    writable = os.access(path, os.W_OK) or not os.path.exists(path)
    if create and not writable:
        raise BadInput("cannot be written", file=path, remedy=_REMEDIES["readonly"])
    mode = "mode=rwc" if create else "mode=rw"
    if not (writable and os.access(path.parent, os.W_OK)):
        # In a folder that cannot be written, SQLite cannot make the files beside a store in WAL mode;
        # without such a file no process is writing, and the store may be read as it is.
        mode = "mode=ro" if os.path.exists(f"{path}-wal") else "mode=ro&immutable=1"

    def connect() -> sqlite3.Connection:
        db = sqlite3.connect(
            f"{path.as_uri()}?{mode}", uri=True, timeout=BUSY_S, isolation_level=None, check_same_thread=False
        )
        try:
            db.execute("PRAGMA synchronous = FULL")  # a commit is on the disk before it is reported
            db.execute("PRAGMA foreign_keys = ON")
        except sqlite3.Error:
            db.close()
            raise
        return db

    engine = create_engine("sqlite://", creator=connect, poolclass=QueuePool)
    event.listen(engine, "begin", _begin)
    return engine, engine.execution_options(asflown_begin="BEGIN IMMEDIATE")


def _begin(connection) -> None:
    # Python's own transactions begin too late: two writers would both read the same last revision.
    connection.exec_driver_sql(connection.get_execution_options().get("asflown_begin", "BEGIN"))


def _postgresql(url: URL) -> tuple[Engine, Engine]:
    waits = {} if "connect_timeout" in url.query else {"connect_timeout": CONNECT_S}
    try:
        engine = create_engine(url, connect_args=waits, pool_pre_ping=True)
    except ImportError:
        raise BadInput(
            "PostgreSQL needs the package psycopg, which is not installed",
            file=label(url),
            remedy="Install it: pip install 'asflown[postgresql]'.",
        ) from None
    reading = engine.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)
    return reading, engine.execution_options(isolation_level="READ COMMITTED")
