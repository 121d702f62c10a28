"""Entries with their values and curves, none of which can be changed or deleted."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None

TABLES = ("entry", "value", "curve")
REFUSAL = "the trend store only grows: nothing in it is changed or deleted"


def upgrade() -> None:
    op.create_table(
        "entry",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("craft", sa.String, nullable=False),
        sa.Column("event", sa.String, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("kind", sa.String, nullable=False),
        sa.Column("motor", sa.String),
        sa.Column("date", sa.String, nullable=False),
        sa.Column("note", sa.Text, nullable=False),
        sa.Column("doubts", sa.JSON, nullable=False),
        sa.Column("provenance", sa.JSON, nullable=False),
        sa.Column("added", sa.String, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_entry"),
        sa.UniqueConstraint("craft", "event", "revision", name="uq_entry_craft_event_revision"),
    )
    op.create_table(
        "value",
        sa.Column("entry_id", sa.Integer, nullable=False),
        sa.Column("place", sa.Integer, nullable=False),
        sa.Column("figure", sa.String, nullable=False),
        sa.Column("basis", sa.String, nullable=False),
        sa.Column("value", sa.Double),
        sa.Column("sigma", sa.Double),
        sa.Column("unit", sa.String, nullable=False),
        sa.PrimaryKeyConstraint("entry_id", "place", name="pk_value"),
        sa.ForeignKeyConstraint(["entry_id"], ["entry.id"], name="fk_value_entry_id"),
        sa.UniqueConstraint("entry_id", "figure", "basis", name="uq_value_entry_id_figure_basis"),
    )
    op.create_table(
        "curve",
        sa.Column("entry_id", sa.Integer, nullable=False),
        sa.Column("place", sa.Integer, nullable=False),
        sa.Column("name", sa.String, nullable=False),
        sa.Column("unit", sa.String, nullable=False),
        sa.Column("data", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("entry_id", "place", name="pk_curve"),
        sa.ForeignKeyConstraint(["entry_id"], ["entry.id"], name="fk_curve_entry_id"),
        sa.UniqueConstraint("entry_id", "name", name="uq_curve_entry_id_name"),
    )
    if op.get_bind().dialect.name == "sqlite":
        _refuse_in_sqlite()
    else:
        _refuse_in_postgresql()


def _refuse_in_sqlite() -> None:
    for table in TABLES:
        for change in ("update", "delete"):
            op.execute(
                f"CREATE TRIGGER {table}_no_{change} BEFORE {change} ON {table} "
                f"BEGIN SELECT RAISE(ABORT, '{REFUSAL}'); END"
            )
    # INSERT OR REPLACE deletes what it replaces without asking the triggers above.
    keys = {
        "entry": "id = NEW.id OR (craft = NEW.craft AND event = NEW.event AND revision = NEW.revision)",
        "value": "entry_id = NEW.entry_id AND (place = NEW.place OR (figure = NEW.figure AND basis = NEW.basis))",
        "curve": "entry_id = NEW.entry_id AND (place = NEW.place OR name = NEW.name)",
    }
    for table, key in keys.items():
        op.execute(
            f"CREATE TRIGGER {table}_no_replace BEFORE INSERT ON {table} "
            f"WHEN EXISTS (SELECT 1 FROM {table} WHERE {key}) BEGIN SELECT RAISE(ABORT, '{REFUSAL}'); END"
        )


def _refuse_in_postgresql() -> None:
    op.execute(
        "CREATE FUNCTION trend_store_refuses() RETURNS trigger LANGUAGE plpgsql AS "
        f"$$ BEGIN RAISE EXCEPTION '{REFUSAL}'; END $$"
    )
    for table in TABLES:
        op.execute(
            f'CREATE TRIGGER {table}_only_grows BEFORE UPDATE OR DELETE OR TRUNCATE ON "{table}" '
            "FOR EACH STATEMENT EXECUTE FUNCTION trend_store_refuses()"
        )
