"""What a whole call of the program costs, beside ``python -c "import numpy, scipy.optimize"``: processor time, user and system.

Run: make bench, or python benchmarks/startup.py.  Processor time, since a busy machine hardly changes it; the least of some runs."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import asflown

RUNS = 5
PEER = ["-c", "import numpy, scipy.optimize"]
VERBS = (
    "--help", "torque", "torque t.csv --craft cassini --method nope", "torque t.csv --craft cassini --method momentum",
    "torque t.csv --craft cassini --method transfer", "wheels t.csv --craft cassini", "external-torque t.csv --craft cassini",
    "telemetry check t.csv", "craft show cassini", "torque t.csv --craft cassini --axis y",
)  # fmt: skip


def spent(words: list[str], folder: Path) -> float:
    """Processor time of a process of its own. [s]"""
    best = float("inf")
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        best = min(best, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return best


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        asflown.write_flight(asflown.fly("profile-1", seed=1), folder)
        (folder / "telemetry.csv").rename(folder / "t.csv")
        peer = spent(PEER, folder)
        print(f"{peer:6.2f} s       python -c {PEER[1]!r}")
        for verb in VERBS:
            ours = spent(["-m", "asflown.cli.main", *verb.split()], folder)
            print(f"{ours:6.2f} s {ours / peer:5.1f} asflown {verb}")


if __name__ == "__main__":
    main()
