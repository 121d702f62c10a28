"""Text of the trend verbs."""

from __future__ import annotations

from ..output import wrapped


def print_figure(f, rows: bool) -> None:
    from ...trends.record import sudden_words

    t = f.trend
    newest = ""
    if f.rows:
        last = f.rows[-1]
        newest = f"{last.value:+.4g}" + ("" if last.sigma is None else f" ± {last.sigma:.2g}") + f" {f.unit}".rstrip()
    print(f"{f.figure} · {f.basis} · {newest} · {f.verdict}")
    if rows:
        for r in f.rows:
            print(f"  {r.event:24s} {r.date[:10]}  {r.value:+.4g}" + ("" if r.sigma is None else f" ± {r.sigma:.2g}"))
        for r in f.doubted:
            print(f"  {r.event:24s} {r.date[:10]}  {r.value:+.4g}   doubted: not judged")
    if t is None:
        print("  too few events for a trend")
        return
    change = "" if t.change_percent is None else f"change {t.change_percent:+.1f} %"
    if t.change_percent_ci95:
        change += f" (95 %: {t.change_percent_ci95[0]:+.1f} to {t.change_percent_ci95[1]:+.1f})"
    print(f"  {change or 'no relative change'}   slope {t.slope_per_year:+.3g} a year   p {t.p_value:.2g}" + (
        "" if f.trend_p_adjusted is None else f" ({f.trend_p_adjusted:.2g} over all figures)"))  # fmt: skip
    if t.detectable_percent is not None:
        print(f"  a change of {t.detectable_percent:.0f} % would be detected with 80 % power")
    if (sudden := sudden_words(f)) is not None:
        print(wrapped("  ", sudden))
    for reason in f.reasons:
        print(wrapped("  ", reason))


def print_newest(health, figures) -> None:
    print(
        f"  {'figure':24s} {'value':>11s} {'expected':>11s} {'95 % from':>11s} {'to':>11s} {'p':>7s} {'all':>7s}  detectable"
    )
    for f in figures:
        n = f.newest
        if n is None:
            continue
        adjusted = "" if f.newest_p_adjusted is None else f"{f.newest_p_adjusted:7.2g}"
        least = n.detectable()
        seen = "" if least is None else f"{least:.0f} %"
        print(
            f"  {f.figure:24s} {n.value:+11.4g} {n.expected:+11.4g} {n.low:+11.4g} {n.high:+11.4g} {n.p_value:7.2g} {adjusted:>7s}  {seen}"
        )
    if health.shape is not None:
        s = health.shape
        print(
            f"  shape of the torque: distance {s.distance:.2f} from the family, median of the others {s.usual:.2f}; p {s.p_value:.2g}"
        )


def print_cold_warm(record: dict) -> None:
    for p in record["pairs"]:
        print(f"  cold {p['cold']} (after {p['rest_days']} days) · warm {p['warm']}")
    if record["equivalence"]:
        print(f"  {'figure':24s} {'warm - cold':>12s} {'90 % interval':>20s} {'p':>8s}   equivalent within")
    for e in record["equivalence"]:
        low, high = e["difference_percent_ci90"]
        word = f"within {e['margin_percent']:g} %" if e["equivalent"] else f"not shown within {e['margin_percent']:g} %"
        print(f"  {e['figure']:24s} {e['difference_percent']:+11.1f}% {low:+9.1f} to {high:+6.1f}% {e['p_value']:8.2g}   "
              f"{e['provable_percent']:.0f} %: {word}")  # fmt: skip
    c = record["curves"]
    if c:
        p = "" if c["p_value"] is None else f"; p = {c['p_value']:.2g} for larger differences within pairs"
        print(f"  whole curves: pairs {', '.join(f'{d:.2f}' for d in c['pairs'])}; other neighbours "
              f"{min(c['others']):.2f} to {max(c['others']):.2f}{p}" if c["others"] else "  whole curves: no other neighbours")  # fmt: skip


def print_two(record: dict) -> None:
    print(f"  {'figure':24s} {record['first']:>22s} {record['second']:>22s}   difference")
    for r in record["figures"]:
        sigma = "" if r["sigma_difference"] is None else f" ± {r['sigma_difference']:.2g}"
        print(
            f"  {r['figure']:24s} {r['first']:+22.4g} {r['second']:+22.4g}   {r['difference']:+.3g}{sigma} {r['unit']}"
        )
    if record["curve_distance"] is not None:
        print(f"  curves, registered: rms difference {100 * record['curve_distance']:.0f} % of their size")


def value_of(entry, figure: str, basis: str | None) -> float | None:
    found = entry.best(figure) if basis is None else entry.value(figure, basis)
    return None if found is None else found.value


def doubts_by_event(entries) -> dict[str, str]:
    """Doubts, with how many events have them; those that differ only in numbers and dates count as one."""
    from ...kit.doubts import grouped

    names = {id(d): e.event for e in entries for d in e.doubts}
    return {str(d): names[id(d)] if n == 1 else f"{n} events" for d, n in grouped(d for e in entries for d in e.doubts)}
