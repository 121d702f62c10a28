"""The tables of the trend store as the code knows them; migrations/ makes them."""

from __future__ import annotations

from sqlalchemy import (
    JSON,
    Column,
    Double,
    ForeignKey,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

#: The newest migration.  A test holds it to migrations/versions.
HEAD = "0002"
#: Our own name, so that a database may hold another program's alembic_version in another schema.
VERSION_TABLE = "trend_store_version"

METADATA = MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
    }
)

ENTRY = Table(
    "entry",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("craft", String, nullable=False),
    Column("event", String, nullable=False),
    Column("revision", Integer, nullable=False),
    Column("kind", String, nullable=False),
    Column("motor", String),
    Column("date", String, nullable=False),  # UTC, ISO 8601
    Column("note", Text, nullable=False),
    Column("doubts", JSON, nullable=False),  # sentences
    Column("doubts_detail", JSON),  # the same with kind and severity; null in entries of earlier versions
    Column("provenance", JSON, nullable=False),
    Column("added", String, nullable=False),  # UTC, ISO 8601
    UniqueConstraint("craft", "event", "revision"),
)

VALUE = Table(
    "value",
    METADATA,
    Column("entry_id", ForeignKey("entry.id"), primary_key=True),
    Column("place", Integer, primary_key=True),  # its place among the entry's values
    Column("figure", String, nullable=False),
    Column("basis", String, nullable=False),
    Column("value", Double),
    Column("sigma", Double),
    Column("unit", String, nullable=False),
    UniqueConstraint("entry_id", "figure", "basis"),
)

CURVE = Table(
    "curve",
    METADATA,
    Column("entry_id", ForeignKey("entry.id"), primary_key=True),
    Column("place", Integer, primary_key=True),
    Column("name", String, nullable=False),
    Column("unit", String, nullable=False),
    Column("data", LargeBinary, nullable=False),  # an .npz file: time_s, values and perhaps sigma
    UniqueConstraint("entry_id", "name"),
)
