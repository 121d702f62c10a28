"""From a store to verdicts: the entries of one craft, limits in their units, a verdict on each kind."""

from __future__ import annotations

from pathlib import Path

from ..kit.errors import BadInput, some_of
from ..kit.quantities import quantity
from .entry import MOVES, RECORDS, Entry
from .store import TrendStore
from .verdicts import Health, judge


def entries_in(store: str, craft: str | None, *, curves: bool) -> tuple[list[Entry], str]:
    """Latest entries of the one craft asked for, and its name.

    Raises BadInput where there is no store, it is empty, or ``craft`` is not given and there are several."""
    with TrendStore.open(store, create=False) as trends:
        crafts = trends.crafts()
        if craft is not None:
            craft = Path(craft).stem if craft.endswith(".toml") else craft
        if not crafts or (craft is not None and craft not in crafts):
            what = "is empty" if not crafts else f"has no entries of {craft!r}"
            raise BadInput(f"the store {what}", file=trends,
                           remedy=f"Crafts in the store: {some_of(crafts)}. `asflown trend add` adds entries.")  # fmt: skip
        if craft is None and len(crafts) > 1:
            raise BadInput(
                f"the store has entries of several crafts: {some_of(crafts)}",
                file=trends,
                remedy="Choose one with --craft.",
            )
        name = craft or crafts[0]
        return trends.entries(name, curves=curves), name


def health_in(store: str, craft: str | None, kind: str | None, limits: list[str], **options) -> Health:
    """The verdict on one kind; ``limits`` as in ``limits_of``, ``options`` as of ``judge``.

    ``kind`` None: deploys, or the only kind there is.  Raises BadInput where there are several others, and where there is none."""
    entries, name = entries_in(store, craft, curves=True)
    kinds = _kinds_of(entries, name)
    if kind is None:
        kind = MOVES[0] if MOVES[0] in kinds else kinds[0]
        if kind not in MOVES and len(kinds) > 1:
            raise BadInput(
                "the store has figures of several kinds", remedy=f"Choose one with --kind: {some_of(kinds)}."
            )
    elif kind not in kinds:
        raise BadInput(f"the store has no figures of merit of kind {kind}", remedy=f"Its kinds: {some_of(kinds)}.")
    return _judged(entries, kind, limits_of(limits, entries), **options)


def healths_in(store: str, craft: str | None, limits: list[str]) -> list[Health]:
    """Verdicts on every kind that has figures: deploys, stows, then records of other kinds.  Raises BadInput where there is none."""
    entries, name = entries_in(store, craft, curves=True)
    limit = limits_of(limits, entries)
    return [_judged(entries, kind, limit) for kind in _kinds_of(entries, name)]


def _kinds_of(entries: list[Entry], name: str) -> list[str]:
    """Kinds that have figures.  Raises BadInput where there is none."""
    kinds = [k for k in (*MOVES, *RECORDS) if any(e.kind == k and e.values for e in entries)]
    if not kinds:
        raise BadInput(
            f"the store has no figures of merit of {name}",
            remedy="Add some with `asflown trend add`, or with --store of `asflown wheels`, `inertia`, `thrust`, `sources` or `gates`.",
        )
    return kinds


def limits_of(texts: list[str], entries: list[Entry]) -> dict[str, float]:
    """'angular_impulse=-0.5 N m s' -> SI by figure.  Raises BadInput for an unknown figure or a unit of another kind."""
    units = {v.figure: v.unit for e in entries for v in e.values}
    found = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or name.strip() not in units:
            raise BadInput(f"--limit {text!r} does not name a figure of this store",
                           remedy=f'Write it as in "angular_impulse=-0.5 N m s". Figures: {some_of(units)}.')  # fmt: skip
        found[name.strip()] = quantity(value.strip(), units[name.strip()])
    return found


def _judged(entries: list[Entry], kind: str, limits: dict[str, float], **options) -> Health:
    moves = kind in MOVES
    counted = [e for e in entries if e.kind == kind or (moves and e.kind in MOVES)]
    allowed = _cycles_allowed(counted) if moves else None
    return judge(counted, kind=kind, cycles_allowed=allowed, limits=limits, **options)


def _cycles_allowed(entries: list[Entry]) -> int | None:
    """Cycles allowed to the mechanism, by the craft file with which the latest of them was analysed."""
    said = [e.provenance["cycles_allowed"] for e in entries if "cycles_allowed" in e.provenance]
    return said[-1] if said else None
