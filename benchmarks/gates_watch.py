"""The A branch's last months flown many times: alarms at OTM-160 or OTM-169, false ones before, and what the power curve said.

    python benchmarks/gates_watch.py                 # 1000 stories for each weakness; some minutes
    python benchmarks/gates_watch.py --stories 100 --weaker 0,0.03
    python benchmarks/gates_watch.py --given         # judged by the model that flew them, not by the burns before

Wanted: alarms of one burn in the share that the power says, no alarm before in 95 %.  The power of either burn: that of OTM-160,
and where it raised no alarm that of OTM-169.  The model that judges OTM-169 then holds a burn that was weak already, which
hides the second one: the threshold is the model's, the error is drawn by the model without it.
"""

from __future__ import annotations

import argparse

import numpy as np

from asflown.estimate.gates import gates_watch
from asflown.estimate.gates.power import alarm_chance
from asflown.estimate.gates.watch import Alarm
from asflown.maneuvers.history import past_model
from asflown.sim.maneuver_sets import A_BRANCH_END, a_branch

FIRST, SMALL, LAST = A_BRANCH_END


def story(weaker: float, seed, given: bool = False) -> tuple[float, ...]:
    """An alarm before OTM-160; by OTM-160 alone, its power; by either burn alone, the power; in any way; at OTM-166."""
    past = past_model("rcs/2008-01")
    m = a_branch(past.model, weaker, seed)
    w = gates_watch(m, against=past if given else None)
    by = {b.id: b for b in w.burns}
    alone = {i: Alarm.ONE_BURN in by[i].alarms for i in (FIRST, LAST)}
    said = alarm_chance(by[FIRST].foreseen, weaker * by[FIRST].dv_mps, w.limit_p)
    either = said
    if not alone[FIRST]:
        sound = None if given else gates_watch(m.without([FIRST, SMALL], "weak"), first=LAST).burns[0].foreseen
        either += alarm_chance(by[LAST].foreseen, weaker * by[LAST].dv_mps, w.limit_p, drawn=sound)
    return (
        any(b.alarms for b in w.burns if b.id not in A_BRANCH_END), alone[FIRST], said, alone[FIRST] or alone[LAST], either,
        bool(by[FIRST].alarms or by[LAST].alarms), bool(by[SMALL].alarms),
    )  # fmt: skip


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--stories", type=int, default=1000)
    ask.add_argument("--weaker", default="0,0.02,0.03,0.05,0.1")
    ask.add_argument("--given", action="store_true")
    asked = ask.parse_args()
    print("weaker  alarm before  OTM-160 alone   said  either alone   said  any alarm  OTM-166")
    for weaker in map(float, asked.weaker.split(",")):
        found = np.array([story(weaker, [2008, n], asked.given) for n in range(asked.stories)], float)
        early, first, said, one, power, some, small = found.mean(axis=0)
        print(
            f"{weaker:6.2f}  {early:12.3f}  {first:13.3f}  {said:5.3f}  {one:12.3f}  {power:5.3f}  {some:9.3f}  {small:7.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
