"""How well `asflown inertia` finds the tensor of simulated flights of `leo-slews`: pulls and coverage of the six elements.

Run: python benchmarks/leo_slews.py [--flights 100] [--first 0] [--out flights.jsonl].  About 10 s a flight and core.

Every flight has its own inertia (one sigma of the craft file's), orbit, dipole, levers, density and a controller that believes another
inertia and runs at another bandwidth, drawn as for sources_accuracy.py; every fourth flies through NRLMSIS.  Wheels stick and rub as the
scenario says.  The table in docs/theory/inertia.md is this one's.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from sources_accuracy import CRAFT, drawn

from asflown.dynamics.rigid_body import ELEMENTS, elements_of
from asflown.estimate.inertia import inertia
from asflown.kit.doubts import Severity
from asflown.sim.flight.closed_loop import fly


def one(seed: int) -> dict:
    flight = fly("leo-slews", seed=seed, changes=drawn(seed)["changes"])
    start = time.process_time()
    result = inertia(flight.telemetry, CRAFT)
    seconds = time.process_time() - start
    error = elements_of(result.inertia_kgm2 - flight.inertia_kgm2)
    return {
        "seed": seed, "seconds": seconds, "settled": result.settled, "error": error.tolist(),
        "sigma": elements_of(result.inertia_sigma_random_kgm2).tolist(),
        "doubts": [d.kind.id for d in result.doubts if d.severity >= Severity.CAUTION],
    }  # fmt: skip


def table(flights: list[dict]) -> None:
    settled = [f for f in flights if f["settled"]]
    error, sigma = (np.array([f[name] for f in settled]) for name in ("error", "sigma"))
    pull = error / sigma
    print(
        f"{len(flights)} flights, {len(settled)} settled, {np.median([f['seconds'] for f in flights]):.1f} CPU-seconds each (median)"
    )
    rows = (
        ("mean pull", pull.mean(axis=0), ".2f"), ("width of the pulls", pull.std(axis=0), ".2f"),
        ("95 % interval holds", np.mean(np.abs(pull) < 1.96, axis=0), ".2f"), ("stated sigma [kg m2]", np.median(sigma, axis=0), ".1e"),
    )  # fmt: skip
    print(f"{'':24}" + "".join(f"{e:>10}" for e in ELEMENTS))
    for name, values, form in rows:
        print(f"{name:24}" + "".join(f"{v:>10{form}}" for v in values))
    print(
        f"all: width {np.sqrt(np.mean(pull**2)):.2f}, {np.mean(np.abs(pull) < 1.96):.3f} held, largest pull {np.abs(pull).max():.1f}"
    )
    every = [d for f in flights for d in set(f["doubts"])]
    print("doubts: " + (", ".join(f"{d} {every.count(d)}" for d in sorted(set(every))) or "none"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flights", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument(
        "--out", type=Path, help="a line of JSON for every flight; flights already there are not flown again"
    )
    asked = parser.parse_args()
    lines = asked.out.read_text().splitlines() if asked.out is not None and asked.out.exists() else []
    flights = {f["seed"]: f for f in map(json.loads, lines)}
    seeds = range(asked.first, asked.first + asked.flights)
    for seed in seeds:
        if seed not in flights:
            flights[seed] = one(seed)
            if asked.out is not None:
                with asked.out.open("a") as file:
                    file.write(json.dumps(flights[seed]) + "\n")
    table([flights[seed] for seed in seeds])


if __name__ == "__main__":
    main()
