"""Verdicts, rests, cold and warm, curves: what the dates and figures of an actuator's years say."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.kit.errors import BadInput
from asflown.trends.entry import Curve, Entry, Value
from asflown.trends.statistics.curves import distance, registered, shape_of
from asflown.trends.statistics.pairs import cycles, equivalence, find_pairs, rests, whole_days
from asflown.trends.statistics.slope import trend_of
from asflown.trends.verdicts import TOO_FEW, judge, values_of

from .histories import history, torque

TIME = np.arange(-60.0, 361.0)


def curve(size=1.0, late_s=0.0):
    return Curve("torque, fused", "N m", TIME, torque(TIME, size, late_s))


def test_published_days_since_the_last_actuation():
    """000 Tables 1, 2, B1, third column, with its errors put right (997 is 998, 17 is 17 from the stow of 14 October)."""
    rest = {k: whole_days(v) for k, v in rests(history()).items()}
    table = {
        "deploy-2004-12-09": 161, "deploy-2005-07-09": 12, "deploy-2006-05-19": 219, "deploy-2006-06-29": 38,
        "deploy-2007-08-28": 39, "deploy-2008-10-30": 6, "deploy-2009-10-31": 17, "deploy-2010-11-28": 161,
        "deploy-2011-09-10": 242, "deploy-2012-10-12": 145, "deploy-2015-07-14": 998, "deploy-2015-09-29": 77,
        "stow-2006-05-22": 3, "stow-2008-11-01": 2, "stow-2009-10-14": 1, "stow-2011-09-14": 4, "stow-2012-10-19": 7,
        "stow-2015-09-30": 1,
    }  # fmt: skip
    off = {k: rest[k] - v for k, v in table.items()}
    assert all(abs(d) <= 1 for d in off.values()), off
    assert "stow-2004-07-01" not in rest


def test_published_cold_and_warm_pairs_are_found_from_the_dates():
    """000 Table 2."""
    pairs = [(p.cold.event, p.warm.event) for p in find_pairs(history())]
    assert pairs == [
        ("deploy-2006-05-19", "deploy-2006-06-29"), ("deploy-2009-10-13", "deploy-2009-10-31"),
        ("deploy-2015-07-14", "deploy-2015-09-29"),
    ]  # fmt: skip


def test_law_cycles_count_every_actuation_listed():
    assert cycles(history()) == 14


def test_published_margin_that_three_pairs_can_prove():
    """state of the art 6: 5 % scatter pooled over the events proves about 7 %, if the pairs show no difference."""
    entries = history(scatter=0.05, seed=8)
    same = [replace(e, values=tuple(replace(v, value=v.value) for v in e.values)) for e in entries]
    held, values = values_of([e for e in same if e.kind == "deploy" and e.values], "angular_impulse", "fused")
    trend = trend_of(values)
    answer = equivalence("angular_impulse", find_pairs(same), trend)
    reach = answer.ci90[1] - answer.difference_percent
    assert len(held) == 13 and answer.pairs == 3
    assert reach == pytest.approx(7, abs=2.5)
    assert answer.equivalent == (abs(answer.difference_percent) + reach < 15.5) or abs(answer.p_value - 0.05) < 0.02


def test_recovery_a_cold_start_that_differs_is_not_called_the_same():
    entries = [
        replace(e, values=tuple(replace(v, value=1.3 * v.value) for v in e.values))
        if e.event in ("deploy-2006-05-19", "deploy-2009-10-13", "deploy-2015-07-14")
        else e
        for e in history(scatter=0.01, seed=1)
    ]
    answers = judge(entries).equivalences
    assert len(answers) == 3 and not any(a.equivalent for a in answers)
    assert all(a.difference_percent < -10 for a in answers)


def test_law_registration_undoes_a_shift():
    t = np.arange(0.0, 241.0)
    onto = torque(t)
    moved = registered(curve(late_s=4.0), t, onto, scaled=False)
    apart = np.sqrt(np.mean((moved - onto) ** 2) / np.mean(onto**2))
    assert apart < 0.06
    assert np.sqrt(np.mean((torque(np.arange(0.0, 241.0), late_s=4.0) - onto) ** 2) / np.mean(onto**2)) > 0.5


def test_law_distance_is_symmetric_and_nothing_to_itself():
    a, b = curve(), curve(1.3, 2.0)
    assert distance(a, a) == pytest.approx(0, abs=1e-9)
    assert distance(a, b) == pytest.approx(distance(b, a))
    assert 0.1 < distance(a, b) < 0.5


def test_recovery_a_new_shape_is_seen_and_a_new_size_is_left_to_the_figures():
    deploys = [e for e in history(curves=True, seed=4) if e.kind == "deploy"]
    past, day = [e.curve("torque, fused") for e in deploys], np.array([e.day for e in deploys])
    wide = Curve("torque, fused", "N m", TIME, torque(TIME) + 0.006 * np.exp(-(((TIME - 40) / 8) ** 2)))
    assert shape_of(past[-1], past[:-1], day).p_value > 0.02
    assert shape_of(replace(past[-1], values=1.4 * past[-1].values), past[:-1], day).p_value > 0.02
    assert shape_of(wide, past[:-1], day).p_value < 0.01
    assert shape_of(past[-1], past[:5], day[:6]) is None


def test_recovery_verdicts_of_a_change_and_of_none():
    alarms = [judge(history(curves=True, seed=seed)).verdict == "alarm" for seed in range(8)]
    assert sum(alarms) <= 2  # one in twenty looks
    moving = judge(history(change=0.4, seed=2))
    assert moving.verdict == "watch"
    assert "angular_impulse has increased by" in moving.reasons[0]
    f = moving.figure("angular_impulse")
    assert f.trend.change_percent_ci95[0] < 40 < f.trend.change_percent_ci95[1]


def test_recovery_a_sudden_change_raises_an_alarm_with_the_reason():
    entries = [
        replace(e, values=(replace(e.values[0], value=1.5 * e.values[0].value), *e.values[1:]))
        if e.event == "deploy-2015-09-29"
        else e
        for e in history(seed=3)
    ]
    found = judge(entries)
    assert found.verdict == "alarm" and "angular_impulse of deploy-2015-09-29 deviates" in found.reasons[0]
    before = judge(entries, until="deploy-2015-07-14")  # it had not happened then
    assert not any("deviates" in r for r in before.reasons)


def test_recovery_a_sudden_change_that_stays_is_said_beside_the_slope():
    from asflown.trends.record import sudden_words

    late = [
        replace(e, values=tuple(replace(v, value=1.3 * v.value) for v in e.values)) if e.date > "2010" else e
        for e in history(scatter=0.02, seed=6)
    ]
    f = judge(late).figure("angular_impulse")
    assert f.rows[f.step.before].event == "deploy-2009-10-31"
    assert f.step.percent == pytest.approx(30, abs=3) and "fits better than a slope" in sudden_words(f)
    assert sudden_words(judge(history(change=0.3, scatter=0.01, seed=6)).figure("angular_impulse")) is None


def test_law_limits_are_watched_and_then_alarm():
    entries = history(change=0.4, seed=2)
    assert judge(entries, limits={"angular_impulse": -0.30}).verdict == "alarm"
    f = judge(entries, limits={"angular_impulse": -0.42}).figure("angular_impulse")
    assert f.verdict == "watch" and "may reach its limit" in f.reasons[-1]
    assert f.limit_reached[0] < f.limit_reached[1]


def test_law_cycles_and_ends_are_judged():
    assert judge(history(), cycles_allowed=14).verdict == "alarm"
    assert "of 16 allowed cycles" in " ".join(judge(history(), cycles_allowed=16).reasons)
    stuck = [
        replace(
            e,
            values=(
                *e.values,
                Value("microswitch", "telemetry", 0.0 if e.event == "deploy-2015-09-29" else 1.0, None, ""),
            ),
        )
        if e.values
        else e
        for e in history()
    ]
    assert "does not show the end position" in judge(stuck).reasons[0]


def test_few_events_are_shown_and_doubted_not_judged():
    few = judge([e for e in history() if e.event in ("deploy-2004-12-09", "deploy-2005-07-09")])
    assert few.verdict == "pass" and few.doubts.has(TOO_FEW)
    with pytest.raises(BadInput, match="no figures of merit of kind stow"):
        judge([e for e in history() if e.kind == "deploy"], kind="stow")
    with pytest.raises(BadInput, match="no figure 'speed'"):
        judge(history()).figure("speed")
    with pytest.raises(BadInput, match="no event 'x'"):
        judge(history(), until="x")
    assert Entry("a", "b", "deploy", "2000-01-02T00:00:00").day == 1.0
