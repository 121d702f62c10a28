"""Density from thrusters' on-times: laws on the balance, recovery on simulated flybys E5 and of an atmosphere, what it refuses."""

from functools import cache

import numpy as np
import pytest

import flights
from asflown.dynamics.flyby import flyby_called, published_peaks
from asflown.estimate.density.along_flyby import density
from asflown.estimate.firing.impulse import gained
from asflown.estimate.jets.fit import jets
from asflown.estimate.subject import subject_of
from asflown.estimate.torque.on_times import OnTimes, areas
from asflown.kit.errors import BadInput
from cli.program import complaint, run
from flights import CASSINI, saved, without

HELD = {"velocity_B": (0, 1, 0), "up_B": (1, 0, 0)}
E5_S, TITAN_S = 300.0, 420.0


def flown(scenario="e5", seed=2, thrust="0.96 N", noise="nominal", **flyby):
    return flights.flown(scenario, seed=seed, noise=noise, thrusters={"thrust": thrust}, flyby=flyby)


@cache
def found(scenario="e5", closest_s=E5_S):
    f = flown(scenario)
    return f, density(f.telemetry, CASSINI, f.met.flyby.name, closest_s, **HELD)


def truth_along(f, r, closest_s):
    return np.interp(r.time_s + closest_s, f.truth.time_s, f.truth.density_kgm3)


# ---- published ----------------------------------------------------------------------------------------------


def test_published_e5():
    """004 Table 4: 12.5e-12 at +20 s and 198 km (its own altitude and time give 197.1), 1.51 times the mass spectrometer's."""
    e5 = flyby_called("E5")
    assert e5.altitude(20.0) / 1e3 == pytest.approx(197.1, abs=0.05) and e5.altitude(0.0) == pytest.approx(24.6e3)
    assert e5.altitude(30.0) / 1e3 == pytest.approx(346.6, abs=0.05)
    aacs, inms = (
        next(p for p in published_peaks() if (p.flyby, p.instrument) == ("E5", who)) for who in ("AACS", "INMS")
    )
    assert aacs.density_kgm3[0] / inms.density_kgm3[0] == pytest.approx(1.51, abs=0.005)
    peak = flown().met.peak  # the scenario's jets are scaled to it
    assert peak[1] == pytest.approx(12.5e-12, rel=0.005) and peak[0] - E5_S == pytest.approx(20, abs=2)


# ---- laws ---------------------------------------------------------------------------------------------------


def test_law_areas_are_the_integrals_of_a_piecewise_linear_curve():
    rng = np.random.default_rng(3)
    knots, values = np.arange(0.0, 21.0, 2.0), rng.standard_normal(11)
    instants = np.sort(rng.uniform(0, 20, 15))
    fine = np.linspace(0, 20, 200_001)
    summed = np.concatenate(
        [[0], np.cumsum(np.diff(fine) * (lambda y: 0.5 * (y[1:] + y[:-1]))(np.interp(fine, knots, values)))]
    )
    assert areas(instants, knots) @ values == pytest.approx(np.diff(np.interp(instants, fine, summed)), abs=1e-8)
    assert areas(np.array([20.0, 25.0]), knots) @ values == pytest.approx([5 * values[-1]])  # held beyond the end


def test_law_momentum_less_what_thrusters_gave_is_the_impulse_from_outside():
    """Without noise, thrust known: but for tails still to come where a sample is taken soon after a pulse."""
    f = flown(noise="none", thrust="1.0101489522443345 N", seed=5)
    g = gained(subject_of(f.telemetry, CASSINI), "z")
    given = np.concatenate([[0], np.cumsum(0.125 * f.truth.torque_Nm[:-1, 2])])
    outside = np.diff(np.interp(g.time_s, f.truth.time_s, given))
    off = np.abs(g.impulse_Nms - outside)
    assert np.median(off) < 3e-4  # N m s: pulses give 0.42 each, to 2 %
    assert np.mean(off < 0.025) > 0.9


def test_law_an_atmospheres_scale_height_does_not_depend_on_the_scale_of_drag():
    f, r = found("titan", TITAN_S)
    twice = density(f.telemetry, CASSINI, "Titan", TITAN_S, area_m2=2 * 18.401, **HELD)
    assert twice.atmosphere.scale_height_m == pytest.approx(r.atmosphere.scale_height_m)
    assert twice.atmosphere.density_kgm3 == pytest.approx(r.atmosphere.density_kgm3 / 2)


# ---- recovery -----------------------------------------------------------------------------------------------


