"""Files that are written completely or not at all."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Callable


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
    check_folder(path.parent)


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


def write_whole(path: str | Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a temporary neighbour of ``path``, then put it in place.

    A crash or a full disk leaves the old file, never half a new one.  Raises BadInput where the
    place cannot be written."""
    path = Path(path)
    check_place(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
    except OSError as why:
        raise BadInput(
            f"cannot be written ({why.strerror})", file=path, remedy="Name a folder you may write to."
        ) from why
    temporary = Path(name)
    try:
        write(temporary)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as why:
        raise BadInput(f"cannot be written ({why.strerror})", file=path, remedy="Check the disk and the path.") from why
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    write_whole(path, lambda p: p.write_text(text, encoding="utf-8"))
