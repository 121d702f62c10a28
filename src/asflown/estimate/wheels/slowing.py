"""A stretch in which a wheel slows steadily."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from .run_downs import SHAPE

if TYPE_CHECKING:
    from ...kit.doubts import Kind


class Slowing(NamedTuple):
    """Samples ``first`` to before ``end`` of a wheel, in which it slows steadily; ``cause``: None where only a bearing explains it.

    ``found_by``: its shape, or that its motor's current is zero."""

    first: int
    end: int
    cause: Kind | None
    found_by: str = SHAPE
