"""How far a long piece of work is: whoever works says it here, and whoever wants to know asks."""

from __future__ import annotations

from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@dataclass(frozen=True)
class Stage:
    """A piece of work under way; ``share``: asks how much of it is done, 0 to 1, or None where that is not known."""

    what: str
    share: Callable[[], float | None] = lambda: None


_under_way: list[Stage] = []


@contextmanager
def stage(what: str, share: Callable[[], float | None] = lambda: None) -> Iterator[None]:
    """While this lasts, ``what`` is under way."""
    here = Stage(what, share)
    _under_way.append(here)
    try:
        yield
    finally:
        _under_way.remove(here)


def now() -> tuple[str, float | None]:
    """What is under way, the innermost, and how much of it is done where that is known."""
    with suppress(Exception):  # the work may end while it is asked
        here = _under_way[-1]
        share = here.share()
        return here.what, None if share is None or not 0 <= share <= 1 else share
    return "", None
