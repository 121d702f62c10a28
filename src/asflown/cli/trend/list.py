"""The verb `trend list`."""

from __future__ import annotations

from ..options import JSON
from ..output import print_json, provenance
from ..verb import verb, weighed
from .store_options import BASIS, FIGURE, STORE, WHOSE, without_password
from .tables import value_of


@verb
def list_(store: str = STORE, figure: str = FIGURE, basis: str = BASIS, craft: str = WHOSE, json: bool = JSON) -> None:
    """Events in the store by date, with days since the last actuation and cycles used, both computed from the dates."""
    from ...kit.doubts import Doubts
    from ...kit.errors import BadInput, some_of
    from ...trends.board import entries_in
    from ...trends.entry import MOVES
    from ...trends.statistics import cycles, rests, whole_days

    entries, name = entries_in(store, craft, curves=False)
    known = {v.figure for e in entries for v in e.values}
    if figure is not None and figure not in known:
        raise BadInput(f"the store has no figure {figure!r}", remedy=f"Its figures: {some_of(sorted(known))}.")
    moves = [e for e in entries if e.kind in MOVES]
    rest = rests(moves)
    rows: list[dict] = [
        {"event": e.event, "kind": e.kind, "date": e.date, "revision": e.revision, "motor": e.motor,
         "days_since_last": whole_days(rest[e.event]) if e.event in rest else None,
         "figures": e.known, **weighed(e.doubts).record()}
        | ({} if figure is None else {"value": value_of(e, figure, basis), "figure": figure}) for e in entries
    ]  # fmt: skip
    if json:
        print_json({
            "command": "trend list", "craft": name, "events": rows, "cycles_used": cycles(moves),
            **Doubts().record(), "provenance": provenance({}, {"store": without_password(store), "craft": craft}),
        })  # fmt: skip
        return
    print(f"{name}: {len(rows)} events, {cycles(moves):g} cycles")
    print(f"  {'event':24s} {'date':10s} {'kind':7s} {'days since last':>15s} {'revision':>8s} {'figures':>7s}")
    for r in rows:
        since = "" if r["days_since_last"] is None else str(r["days_since_last"])
        print(
            f"  {r['event']:24s} {r['date'][:10]} {r['kind']:7s} {since:>15s} {r['revision']:8d} {r['figures'] or '':>7}"
            + ("" if r.get("value") is None else f"  {r['value']:+.4g}")
        )
