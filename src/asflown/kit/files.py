"""Files that are written completely or not at all, and that never take the place of another's."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
import tempfile
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

#: Every file made here says so near its beginning or its end, with its kind.
_MARK = "written by asflown as "
#: How far from both ends the mark is looked for. [bytes]
_REACH = 1 << 16


def sha256_of(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def sha256_of_file(path: str | Path) -> str:
    """The digest of a file's content, read in blocks."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def check_place(path: str | Path) -> None:
    """Raise BadInput where no file can be written; called before the work whose result it will hold.

    An existing file must be a plain one (a rename would replace a device or a pipe)."""
    path = Path(path)
    if os.path.exists(path) and not os.path.isfile(path):
        what = "a directory" if os.path.isdir(path) else "not a plain file"
        raise BadInput(f"cannot be written (this is {what})", file=path, remedy="Name a file.")
    target = Path(os.path.realpath(path))
    if os.path.islink(target):
        raise BadInput("cannot be written (a link that leads to itself)", file=path, remedy="Name a file.")
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise BadInput("cannot be written (it is read-only)", file=path, remedy="Name another file.")
    check_folder(target.parent)


def check_folder(folder: str | Path) -> None:
    """Raise BadInput where ``folder`` cannot be written to or made."""
    folder = Path(folder)
    there = next(p for p in (folder.absolute(), *folder.absolute().parents) if os.path.exists(p))
    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError as why:
        raise BadInput(
            f"cannot be written ({there}: {why.strerror})", file=folder, remedy="Name a folder you may write to."
        ) from None


# ---- whose a file is --------------------------------------------------------------------------------


def mark(kind: str) -> str:
    """What a file of ours says of itself; its writer puts it where the format has room for remarks."""
    return f"{_MARK}{kind}"


def is_ours(path: str | Path, kind: str) -> bool:
    """Whether a file says that it is ours and of this kind."""
    with open(path, "rb") as file:
        ends = file.read(_REACH)
        file.seek(max(os.fstat(file.fileno()).st_size - _REACH, 0))
        ends += file.read(_REACH)
    return re.search(re.escape(mark(kind).encode()) + rb"(?![\w-])", ends) is not None


def check_output(
    path: str | Path, kind: str, *, inputs: Iterable[str | Path] = (), force: bool = False, ours: bool | None = None
) -> None:
    """Raise BadInput where an output would replace one of the inputs, or a file that is not ours of its kind.

    ``force`` lets it replace a file that is no input; ``ours``: whether an existing file is, where that is known otherwise."""
    check_place(path)
    if not os.path.exists(path):
        return
    for other in inputs:
        if os.path.exists(other) and os.path.samefile(path, other):
            raise BadInput("this output would replace an input", file=path, remedy="Name another file.")
    if not force and not (is_ours(path, kind) if ours is None else ours):
        raise BadInput(
            f"this file exists, and asflown did not write it as {kind}",
            file=path,
            remedy="Name another file, or add --force to replace it.",
        )


# ---- writing ----------------------------------------------------------------------------------------


@dataclass
class _Waiting:
    """Files written and not yet put in place, and folders made for them."""

    files: list[tuple[Path, Path]] = field(default_factory=list)
    folders: list[Path] = field(default_factory=list)


_WAITING: ContextVar[_Waiting | None] = ContextVar("waiting", default=None)


@contextmanager
def together() -> Iterator[None]:
    """What is written inside appears at the end, all of it, or none where an error ends it."""
    if _WAITING.get() is not None:  # inside another, which ends later
        yield
        return
    waiting = _Waiting()
    token = _WAITING.set(waiting)
    try:
        yield
        for temporary, target in waiting.files:
            try:
                os.replace(temporary, target)
            except OSError as why:
                raise _unwritten(target, why) from why
    finally:
        _WAITING.reset(token)
        for temporary, _ in waiting.files:
            temporary.unlink(missing_ok=True)
        for folder in reversed(waiting.folders):
            with suppress(OSError):  # it has files now
                folder.rmdir()


def write_whole(path: str | Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a temporary neighbour of ``path``, then put it in place.

    A crash or a full disk leaves the old file, never half a new one.  A link stays and leads to the new content.  A new file's
    permissions are the user's (umask), an old one's stay.  Raises BadInput where the place cannot be written."""
    check_place(path)
    with together():
        waiting = _WAITING.get()
        assert waiting is not None
        target = Path(os.path.realpath(path))
        temporary = target.with_name(f".{secrets.token_hex(8)}{target.suffix[:16]}")
        waiting.folders += [f for f in reversed(target.parents) if not f.exists()]
        kept = False
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
            write(temporary)
            if target.exists():
                os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
            waiting.files.append((temporary, target))
            kept = True
        except OSError as why:
            raise _unwritten(path, why) from why
        finally:
            if not kept:
                temporary.unlink(missing_ok=True)


def _unwritten(path: str | Path, why: OSError) -> BadInput:
    return BadInput(f"cannot be written ({why.strerror or why})", file=path, remedy="Check the disk and the path.")


def write_text(path: str | Path, text: str) -> None:
    """Text in UTF-8; halves of characters, as in names of files that are no text, are written as escapes."""
    write_whole(path, lambda p: p.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n"))
