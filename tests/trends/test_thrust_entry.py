"""Thrust over the years: against the blow-down, each thruster against the others, and what would have been seen."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.estimate.firing.priors import thrust_priors
from asflown.estimate.thrust.methods import thrust
from asflown.estimate.thrust.result import ThrustResult
from asflown.kit.errors import BadInput
from asflown.kit.timeline import utc_to_tai_ns
from asflown.sim.flight.closed_loop import fly
from asflown.trends.entries.thrust import thrust_entry
from asflown.trends.verdicts import judge
from cli.program import run
from flights import telemetry_of

CASSINI = load_craft("cassini", cm=(0, 0, 1.35))
NAMES = tuple(t.name for t in CASSINI.thrusters)
DATES = ["2005-01-28", "2005-02-18", "2005-03-02", "2005-03-12", "2005-04-04", "2005-07-01", "2005-10-01", "2006-01-10",
         "2006-06-01", "2006-12-01", "2007-06-01", "2008-01-15", "2008-06-01"]  # fmt: skip
OWN = 0.012  # sigma of a thruster over the mean, as joint results of wheel biasings have it


def records(seed: int, weak: float = 1.0, faster: float = 0.0):
    """Entries of 13 events; at the last Z3 has ``weak`` of its thrust, and all lose ``faster`` more than predicted."""
    rng = np.random.default_rng(seed)
    entries, own = [], 1 + 0.01 * rng.standard_normal(8)
    for k, date in enumerate(DATES):
        ns = int(utc_to_tai_ns(date))
        predicted = CASSINI.thrust_at(ns)
        mean = predicted * (1 - faster * k / (len(DATES) - 1)) * (1 + 0.02 * rng.standard_normal())
        ratios = (
            own
            * (1 + OWN * rng.standard_normal(8))
            * np.where(np.array(NAMES) == "Z3", weak if date == DATES[-1] else 1, 1)
        )
        result = ThrustResult(
            craft="cassini", epoch=date, method="joint", names=NAMES,
            thrust_N={n: mean * r for n, r in zip(NAMES, ratios, strict=True)},
            thrust_sigma_N=dict.fromkeys(NAMES, 0.02), mean_thrust_N=mean, mean_thrust_sigma_N=0.02, pulse_ratio={},
            on_time_s=dict.fromkeys(NAMES, 1.0), pulses=dict.fromkeys(NAMES, 8.0), pulses_counted=True,
            fall_time_s=0.065, fall_time_sigma_s=0.004,
            over_mean={n: (r, OWN) for n, r in zip(NAMES, ratios, strict=True)}, predicted_thrust_N=predicted,
        )  # fmt: skip
        entries.append(thrust_entry(result, telemetry_of(ns, body_rate_x=([0], [0])), CASSINI))
    return entries


def test_recovery_of_a_thruster_that_degrades_and_what_would_have_been_seen():
    health = judge(records(1, weak=0.85), kind="thrust")
    assert health.verdict == "alarm"
    assert any("thrust_Z3_over_mean" in r for r in health.reasons) and not any("Z1" in r for r in health.reasons)
    newest = health.figure("thrust_Z3_over_mean").newest
    assert 2 < newest.detectable() < 8 and newest.power(15) > 0.95


@pytest.mark.slow
def test_recovery_of_degradation_comes_with_the_stated_power():
    """6 % less of one thruster, thirteen events, eight thrusters watched: as often an alarm as is said, and hardly without."""
    found = [judge(records(s, weak=0.94), kind="thrust").figure("thrust_Z3_over_mean") for s in range(60)]
    said = np.mean([f.newest.power(6) for f in found])
    assert np.mean([f.newest.p_value < 0.05 for f in found]) == pytest.approx(said, abs=0.2)
    quiet = [judge(records(s), kind="thrust").verdict for s in range(60)]
    assert np.mean([v == "alarm" for v in quiet]) <= 0.15


@pytest.mark.slow
def test_recovery_of_a_thrust_that_falls_faster_than_predicted():
    """The recharge of April 2006, 0.69 to 1.01 N, is in the prediction and leaves no trace in the ratio."""
    found = [judge(records(s), kind="thrust").figure("thrust_over_prediction").trend for s in range(20)]
    assert np.mean([t.change_percent for t in found]) == pytest.approx(0, abs=1.5)
    assert np.mean([t.change_percent_ci95[0] < 0 < t.change_percent_ci95[1] for t in found]) >= 0.8
    faster = judge(records(2, faster=0.12), kind="thrust").figure("thrust_over_prediction").trend
    assert faster.change_percent == pytest.approx(-12, abs=5) and faster.p_value < 0.02


def test_other_methods_are_kept_apart_and_a_record_needs_a_date(tmp_path):
    flight = fly("wheel-bias-day28", craft=CASSINI)
    printed = thrust(flight.telemetry, CASSINI, method="printed")
    bases = {v.basis for v in thrust_entry(printed, flight.telemetry, CASSINI, "mine").values}
    assert bases == {"printed, corrected"}
    with pytest.raises(BadInput, match="cannot enter a trend"):
        thrust_entry(printed, replace(flight.telemetry, dated=False), CASSINI)


def test_program_watches_thrust(tmp_path):
    from asflown.trends.store.store import TrendStore

    store = tmp_path / "s.db"
    with TrendStore.open(store) as trends:
        trends.add(records(1, weak=0.85))
    done = run("trend", "watch", "--kind", "thrust", "--store", store)
    assert done.code == 3 and "thrust_Z3_over_mean" in done.out
    page = tmp_path / "page.html"
    assert run("report", store, "--out", page).code in (0, 3) and "13 thrust" in page.read_text()


@pytest.mark.slow
def test_recovery_of_a_degraded_thruster_flown_end_to_end():
    """Eight biasings flown; in the last Z3 gives 85 %.  The centre of mass is known to 1 cm."""
    entries = []
    for k, date in enumerate(DATES[:8]):
        weak = [{"thruster": "Z3", "start": "0 s", "factor": 0.85}] if k == 7 else []
        flight = fly(
            "wheel-bias-day28", craft=CASSINI, seed=k, changes={"epoch": f"{date}T00:00:00", "thruster_faults": weak}
        )
        result = thrust(flight.telemetry, CASSINI, priors=thrust_priors(CASSINI, center_sigma_m=(0.01, 0.01, 0.1)))
        entries.append(thrust_entry(result, flight.telemetry, CASSINI))
    health = judge(entries, kind="thrust")
    assert health.verdict == "alarm" and any("thrust_Z3_over_mean" in r for r in health.reasons)
