"""Doubts with their kind and severity beside the sentences."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    op.add_column("entry", sa.Column("doubts_detail", sa.JSON))
