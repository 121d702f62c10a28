"""The bar of a long piece of work, on standard error: with the time left from 3 s on; a line every 10 s where that is redirected."""

from __future__ import annotations

import sys
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ..kit.progress import now

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import TextIO

_FROM_S, _EVERY_S, _LINE_EVERY_S, _WIDTH = 3.0, 0.5, 10.0, 24


def told(what: str, share: float | None, elapsed_s: float) -> str:
    """'reading t.csv  [######------]  50 %, 12 s left'; without a share the time it has taken."""
    if share is None or share <= 0:
        return f"{what}, {elapsed_s:.0f} s so far"
    done = round(share * _WIDTH)
    left_s = elapsed_s * (1 - share) / share
    return f"{what} [{'#' * done}{'-' * (_WIDTH - done)}] {100 * share:.0f} %, {left_s:.0f} s left"


@contextmanager
def shown(stream: TextIO | None = None) -> Iterator[None]:
    """Show what is under way while this lasts; nothing where it is short."""
    stream, ended = stream or sys.stderr, threading.Event()
    watch = threading.Thread(target=_watch, args=(stream, ended), daemon=True)
    watch.start()
    try:
        yield
    finally:
        ended.set()
        watch.join()


def _watch(stream: TextIO, ended: threading.Event) -> None:
    terminal, wide, stage, since, last = stream.isatty(), 0, "", time.monotonic(), time.monotonic()
    while not ended.wait(_EVERY_S):
        what, share = now()
        moment = time.monotonic()
        if what != stage:
            stage, since = what, moment
        if not what or moment - since < _FROM_S or (not terminal and moment - last < _LINE_EVERY_S):
            continue
        text, last = told(what, share, moment - since), moment
        try:
            stream.write(f"\r{text:<{wide}}" if terminal else f"{text}\n")
            stream.flush()
        except (OSError, ValueError):  # nobody listens any more
            return
        wide = max(wide, len(text))
    if wide and terminal:
        stream.write(f"\r{'':<{wide}}\r")
        stream.flush()
