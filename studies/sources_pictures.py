"""What `asflown sources` tells of a simulated nadir hold, of an orbit and of twelve hours of the Space Station and of INSPIRESat-1, drawn.

Run: python studies/sources_pictures.py docs/pictures.   Answer, 2026-11: docs/theory/sources.md and docs/flight-data.md.
"""

import os
import sys
from pathlib import Path

from PIL import Image

import asflown

DATA = Path(os.environ.get("ASFLOWN_FLIGHT_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
RECORDINGS = {
    "iss-sources": ("iss/iss_20181012_hours_00_12.csv.gz", "iss", ("4360", "10010")),
    "iss-sources-twelve-hours": ("iss/iss_20181012_hours_00_12.csv.gz", "iss", (None, None)),
    "inspiresat1-sources": ("inspiresat1/is1_adcs_1hz.csv", "inspiresat1", (None, None)),
}


def main(folder: Path) -> None:
    flight = asflown.fly("leo-nadir")
    told = {"sources-nadir": asflown.sources(flight.telemetry, asflown.load_craft("pyramid"))}
    for name, (file, craft, (start, stop)) in RECORDINGS.items():
        telemetry = asflown.load_telemetry(DATA / file, channels=EXAMPLES / f"{craft}.toml").between(start, stop)
        told[name] = asflown.sources(telemetry, asflown.load_craft(craft))
    for name, result in told.items():
        print(f"\n== {name}\n{result}")
        for doubt in result.doubts.gravest_first:
            print(f"  {doubt.severity.label}: {doubt}")
        path = folder / f"{name}.png"
        asflown.save_figure(result, path)
        with Image.open(path) as picture:  # few colours are in it: a palette halves the file
            small = picture.convert("RGB").quantize(48)
        small.save(path, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
