"""What does the leak monitor find, how soon and how well, beside the papers' threshold monitor at the same false-alarm rate?

Run: python studies/leak_power.py [quiet|stated|leaks|weak|all] [flights a line, 100].   The tables of docs/theory/leak.md, 2026-11.
"""

import sys

import numpy as np
from scipy.stats import norm

from asflown.craft.load import load_craft
from asflown.estimate.leak.likelihood import threshold_for
from asflown.estimate.leak.watch import leak
from asflown.sim.flight.closed_loop import fly

LEAKS_MN = (0.01, 0.02, 0.05, 0.1, 0.3, 1.0, 3.0, 10.0)
LOSSES = (0.05, 0.1, 0.2, 0.4)
ONSET_S, WINDOW_S = 900.0, 600.0
THRUSTERS = ("Z1", "Z2", "Z3", "Z4", "Y1", "Y2", "Y3", "Y4")


def with_error(hits) -> str:
    p = np.mean(hits)
    return f"{p:.3f} ± {np.sqrt(max(p * (1 - p), 0.25 / len(hits)) / len(hits)):.3f}"


def delays(times) -> str:
    return (
        "-"
        if not len(times)
        else f"{np.median(times):.0f} ({np.percentile(times, 5):.0f} to {np.percentile(times, 95):.0f})"
    )


def quiet(flights: int) -> None:
    craft = load_craft("cassini", cm=(0, 0, 1.35))
    highest, theirs, worst = [], [], []
    for seed in range(flights):
        r = leak(fly("leak", seed=1000 + seed, changes={"thruster_faults": []}).telemetry, craft)
        highest.append(r.statistic.max())
        theirs.append(np.abs(r.monitor.gained_Nms).max() / np.sqrt(2) / r.noise_Nms.max())
        worst.append(r.smallest_detectable_Nm)
    step_h = float(np.median(np.diff(r.time_s))) / 3600
    print(f"{flights} quiet hours: share with an alarm; smallest leak {1e6 * np.mean(worst):.1f} uN m in 600 s")
    for rate in (0.01, 0.03, 0.1, 0.3, 1.0):
        z = norm.isf(rate * step_h / 6)
        ours = with_error(np.array(highest) > threshold_for(rate * step_h))
        stated = 1 - np.exp(-rate)
        print(
            f"  {rate:4.2f} an hour, {stated:.3f}: {ours}; papers' monitor {with_error(np.array(theirs) > z)}",
            flush=True,
        )


def stated(flights: int) -> None:
    craft = load_craft("cassini", cm=(0, 0, 1.35))
    print("leaks of the smallest size stated (mean of 20 flights), found within the window, and named")
    for window in (60.0, 300.0, 600.0):
        sizes = []
        for seed in range(20):
            f = fly("leak", seed=3000 + seed, changes={"duration": f"{ONSET_S + window} s", "thruster_faults": []})
            smallest = leak(f.telemetry, craft, window_s=window).smallest_detectable_N
            if smallest:  # an alarm before has none
                sizes.append(list(smallest.values()))
        found, named = [], []
        for seed in range(flights):
            thruster, onset = THRUSTERS[seed % 8], ONSET_S + 0.125 * (seed * 7 % 64)
            size = np.mean(sizes, axis=0)[seed % 8]
            f = fly(
                "leak",
                seed=4000 + seed,
                changes={
                    "duration": f"{onset + window + 32} s",
                    "thruster_faults": [{"thruster": thruster, "start": f"{onset} s", "leak": f"{1e3 * size} mN"}],
                },
            )
            r = leak(f.telemetry.between(None, onset + window), craft)
            late = leak(f.telemetry, craft)
            found.append(late.alarm and late.alarm_s <= onset + window)
            if r.alarm:
                named.append(r.thruster == thruster)
        print(
            f"  {window:4.0f} s  {1e6 * np.mean(sizes):.1f} uN  found {with_error(found)}  named {with_error(named)}",
            flush=True,
        )


def leaks(flights: int) -> None:
    craft = load_craft("cassini", cm=(0, 0, 1.35))
    print("leaks in a hold, from 900 s on; found within 600 s, named at the end of them, delay [s]; papers' monitor")
    for size in LEAKS_MN:
        found, named, delay, pulls, theirs, their_delay, their_named = [], [], [], [], [], [], []
        for seed in range(flights):
            thruster = THRUSTERS[seed % 8]
            onset = ONSET_S + 0.125 * (seed * 7 % 64)
            f = fly(
                "leak",
                seed=5000 + seed,
                changes={
                    "duration": f"{onset + WINDOW_S} s",
                    "thruster_faults": [{"thruster": thruster, "start": f"{onset} s", "leak": f"{size} mN"}],
                },
            )
            r = leak(f.telemetry, craft)
            hit = r.alarm and r.kind == "leak" and r.alarm_s >= onset
            found.append(bool(hit))
            if hit:
                delay.append(r.alarm_s - onset)
                named.append(r.thruster == thruster)
                if r.thruster == thruster:
                    pulls.append((r.leak_N - 1e-3 * size) / r.leak_sigma_N)
            m = r.monitor
            theirs.append(m.alarm is not None and r.time_s[m.alarm] >= onset)
            if theirs[-1]:
                their_delay.append(r.time_s[m.alarm] - onset)
                their_named.append(m.thruster == thruster)
        right = with_error(named) if named else "-"
        their_right = with_error(their_named) if their_named else "-"
        pull = f"{np.mean(pulls):+.2f}, {np.std(pulls):.2f}" if len(pulls) > 4 else "-"
        print(
            f"{size:6.2f} mN  found {with_error(found)}  named {right}  after {delays(delay)}  pulls {pull}  |  found {with_error(theirs)}  "
            f"named {their_right}  after {delays(their_delay)}",
            flush=True,
        )


def weak(flights: int) -> None:
    print("weak thrusters: found, named, loss found")
    cases = (
        ("wheel-bias-fsds", "cassini@001-fsds", "Y2", "60 s"),
        ("wheel-bias-fsds", "cassini@001-fsds", "Y4", "90 s"),
        ("wheel-bias-day28", "cassini", "Y1", "60 s"),
        ("rcs-burn", "cassini", "Z3", "300 s"),
        ("rcs-burn", "cassini", "Z1", "340 s"),
    )
    for scenario, name, thruster, start in cases:
        for loss in LOSSES:
            found, named, losses = [], [], []
            for seed in range(flights // 2):
                f = fly(
                    scenario,
                    seed=8000 + seed,
                    changes={"thruster_faults": [{"thruster": thruster, "start": start, "factor": 1 - loss}]},
                )
                use = f.scenario.thrusters
                r = leak(f.telemetry, load_craft(name, cm=use.center_of_mass), thrust_N=use.thrust)
                found.append(r.alarm)
                if r.alarm:
                    named.append(r.thruster == thruster and r.kind == "weak")
                    losses.append(r.loss if r.loss is not None else np.nan)
            right = with_error(named) if named else "-"
            of = f"{100 * np.nanmedian(losses):.0f} %" if losses else "-"
            print(
                f"{scenario:17s} {thruster} from {start:5s} {100 * loss:3.0f} %  found {with_error(found)}  named {right}  loss {of}",
                flush=True,
            )


if __name__ == "__main__":
    what = sys.argv[1] if len(sys.argv) > 1 else "all"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    if what in ("quiet", "all"):
        quiet(4 * count)
    if what in ("stated", "all"):
        stated(2 * count)
    if what in ("leaks", "all"):
        leaks(count)
    if what in ("weak", "all"):
        weak(count)
