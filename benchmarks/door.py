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

#: The most memory of this process alone; what getrusage tells begins with its parent's.
_HIGHEST = """
def highest():
    with open("/proc/self/status") as status:
        return 1024 * int(next(line for line in status if line.startswith("VmHWM")).split()[1])
"""
_DUCKDB = """
import json, sys, time
import duckdb
began = highest()
spent, start = time.process_time(), time.perf_counter()
with duckdb.connect() as db:
    db.execute("SET enable_progress_bar = false")
    found = db.execute(f"SELECT * FROM '{sys.argv[1]}'").fetchnumpy()
took, spent = time.perf_counter() - start, time.process_time() - spent
total = float(sum(v.sum() for n, v in found.items() if not n.startswith("time")))
print(json.dumps([took, spent, highest() - began, total]))
"""
_ASFLOWN = """
import json, sys, time
import duckdb, scipy.special
from asflown import load_telemetry
import asflown.telemetry.load, asflown.telemetry.screening
began = highest()
spent, start = time.process_time(), time.perf_counter()
found = load_telemetry(sys.argv[1])
took, spent = time.perf_counter() - start, time.process_time() - spent
total = float(sum(c.values.sum() for c in found.channels.values()))
print(json.dumps([took, spent, highest() - began, total]))
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


def best(program: str, path: Path, runs: int) -> tuple[float, float, float, float]:
    """Least time, least processor time [s] and memory [bytes] of some runs, and the sum of all numbers."""
    found = [json.loads(subprocess.run([sys.executable, "-c", _HIGHEST + program, str(path)], capture_output=True, check=True).stdout) for _ in range(runs)]  # fmt: skip
    return min(f[0] for f in found), min(f[1] for f in found), min(f[2] for f in found), found[0][3]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, nargs="+", default=[1_000_000, 5_000_000])
    parser.add_argument("--runs", type=int, default=3)
    asked = parser.parse_args()
    print(f"{'':>10} {'':>8} {'time [s]':^26} {'processor time [s]':^26} {'peak memory over the columns':>28}")
    print(
        f"{'rows':>10} {'format':>8} {'DuckDB':>9} {'asflown':>9} {'ratio':>6} {'DuckDB':>9} {'asflown':>9} {'ratio':>6} {'DuckDB':>19} {'asflown':>8}"
    )
    for rows in asked.rows:
        with tempfile.TemporaryDirectory() as folder:
            for kind, path in write(Path(folder), rows).items():
                theirs, ours = best(_DUCKDB, path, asked.runs), best(_ASFLOWN, path, asked.runs)
                assert abs(ours[3] - theirs[3]) <= 1e-9 * abs(theirs[3]), "the two read different numbers"
                own = 8.0 * rows * (1 + len(WHEELS) + len(AXES))
                times = "".join(f" {theirs[k]:>9.2f} {ours[k]:>9.2f} {ours[k] / theirs[k]:>6.1f}" for k in (0, 1))
                print(f"{rows:>10} {kind:>8}{times} {theirs[2] / own:>19.1f} {ours[2] / own:>8.1f}")


if __name__ == "__main__":
    main()
