"""Fitted Gates models: against exact answers, laws, and many simulated sets."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize, stats

from asflown.estimate.gates import fit_doubts as doubt
from asflown.estimate.gates import gates, gates_judgement, gates_watch
from asflown.estimate.gates.fit_doubts import FEWEST
from asflown.estimate.gates.intervals import _cuts
from asflown.estimate.gates.likelihoods import problems
from asflown.kit.errors import BadInput
from asflown.kit.plain import plain
from asflown.maneuvers.history import past_model
from asflown.maneuvers.model import Gates
from asflown.maneuvers.table import Maneuvers
from asflown.sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute
from maneuvers.sample import maneuvers

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

MAIN, RCS = past_model("main/2012-1").model, past_model("rcs/2012-1").model


@pytest.fixture(scope="module")
def main_set():
    return execute(MAIN, MAIN_ENGINE_SET, 5)


def values(fit) -> np.ndarray:
    return np.array([x for p in fit.parts for x in p.point.values])


def test_law_burns_of_one_size_give_the_sample_variance():
    """With one size, no tracking errors and no proportional term: the restricted estimate is the sample's variance with N - 1."""
    m = maneuvers(Gates(3e-3, 0, 2e-3, 0), np.full(20, 1.0))
    fit = gates(
        replace(m, dv_mps=np.linspace(1, 1 + 1e-9, 20)),
        hold={"magnitude_proportional": 0.0, "pointing_proportional": 0.0},
        model="zero-mean",
    )
    x = m.magnitude_error_mps
    assert fit.magnitude.point.fixed == pytest.approx(np.sqrt(np.mean(x**2)), rel=1e-6)
    low, high = fit.magnitude.sigma_ci95[0]
    ratio = 20 * np.mean(x**2) / stats.chi2.ppf([0.975, 0.025], 20)
    assert [low, high] == pytest.approx(
        np.sqrt(ratio), rel=0.03
    )  # the exact interval has equal tails, ours equal likelihoods


def test_law_restricted_likelihood_takes_out_the_small_sample_bias():
    """Two fitted biases: maximum likelihood's sigma is sqrt((N - 2) / N) of the restricted one where all burns count alike."""
    m = maneuvers(Gates(3e-3, 0, 2e-3, 0), np.linspace(1, 3, 11))
    hold = {"magnitude_proportional": 0.0}
    restricted = gates(m, hold=hold).magnitude.point.fixed
    plain = problems(m, hold=hold)["magnitude"]
    assert replace(plain, reml=False).minimum().fixed / restricted == pytest.approx(np.sqrt(9 / 11), rel=1e-5)


@pytest.mark.parametrize("likelihood", ["additive", "robust", "printed", "unweighted"])
def test_law_the_maximum_is_one(likelihood, main_set):
    """No other optimiser finds better, from anywhere.  The robust one takes weights as given in its restricted part: 0.01 off."""
    for problem in problems(main_set, likelihood=likelihood).values():
        off = 1e-7
        if likelihood == "robust":
            assert problem.minimum().objective <= _least(problem, [3e-3, 5e-4]) + 1e-2
            problem, off = replace(problem, reml=False), 1e-6
        best = problem.minimum().objective
        assert best <= min(_least(problem, start) for start in ([3e-3, 5e-4], [1e-4, 1e-3], [8e-3, 1e-5])) + off


def _least(problem, start) -> float:
    """The least objective that a simplex finds from a start."""
    simplex = [start, [2 * start[0], start[1]], [start[0], 2 * start[1]]]
    how = {"xatol": 1e-9, "fatol": 1e-10, "initial_simplex": simplex}
    at = lambda s: problem.minimum(fixed=abs(s[0]), proportional=abs(s[1])).objective  # noqa: E731
    return optimize.minimize(at, start, method="Nelder-Mead", options=how).fun


