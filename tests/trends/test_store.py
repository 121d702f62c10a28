"""The trend store, in SQLite and in PostgreSQL: the same laws for both.

PostgreSQL: a server's URL in ASFLOWN_TEST_POSTGRESQL, whose user may make schemas and roles; .ci/run starts one."""

import hashlib
import os
import random
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine, event, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import DBAPIError

from asflown.kit.doubts import Doubts
from asflown.kit.errors import BadInput
from asflown.trends.entry import Curve, Entry, Value
from asflown.trends.store import place
from asflown.trends.store.schema import HEAD, METADATA, VERSION_TABLE
from asflown.trends.store.store import TrendStore
from trends.writer import CURVES, VALUES, entry

SERVER = os.environ.get("ASFLOWN_TEST_POSTGRESQL")
WRITER = Path(__file__).with_name("writer.py")


def admin():
    return create_engine(make_url(SERVER).set(drivername="postgresql+psycopg"), isolation_level="AUTOCOMMIT")


@pytest.fixture
def server():
    """Makes an empty schema of its own, and gives its URL."""
    if not SERVER:
        pytest.skip("no PostgreSQL server (set ASFLOWN_TEST_POSTGRESQL to its URL)")
    made, engine = [], admin()

    def fresh() -> str:
        made.append(f"asflown_test_{uuid4().hex}")
        with engine.connect() as c:
            c.execute(text(f"CREATE SCHEMA {made[-1]}"))
        url = make_url(SERVER).update_query_dict({"options": f"-csearch_path={made[-1]}"})
        return url.render_as_string(hide_password=False)

    yield fresh
    with engine.connect() as c:
        for schema in made:
            c.execute(text(f"DROP SCHEMA {schema} CASCADE"))
    engine.dispose()


@pytest.fixture(params=["sqlite", "postgresql"])
def fresh(request, tmp_path):
    """Gives, each time it is called, the place of a store that is not there yet."""
    if request.param == "postgresql":
        return request.getfixturevalue("server")
    return lambda: str(tmp_path / f"{uuid4().hex}.db")


@pytest.fixture
def url(fresh):
    return fresh()


@contextmanager
def raw(url):
    """A connection to the store's database, past the store."""
    _, writing = place.reach(place.url_of(url), create=False)
    try:
        with writing.connect() as connection:
            yield connection
    finally:
        writing.dispose()


