"""A peak's sigma, held against flights of the estimator's own model."""

import numpy as np
import pytest

import asflown
from asflown import fly
from asflown.estimate.fused.peaks import peak_scale
from asflown.kit.peaks import PEAK_REACH_S, excursions
from asflown.sim.scenario.scenario import load_scenario
from flights import CASSINI, flown


def flights(off: float, said: float, seed: int):
    """A mean torque with two peaks, true ones, and draws off by ``off`` and as wide as ``said``. [N m]"""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0, 100, 0.5)
    mean = np.interp(time_s, [10, 30, 50, 70, 90], [0, 0.02, 0, -0.01, 0])
    bump = np.abs(mean) > 0
    true = np.repeat(mean[None], 300, axis=0)
    found = mean + off * np.sign(mean) * rng.standard_normal((300, 1)) * bump
    return time_s, mean, true, found[:, None] + said * np.sign(mean) * rng.standard_normal((300, 200, 1)) * bump


@pytest.mark.parametrize(("ratio", "scale"), [(0.5, 1.0), (1.5, 1.5), (2.0, 2.0)])
def test_law_the_scale_is_the_width_of_the_pulls_and_only_widens(ratio, scale):
    said = 2e-4
    time_s, mean, true, drawn = flights(ratio * said, said, seed=1)
    assert peak_scale(time_s, mean, excursions(mean), true, drawn) == pytest.approx(scale, rel=0.1)


def test_law_noise_has_no_excursions():
    noise = 1e-4 * np.random.default_rng(2).standard_normal(500)
    assert len(excursions(noise)) and not len(excursions(noise, np.full(500, 1e-4)))
    assert not len(excursions(np.full(500, np.nan))) and not len(excursions(np.zeros(500)))


def test_law_what_stands_out_less_than_a_quarter_is_no_excursion():
    time_s = np.arange(0, 100.0)
    torque = np.interp(time_s, [0, 20, 40, 60, 70, 80, 90], [0, 4, 0, -2, 0, 0.9, 0])
    assert excursions(torque).tolist() == [20, 60]


def test_recovery_sigma_and_interval_of_a_peak_are_those_of_its_draws_times_the_scale():
    r = asflown.torque(flown("cover-deploy", seed=3).telemetry, CASSINI, axis="y", method="fused")
    scale = r.settings["torque"]["y"]["peak_scale"]
    assert 1 <= scale < 3 and scale == r.peak_scale("y") and r.peak_scale("x") == 1.0
    at_s, true = LARGE[0]
    p = r.peak(at_s, PEAK_REACH_S, "y")
    near = np.abs(r.paths_time_s - at_s) <= PEAK_REACH_S
    highest = r.paths_Nm[:, near, 1].max(axis=1)
    assert p.torque_Nm == pytest.approx(highest.mean()) and abs(p.torque_Nm - true) < 3 * p.torque_sigma_Nm
    assert 0.6 < p.torque_sigma_Nm / (scale * highest.std()) < 1.4
    assert np.ptp(p.torque_ci95_Nm) == pytest.approx(scale * np.ptp(np.quantile(highest, [0.025, 0.975])))
    assert p.holds(p.torque_Nm) and not p.holds(2 * p.torque_Nm)


def test_law_pure_lines_are_not_flown_again():
    r = asflown.torque(flown("profile-2", seed=3).telemetry, CASSINI, axis="y", method="fused")
    assert r.settings["torque"]["y"]["lines_probability"] > 0.5 and "peak_scale" not in r.settings["torque"]["y"]
    assert r.peak_scale("y") == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["half", "double"])
def test_recovery_intervals_of_a_curves_narrow_peaks_hold(noise):
    """The cover's come out 8 % high and 6 % low: their draws alone say too little of it."""
    plan, held = load_scenario("cover-deploy"), []
    for seed in range(1000, 1008):
        flight = fly(plan, seed=seed, noise=noise)
        r = asflown.torque(flight.telemetry, CASSINI, axis="y", method="fused")
        held += [r.peak(at_s, PEAK_REACH_S, "y").holds(true) for at_s, true in LARGE]
    assert np.mean(held) > 0.85


#: True extremes of the cover's torque about y. [s], [N m]
LARGE = (
    (145.4, 0.01086),
    (177.25, 0.01131),
    (205.25, 0.01102),
    (243.5, 0.01507),
    (163.25, -0.01091),
    (191.25, -0.01261),
    (217.9, -0.01071),
)
