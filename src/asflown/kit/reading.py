"""The one door for what parsers raise, and for how much of a file they may be given."""

from __future__ import annotations

import csv
import os
import stat
import struct
import zlib
from contextlib import contextmanager
from typing import TYPE_CHECKING

from .errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

#: What the parsers used here raise for input that is damaged, or beyond what they can hold.
_RAISED = (
    ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError, MemoryError, OSError, EOFError,
    csv.Error, struct.error, zlib.error,
)  # fmt: skip


@contextmanager
def reading(file: object, remedy: str, what: str = "this") -> Iterator[None]:
    """Whatever a parser raises inside is a BadInput that names the file; a BadInput gets the file where it has none."""
    try:
        yield
    except BadInput as why:
        raise why.within(file) from why.__cause__
    except _RAISED as why:
        said = (str(why).splitlines() or [""])[0][:200]
        kind = "nested too deeply" if isinstance(why, RecursionError) else f"{type(why).__name__}: {said}"
        raise BadInput(f"{what} cannot be read ({kind})", file=file, remedy=remedy) from why


def limit(name: str, usual: int) -> int:
    """How much a reader may be given: the environment's ASFLOWN_MAX_name, or the usual."""
    said = os.environ.get(f"ASFLOWN_MAX_{name}", "")
    return int(said) if said.isascii() and said.isdigit() and len(said) < 19 else usual


#: Files that are read into memory whole: documents, and tables other than telemetry. [bytes]
LARGEST_FILE = limit("FILE_BYTES", 256_000_000)


def read_bytes(path: str | Path, what: str, remedy: str) -> bytes:
    """A file's bytes.  Raises BadInput where there is none, where it is no plain file (a pipe has no end), and where it is too large."""
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise BadInput(f"this {what} is not a plain file", file=path, remedy="Write it to a file first.")
            if about.st_size > LARGEST_FILE:
                raise BadInput(
                    f"this {what} has {about.st_size / 1e6:.0f} MB, more than {LARGEST_FILE / 1e6:g} MB",
                    file=path,
                    remedy="Divide it, or set ASFLOWN_MAX_FILE_BYTES.",
                )
            return file.read()
    except (OSError, ValueError) as why:
        if isinstance(why, BadInput):
            raise
        raise BadInput(
            f"there is no such {what}, or it cannot be read ({getattr(why, 'strerror', None) or why})",
            file=path,
            remedy=remedy,
        ) from None


def read_text(path: str | Path, what: str, remedy: str) -> str:
    """The text of a file in UTF-8, without a byte order mark.  Raises BadInput as ``read_bytes``, and for what is no text."""
    try:
        text = read_bytes(path, what, remedy).decode("utf-8-sig")
    except UnicodeDecodeError as why:
        raise BadInput(f"this {what} is not a text in UTF-8 ({why})", file=path, remedy=remedy) from None
    if "\0" in text:
        raise BadInput(f"this {what} is not a text (it contains zero bytes)", file=path, remedy=remedy)
    return text


def csv_rows(text: str, file: object, remedy: str) -> list[tuple[int, list[str]]]:
    """Rows of a CSV text with their lines in the file; comments (#) and blank lines are left out but counted."""
    found = []
    for line_number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:  # line by line: a quotation mark is closed within its line
            found.append((line_number, next(csv.reader([line], strict=True, skipinitialspace=True))))
        except csv.Error as why:
            raise BadInput(f"this line cannot be read ({why})", file=file, line=line_number, remedy=remedy) from None
    return found


def plain_number(text: str) -> float:
    """Text as a number.  Raises ValueError also for 1_000 and for digits of other scripts, which Python reads: data are not written so."""
    if not text.isascii() or "_" in text:
        raise ValueError(f"{text[:40]!r} is not a number")
    return float(text)


def _without_waiting(path, flags):
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))  # a pipe that nobody writes to would be waited for
