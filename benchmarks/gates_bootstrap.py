"""A thousand refits of a Gates model: asflown beside a loop of scipy.optimize over the same sets.

    python benchmarks/gates_bootstrap.py

Both maximise the same restricted likelihood, biases solved for inside; scipy's bounded quasi-Newton (L-BFGS-B) with the gradient
by differences, as one writes it down, from the one start that the truth is, while asflown looks from an edge too.  Wanted: 30 times.
"""

from __future__ import annotations

import json
import time

import numpy as np
from scipy import optimize

from asflown.estimate.gates.likelihood import Problem
from asflown.estimate.gates.likelihoods import problems
from asflown.maneuvers.history import past_model
from asflown.sim.maneuver_sets import MAIN_ENGINE_SET, execute

REFITS = 1000


def scipy_refit(problem: Problem, y: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, float]:
    """Sigmas (in the problem's units) of one set, and the objective there."""

    def objective(sigmas):
        s = np.maximum(problem.d + sigmas[0] ** 2 + (sigmas[1] * problem.v) ** 2, 1e-12)
        WX = problem.X / s[:, None]
        A = problem.X.T @ WX
        r = y - problem.X @ np.linalg.solve(A, WX.T @ y)
        return 0.5 * (np.sum(np.log(s) + r * r / s) + np.linalg.slogdet(A)[1])

    done = optimize.minimize(objective, start, method="L-BFGS-B", bounds=[(0, None)] * 2)
    return done.x, float(done.fun)


def main() -> None:
    burns = execute(past_model("main/2012-1").model, MAIN_ENGINE_SET, 1)
    rows = []
    for name, problem in problems(burns).items():
        best = problem.minimum()
        problem.refits(best, 2, np.random.default_rng(0))  # compiled before the clock runs
        times = []
        for _ in range(5):
            begin = time.perf_counter()
            found = problem.refits(best, REFITS, np.random.default_rng(7))
            times.append(time.perf_counter() - begin)
        mean = problem.X @ (best.beta / problem.bias_units)
        sets = mean + np.sqrt(problem.variances(best)) * np.random.default_rng(7).standard_normal(
            (REFITS, len(problem.y))
        )
        start = np.array([best.fixed, best.proportional]) / problem.units
        begin = time.perf_counter()
        loop = np.array([scipy_refit(problem, y, start)[0] for y in sets])
        slow = time.perf_counter() - begin
        apart = np.abs(loop - found[:, :2] / problem.units).max(axis=1)
        rows.append({"part": name, "refits": REFITS, "asflown_s": min(times), "scipy_s": slow, "ratio": slow / min(times),
                     "median_difference": float(np.median(apart)), "share_apart_by_1_percent": float(np.mean(apart > 0.01))})  # fmt: skip
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
