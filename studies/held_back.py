"""Do the fused method's bands hold on what it never saw of two real recordings?

Run: python studies/held_back.py (6 minutes).  The recordings are looked for in $ASFLOWN_FLIGHT_DATA, else in
../shared/data; one that is missing is named and skipped.  Answer, 2026-11: for blocks, yes:
whitened pulls of size 0.99 to 1.07 for the Space Station and INSPIRESat-1's z, 1.02 to 1.14 about x and y, where wheels
stick and tear loose.  Whole channels hold (0.88 to 1.10) with the levels of the whole record, not always with those
of the rest (0.61 to 1.9): a minute or six of a channel do not say how it will behave for the rest of the record.

Held back are blocks of 60 s, of one channel or of all of an axis, every fourth at once, the levels fitted to the
rest; and a whole channel but its first 60 s (the Space Station: but 180 s at both ends), with the levels of the rest
and with those of the whole record.  An error of a whole channel is one draw of a slow process: its plain pull says
as much as one number can.  The whitened pull of each sample, given the held-back ones before it, is worth one each.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

import asflown
from asflown.estimate.fused.free_body import FreeBody
from asflown.estimate.fused.gather import gather
from asflown.estimate.fused.held_back import APART, HeldBack, between_ends, blocks, hold_back
from asflown.estimate.fused.levels import OUTLYING, fit_levels
from asflown.estimate.fused.series import ROWS
from asflown.estimate.subject.subject import subject_of

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("ASFLOWN_FLIGHT_DATA", ROOT.parent / "shared" / "data"))
# craft, file, stretches [s] (without a gap, or None: all), seconds of a channel kept at its start and end
CASES = (
    ("inspiresat1", "inspiresat1/is1_adcs_1hz.csv", (None,), (60.0, 0.0)),
    ("iss", "iss/iss_20181012_hours_00_12.csv.gz", ((4728, 6918), (16084, 18274), (36521, 38711)), (180.0, 180.0)),
)


def cases(body: FreeBody, series, kept):
    """Name and held-back samples of every case of one axis."""
    rows = [s.row for s in series]
    for name, held in [*((f"blocks, {ROWS[r]}", [r]) for r in rows), ("blocks, both", rows)]:
        yield name, [hold_back(body, series, blocks(series, held, turn)) for turn in range(APART)]
    whole = fit_levels(body, series).levels
    for row in rows:
        held = between_ends(series, row, *kept)
        yield f"whole {ROWS[row]}", [hold_back(body, series, held)]
        yield "  levels of the whole record", [hold_back(body, series, held, whole)]


def line(axis: str, name: str, parts: list[HeldBack], row: int) -> str:
    mine = [p.row == row for p in parts]
    pull, white = (
        np.concatenate([getattr(p, f)[m] for p, m in zip(parts, mine, strict=True)]) for f in ("pull", "whitened")
    )
    sound = np.abs(white) <= OUTLYING
    size = [float(np.sqrt(np.mean(v**2))) for v in (pull, white, white[sound])]
    inside = [np.mean(np.abs(v) < k) for v in (pull, white) for k in (1, 1.96)]
    return (
        f"{axis}  {name:28s} {ROWS[row]:14s} {len(pull):5d} {size[0]:7.2f} {inside[0]:6.2f} {inside[1]:6.2f}"
        f" {size[1]:9.2f} {inside[2]:6.2f} {inside[3]:6.2f} {np.sum(~sound):7d} {size[2]:9.2f}"
    )


def main() -> None:
    for craft, file, stretches, kept in CASES:
        if not (DATA / file).exists():
            print(f"{Path(file).name} is not there: set ASFLOWN_FLIGHT_DATA to the folder that holds {craft}/")
            continue
        whole = asflown.load_telemetry(DATA / file, channels=ROOT / "examples" / f"{craft}.toml")
        for stretch in stretches:
            telemetry = whole.between(*stretch) if stretch else whole
            subject = subject_of(telemetry, asflown.load_craft(craft))
            series, I_B = gather(subject, (0, 1, 2), None).series, subject.known_inertia()
            print(f"\n{craft}" + (f", {stretch[0]} to {stretch[1]} s" if stretch else ""))
            print(
                "   held back                    judged         count    pull   in 1  in 1.96  whitened   in 1  in 1.96"
                f" beyond {OUTLYING:g}  without"
            )
            for j, axis in enumerate("xyz"):
                for name, parts in cases(FreeBody(inertia_kgm2=I_B[j, j]), series[j], kept):
                    for row in np.unique(parts[0].row):
                        print(line(axis, name, parts, row), flush=True)


if __name__ == "__main__":
    main()
