"""How fast and in how much memory a table is loaded and screened, beside DuckDB's own read of the same file.

Run: make bench, or python benchmarks/door.py --rows 1000000.  Each load is a process of its own, so that its peak memory is its own.
The numbers read are compared with DuckDB's: a ratio of speeds means something only between equal answers.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

WHEELS, AXES = ("1", "2", "3"), "xyz"

_DUCKDB = """
import json, resource, sys, time
import duckdb
began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
start = time.perf_counter()
with duckdb.connect() as db:
    db.execute("SET enable_progress_bar = false")
    found = db.execute(f"SELECT * FROM '{sys.argv[1]}'").fetchnumpy()
took = time.perf_counter() - start
total = float(sum(v.sum() for n, v in found.items() if not n.startswith("time")))
print(json.dumps([took, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - began) * 1024, total]))
"""
_ASFLOWN = """
import json, resource, sys, time
import duckdb, scipy.special
from asflown import load_telemetry
import asflown.telemetry.load, asflown.telemetry.screening
began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
start = time.perf_counter()
found = load_telemetry(sys.argv[1])
took = time.perf_counter() - start
total = float(sum(c.values.sum() for c in found.channels.values()))
print(json.dumps([took, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - began) * 1024, total]))
"""


def write(folder: Path, rows: int) -> dict[str, Path]:
    """A quiet hold of three wheels at 4 Hz, as CSV and as Parquet."""
    import duckdb
    import pandas

    rng = np.random.default_rng(1)
    columns = {"time [s]": 0.25 * np.arange(rows)}
    columns |= {f"wheel_rate_{w} [rad/s]": np.round(100 + np.cumsum(rng.normal(0, 0.01, rows)), 4) for w in WHEELS}
    columns |= {f"body_rate_{a} [rad/s]": np.round(rng.normal(0, 1e-5, rows), 9) for a in AXES}
    frame = pandas.DataFrame(columns)
    paths = {"CSV": folder / "t.csv", "Parquet": folder / "t.parquet"}
    with duckdb.connect() as db:
        db.register("frame", frame)
        db.execute(f"COPY frame TO '{paths['CSV']}' (FORMAT csv, HEADER)")
        db.execute(f"COPY frame TO '{paths['Parquet']}' (FORMAT parquet)")
    return paths


def best(program: str, path: Path, runs: int) -> tuple[float, float, float]:
    """Least time [s] and memory [bytes] of some runs, and the sum of all numbers."""
    found = [json.loads(subprocess.run([sys.executable, "-c", program, str(path)], capture_output=True, check=True).stdout) for _ in range(runs)]  # fmt: skip
    return min(f[0] for f in found), min(f[1] for f in found), found[0][2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, nargs="+", default=[1_000_000, 5_000_000])
    parser.add_argument("--runs", type=int, default=3)
    asked = parser.parse_args()
    print(f"{'rows':>10} {'format':>8} {'DuckDB':>9} {'asflown':>9} {'ratio':>6} {'memory over the columns':>24}")
    for rows in asked.rows:
        with tempfile.TemporaryDirectory() as folder:
            for kind, path in write(Path(folder), rows).items():
                theirs, ours = best(_DUCKDB, path, asked.runs), best(_ASFLOWN, path, asked.runs)
                assert abs(ours[2] - theirs[2]) <= 1e-9 * abs(theirs[2]), "the two read different numbers"
                own = 8.0 * rows * (1 + len(WHEELS) + len(AXES))
                print(
                    f"{rows:>10} {kind:>8} {theirs[0]:>7.2f} s {ours[0]:>7.2f} s {ours[0] / theirs[0]:>6.1f} {ours[1] / own:>24.1f}"
                )


if __name__ == "__main__":
    main()
