"""Gates models in the trend store: sigmas and biases epoch by epoch, and an engine that has changed."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.estimate.gates import gates
from asflown.kit.errors import BadInput
from asflown.kit.timeline import utc_to_tai_ns
from asflown.maneuvers.history import past_model
from asflown.sim.maneuver_sets import RCS_SET, execute
from asflown.trends.entries.gates import gates_entry
from asflown.trends.store.store import TrendStore
from asflown.trends.verdicts import judge
from cli.program import complaint, run
from flights import CASSINI

RCS = past_model("rcs/2012-1").model
YEARS = range(2005, 2013)
DAY = 86_400_000_000_000


def burns(year: int, seed, **changes):
    """An epoch's burns, a week apart; ``changes`` to the model of the last."""
    model = replace(RCS, **changes) if year == YEARS[-1] else RCS
    m = execute(model, RCS_SET, seed)
    return replace(m, tai_ns=int(utc_to_tai_ns(f"{year}-01-01")) + 7 * DAY * np.arange(len(m)))


def epochs(seed: int, **changes):
    return [gates_entry(gates(burns(y, [seed, y], **changes)), CASSINI) for y in YEARS]


def test_an_entry_holds_every_parameter_with_its_sigma():
    fit = gates(burns(2005, 1))
    entry = gates_entry(fit, CASSINI)
    assert (entry.kind, entry.event, entry.date[:10]) == ("gates", "gates-rcs-2005-12-03", "2005-12-03")
    held = {v.figure: v for v in entry.values}
    assert set(held) == {
        f"{part}_{term}_rcs" for part, terms in (
            ("magnitude", ("fixed", "proportional", "bias_fixed", "bias_proportional")),
            ("pointing", ("fixed", "proportional", "bias_x_fixed", "bias_x_proportional", "bias_y_fixed", "bias_y_proportional")),
        ) for term in terms
    }  # fmt: skip
    low, high = fit.magnitude.interval("fixed")
    fixed = held["magnitude_fixed_rcs"]
    assert (fixed.value, fixed.sigma, fixed.unit) == (
        fit.magnitude.point.fixed,
        pytest.approx((high - low) / 3.92),
        "m/s",
    )
    assert held["pointing_bias_y_proportional_rcs"].value == fit.pointing.point.beta[3]
    assert held["pointing_bias_y_proportional_rcs"].unit == "rad" and held["magnitude_proportional_rcs"].unit == ""
    assert entry.doubts == fit.doubts and entry.provenance == fit.provenance


def test_what_is_held_is_no_estimate_and_a_limit_counts_as_zero():
    m = burns(2005, 2)
    held = gates_entry(gates(m, hold={"pointing_fixed": 0.0}), CASSINI, "mine")
    assert held.event == "mine" and held.best("pointing_fixed_rcs") is None
    fit = next(f for s in range(20) if "pointing.fixed" in (f := gates(burns(2005, s))).at_bound)
    limit = gates_entry(fit, CASSINI).best("pointing_fixed_rcs")
    assert limit.value == 0 and limit.sigma == pytest.approx(fit.pointing.interval("fixed")[1] / 1.96)


def test_other_readings_are_kept_apart_and_few_burns_give_nothing():
    m = burns(2005, 3)
    for words, basis in (
        ({"model": "zero-mean"}, "zero-mean, additive"),
        ({"likelihood": "unweighted"}, "estimated-bias, unweighted"),
    ):
        assert {v.basis for v in gates_entry(gates(m, **words), CASSINI).values} == {basis}
    assert gates_entry(gates(m.take(range(5))), CASSINI).known == 0
    with pytest.raises(BadInput, match="cannot enter a trend"):
        gates_entry(gates(replace(m, tai_ns=None)), CASSINI)


def test_recovery_of_an_engine_that_loses_thrust_or_scatters_more():
    weak = judge(epochs(1, bias_proportional=RCS.bias_proportional - 0.02), kind="gates")
    assert weak.verdict == "alarm" and "magnitude_bias_proportional_rcs" in weak.reasons[0]
    loose = judge(epochs(1, pointing_proportional_rad=3 * RCS.pointing_proportional_rad), kind="gates")
    assert loose.verdict == "alarm" and "pointing_proportional_rcs" in loose.reasons[0]


@pytest.mark.slow
def test_recovery_of_false_alarms_of_epochs_that_do_not_change():
    """Ten figures watched together; 60 missions: 5 % and 3 sigma."""
    said = [judge(epochs(s), kind="gates").verdict == "alarm" for s in range(60)]
    assert np.mean(said) <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 60)


def test_program_keeps_shows_watches_and_reports(tmp_path):
    store, table, page = tmp_path / "s.db", tmp_path / "set.csv", tmp_path / "page.html"
    with TrendStore.open(store) as trends:
        trends.add([gates_entry(gates(burns(y, y)), CASSINI) for y in YEARS])
    run("gates", "simulate", "--by", "rcs/2012-1", "--start", "2014-01-01", "--out", table)
    done = run("gates", table, "--store", store, "--id", "mine")
    assert done.code == 0 and "kept as mine" in done.err
    record = run(
        "trend", "show", "--kind", "gates", "--store", store, "--figure", "magnitude_fixed_rcs", "--json"
    ).record
    assert record["kind"] == "gates" and len(record["rows"]) == len(YEARS) + 1
    assert run("report", store, "--out", page).code == 0
    text = page.read_text()
    assert "9 gates" in text and "magnitude fixed rcs" in text and text.count("<svg") == 10 and "cycles</p>" not in text
    run("gates", "simulate", "--out", table)
    assert "cannot enter a trend" in complaint("gates", table, "--store", store)
    assert "is not a time" in complaint("gates", "simulate", "--start", "soon", "--out", table)