def writer(*arguments) -> subprocess.Popen:
    source = Path(__file__).resolve().parents[2] / "src"
    return subprocess.Popen(
        [sys.executable, str(WRITER), *map(str, arguments)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": str(source), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip


def killed(process: subprocess.Popen) -> list[str]:
    """Killed as by a power cut; what it had said and nobody read yet."""
    process.kill()
    with process:  # not communicate(), which overlooks what readline() has fetched already
        said = process.stdout.read()
    return said[: said.rfind("\n") + 1].split()  # a word cut short was not said


def wait_for_writers(store) -> None:
    """A server may still be finishing the commit of a process that is gone."""
    with store._writing.begin() as connection:
        place.wait_for_turn(connection)


def is_whole(e: Entry) -> bool:
    return len(e.values) == VALUES and len(e.curves) == CURVES and all(len(c.values) == 400 for c in e.curves)


# ---- what is kept


def test_law_what_is_added_comes_back(url):
    t = np.array([-1.0, 0.0, 0.1, 5e-324])
    curves = (
        Curve("torque, fused", "N m", t, np.array([np.nan, 1 / 3, -0.0, 1e300]), np.array([np.nan, 0.1, 0.2, np.inf])),
        Curve("motor_current", "A", t[:0], t[:0]),
    )
    values = (
        Value("peak", "fused", 1 / 3, None, "N m"),
        Value("peak", "momentum, printed", None, 0.25, "N m"),
        Value("impulse", "telemetry", -5e-324, 1e300, "N m s"),
    )
    first = Entry(
        "cassini", "deploy 1", "deploy", "2005-01-01T00:00:00", "A", "noted: ±1 µN·m, 'quoted'; %s", values, curves,
        ("one doubt", "τ is off"), {"inputs": [{"file": "a.csv", "sha256": "0" * 64}], "seed": 7, "none": None},
    )  # fmt: skip
    with TrendStore.open(url) as store:
        added = store.add(first)
    with TrendStore.open(url, create=False) as store:
        (kept,) = store.entries(curves=True)
    assert replace(kept, curves=(), revision=None, added=None) == replace(first, curves=())
    assert (kept.revision, kept.added) == (added[0].revision, added[0].added) == (1, kept.added)
    assert abs(replace(kept, date=kept.added).day * 86400 + 946684800 - time.time()) < 60  # s
    for was, now in zip(curves, kept.curves, strict=True):
        assert (was.name, was.unit) == (now.name, now.unit)
        for a, b in ((was.time_s, now.time_s), (was.values, now.values), (was.sigma, now.sigma)):
            assert (a is None and b is None) or a.tobytes() == b.tobytes()  # to the bit, NaN and -0 too


def test_law_numbers_that_are_not_finite_are_kept_as_none(url):
    nan, inf = float("nan"), float("inf")
    odd = Entry(
        "c", "e", "deploy", "2005-01-01T00:00:00", values=(Value("a", "fused", nan, inf, "s"),),
        provenance={"a": nan, "b": [np.float64(inf), np.int64(3), np.arange(2)], "path": Path("x/y"), "NUL": "\0"},
    )  # fmt: skip
    with TrendStore.open(url) as store:
        (added,) = store.add([odd])
        (kept,) = store.entries()
    assert kept == added
    assert kept.values == (Value("a", "fused", None, None, "s"),)
    assert kept.provenance == {"a": None, "b": [None, 3, [0, 1]], "path": str(Path("x/y")), "NUL": "\0"}


def test_law_an_event_analysed_again_is_a_further_revision(url):
    with TrendStore.open(url) as store:
        assert [e.revision for e in store.add([entry("a"), entry("b"), entry("a")])] == [1, 1, 2]
        assert store.add(replace(entry("a"), craft="juice"))[0].revision == 1
        assert [(e.event, e.revision) for e in store.entries("cassini")] == [("a", 2), ("b", 1)]
        every = store.entries("cassini", revisions="all", curves=True)
        assert [(e.event, e.revision) for e in every] == [("a", 1), ("a", 2), ("b", 1)]
        assert all(is_whole(e) for e in every)
        assert store.crafts() == ["cassini", "juice"]


def test_law_entries_come_in_order_of_date_and_by_what_their_latest_revision_is(url):
    def at(event, date, kind="deploy"):
        return Entry("cassini", event, kind, date)

    with TrendStore.open(url) as store:
        assert store.entries() == [] and store.crafts() == []
        store.add([at("z", "2003-05-01T00:00:00"), at("B", "2004-01-01T00:00:00"), at("a", "2004-01-01T00:00:00")])
        store.add([at("first", "2002-12-31T23:59:60"), at("was a deploy", "2001-01-01T00:00:00")])
        store.add(at("was a deploy", "2001-01-01T00:00:00", "stow"))
        assert [e.event for e in store.entries()] == ["was a deploy", "first", "z", "B", "a"]
        assert [e.event for e in store.entries(kind="deploy")] == ["first", "z", "B", "a"]
        assert [e.event for e in store.entries(kind="stow")] == ["was a deploy"]
        assert [e.kind for e in store.entries(event="was a deploy", revisions="all")] == ["deploy", "stow"]
        assert store.entries("juice") == []
        with pytest.raises(ValueError, match="'latest' or 'all'"):
            store.entries(revisions="newest")


def test_law_curves_stay_in_the_store_unless_asked_for(url):
    said = []
    with TrendStore.open(url) as store:
        store.add(entry("a"))
        event.listen(store._reading, "before_cursor_execute", lambda *a: said.append(a[2]))
        assert store.entries()[0].curves == ()
        assert said and not any("curve" in s for s in said)
        assert len(store.entries(curves=True)[0].curves) == CURVES and any("curve" in s for s in said)


# ---- nothing is changed


@pytest.mark.parametrize("table", ["entry", "value", "curve"])
def test_law_the_database_refuses_change_and_deletion(url, table):
    with TrendStore.open(url) as store:
        store.add(entry("a"))
        before = store.entries(curves=True)
        column = {"entry": "note", "value": "unit", "curve": "unit"}[table]
        orders = [
            f"UPDATE {table} SET {column} = 'x'",
            f"UPDATE {table} SET {column} = {column}",
            f"DELETE FROM {table}",
        ]
        with raw(url) as c:
            columns = ", ".join(f'"{x.name}"' for x in METADATA.tables[table].columns)
            if c.dialect.name == "sqlite":
                orders.append(f"INSERT OR REPLACE INTO {table} ({columns}) SELECT {columns} FROM {table}")
                orders.append(f"DELETE FROM {table} RETURNING 1")
            else:
                key = "id" if table == "entry" else "entry_id, place"
                orders.append(f"TRUNCATE {table} CASCADE")
                orders.append(
                    f"INSERT INTO {table} ({columns}) SELECT {columns} FROM {table} "
                    f"ON CONFLICT ({key}) DO UPDATE SET {column} = 'x'"
                )
            for order in orders:
                with pytest.raises(DBAPIError, match="only grows"):
                    c.execute(text(order))
                c.rollback()
        assert [repr(e) for e in store.entries(curves=True)] == [repr(e) for e in before]


def test_law_a_list_with_one_impossible_entry_keeps_none(url):
    a, t = entry("a"), np.zeros(3)
    impossible = {
        "twice": replace(a, values=a.values + a.values[:1]),
        "curve curve 0 twice": replace(a, curves=a.curves + a.curves[:1]),
        "shape": replace(a, curves=(Curve("c", "s", t, t[:2]),)),
        "differ": replace(a, curves=(Curve("c", "s", t, t, np.zeros((3, 1))),)),
        "NUL": replace(a, note="a\0b"),
        "unpaired surrogate": replace(a, doubts=Doubts(["\ud800"])),
        "without craft or event": replace(a, event=""),
        "the date '2005-001'": replace(a, date="2005-001"),
    }
    with TrendStore.open(url) as store:
        for why, bad in impossible.items():
            with pytest.raises(BadInput, match=why):
                store.add([a, bad])
        assert store.entries(revisions="all") == []


# ---- killed


def test_law_kill_loses_nothing_that_was_acknowledged(url):
    """Eight writers, each killed at a moment of its own."""
    chance, acknowledged = random.Random(1), 0
    for n in range(8):
        process = writer("add", url, "a", n, 0)
        said = [process.stdout.readline().strip()]
        time.sleep(chance.uniform(0, 0.15))
        said += killed(process)
        revisions = [int(word) for word in said]
        assert revisions == list(range(revisions[0], revisions[-1] + 1))
        assert revisions[0] in (acknowledged + 1, acknowledged + 2)  # one may be kept and not yet reported
        acknowledged = revisions[-1]
        with TrendStore.open(url) as store:
            wait_for_writers(store)
            kept = store.entries(revisions="all", curves=True)
        assert [e.revision for e in kept] == list(range(1, len(kept) + 1))
        assert len(kept) in (acknowledged, acknowledged + 1)
        assert all(is_whole(e) for e in kept)
        assert sum(e.note == str(n) for e in kept) in (len(said), len(said) + 1)
    assert acknowledged >= 8
    with raw(url) as c:
        for table, per_entry in (("value", VALUES), ("curve", CURVES)):
            assert c.scalar(text(f"SELECT count(*) FROM {table}")) == per_entry * len(kept)
    with TrendStore.open(url) as store:
        assert store.add(entry("a"))[0].revision == len(kept) + 1


def test_law_killed_inside_a_transaction_leaves_no_half_entry(url):
    with TrendStore.open(url) as store:
        store.add(entry("a"))
        process = writer("halfway", url)
        assert process.stdout.readline() == "halfway\n"
        assert [e.event for e in store.entries()] == ["a"]  # and a reader does not wait
        killed(process)
        assert store.add(entry("b"))[0].revision == 1  # nor is the next writer kept out
    with TrendStore.open(url, create=False) as store:
        kept = store.entries(curves=True)
    assert [e.event for e in kept] == ["a", "b"] and all(is_whole(e) for e in kept)
    with raw(url) as c:
        assert c.scalar(text("SELECT count(*) FROM entry")) == 2
        assert c.scalar(text("SELECT count(*) FROM value")) == 2 * VALUES
        assert c.scalar(text("SELECT count(*) FROM curve")) == 2 * CURVES


def test_law_killed_while_a_store_is_made_it_can_still_be_made(fresh):
    chance = random.Random(2)
    for _ in range(5):
        url, process = fresh(), writer("open")
        process.stdout.readline()
        process.stdin.write(f"{url}\n")
        process.stdin.flush()
        time.sleep(chance.uniform(0, 0.2))
        said = killed(process)
        with TrendStore.open(url) as store:
            assert len(store.entries()) >= len(said)
            assert store.add(entry("after"))[0].revision == 1


# ---- at once


def test_law_four_writers_of_one_event_lose_nothing(url):
    writers = [writer("add", url, "a", n, 25) for n in range(4)]
    said = [[int(x) for x in p.communicate()[0].split()] for p in writers]
    assert [p.returncode for p in writers] == [0] * 4
    assert all(len(s) == 25 and s == sorted(s) for s in said)
    assert sorted(r for s in said for r in s) == list(range(1, 101))
    with TrendStore.open(url, create=False) as store:
        kept = store.entries(revisions="all", curves=True)
    assert [e.revision for e in kept] == list(range(1, 101)) and all(is_whole(e) for e in kept)
    by_revision = {e.revision: e.note for e in kept}
    assert all(by_revision[r] == str(n) for n, s in enumerate(said) for r in s)


def test_law_a_writer_that_never_ends_is_not_waited_for_forever(url, monkeypatch):
    monkeypatch.setattr(place, "BUSY_S", 0.2)
    with TrendStore.open(url) as first, TrendStore.open(url) as second:
        with first._writing.begin() as connection:
            place.wait_for_turn(connection)
            with pytest.raises(BadInput, match=r"lock[\s\S]*Another program holds it"):
                second.add(entry("a"))
            assert second.entries() == []
        assert second.add(entry("a"))[0].revision == 1


def test_law_two_that_open_a_new_store_at_once_both_get_it(fresh):
    writers = [writer("open"), writer("open")]
    try:
        assert [p.stdout.readline() for p in writers] == ["ready\n"] * 2
        for _ in range(15):
            url = fresh()
            for p in writers:
                p.stdin.write(f"{url}\n")
                p.stdin.flush()
            assert sorted(p.stdout.readline() for p in writers) == ["1\n", "2\n"]
    finally:
        for p in writers:
            killed(p)


def test_law_a_new_store_waits_for_whoever_holds_its_file(tmp_path):
    path = tmp_path / "trends.db"
    other = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    other.execute("BEGIN IMMEDIATE")
    letting_go = threading.Timer(0.3, other.rollback)
    letting_go.start()
    with TrendStore.open(path) as store:
        assert store.add(entry("a"))[0].revision == 1
    letting_go.join()
    other.close()


def test_law_sqlite_has_a_commit_on_the_disk_before_it_says_so(tmp_path):
    TrendStore.open(tmp_path / "trends.db").close()
    with raw(tmp_path / "trends.db") as c:
        assert c.scalar(text("PRAGMA journal_mode")) == "wal"
        assert c.scalar(text("PRAGMA synchronous")) == 2  # FULL
        assert c.scalar(text("PRAGMA foreign_keys")) == 1


def test_law_a_copy_made_while_the_store_is_open_is_a_store(tmp_path):
    with TrendStore.open(tmp_path / "trends.db") as store:
        store.add(entry("a"))
        copying = sqlite3.connect(tmp_path / "trends.db")
        copying.execute("VACUUM INTO ?", (str(tmp_path / "copy.db"),))
        copying.close()
        there = store.entries(curves=True)
    with TrendStore.open(tmp_path / "copy.db") as copy:
        assert repr(copy.entries(curves=True)) == repr(there)
        assert copy.add(entry("a"))[0].revision == 2
    with raw(tmp_path / "copy.db") as c:
        assert c.scalar(text("PRAGMA journal_mode")) == "wal"
        with pytest.raises(DBAPIError, match="only grows"):
            c.execute(text("DELETE FROM entry"))


# ---- its schema


def test_law_migrations_from_empty_make_what_the_code_declares(url):
    TrendStore.open(url).close()
    options = {"version_table": VERSION_TABLE, "compare_type": True, "compare_server_default": True}
    with raw(url) as c:
        assert compare_metadata(MigrationContext.configure(c, opts=options), METADATA) == []
        assert c.scalar(text(f"SELECT version_num FROM {VERSION_TABLE}")) == HEAD
    config = Config()
    config.set_main_option("script_location", "asflown.trends.store:migrations")
    assert ScriptDirectory.from_config(config).get_heads() == [HEAD]


def test_law_a_store_of_a_newer_schema_is_left_alone(url):
    TrendStore.open(url).close()
    with raw(url) as c:
        c.execute(text(f"UPDATE {VERSION_TABLE} SET version_num = '9999'"))
        c.commit()
    for create in (True, False):
        with pytest.raises(BadInput, match=r"newer asflown.*9999[\s\S]*Upgrade"):
            TrendStore.open(url, create=create)


def test_law_another_programs_database_is_left_alone(url):
    with raw_empty(url) as c:
        c.execute(text("CREATE TABLE accounts (id INTEGER)"))
        c.commit()
    with pytest.raises(BadInput, match="not a trend store: its tables are accounts"):
        TrendStore.open(url)
    with raw(url) as c:
        assert c.dialect.get_table_names(c) == ["accounts"]


@contextmanager
def raw_empty(url):
    if "://" not in url:
        sqlite3.connect(url).close()
        Path(url).touch()
    with raw(url) as c:
        yield c


# ---- reading


def test_law_reading_makes_nothing_and_changes_nothing(url):
    with pytest.raises(BadInput, match=r"there is no trend store[\s\S]*trend add"):
        TrendStore.open(url, create=False)
    TrendStore.open(url).close()
    if "://" in url:
        return
    assert Path(url).stat().st_size
    before = hashlib.sha256(Path(url).read_bytes()).digest()
    with TrendStore.open(url, create=False) as store:
        assert store.entries() == []
    assert hashlib.sha256(Path(url).read_bytes()).digest() == before
    assert [p.name for p in Path(url).parent.iterdir()] == [Path(url).name]


def test_law_a_store_that_may_not_be_written_can_be_read(tmp_path, monkeypatch):
    path = tmp_path / "trends.db"
    with TrendStore.open(path) as store:
        store.add(entry("a"))
    monkeypatch.setattr(place.os, "access", lambda *_: False)  # chmod does not stop root
    with TrendStore.open(path, create=False) as store:
        assert is_whole(store.entries(curves=True)[0])
        with pytest.raises(BadInput, match=r"readonly[\s\S]*Copy the store"):
            store.add(entry("b"))
    with pytest.raises(BadInput, match="cannot be written"):
        TrendStore.open(path)


def test_law_postgresql_needs_no_more_than_the_right_to_read_or_to_insert(server):
    url, role = server(), f"asflown_test_{uuid4().hex}"
    with TrendStore.open(url) as store:
        store.add(entry("a"))
    schema = make_url(url).query["options"].split("=")[1]
    theirs = make_url(url).set(username=role, password="geheim").render_as_string(hide_password=False)
    engine = admin()
    try:
        with engine.connect() as c:
            c.execute(text(f"CREATE ROLE {role} LOGIN PASSWORD 'geheim'"))
            c.execute(text(f"GRANT USAGE ON SCHEMA {schema} TO {role}"))
            c.execute(text(f"GRANT SELECT ON ALL TABLES IN SCHEMA {schema} TO {role}"))
        with TrendStore.open(theirs, create=False) as store:
            assert is_whole(store.entries(curves=True)[0])
            with pytest.raises(BadInput, match="permission denied") as why:
                store.add(entry("b"))
        assert "geheim" not in str(why.value)
        with pytest.raises(BadInput, match="can be read but not written"):
            TrendStore.open(theirs)
        with engine.connect() as c:
            c.execute(text(f"GRANT INSERT ON ALL TABLES IN SCHEMA {schema} TO {role}"))
            c.execute(text(f"GRANT USAGE ON ALL SEQUENCES IN SCHEMA {schema} TO {role}"))
        with TrendStore.open(theirs) as store:
            assert store.add(entry("a"))[0].revision == 2
    finally:
        with engine.connect() as c:
            c.execute(text(f"DROP OWNED BY {role}"))
            c.execute(text(f"DROP ROLE {role}"))
        engine.dispose()


# ---- bad places


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("", "no path or URL"),
        (":memory:", "no path or URL"),
        ("sqlite://", "names no file"),
        ("sqlite:///x.db?mode=ro", "names no file"),
        ("mysql://me:geheim@host/db", "'mysql'"),
        ("postgresql+psycopg2://me:geheim@host/db", "'postgresql\\+psycopg2'"),
        ("postgresql://me:geh:eim@host:geheim/db", "cannot be read"),
        ("postgresql://me:geheim@127.0.0.1:1/db", "(?s)127.0.0.1.*Check the server"),
        ("postgresql://me@127.0.0.1:1/db?password=geheim", "(?s)127.0.0.1.*Check the server"),
        ("postgresql://me:geheim@127.0.0.1/db?geheim=1", "invalid connection option"),
        ("postgresql://me:geheim@127.0.0.1/db?plugin=no", "Can't load plugin"),
        ("postgresql://me:geheim@/db?host=a,b&port=1,2,3", "hosts and ports"),
        ("postgresql://me:ge@heim@127.0.0.1/db", "(?s)cannot be read.*%40"),
        ("postgresql:/me:geheim@host/db", "lacks its //"),
        (Path("postgresql+psycopg://me:geheim@host/db"), "lacks its //"),
        ("/proc/asflown/trends.db", "cannot be written"),
        (f"/tmp/{300 * 'x'}.db", "unable to open"),
    ],
)
def test_bad_place_is_one_clear_error_without_the_password(url, why):
    with pytest.raises(BadInput, match=why) as error:
        TrendStore.open(url)
    assert error.value.remedy and error.value.__cause__ is None
    assert "heim" not in str(error.value).replace('option "geheim"', "")