def test_law_units_and_order_do_not_matter(main_set):
    first = values(gates(main_set))
    turned = main_set.take(np.arange(len(main_set))[::-1])
    assert values(gates(turned)) == pytest.approx(first, rel=1e-4, abs=1e-9)
    scaled = replace(
        main_set, magnitude_error_mps=10 * main_set.magnitude_error_mps, sigma_magnitude_mps=10 * main_set.sigma_magnitude_mps,
        pointing_error_mps=10 * main_set.pointing_error_mps, pointing_covariance=100 * main_set.pointing_covariance,
    )  # fmt: skip
    assert values(gates(scaled)) == pytest.approx(10 * first, rel=1e-4, abs=1e-9)


def test_law_pointing_turns_with_its_axes(main_set):
    """Pointing errors turned about Z give the same sigmas and biases turned likewise."""
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s], [s, c]])
    turned = replace(
        main_set,
        pointing_error_mps=main_set.pointing_error_mps @ R.T,
        pointing_covariance=R @ main_set.pointing_covariance @ R.T,
    )
    a, b = gates(main_set).pointing.point, gates(turned).pointing.point
    assert (b.fixed, b.proportional) == pytest.approx((a.fixed, a.proportional), rel=1e-4)
    assert b.beta[[0, 2]] == pytest.approx(R @ a.beta[[0, 2]], rel=1e-4)


def test_published_cuts_of_a_bounded_mean():
    """Feldman and Cousins (1998): 1.64^2 on the bound, 1.96^2 far from it."""
    _, cut = _cuts()
    assert cut[0] == pytest.approx(stats.norm.ppf(0.95) ** 2, rel=1e-6) and cut[-1] == pytest.approx(
        stats.norm.ppf(0.975) ** 2, rel=1e-6
    )
    assert (np.diff(cut) >= -1e-9).all()


def test_published_weights_are_kept_and_doubted(main_set):
    fit = gates(main_set, likelihood="printed")
    assert fit.record()["magnitude"]["ci95"]["fixed_mps"] is None
    assert fit.doubts.has(doubt.EXPONENT_WEIGHTS)
    even = replace(
        main_set, sigma_magnitude_mps=np.full(48, 1e-3), pointing_covariance=np.tile(1e-6 * np.eye(2), (48, 1, 1))
    )
    assert values(gates(even, likelihood="printed")) == pytest.approx(
        values(gates(even, likelihood="unweighted")), rel=1e-6
    )


def test_published_normaliser_moves_the_likelihood_by_n_ln_root_two_pi(main_set):
    part = gates(main_set).pointing
    assert part.log_likelihood_printed - part.log_likelihood == pytest.approx(48 * np.log(np.sqrt(2 * np.pi)))


def test_five_burns_give_no_sigma_and_say_so(main_set):
    record = gates(main_set.take(range(5))).record()
    for part in ("magnitude", "pointing"):
        for name, value in record[part].items():
            if name not in ("held", "models") and "ci95" not in name and "log" not in name:
                assert value in (None, [None, None])
        low, high = record[part]["ci95"]["fixed_mps"]
        assert high is None or high > max(2 * low, 4e-3)
    assert gates(main_set.take(range(5))).doubts.has(doubt.TOO_FEW_BURNS)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6, FEWEST])
def test_any_number_of_burns_is_answered(count, main_set):
    fit = gates(main_set.take(range(count)), bootstrap=20)
    assert fit.known == (count >= FEWEST)
    assert str(fit) and fit.record()
    if count <= 2:  # two measurements do not determine four parameters: 002 Appendix B says they do
        assert fit.record()["magnitude"]["ci95"]["fixed_mps"] is None


