"""Whether the verdicts on an actuator's years keep their word: thousands of missions drawn as figures of merit, and some flown.

    python benchmarks/trend_verdicts.py                  # 2,000 missions a condition, half an hour on two cores
    python benchmarks/trend_verdicts.py --runs 200
    python benchmarks/trend_verdicts.py --flown 20       # missions flown, analysed and judged end to end, as many minutes

Drawn missions have Cassini's eleven deployments (000 Table 1), four figures with the fused method's own sigma and
an event-to-event scatter of 5 %.  Wanted: intervals hold at their stated rate; without a trend 5 % false trends and
5 % false alarms over all figures together; a sudden change of 25 % at the last event raises an alarm as often as the
stated power says; a slow drift is seen before its limit.
"""

# ruff: noqa: E402  (threads are limited before numpy is there)
from __future__ import annotations

import argparse
import json
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np

from asflown.trends.entry import Entry, Value
from asflown.trends.verdicts import judge

DATES = (
    "2004-12-09", "2005-07-09", "2006-05-19", "2007-08-28", "2008-10-30", "2009-10-13", "2010-11-28", "2011-09-10",
    "2012-10-12", "2015-07-14", "2015-09-29",
)  # fmt: skip
#: Figure -> value at first, its own relative sigma as the fused method has it, change over the years [share].
FIGURES = {
    "angular_impulse": (-0.28, 0.013, 0.30), "peak_positive": (0.013, 0.08, -0.33), "peak_negative": (-0.012, 0.10, -0.33),
    "peak_momentum": (-0.29, 0.012, 0.30),
}  # fmt: skip
SCATTER = 0.05
SUDDEN = 0.25
#: The slow drift: the limit is passed after this share of the time between first and last event.
PASSED_AT = 0.8
LIMIT = 1.6


def drawn(seed: int, change: float, sudden: float = 0.0, tails: bool = False, proportional: bool = True) -> list[Entry]:
    """One mission's entries; ``change``: factor on every figure's own change."""
    rng = np.random.default_rng(seed)
    days = (np.array(DATES, "datetime64[D]") - np.datetime64(DATES[0])).astype(float)
    share = days / days[-1]
    values: list[list[Value]] = [[] for _ in DATES]
    for k, (name, (first, relative, whole)) in enumerate(FIGURES.items()):
        line = first * (1 + change * whole * share)
        noise = rng.standard_t(4, len(days)) / np.sqrt(2) if tails else rng.standard_normal(len(days))
        y = line + (line if proportional else first) * SCATTER * noise
        sigma = np.abs(line) * relative * rng.uniform(0.7, 1.4, len(days))
        y = y + sigma * rng.standard_normal(len(days))
        if k == 0:
            y[-1] += sudden * line[-1]
        for at, v, s in zip(values, y, sigma, strict=True):
            at.append(Value(name, "fused", float(v), float(s), "N m"))
    return [
        Entry("cassini", f"deploy-{d}", "deploy", f"{d}T00:01:00", values=tuple(v))
        for d, v in zip(DATES, values, strict=True)
    ]


def trending(job) -> dict:
    seed, change, sudden, tails = job
    health = judge(drawn(seed, change, sudden, tails))
    found: dict = {"false_trend": False, "alarm": any("out of line" in r for f in health.figures for r in f.reasons)}
    for f in health.figures:
        true = 100 * change * FIGURES[f.figure][2]
        ends = f.trend.change_percent_ci95  # none where an outlier has the other sign: a change has no percent then
        found[f"covered {f.figure}"] = np.nan if ends is None else ends[0] <= true <= ends[1]
        found[f"seen {f.figure}"] = f.trend_p_adjusted < 0.05
        found[f"percent {f.figure}"] = np.nan if ends is None else f.trend.change_percent
        found["false_trend"] |= f.trend_p_adjusted < 0.05
    first = health.figures[0]
    found["alarm_of_first_alone"] = first.newest.p_value < 0.05
    found["power_of_first_alone"] = first.newest.power(100 * SUDDEN)
    found["alarm_of_first"] = first.newest_p_adjusted < 0.05
    found["power_of_first"] = first.newest.power(100 * SUDDEN, 0.05 / len(health.figures))
    return found


def drifting(seed: int) -> dict:
    """A figure that will pass its limit: is it seen before?  Judged anew at every event."""
    change = (LIMIT - 1) / PASSED_AT / FIGURES["angular_impulse"][2]
    entries = drawn(seed, change)
    limit = LIMIT * FIGURES["angular_impulse"][0]
    days = np.array([e.day for e in entries])
    passed = days[0] + PASSED_AT * (days[-1] - days[0])
    for k in range(5, len(entries) + 1):
        f = judge(entries[:k], limits={"angular_impulse": limit}).figures[0]
        if f.verdict != "pass":
            return {"before": bool(days[k - 1] < passed), "years_before": (passed - days[k - 1]) / 365.25}
    return {"before": False, "years_before": -1.0}