@pytest.mark.parametrize("password", ["me:geheim@host/db", "me:ge/heim@host/db", "me@host/db?password=geheim"])
def test_law_a_report_names_a_store_without_its_password(password):
    from asflown.cli.trend.store_options import without_password

    named = without_password(f"postgresql://{password}")
    assert named.startswith("postgresql://me") and named.endswith("@host/db") and "heim" not in named
    assert without_password("trends.db") == without_password("sqlite:///trends.db") == "trends.db"


def test_bad_files_are_one_clear_error_and_left_as_they_are(tmp_path):
    with TrendStore.open(tmp_path / "good.db") as store:
        store.add([entry("a")] * 3)
    good = (tmp_path / "good.db").read_bytes()
    for name, content, why in (
        ("short.db", b"a,b\n1,2\n", r"not a database[\s\S]*another file"),
        ("long.db", b"a,b\n1,2\n" * 1000, r"not a database"),
        ("empty.db", b"", "there is no trend store"),
        ("cut.db", good[: len(good) // 2], r"malformed[\s\S]*backup"),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(BadInput, match=why) as error, TrendStore.open(path, create=False) as store:
            store.entries(curves=True)
        assert error.value.file == str(path)
        assert path.read_bytes() == content
    with pytest.raises(BadInput, match="directory"):
        TrendStore.open(tmp_path)
    with pytest.raises(BadInput, match="there is no trend store"):
        TrendStore.open(tmp_path, create=False)
    with pytest.raises(BadInput, match="there is no trend store"):
        TrendStore.open(tmp_path / (300 * "x"), create=False)
    assert not list(tmp_path.glob("*-wal"))


def test_bad_curve_in_the_store_is_one_clear_error(url):
    with TrendStore.open(url) as store:
        store.add(Entry("c", "e", "deploy", "2005-01-01T00:00:00"))
        with raw(url) as c:
            c.execute(
                text("INSERT INTO curve (entry_id, place, name, unit, data) VALUES (1, 0, 'torque', 'N m', :data)"),
                {"data": b"PK\x03\x04 not really"},
            )
            c.commit()
        assert len(store.entries()) == 1
        with pytest.raises(BadInput, match=r"curve 'torque' is damaged[\s\S]*backup"):
            store.entries(curves=True)


def test_bad_without_psycopg_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(BadInput, match=r"psycopg[\s\S]*pip install 'asflown\[postgresql\]'") as error:
        TrendStore.open("postgresql://me:geheim@host/db")
    assert "geheim" not in str(error.value)


def test_law_odd_names_of_files_are_only_names(tmp_path):
    for name in ("a b.db", "100%?x=1#y.db", "café.db", "new/folder/x.db"):
        with TrendStore.open(tmp_path / name) as store:
            store.add(entry("a"))
        assert (tmp_path / name).is_file()
        with TrendStore.open(f"sqlite:///{tmp_path}/plain.db") as store:
            assert str(store) == f"{tmp_path}/plain.db"


def test_law_a_link_to_a_store_is_that_store(tmp_path):
    (tmp_path / "here").mkdir()
    link = tmp_path / "here" / "link.db"
    link.symlink_to(tmp_path / "trends.db")
    with TrendStore.open(link) as one, TrendStore.open(tmp_path / "trends.db") as other:
        assert [s.add(entry("a"))[0].revision for s in (one, other, one)] == [1, 2, 3]
    assert [p.name for p in link.parent.iterdir()] == ["link.db"]
