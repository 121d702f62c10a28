"""What every verb has besides its own options: --strict, --accept, and --force where it writes files.

A verb passes what is to be doubted of its answer through ``weighed``; --strict then decides the exit code.
"""

from __future__ import annotations

import functools
import inspect
import pkgutil
import re
from difflib import get_close_matches
from importlib import import_module, resources
from typing import TYPE_CHECKING

import typer

from ..kit.errors import BadInput, some_of

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any

    from ..kit.doubts import Doubt, Doubts

#: Parameters that name what a verb writes.
WRITTEN = ("out", "table", "plot", "plot_dir", "report", "folder")
STRICT = typer.Option(False, "--strict", help="Exit code 3 where the answer has a suspect or void doubt.")
ACCEPT = typer.Option(
    [],
    "--accept",
    metavar="KIND",
    help="A kind of doubt (docs/doubts.md) taken off as known, and recorded; may be repeated.",
)
FORCE = typer.Option(False, "--force", help="Replace files that asflown did not write; never an input.")
#: A kind of doubt where it is declared.
_DECLARED = re.compile(r"\bKind\(\s*\"([a-z0-9-]+(?:\.[a-z0-9-]+)+)\"")


class Asked:
    """What the running verb was asked, and what has come of it."""

    strict: bool = False
    accept: tuple[str, ...] = ()
    force: bool = False
    graves: int = 0  # suspect and void doubts that were not accepted
    accepted: tuple[Doubt, ...] = ()

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Of these, what changes an answer, for the provenance."""
        if not cls.accept:
            return {}
        return {"accept": list(cls.accept), "accepted": [f"{d.kind.id}: {d}" for d in cls.accepted]}


def weighed(doubts: Iterable[Doubt]) -> Doubts:
    """The doubts without the kinds that --accept takes off; the grave ones among them count for --strict."""
    from ..kit.doubts import Doubts

    whole = Doubts(doubts)
    left = Doubts(d for d in whole if d.kind.id not in Asked.accept)
    Asked.accepted = tuple(dict.fromkeys((*Asked.accepted, *(d for d in whole if d.kind.id in Asked.accept))))
    Asked.graves += sum(d.is_grave for d in left)
    return left


def verb(function):
    """Decorate the function of a verb: it takes --strict and --accept too, and --force where it names files to be written."""
    signature = inspect.signature(function, eval_str=True)
    own = list(signature.parameters.values())
    more = {"strict": (bool, STRICT), "accept": (list[str], ACCEPT)}
    if any(p.name in WRITTEN for p in own):
        more["force"] = (bool, FORCE)

    @functools.wraps(function)
    def call(*args, strict: bool = False, accept: Iterable[str] = (), force: bool = False, **given):
        Asked.strict, Asked.force, Asked.accept = strict, force, known_kinds_of(accept)
        Asked.graves, Asked.accepted = 0, ()
        function(*args, **given)
        if strict and Asked.graves:
            raise typer.Exit(3)

    added = [
        inspect.Parameter(n, inspect.Parameter.KEYWORD_ONLY, default=option, annotation=kind)
        for n, (kind, option) in more.items()
    ]
    call.__signature__ = signature.replace(parameters=[*own, *added])  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in (*own, *added)}
    return call


def known_kinds(*, imported: bool = False) -> list[str]:
    """Ids of the kinds of doubt: those whose ids are written where they are declared, without importing them, which takes seconds.

    ``imported``: all, as every module declares them."""
    if imported:
        from ..kit.doubts import kinds

        for module in pkgutil.walk_packages([str(resources.files("asflown"))], "asflown."):
            if ".migrations" not in module.name and not module.name.endswith(("__main__", "prewarm")):
                import_module(module.name)
        return list(kinds())
    found: set[str] = set()
    folders = [resources.files("asflown")]
    while folders:
        for part in folders.pop().iterdir():
            if part.is_dir():
                folders.append(part)
            elif part.name.endswith(".py"):
                found.update(_DECLARED.findall(part.read_text(encoding="utf-8")))
    return sorted(found)


def known_kinds_of(asked: Iterable[str] | None) -> tuple[str, ...]:
    """The kinds that --accept names.  Raises BadInput for one that does not exist."""
    kinds = tuple(dict.fromkeys(asked or ()))
    known = known_kinds() if kinds else []
    if not set(kinds) <= set(known):
        known = known_kinds(imported=True)
    for kind in kinds:
        if kind not in known:
            near = get_close_matches(kind, known, 3, 0.5)
            raise BadInput(
                f"--accept {kind!r}: there is no such kind of doubt",
                remedy=(f"Did you mean {some_of(near)}? " if near else "")
                + "docs/doubts.md lists the kinds; doubts_detail of --json has those of an answer.",
            )
    return kinds
