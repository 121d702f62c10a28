"""Local regression beside scikit-misc, in one process: equal answers, and how much faster.

Run: make bench.  The peer evaluates directly at every point (surface='direct'), as ours does where a
window misses samples; complete windows on an even lattice share one set of coefficients here.
"""

import time

import numpy as np
from skmisc.loess import loess as peer

from asflown.kit.regression import local_polynomial


def best_of(runs, work):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        answer = work()
        times.append(time.perf_counter() - start)
    return min(times), answer


def main() -> None:
    rng = np.random.default_rng(0)
    print(
        f"{'record':>34s} {'samples':>8s} {'window':>7s} {'ours [ms]':>10s} {'peer [ms]':>10s} {'ratio':>7s} {'largest difference':>19s}"
    )
    for name, samples, span, lost in (
        ("Cassini, 1 s", 481, 39, 0), ("an hour, 1 s", 3601, 39, 0), ("an hour, 2 % missing", 3601, 39, 72),
        ("five hours, 1 s", 18001, 39, 0),
    ):  # fmt: skip
        x = np.arange(samples, dtype=float)
        x = np.delete(x, rng.choice(np.arange(1, samples - 1), lost, replace=False))
        y = np.sin(x / 20) + 0.1 * rng.normal(size=len(x))

        def theirs(x=x, y=y, span=span):
            fit = peer(x, y, span=(span + 1e-3) / len(x), degree=2, surface="direct")
            fit.fit()
            return fit.outputs.fitted_values

        t_ours, ours = best_of(5, lambda x=x, y=y, span=span: local_polynomial(x, y, x, degree=2, neighbors=span).value)
        t_peer, reference = best_of(2, theirs)
        print(f"{name:>34s} {len(x):8d} {span:7d} {1e3 * t_ours:10.2f} {1e3 * t_peer:10.2f} {t_peer / t_ours:7.1f} "
              f"{np.abs(ours - reference).max():19.1e}")  # fmt: skip


if __name__ == "__main__":
    main()