def test_recovery_of_e5_and_of_its_thrust():
    f, r = found()
    truth = truth_along(f, r, E5_S)
    near = truth > 0.02 * truth.max()
    assert r.method == "on-times"
    assert np.sqrt(np.mean((r.density_kgm3 - truth)[near] ** 2)) < 0.05 * truth.max()
    assert r.peak.density_kgm3 == pytest.approx(truth.max(), rel=0.2) and abs(r.peak.time_s - 21.6) < 4
    told = r.settings["torque"]
    assert told["thrust_believed_N"] == pytest.approx(1.01, abs=0.001)
    assert abs(told["thrust_N"] - 0.96) < 2 * told["thrust_sigma_N"]
    step = told["impulses"][75]
    assert (step["start_s"], step["stop_s"]) == (300.0, 304.0) and step["sigma_Nms"] < 0.03


def test_recovery_of_an_atmosphere():
    f, r = found("titan", TITAN_S)
    a = r.atmosphere
    truth = truth_along(f, r, TITAN_S)
    assert np.sqrt(np.mean((r.density_kgm3 - truth) ** 2)) < 0.03 * truth.max()
    assert a.scale_height_m == pytest.approx(58e3, rel=0.01) and a.density_kgm3 == pytest.approx(5e-10, rel=0.03)
    record = r.record()["atmosphere"]
    assert record["scale_height_ci95_km"][0] < record["scale_height_km"] < record["scale_height_ci95_km"][1]
    assert "scale height [km]" in str(r)


def test_recovery_of_a_thin_atmosphere_on_wheels():
    """The same balance where nothing fires: momentum is all."""
    passage = {"name": "Titan", "closest_approach": "240 s", "density": "2e-11 kg/m3"}
    f = flights.flown("quiet", epoch="2008-02-22T17:00:00", flyby=passage, seed=4)
    a = density(f.telemetry, CASSINI, "Titan", 240.0, method="momentum").atmosphere
    low, high = a.scale_height_ci95_m
    assert low < 58e3 < high and high - low < 12e3
    assert a.density_ci95_kgm3[0] * 0.97 < 2e-11 < a.density_ci95_kgm3[1] * 1.03


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [1, 2])
def test_recovery_of_e5_over_many_flybys(exponent):
    """A cusp narrower than the on-times' spacing comes out lower; a round top does not by much."""
    off, pulls, late, thrust = [], [], [], []
    for seed in range(100, 140):
        believed = 1.0101 * (1 + 0.05 * np.random.default_rng(seed).standard_normal())
        f = flights.flown("e5", seed=seed, thrusters={"thrust": f"{believed:.4f} N"}, flyby={"exponent": exponent})
        r = density(f.telemetry, CASSINI, "E5", E5_S, **HELD)
        at, rho, _, _ = f.met.peak
        off.append(r.peak.density_kgm3 / rho - 1)
        pulls.append((r.peak.density_kgm3 - rho) / r.peak.density_sigma_shape_kgm3)
        late.append(r.peak.time_s + E5_S - at)
        thrust.append((r.settings["torque"]["thrust_N"] - believed) / r.settings["torque"]["thrust_sigma_N"])
    assert np.mean(off) == pytest.approx({1: -0.10, 2: -0.02}[exponent], abs=0.03)
    assert np.sqrt(np.mean(np.square(pulls))) < {1: 2.5, 2: 1.5}[exponent]
    assert np.abs(np.mean(late)) < 2 and np.abs(np.mean(thrust)) < 0.5


# ---- what it chooses, says and refuses ----------------------------------------------------------------------


def test_it_is_chosen_where_thrusters_fire_and_only_there():
    f = flown()
    named = density(f.telemetry, CASSINI, "E5", E5_S, method="momentum")
    assert named.method == "momentum"
    with pytest.raises(BadInput, match="thrusters fire"):
        jets(f.telemetry, CASSINI, "E3", E5_S)


@pytest.mark.parametrize(("telemetry", "words"), [
    (lambda t: t.between(300, 360), "too few"),
    (lambda t: flights.flown("quiet", duration="120 s").telemetry, "no thruster fires"),
    (lambda t: flights.flown("slews", seed=1, duration="600 s", thrusters={"center_of_mass": "0 0 1.35 m"}).telemetry, "turns by"),
])  # fmt: skip
def test_what_it_refuses(telemetry, words):
    with pytest.raises(BadInput, match=words):
        OnTimes().estimate(subject_of(telemetry(flown().telemetry), CASSINI), (2,))


def test_the_verb(tmp_path):
    path = saved(flown().telemetry, tmp_path)
    words = ("density", path, "--flyby", "E5", "--closest-approach", "2008-10-09T19:06:40")
    done = run(*words, "--json")
    assert done.code == 0 and done.record["method"] == "on-times" and done.record["peak"]["sigma_time_s"] > 0
    assert {"start_s", "stop_s", "impulse_Nms", "sigma_Nms"} == set(done.record["settings"]["torque"]["impulses"][0])
    assert done.record["atmosphere"] is None
    lean = saved(without(flown().telemetry, "body_rate"), tmp_path, "lean.csv")
    assert "body_rate_x" in complaint(*words[:1], lean, *words[2:])
