"""Is the power said before a burn the share of alarms? Sets of burns by a known model, then one that falls short.

    python benchmarks/gates_power.py                 # 1000 sets a line; some minutes
    python benchmarks/gates_power.py --sets 100 --before 37

Columns: alarms counted; the chance of an alarm given the threshold that stood and the true model, whose mean is what the count
tends to; the power said; one sigma of the difference of the last two; degrees of freedom of the scale.
The limit on p is that of 25 watched burns. Shortfalls: 2, 3 and 5 % where one of them can be seen, and shares of a tenth for large
burns of the main engine.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from scipy import stats

from asflown.estimate.gates.foreseen import foresee
from asflown.estimate.gates.likelihoods import problems
from asflown.estimate.gates.power import alarm_chance
from asflown.maneuvers.history import past_model
from asflown.sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute

LIMIT_P = 0.05 / 3 / 25
#: Model, burns it is flown with, and per size of the last burn [m/s] by which shares it falls short.
CASES = {
    "rcs/2008-01": (RCS_SET, {0.05: (0.05, 0.08, 0.12), 0.12: (0.02, 0.03, 0.05), 0.23: (0.02, 0.03, 0.05)}),
    "main/2012-1": (
        MAIN_ENGINE_SET,
        {0.5: (0.02, 0.03, 0.05), 3.0: (0.003, 0.005, 0.008), 8.0: (0.002, 0.003, 0.005), 12.0: (0.002, 0.004, 0.008)},
    ),
}


def power_said(name: str, before: int, dv_mps: float, shares, sets: int, seed=0) -> np.ndarray:
    """(sets, shares, 4): alarm counted (0 or 1), its chance by the truth, the power said, degrees of freedom."""
    truth = past_model(name).model
    burns = replace(CASES[name][0], count=before + 1)
    found = np.empty((sets, len(shares), 4))
    for n in range(sets):
        rng = np.random.default_rng([seed, before, n])
        low, high = np.log([burns.smallest_mps, burns.largest_mps])
        m = execute(truth, burns, rng, dv_mps=[*np.exp(rng.uniform(low, high, before)), dv_mps])
        problem = problems(m.take(range(before)))["magnitude"]
        od = m.sigma_magnitude_mps[-1] ** 2
        told = foresee(problem, problem.minimum(), dv_mps, od)
        sigma = np.sqrt(truth.sigma_magnitude(dv_mps) ** 2 + od)
        reach = -stats.t.ppf(LIMIT_P / 2, told.freedom) * np.sqrt(told.covariance[0, 0])
        ends = told.mean[0] + np.array([-reach, reach]) - truth.mean_magnitude(dv_mps)
        for k, share in enumerate(shares):
            low_end, high_end = (ends + share * dv_mps) / sigma
            counted = told.p_value(m.magnitude_error_mps[-1] - share * dv_mps) < LIMIT_P
            true = stats.norm.cdf(low_end) + stats.norm.sf(high_end)
            found[n, k] = counted, true, alarm_chance(told, share * dv_mps, LIMIT_P), told.freedom
    return found


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--sets", type=int, default=1000)
    ask.add_argument("--before", default="15,37,60")
    asked = ask.parse_args()
    print("model        before  dv m/s  short by  alarms   true   said  sigma of their difference  freedom")
    for name, (_, sizes) in CASES.items():
        for before in map(int, asked.before.split(",")):
            for dv, shares in sizes.items():
                found = power_said(name, before, dv, shares, asked.sets)
                apart = np.std(found[..., 1] - found[..., 2], axis=0) / np.sqrt(asked.sets)
                for share, (counted, true, said, freedom), s in zip(shares, found.mean(axis=0), apart, strict=True):
                    print(
                        f"{name:12s} {before:6d} {dv:7.2f} {100 * share:7.1f} % {counted:7.3f} {true:6.3f} {said:6.3f} {s:27.3f} {freedom:8.0f}"
                    )


if __name__ == "__main__":
    main()