def campaign(pool, runs: int, only: list[str]) -> dict:
    """Every condition; prints as it goes."""
    conditions = {
        "as Cassini": (1.0, 0.0, False), "no trend": (0.0, 0.0, False), "sudden 25 %": (1.0, SUDDEN, False),
        "long tails": (0.0, 0.0, True),
    }  # fmt: skip
    table = {}
    for number, (name, how) in enumerate(conditions.items()):
        if only and name not in only:
            continue
        jobs = [(10**6 * number + k, *how) for k in range(runs)]
        rows = list(pool.map(trending, jobs, chunksize=8))
        mean = {k: float(np.nanmean([r[k] for r in rows])) for k in rows[0]}
        table[name] = mean
        print(f"{name} ({runs} missions, Monte-Carlo error of a share of 0.95: {np.sqrt(0.05 * 0.95 / runs):.3f})")
        for f, (_, _, whole) in FIGURES.items():
            print(f"  {f:18s} true {100 * how[0] * whole:+5.1f} %  mean {mean[f'percent {f}']:+6.1f} %  95 % interval holds "
                  f"{mean[f'covered {f}']:.3f}  seen {mean[f'seen {f}']:.3f}")  # fmt: skip
        print(f"  a trend in any {mean['false_trend']:.3f}   an alarm in any {mean['alarm']:.3f}")
        print(f"  first figure out of line {mean['alarm_of_first_alone']:.3f} alone, {mean['alarm_of_first']:.3f} among all; "
              f"power stated for 25 %: {mean['power_of_first_alone']:.3f} and {mean['power_of_first']:.3f}", flush=True)  # fmt: skip
    if only and "drift" not in only:
        return table
    rows = list(pool.map(drifting, range(9 * 10**6, 9 * 10**6 + max(runs // 4, 20)), chunksize=4))
    table["drift"] = {"before": float(np.mean([r["before"] for r in rows])),
                      "years_before": float(np.median([r["years_before"] for r in rows]))}  # fmt: skip
    print(f"slow drift ({len(rows)} missions): seen before its limit {table['drift']['before']:.3f}, "
          f"by {table['drift']['years_before']:.1f} years (median)")  # fmt: skip
    return table


def flown(seed: int) -> dict:
    """A mission flown in the closed loop, analysed from its telemetry and judged; the truth beside the answer."""
    from asflown.craft.load import load_craft
    from asflown.sim.mission.flown import fly_mission
    from asflown.sim.mission.mission import load_mission
    from asflown.trends.entries.actuation import analyse
    from asflown.trends.entries.events import load_events

    with tempfile.TemporaryDirectory() as folder:
        fly_mission(load_mission("cassini-mission"), folder, seed=seed)
        craft = load_craft("cassini")
        health = judge([analyse(e, craft) for e in load_events(Path(folder) / "events.toml")], cycles_allowed=20)
    return {
        f.figure: (f.trend.change_percent, *f.trend.change_percent_ci95) for f in health.figures
        if f.basis == "fused" and f.figure in ("angular_impulse", "peak_positive", "peak_negative")
    } | {"verdict": health.verdict, "reasons": health.reasons, "shape_p": health.shape.p_value}  # fmt: skip


def fly_missions(pool, runs: int) -> list[dict]:
    rows = list(pool.map(flown, range(1, runs + 1)))
    for name, true in (("angular_impulse", 30.0), ("peak_positive", -33.0), ("peak_negative", -33.0)):
        found = np.array([r[name] for r in rows])
        inside = np.mean((found[:, 1] <= true) & (true <= found[:, 2]))
        print(f"{name:18s} true {true:+.0f} %  mean {found[:, 0].mean():+.1f} +- {found[:, 0].std() / np.sqrt(runs):.1f} %  "
              f"interval holds {inside:.2f} of {runs}")  # fmt: skip
    print("shape's p:", " ".join(f"{p:.2g}" for p in sorted(r["shape_p"] for r in rows)))
    print("alarms:", [x for r in rows for x in r["reasons"] if "out of line" in x])
    print("verdicts:", {v: sum(r["verdict"] == v for r in rows) for v in ("pass", "watch", "alarm")})
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--only", help="conditions, divided by commas: as Cassini, no trend, …, drift")
    parser.add_argument("--flown", type=int, default=0, help="only so many missions flown end to end")
    parser.add_argument("--json", help="file for the figures")
    args = parser.parse_args()
    with ProcessPoolExecutor() as pool:
        found = (
            fly_missions(pool, args.flown)
            if args.flown
            else campaign(pool, args.runs, args.only.split(",") if args.only else [])
        )
    if args.json:
        Path(args.json).write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
