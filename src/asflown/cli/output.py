"""How every verb speaks: one JSON object or one table on standard output, the rest on standard error."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
from contextlib import suppress

from ..kit.escapes import encodable, visible
from ..kit.plain import plain
from .verb import Asked


def print_json(record: dict) -> None:
    """The one JSON object of a verb."""
    sys.stdout.write(json.dumps(plain(record), allow_nan=False) + "\n")


def provenance(inputs: dict[str, str], options: dict, seed=None) -> dict:
    """Files (name -> SHA-256), the project file where it was used, versions, options and seed that made a result."""
    from ..kit.result import Input
    from ..kit.result import provenance as told
    from .project import Defaults

    return told([*(Input(n, d) for n, d in inputs.items()), *Defaults.used], options | Asked.options(), seed)


def say(text: str = "") -> None:
    """Progress and remarks: standard error, so that standard output stays clean."""
    with suppress(OSError):  # nobody can read it: the answer itself counts
        print(encodable(visible(text), sys.stderr.encoding), file=sys.stderr, flush=True)


class NobodyReads(Exception):
    """Whoever read standard output has gone: `asflown … | head`.  No OSError, which the parser would answer with exit code 1."""


class Shown:
    """Standard output on which nothing from outside commands the terminal, and which its encoding cannot stop."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text: str) -> int:
        try:
            self._stream.write(encodable(visible(text), self._stream.encoding))
        except BrokenPipeError:
            raise NobodyReads from None
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except BrokenPipeError:
            raise NobodyReads from None

    def __getattr__(self, name):
        return getattr(self._stream, name)


def progress():
    """``say`` on a terminal; None where standard error is redirected, so that it has errors only."""
    return say if sys.stderr.isatty() else None


def print_doubts(doubts) -> None:
    """Doubts under every text result, the gravest first; suspect and void ones are marked."""
    from ..kit.doubts import Doubts, doubt_mark

    for d in Doubts(doubts).gravest_first:
        print(wrapped(f"  {doubt_mark(d):<6} ", str(d)))
    for d in Asked.accepted:
        print(wrapped("  ACCEPTED ", str(d)))


def wrapped(head: str, text: str) -> str:
    """A sentence after its head, wrapped to the terminal; one line where the output is redirected."""
    if not sys.stdout.isatty():
        return head + text
    width = max(40, shutil.get_terminal_size().columns)
    return textwrap.fill(head + text, width, subsequent_indent=" " * len(head), break_long_words=False)
