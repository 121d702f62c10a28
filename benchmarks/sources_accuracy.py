"""How well `asflown sources` finds dipole and levers of simulated flights: pulls and coverage of the 95 % intervals.

Run: python benchmarks/sources_accuracy.py [--flights 100] [--first 0] [--out flights.jsonl].  About 3 s a flight and core.

Every flight is an hour of `leo-nadir` with its own inertia (one sigma of the craft file's), orbit, dipole, levers, density and a
controller that believes another inertia and runs at another bandwidth.  Every fourth flies through NRLMSIS, whose density is no sine
over the orbit; its drag lever has no one true value and is not judged.  On half of them a constant torque acts (3 uN m about each
axis, one sigma), which no option tells the estimator.  The table in docs/theory/sources.md is this one's.
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

from asflown.craft.load import load_craft
from asflown.estimate.sources import sources
from asflown.sim.flight.closed_loop import fly

CRAFT = load_craft("pyramid")
ELEMENTS = np.array([11.8, 13.2, 9.1, 0.12, -0.2, 0.06])  # of the craft file, moments first [kg m2]


def drawn(seed: int) -> dict:
    """What is true of one flight, and the scenario's changes."""
    rng = np.random.default_rng(seed)
    true = {
        "dipole": rng.normal(0, 0.25, 3), "sunlight": rng.normal(0, 1e-5, 3), "drag": rng.normal(0, 8e-6, 3),
        "msis": seed % 4 == 3, "constant": (seed % 4 in (1, 2)) * 3e-6 * np.random.default_rng([seed, 1]).standard_normal(3), "scale_height": rng.uniform(50e3, 75e3), "factor": rng.lognormal(0, 0.3),
    }  # fmt: skip
    off = np.array([1, 1, 1, 0.5, 0.5, 0.5]) * 0.02 * 11.4

    def inertia():
        return " ".join(f"{v:.6f}" for v in ELEMENTS + off * rng.standard_normal(6)) + " kg m2"

    def vector(v, unit):
        return " ".join(f"{x:.6e}" for x in v) + f" {unit}"

    environment = {
        "residual_dipole": vector(true["dipole"], "A m2"), "sunlight_lever": vector(true["sunlight"], "N m"),
        "drag_lever": vector(true["drag"], "N m"), "density_factor": true["factor"], "scale_height": f"{true['scale_height']} m",
        "density_swing": 0.0 if true["msis"] else rng.uniform(0.1, 0.6), "density_phase": f"{rng.uniform(-np.pi, np.pi)} rad",
    }  # fmt: skip
    if true["msis"]:
        environment |= {
            "air": "msis",
            "f107": rng.uniform(80, 200),
            "f107_mean": rng.uniform(80, 200),
            "ap": rng.uniform(4, 30),
        }
    return true | {
        "changes": {
            "inertia": inertia(),
            "torques": [{"shape": "constant", "torque": vector(true["constant"], "N m")}],
            "environment": environment,
            "orbit": {
                "semi_major_axis": f"{rng.uniform(6840, 6980)} km", "eccentricity": rng.uniform(0, 0.003),
                "inclination": f"{rng.uniform(50, 100)} deg", "ascending_node": f"{rng.uniform(0, 360)} deg",
                "mean_anomaly": f"{rng.uniform(0, 360)} deg",
            },
            "controller": {"inertia": inertia(), "bandwidth": f"{0.02 * rng.uniform(0.8, 1.25)} Hz"},
        }
    }  # fmt: skip


def one(seed: int) -> dict:
    true = drawn(seed)
    flight = fly("leo-nadir", seed=seed, changes=true["changes"])
    tlm = flight.telemetry
    start = time.process_time()
    result = sources(tlm, CRAFT)
    out = {
        "seed": seed,
        "seconds": time.process_time() - start,
        "msis": true["msis"],
        "acts": bool(true["constant"].any()),
        "doubts": [d.kind.id for d in result.doubts],
    }
    # both levers are at the mean density of the arc without its swing
    share = true["factor"]
    for name, scale in (("dipole", 1.0), ("sunlight", 1.0), ("drag", share), ("constant", 1.0)):
        of = result.found[name]
        truth = scale * true[name]
        out[name] = {
            "pull": ((of.value - truth) / of.sigma).tolist(), "within": ((of.ci95[:, 0] <= truth) & (truth <= of.ci95[:, 1])).tolist(),
            "half": (0.5 * np.diff(of.ci95, axis=1)[:, 0]).tolist(), "told": of.told.tolist(),
        }  # fmt: skip
    return out


def table(flights: list[dict]) -> None:
    for acts in (False, True):
        print(f"\n{'with' if acts else 'without'} a constant torque")
        _table([f for f in flights if f["acts"] is acts])


def _table(flights: list[dict]) -> None:
    if not flights:
        return
    print(f"{len(flights)} flights, {np.median([f['seconds'] for f in flights]):.1f} CPU-seconds each (median)")
    print(f"{'':12}{'axis':>5}{'flights':>9}{'told':>7}{'rms pull':>10}{'within 95 %':>13}{'half width (median)':>21}")
    for name, unit in (("dipole", "A m2"), ("sunlight", "N m"), ("drag", "N m"), ("constant", "N m")):
        use = [f for f in flights if name != "drag" or not f["msis"]]
        for j, axis in enumerate("xyz"):
            pull, within, half, told = (
                np.array([f[name][k][j] for f in use]) for k in ("pull", "within", "half", "told")
            )
            print(
                f"{name:12}{axis:>5}{len(use):>9}{told.mean():>7.2f}{np.sqrt(np.mean(pull**2)):>10.2f}{within.mean():>13.2f}{np.median(half):>16.2g} {unit}"
            )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--flights", type=int, default=100)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--out", type=Path, help="one JSON line a flight; those already there are not flown again")
    given = options.parse_args()
    done = [json.loads(line) for line in given.out.read_text().splitlines()] if given.out and given.out.exists() else []
    for seed in range(given.first, given.first + given.flights):
        if any(f["seed"] == seed for f in done):
            continue
        done.append(one(seed))
        if given.out:
            with given.out.open("a") as file:
                file.write(json.dumps(done[-1]) + "\n")
    table(done)


if __name__ == "__main__":
    main()
