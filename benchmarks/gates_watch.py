"""The A branch's last months flown many times: alarms at OTM-160 or OTM-169, false ones before, and what the power curve said.

    python benchmarks/gates_watch.py                 # 1000 stories for each weakness; some minutes
    python benchmarks/gates_watch.py --stories 100 --weaker 0,0.03
    python benchmarks/gates_watch.py --given         # judged by the model that flew them, not by the burns before

Wanted: alarms of one burn in the share that the power of both burns gives, no alarm before in 95 %.
"""

from __future__ import annotations

import argparse

import numpy as np

from asflown.estimate.gates_watch import alarm_chance, watch_maneuvers
from asflown.maneuvers.history import past_model
from asflown.sim.maneuver_sets import A_BRANCH_END, a_branch

SHOWN = ("OTM-160", "OTM-169")


def story(weaker: float, seed, given: bool = False) -> tuple[bool, bool, bool, bool, float]:
    """An alarm before; at either burn by that burn alone; in any way; OTM-166 among them; the power beforehand."""
    past = past_model("rcs/2008-01")
    w = watch_maneuvers(a_branch(past.model, weaker, seed), against=past if given else None)
    by = {b.id: b for b in w.burns}
    missed = np.prod([1 - alarm_chance(by[i].foreseen, weaker * by[i].dv_mps, w.limit_p) for i in SHOWN])
    return (
        any(b.alarms for b in w.burns if b.id not in A_BRANCH_END), any("one burn" in by[i].alarms for i in SHOWN),
        any(by[i].alarms for i in SHOWN), bool(by["OTM-166"].alarms), float(1 - missed),
    )  # fmt: skip


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--stories", type=int, default=1000)
    ask.add_argument("--weaker", default="0,0.02,0.03,0.05,0.1")
    ask.add_argument("--given", action="store_true")
    asked = ask.parse_args()
    print("weaker  alarm before  one burn  power said  any alarm  OTM-166")
    for weaker in map(float, asked.weaker.split(",")):
        early, one, some, small, power = np.mean(
            [story(weaker, [2008, n], asked.given) for n in range(asked.stories)], axis=0
        )
        print(f"{weaker:6.2f}  {early:12.3f}  {one:8.3f}  {power:10.3f}  {some:9.3f}  {small:7.3f}")


if __name__ == "__main__":
    main()
