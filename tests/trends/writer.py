"""A process of its own that writes to a trend store, for tests that kill it or set several against each other."""

import sys
import time
from itertools import count

import numpy as np

from asflown.trends.entry import Curve, Entry, Value
from asflown.trends.store import store as under_test
from asflown.trends.store.store import TrendStore

VALUES, CURVES = 20, 4


def entry(event: str, note: str = "") -> Entry:
    time_s = np.arange(400) / 10
    return Entry(
        "cassini", event, "deploy", "2005-01-01T00:00:00", note=note,
        values=tuple(Value(f"figure {i}", "fused", i / 7, 0.1, "N m") for i in range(VALUES)),
        curves=tuple(Curve(f"curve {i}", "N m", time_s, np.sin(time_s + i)) for i in range(CURVES)),
    )  # fmt: skip


def say(word) -> None:
    print(word, flush=True)


def add(url: str, event: str, note: str, most: int) -> None:
    """Reports each revision once it is kept; ``most`` 0: until killed."""
    with TrendStore.open(url) as store:
        for _ in range(most) if most else count():
            say(store.add(entry(event, note))[0].revision)


def halfway(url: str) -> None:
    """Stands still inside a transaction: the entry, its values and some of its curves are written."""
    packed, seen = under_test._packed, []

    def stop_at_the_last(curve):
        seen.append(curve)
        if len(seen) == CURVES:
            say("halfway")
            time.sleep(600)
        return packed(curve)

    under_test._packed = stop_at_the_last
    with TrendStore.open(url) as store:
        store.add(entry("halfway"))


def open_each() -> None:
    """Opens every store named on standard input, and adds to it."""
    say("ready")
    for line in sys.stdin:
        with TrendStore.open(line.strip()) as store:
            say(store.add(entry("opened"))[0].revision)


if __name__ == "__main__":
    verb, *rest = sys.argv[1:]
    if verb == "add":
        add(rest[0], rest[1], rest[2], int(rest[3]))
    elif verb == "halfway":
        halfway(rest[0])
    else:
        open_each()