def strange(m, what: str):
    n = len(m)
    none = {"sigma_magnitude_mps": np.zeros(n), "pointing_covariance": np.zeros((n, 2, 2))}
    return {
        "one size": lambda: replace(m, dv_mps=np.full(n, 0.1)),
        "no errors": lambda: replace(m, magnitude_error_mps=np.zeros(n), pointing_error_mps=np.zeros((n, 2))),
        "no errors at all": lambda: replace(m, magnitude_error_mps=np.zeros(n), pointing_error_mps=np.zeros((n, 2)), **none),
        "no tracking errors": lambda: replace(m, **none),
        "on a line": lambda: replace(m, magnitude_error_mps=0.01 * m.dv_mps, **none),
        "nothing tracked": lambda: replace(m, sigma_magnitude_mps=np.ones(n), pointing_covariance=np.tile(np.eye(2), (n, 1, 1))),
        "ellipses without width": lambda: replace(m, pointing_covariance=np.tile(1e-8 * np.ones((2, 2)), (n, 1, 1))),
        "huge": lambda: replace(m, magnitude_error_mps=1e6 * m.magnitude_error_mps),
        "all sizes": lambda: replace(m, dv_mps=np.geomspace(1e-5, 1e5, n)),
    }[what]()  # fmt: skip


@pytest.mark.parametrize("what", ["one size", "no errors", "no errors at all", "no tracking errors", "on a line", "nothing tracked",
                                  "ellipses without width", "huge", "all sizes"])  # fmt: skip
@pytest.mark.parametrize("likelihood", ["additive", "robust", "unweighted"])
def test_strange_burns_are_answered_in_finite_numbers(what, likelihood, main_set):
    fit = gates(strange(main_set, what), likelihood=likelihood, bootstrap=5)
    judged = gates_judgement(fit, draws=10, against=past_model("main/2012-1"))
    json.dumps(plain(fit.record() | judged.record()), allow_nan=False)
    assert str(fit) and str(judged) and np.isfinite(values(fit)).all()
    watched = gates_watch(strange(main_set, what))
    assert watched.record() and str(watched)


def test_a_sigma_on_its_bound_is_a_limit():
    m = maneuvers(Gates(3e-3, 0, 2e-3, 0), np.geomspace(0.3, 3, 40), seed=2)
    fit = gates(m)
    assert "magnitude.proportional" in fit.at_bound
    low, high = fit.record()["magnitude"]["ci95"]["proportional"]
    assert low == 0 and 0 < high < 5e-3
    assert fit.doubts.has(doubt.AT_BOUND) and "< " in str(fit)


def test_a_held_term_stays_and_has_no_interval(main_set):
    fit = gates(main_set, hold={"pointing_fixed": 5e-3})
    assert fit.pointing.point.fixed == pytest.approx(5e-3) and fit.record()["pointing"]["ci95"]["fixed_mps"] is None
    assert fit.record()["pointing"]["held"] == ["fixed"]
    free = gates(main_set)
    low, high = free.pointing.sigma_ci95[1]
    assert low < fit.pointing.point.proportional < high


def test_a_prior_pulls_and_a_wide_one_does_not(main_set):
    few = main_set.take(range(10))
    free, near, wide = (
        gates(few, prior=p, prior_width=w).magnitude.point.fixed for p, w in ((None, 0.5), (MAIN, 0.05), (MAIN, 50.0))
    )
    assert abs(near - 3.5e-3) < 2e-4 and wide == pytest.approx(free, rel=1e-2)
    assert gates(few, prior=MAIN).doubts.has(doubt.PRIOR_USED)


def test_zero_mean_takes_the_biases_up(main_set):
    fit, flat = gates(main_set), gates(main_set, model="zero-mean")
    v = 3.0
    expected = np.hypot(fit.gates.sigma_magnitude(v), fit.gates.mean_magnitude(v))
    assert flat.gates.sigma_magnitude(v) == pytest.approx(expected, rel=0.25)
    assert flat.record()["magnitude"]["bias_fixed_mps"] is None
    assert flat.doubts.has(doubt.BIASES_IN_SIGMAS)


def test_without_pointing_nothing_is_said_of_it(main_set):
    fit = gates(replace(main_set, pointing_error_mps=None, pointing_covariance=None))
    assert fit.record()["pointing"]["fixed_mps"] is None and fit.pointing is None


