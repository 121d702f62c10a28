"""The verb `tune`."""

from __future__ import annotations

import typer

from .options import CM, CRAFT, INERTIA, JSON, craft_from, hashes, numbers_of
from .output import print_doubts, print_json, provenance


def tune(
    spans: str = typer.Option(None, "--spans", help='Shares of the record to try, as in "0.04,0.08,0.12".'),
    widths: str = typer.Option("30,15", "--widths", help="Rises of the injected triangles [s]."),
    noise: str = typer.Option("none", "--noise", help="none, half, nominal or double."),
    runs: int = typer.Option(4, "--runs", min=1, help="Flights a profile, where there is noise."),
    craft: str = CRAFT,
    inertia: str = INERTIA,
    cm: str = CM,
    json: bool = JSON,
) -> None:
    """Search the printed method's smoothing span as the paper did, and show what the best one balances."""
    from ..campaigns.tune import SPANS, best_of, remarks, tune

    ship = craft_from(craft, inertia, cm)
    rises = numbers_of(widths, "--widths")
    shares = numbers_of(spans, "--spans") if spans else list(SPANS)
    rows = tune(ship, rises=rises, spans=shares, runs=runs, noise=noise)
    best, said = best_of(rows), remarks(rows)
    if json:
        options = {
            "spans": shares,
            "widths_s": rises,
            "noise": noise,
            "runs": runs,
            "craft": craft,
            "inertia": inertia,
            "cm": cm,
        }
        print_json({"command": "tune", "rises_s": rises, "rows": [r.record() for r in rows], "best_span": best.span,
                    "doubts": said, "provenance": provenance(hashes(craft), options, 0)})  # fmt: skip
        return
    print("mean error at the peaks [%]: as printed (smoothing alone, with I w put back), per rise of the triangles")
    print("   span  samples   " + "".join(f"{f'{r:g} s':>22s}" for r in rises) + "     rms [mN m]")
    for r in rows:
        cells = "".join(
            f"{a:+12.1f} ({b:+6.1f})" for a, b in zip(r.peak_error_percent, r.smoothing_percent, strict=True)
        )
        print(f"  {r.span:5.0%} {'/'.join(str(n) for n in dict.fromkeys(r.samples)):>8s}   {cells}     {', '.join(f'{1e3 * v:.2f}' for v in r.rms_Nm)}"
              + ("   <- least" if r is best else ""))  # fmt: skip
    print_doubts(said)
