"""Judging a Gates model and its burns: against the papers' counts, brute force, and simulated sets with known faults."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from scipy import stats

from asflown.estimate.gates import gates, gates_judgement, gates_patch, gates_prediction, judge, patch, planned
from asflown.estimate.gates.checks import directions_of, hodges_ajne, inside_band, rayleigh, sign_test
from asflown.kit.errors import BadInput
from asflown.maneuvers.history import past_model
from asflown.maneuvers.model import POINTING_BELOW_BIASES, Gates
from asflown.maneuvers.plan import Plan
from asflown.sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute
from maneuvers.sample import maneuvers

MAIN, RCS = past_model("main/2012-1"), past_model("rcs/2012-1")


def signed(below: int, count: int):
    """Burns of which so many fall short."""
    m = maneuvers(Gates(1e-3, 0, 1e-3, 0), np.geomspace(0.3, 13, count))
    error = np.abs(m.magnitude_error_mps)
    error[:below] *= -1
    return replace(m, magnitude_error_mps=error)


@pytest.mark.parametrize(
    "below, count, percent, p",
    [
        (37, 48, 77.1, 2.2e-4),
        (21, 48, 43.8, 0.47),
        (27, 48, 56.2, 0.47),
        (26, 49, 53.1, 0.78),
        (24, 49, 49.0, 1.0),
        (25, 49, 51.0, 1.0),
    ],
)
def test_published_counts_and_their_signs(below, count, percent, p):
    """002: underburns and overburns of both engines before and after the biases were taken out."""
    spread = gates_judgement(gates(signed(below, count)), draws=20).spreads[0]
    assert spread.below == below and 100 * spread.below / spread.count == pytest.approx(
        percent, abs=0.051
    )  # as printed
    assert spread.sign_p == pytest.approx(p, rel=0.06) == sign_test(below, count)


def test_published_later_burns_lie_closer_than_the_model_says():
    """14 of 14 main-engine burns within 4 mm/s, where sigma is 3.5; 20 of 20 of the RCS within 1 mm/s."""
    chance = lambda limit, sigma, n: float((2 * stats.norm.cdf(limit / sigma) - 1) ** n)  # noqa: E731
    assert chance(4e-3, MAIN.model.sigma_magnitude(0.0), 14) == pytest.approx(0.0168, abs=5e-5)
    assert chance(1e-3, RCS.model.sigma_magnitude(0.1), 20) == pytest.approx(0.081, abs=1e-3)
    assert chance(1e-3, RCS.model.sigma_magnitude(0.0), 20) == pytest.approx(0.394, abs=5e-4)
    quiet = maneuvers(Gates(1.5e-3, 0, 5e-3, 1e-3), np.geomspace(0.5, 10, 14))
    found = gates_judgement(gates(quiet), against=MAIN, draws=20)
    assert found.against.chi2_p < 0.02
    assert [d.about["way"] for d in found.doubts.of(judge.AGAINST_SIGMAS)] == ["smaller"]


@pytest.mark.parametrize("count, expected", [(26, 1.2), (48, 2.2), (49, 2.2), (85, 3.9)])
def test_published_number_of_false_two_sigma_flags(count, expected):
    m = replace(signed(count // 2, count), pointing_error_mps=None, pointing_covariance=None)
    assert round(gates_judgement(gates(m), draws=20).expected_beyond_2_sigma, 1) == expected


def test_published_totals_and_bands():
    assert (MAIN.count[0] + 14, RCS.count[0] + 20) == (62, 69)  # "nearly 70"
    low, high = inside_band(48)
    assert low <= 0.68 * 48 <= high and stats.binom.cdf(high, 48, 0.6827) - stats.binom.cdf(low - 1, 48, 0.6827) >= 0.95


def test_law_half_circles_are_counted_right():
    """Against trying half circles all around."""
    rng = np.random.default_rng(1)
    for n in (5, 9, 20, 41):
        angle = rng.vonmises(0.5, 0.6, n)
        starts = np.concatenate([angle + e + h for e in (-1e-9, 1e-9) for h in (0, np.pi)])
        fewest = min(int(np.sum(np.mod(angle - s, 2 * np.pi) < np.pi)) for s in starts)
        assert hodges_ajne(angle) == pytest.approx(min(1.0, (n - 2 * fewest) * comb(n, fewest) / 2 ** (n - 1)))


def test_law_uniform_directions_pass_as_often_as_they_say():
    rng = np.random.default_rng(2)
    sets = rng.uniform(0, 2 * np.pi, (2000, 30))
    for test in (lambda a: rayleigh(len(a), abs(np.mean(np.exp(1j * a)))), hodges_ajne):
        p = np.array([test(a) for a in sets])
        assert 0.015 < np.mean(p < 0.05) < 0.065  # the second counts, and is coarse: 0.022


def test_directions_of_a_biased_set():
    """002 Figure 11d: nearly all RCS burns in the +X +Y quadrant."""
    d = directions_of(execute(RCS.model, RCS_SET, 1).pointing_error_mps)
    assert max(d.quadrants) == d.quadrants[0] and d.rayleigh_p < 1e-4 and 0 < d.mean_rad < np.pi / 2


def test_law_an_outlier_is_judged_by_the_model_without_it():
    m = execute(MAIN.model, MAIN_ENGINE_SET, 3)
    error = m.magnitude_error_mps.copy()
    error[7] += 25e-3
    m = replace(m, magnitude_error_mps=error)
    fit = gates(m)
    found = gates_judgement(fit, draws=50)
    worst = found.outliers[0]
    assert worst.id == m.id[7] and worst.component == "magnitude" and worst.discovered
    rest = gates(m.without([m.id[7]], "test"))
    moved = next(i for i in found.influence if i.id == m.id[7])
    assert moved.changes["magnitude"]["fixed_mps"] == pytest.approx(
        rest.magnitude.point.fixed - fit.magnitude.point.fixed, rel=1e-3
    )
    assert moved.changes["pointing"]["bias_fixed_mps"][0] == pytest.approx(
        rest.pointing.point.beta[0] - fit.pointing.point.beta[0], rel=1e-2
    )
    assert found.sufficient is False and found.doubts.has(judge.NOT_SUFFICIENT)


@pytest.mark.slow
def test_recovery_outliers_are_rarely_false():
    """The false-discovery rule flags in 5 % of clean sets or fewer; two sigma flags in nearly all."""
    found = [gates_judgement(gates(execute(MAIN.model, MAIN_ENGINE_SET, [8, n])), draws=10).outliers for n in range(60)]
    assert np.mean([any(o.discovered for o in f) for f in found]) < 0.15
    assert np.mean([len(f) for f in found]) == pytest.approx(4.4, abs=1.0)


def test_recovery_one_well_determined_small_burn_decides_a_small_set():
    """002 Figure 9: of 20 RCS burns three are small, one of them well determined; in a set of 69 no burn decides."""
    dv = np.concatenate([[0.01, 0.011, 0.012], np.geomspace(0.06, 0.3, 17)])
    m = maneuvers(Gates(0.3e-3, 4e-3, 0.1e-3, 4.5e-3), dv, 0.3e-3, seed=4)
    error, sigma = m.magnitude_error_mps.copy(), m.sigma_magnitude_mps.copy()
    error[0], sigma[0] = 1.5e-3, 0.02e-3
    sigma[1:3] = 1e-3
    few = gates_judgement(gates(replace(m, magnitude_error_mps=error, sigma_magnitude_mps=sigma)), draws=20)
    worst = max(few.influence, key=lambda i: i.in_sigmas)
    assert worst.id == m.id[0] and few.sufficient is False
    many = gates_judgement(gates(execute(RCS.model, replace(RCS_SET, count=69), 3)), draws=20)
    assert many.sufficient is True


def test_envelope_and_distribution_of_a_right_model():
    found = gates_judgement(gates(execute(MAIN.model, MAIN_ENGINE_SET, 11)), draws=200)
    s = found.spreads[0]
    inside = (s.shape.envelope[0] <= s.shape.quantiles) & (s.shape.quantiles <= s.shape.envelope[1])
    assert inside.mean() > 0.85 and s.shape.p > 0.01
    assert sum(s.record()["pit_counts"]) == 48
    heavy = execute(MAIN.model, MAIN_ENGINE_SET, 11)
    heavy = replace(heavy, magnitude_error_mps=4e-3 * np.random.default_rng(0).standard_t(1.2, 48))
    assert gates_judgement(gates(heavy), draws=200).spreads[0].shape.p < 0.05


@pytest.mark.slow
def test_against_its_own_model_nothing_is_outside_too_often():
    outside = 0
    for n in range(30):
        found = gates_judgement(gates(execute(MAIN.model, MAIN_ENGINE_SET, [12, n])), against=MAIN, draws=5).against
        said = [
            x for keys in found.consistent.values() for v in keys.values() for x in (v if isinstance(v, list) else [v])
        ]
        outside += said.count(False)
    assert outside / 300 == pytest.approx(0.05, abs=0.04)


def test_few_burns_are_counted_and_nothing_more():
    found = gates_judgement(gates(execute(MAIN.model, MAIN_ENGINE_SET, 1).take(range(5))))
    assert found.outliers == () and found.influence == () and found.sufficient is None
    assert found.spreads[0].record()["inside_1_sigma"] is None and str(found) and found.record()


# ---- before and after a patch ---------------------------------------------------------------------


def patched(left_mps: float):
    """The 2012-1 story: 48 burns with the bias, 14 after a patch that took 4 mm/s out and left some."""
    before = execute(MAIN.model, MAIN_ENGINE_SET, 21)
    model = replace(MAIN.model, bias_fixed_mps=left_mps, bias_proportional=3e-4)
    after = execute(model, replace(MAIN_ENGINE_SET, count=14), 22)
    joined = {
        n: np.concatenate([getattr(before, n), getattr(after, n)])
        for n in ("dv_mps", "magnitude_error_mps", "sigma_magnitude_mps", "pointing_error_mps", "pointing_covariance")
    }
    ids = tuple(f"OTM-{k}" for k in range(62))
    return replace(before, id=ids, engine=("main",) * 62, ledger=((),) * 62, **joined)


def test_a_patch_that_worked_and_one_that_did_not():
    good = gates_patch(patched(-0.2e-3), "OTM-48", removed_fixed_mps=-4e-3)
    as_flown, before, after = good.epochs
    assert as_flown.below > before.below and as_flown.bias_fixed_mps - before.bias_fixed_mps == pytest.approx(-4e-3)
    assert good.difference_p > 0.05 and (as_flown.count, after.count) == (48, 14)
    assert [len(b) for b in good.maneuvers.ledger] == [1] * 48 + [0] * 14
    bad = gates_patch(patched(-8e-3), "OTM-48", removed_fixed_mps=-4e-3)
    assert bad.difference_p < 0.01
    assert bad.doubts.has(patch.EPOCHS_DIFFER) and bad.doubts.has(patch.BIAS_LEFT)
    with pytest.raises(BadInput, match="made already"):
        gates_patch(good.maneuvers, "OTM-48", removed_fixed_mps=-4e-3)
    with pytest.raises(BadInput, match="too few to compare"):
        gates_patch(good.maneuvers, "OTM-2", removed_fixed_mps=-4e-3)


# ---- burns to come --------------------------------------------------------------------------------


def test_published_errors_of_planned_burns():
    found = gates_prediction(Plan(("a", "b"), np.array([13.0, 14.0])), MAIN)
    a, _ = found.burns
    assert 1e3 * a.magnitude_sigma_mps == pytest.approx(4.360, abs=5e-4)
    assert 1e3 * a.pointing_sigma_mps[0] == pytest.approx(13.928, abs=5e-4)
    assert 1e3 * a.mean_mps[2] == pytest.approx(-0.2 + 0.03e-2 * 13e3)  # the proportional bias was left
    assert [d.about["burns"] for d in found.doubts.of(planned.OUTSIDE_SIZES)] == ["b"]
    assert gates_prediction(Plan(("a",), np.array([0.1])), RCS).doubts.has(POINTING_BELOW_BIASES)


def test_law_a_plan_with_directions_is_turned():
    axes = np.array([[[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]])  # TVC Z along inertial x
    burn = gates_prediction(Plan(("a",), np.array([1.0]), axes), MAIN).burns[0]
    assert np.sqrt(burn.covariance_N_m2_s2[0, 0]) == pytest.approx(burn.magnitude_sigma_mps)
    assert np.sqrt(burn.covariance_N_m2_s2[1, 1]) == pytest.approx(burn.pointing_sigma_mps[0])
    drawn = burn.samples(20_000, np.random.default_rng(0))
    inside = np.sum(((drawn - burn.mean_mps) / burn.ellipsoid_mps) ** 2, axis=1) <= 1
    assert inside.mean() == pytest.approx(0.95, abs=0.006)


def test_models_differ_in_what_they_foresee():
    m = execute(MAIN.model, MAIN_ENGINE_SET, 2)
    plan = Plan(("a",), np.array([5.0]))
    fits = {w: gates(m, model=w) for w in ("estimated-bias", "mean-aware", "zero-mean")}
    biased, aware, flat = (gates_prediction(plan, f).burns[0] for f in fits.values())
    assert biased.mean_mps == pytest.approx(0) and aware.mean_mps[2] == pytest.approx(
        fits["mean-aware"].gates.mean_magnitude(5.0)
    )
    assert (
        biased.covariance_m2_s2 == pytest.approx(aware.covariance_m2_s2)
        and flat.magnitude_sigma_mps > biased.magnitude_sigma_mps
    )
    assert biased.magnitude_sigma_mps > fits["estimated-bias"].gates.sigma_magnitude(
        5.0
    )  # the bias is not known exactly
    assert gates_prediction(Plan(("b",), np.array([50.0])), fits["zero-mean"]).doubts.has(planned.OUTSIDE_SIZES)
