"""Watching burns for degradation: false alarms, power, and the A branch's last months flown again."""

import numpy as np
import pytest

from asflown.estimate.gates_watch import alarm_chance, cusum_limit, detectable, watch_maneuvers
from asflown.kit.errors import BadInput
from asflown.maneuvers.history import past_model
from asflown.sim.maneuver_sets import A_BRANCH_END, MAIN_ENGINE_SET, RCS_SET, a_branch, execute

RCS = past_model("rcs/2008-01")


def flown(weaker: float, count: int, seed: int):
    return [watch_maneuvers(a_branch(RCS.model, weaker, [seed, n])) for n in range(count)]


def told(watches) -> dict[str, float]:
    """Shares: an alarm before OTM-160; at 160 or 169 by one burn, or in any way; and what the power curve foretold."""
    early, one, any_, foretold = [], [], [], []
    for w in watches:
        by = {b.id: b for b in w.burns}
        last = [by["OTM-160"], by["OTM-169"]]
        early.append(any(b.alarms for b in w.burns if b.id not in A_BRANCH_END))
        one.append(any("one burn" in b.alarms for b in last))
        any_.append(any(b.alarms for b in last))
        foretold.append(last)
    return {"early": float(np.mean(early)), "one": float(np.mean(one)), "any": float(np.mean(any_)), "last": foretold}


def power(watches, weaker: float) -> float:
    return float(np.mean([
        1 - np.prod([1 - alarm_chance(b.foreseen, weaker * b.dv_mps, w.limit_p) for b in w.burns if b.id in ("OTM-160", "OTM-169")])
        for w in watches
    ]))  # fmt: skip


def test_recovery_the_a_branch_story():
    """Thrusters 6 % weak: alarm at OTM-160 or 169, OTM-166 too small to show it, and the last burns stand out to the papers' rule."""
    w = watch_maneuvers(a_branch(RCS.model, 0.06, 1))
    by = {b.id: b for b in w.burns}
    assert w.verdict == "alarm" and w.first_alarm in ("OTM-160", "OTM-169")
    assert (
        by["OTM-166"].detectable_mps / by["OTM-166"].dv_mps
        > 0.2
        > 0.06
        > by["OTM-169"].detectable_mps / by["OTM-169"].dv_mps
    )
    assert not by["OTM-166"].outlier and by["OTM-160"].criteria == (True, True, True)
    assert w.shift.p < 0.01 and -0.08 < w.shift.share < -0.02


@pytest.mark.slow
@pytest.mark.parametrize("weaker", [0.02, 0.03, 0.05])
def test_recovery_alarms_come_in_the_share_the_power_curve_says(weaker):
    """400 stories: 3 sigma of 400 (0.075); none before in 95 % (3 sigma: 0.033)."""
    watches = flown(weaker, 400, 7)
    found = told(watches)
    assert found["one"] == pytest.approx(power(watches, weaker), abs=0.075)
    assert found["any"] >= found["one"]
    assert found["early"] <= 0.05 + 0.033


@pytest.mark.slow
def test_recovery_quick_false_alarms_and_power():
    watches = flown(0.05, 60, 3)
    found = told(watches)
    assert found["early"] <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 60)
    assert found["one"] == pytest.approx(power(watches, 0.05), abs=0.12)


def test_law_the_cumulated_sums_limit_is_passed_as_often_as_asked():
    """Against 40,000 drawn sums."""
    rng = np.random.default_rng(5)
    steps, share = 25, 0.05
    limit = cusum_limit(steps, share)
    s, passed = np.zeros(40_000), np.zeros(40_000, bool)
    for _ in range(steps):
        s = np.maximum(0, s + rng.standard_normal(len(s)) - 0.5)
        passed |= s > limit
    assert passed.mean() == pytest.approx(share, abs=0.005)


def test_law_detectable_is_where_the_power_is_eight_in_ten():
    w = watch_maneuvers(a_branch(RCS.model, 0.0, 4))
    for b in w.burns[::5]:
        assert alarm_chance(b.foreseen, detectable(b.foreseen, w.limit_p), w.limit_p) == pytest.approx(0.8, abs=1e-3)


def test_a_burn_that_alarms_does_not_enter_the_model():
    m = a_branch(RCS.model, 0.15, 2)
    w = watch_maneuvers(m)
    by = {b.id: b for b in w.burns}
    assert by["OTM-160"].alarms and by["OTM-169"].alarms
    clean = watch_maneuvers(m.without(["OTM-160"], "test"), first="OTM-169")
    assert by["OTM-169"].z == pytest.approx(clean.burns[0].z, rel=1e-6)


def test_pointing_raises_its_own_alarm():
    m = execute(RCS.model, RCS_SET, 6)
    m.pointing_error_mps[40] += 20e-3
    w = watch_maneuvers(m)
    alarmed = [b for b in w.burns if b.alarms]
    assert [b.id for b in alarmed] == [m.id[40]] and alarmed[0].alarms == ("pointing",)


def test_a_model_of_the_history_judges_from_the_first_burn():
    m = execute(past_model("main/2012-1").left, MAIN_ENGINE_SET, 3)
    w = watch_maneuvers(m, against=past_model("main/2012-1"))
    assert len(w.burns) == 48 and w.against == "main-engine/2012-1" and any("judged by" in d for d in w.doubts)


def test_too_few_burns_or_wrong_words_are_refused():
    m = a_branch(RCS.model, 0.0, 1)
    for words in ({"first": "A-3"}, {"first": "nobody"}, {"false_alarm": 0.0}):
        with pytest.raises(BadInput):
            watch_maneuvers(m, **words)
    with pytest.raises(BadInput, match="10 burns come before"):
        watch_maneuvers(m.take(range(10)))


def test_record_and_text():
    w = watch_maneuvers(a_branch(RCS.model, 0.1, 1), first="OTM-156")
    record = w.record()
    assert record["verdict"] == "alarm" and record["burns_before"] == 36 and len(record["burns"]) == 4
    assert record["burns"][2]["detectable_underburn"] > 0.2 and set(record["shift"]["posterior"]) == {
        "OTM-156",
        *A_BRANCH_END,
    }
    assert "ALARM" in str(w) and "OTM-169" in str(w)