def test_bad_choices_are_refused(main_set):
    for words in (
        {"model": "biased"},
        {"likelihood": "huber"},
        {"hold": {"fixed": 1.0}},
        {"hold": {"magnitude_fixed": -1.0}},
        {"prior_width": 0.0},
    ):
        with pytest.raises(BadInput):
            gates(main_set, **words)
    with pytest.raises(BadInput, match="sigma of magnitude is zero"):
        gates(replace(main_set, sigma_magnitude_mps=np.zeros(48)), likelihood="printed")


@pytest.mark.slow
def test_recovery_bootstrap_says_what_many_sets_say():
    fits = [gates(execute(MAIN, MAIN_ENGINE_SET, [9, n])).magnitude.point for n in range(150)]
    spread = np.std([f.fixed for f in fits]), np.std([f.beta[0] for f in fits])
    fit = gates(execute(MAIN, MAIN_ENGINE_SET, [9, 0]), bootstrap=1000)
    assert str(fit).count("bootstrap") == 2 and fit.record()["magnitude"]["bootstrap"]["refits"] == 1000
    drawn = fit.magnitude.drawn
    assert np.std(drawn[:, 0]) == pytest.approx(spread[0], rel=0.3)
    assert np.std(drawn[:, 2]) == pytest.approx(spread[1], rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["main-engine", "rcs"])
def test_recovery_of_the_2012_models(engine):
    """500 sets: medians within 5 % away from the bound, intervals that cover; tolerance of coverage: 3 sigma of 500 sets."""
    from gates_recovery import campaign

    for name, row in campaign(engine, 500).items():
        assert 0.92 <= row["coverage_95"] <= 0.975, name
        if row["at_bound"] is not None and row["at_bound"] < 0.1:
            assert row["median_over_truth"] == pytest.approx(1, abs=0.05), name
    if engine == "main-engine":
        assert 0.3 <= campaign(engine, 100)["magnitude proportional"]["at_bound"] <= 0.5


@pytest.mark.slow
def test_recovery_quick_intervals_cover():
    """100 sets of each engine: coverage of all intervals together within 3 sigma of 95 %."""
    from gates_recovery import campaign

    for engine in ("main-engine", "rcs"):
        coverage = [r["coverage_95"] for r in campaign(engine, 100, seed=3).values()]
        assert 0.925 <= np.mean(coverage) <= 0.975


def test_recovery_unweighted_counts_tracking_errors_as_execution_errors():
    sets = [execute(RCS, RCS_SET, [4, n]) for n in range(40)]
    weighted = np.median([gates(m).pointing.point.proportional for m in sets])
    unweighted = np.median([gates(m, likelihood="unweighted").pointing.point.proportional for m in sets])
    assert unweighted > weighted * 1.1


ANY = st.tuples(
    st.floats(1e-6, 1e6), st.floats(-1e6, 1e6), st.floats(0, 1e6), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)
)


@settings(deadline=None, max_examples=60)
@given(
    rows=st.lists(ANY, min_size=1, max_size=18),
    model=st.sampled_from(["estimated-bias", "zero-mean"]),
    likelihood=st.sampled_from(["additive", "robust"]),
)
def test_whatever_the_numbers_the_answer_is_finite_or_null(rows, model, likelihood):
    dv, error, sigma, x, y = np.array(rows).T
    n = len(rows)
    m = Maneuvers(
        tuple(map(str, range(n))),
        ("rcs",) * n,
        dv,
        error,
        sigma,
        np.stack([x, y], 1),
        sigma[:, None, None] ** 2 * np.eye(2),
    )
    fit = gates(m, model=model, likelihood=likelihood, bootstrap=2)
    json.dumps(plain(fit.record() | gates_judgement(fit, draws=3).record()), allow_nan=False)
    if n > 15:
        json.dumps(plain(gates_watch(m).record()), allow_nan=False)
