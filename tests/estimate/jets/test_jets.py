"""Jets of a plume: the surface of their likelihood, recovery on simulated flybys E3, what is identified and what is not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import nnls

from asflown.dynamics.flyby import flyby_called
from asflown.dynamics.plume import as_passed, plume_density, published_jets
from asflown.estimate.density.along_flyby import density
from asflown.estimate.fused import LOOP_NOT_USED
from asflown.estimate.jets import doubts
from asflown.estimate.jets.data import through_loop
from asflown.estimate.jets.fit import jets
from asflown.estimate.jets.surface import WIDTHS_RAD, Surface
from asflown.kit.errors import BadInput
from cli.program import complaint, run
from flights import CASSINI, past_e3, saved

E3 = flyby_called("E3")
CLOSEST_S = 180.0
TRUTH = {"Alexandria": 0.55e-12, "Cairo": 10.3e-12, "Damascus": 8.5e-12}  # 004 Table 3; all 0.36 rad wide


def flown(seed=3, exponent=1, noise="nominal"):
    return past_e3(seed, exponent, noise=noise).telemetry


def fitted(seed=3, exponent=1, noise="nominal", **how):
    return jets(flown(seed, exponent, noise), CASSINI, "E3", CLOSEST_S, power=exponent, method="momentum", **how)


# ---- laws ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("common", [False, True])
def test_law_the_surface_is_non_negative_least_squares_at_every_width(common):
    rng = np.random.default_rng(4)
    columns = np.cumsum(rng.uniform(size=(3, len(WIDTHS_RAD), 30)) * 1e9, axis=2)
    columns -= columns.mean(axis=2, keepdims=True)
    y = columns[0, 5] * 3e-12 - columns[2, 9] * 2e-12 + 1e-3 * rng.standard_normal(30)
    surface = Surface(y, columns, common=common)
    for _ in range(40):
        at = tuple(rng.integers(0, len(WIDTHS_RAD), size=len(surface.shape)))
        k = np.repeat(at, 3) if common else at
        best, left = nnls(1e-12 * columns[np.arange(3), k].T, y)
        flat = np.ravel_multi_index(at, surface.shape)
        assert surface.misfit[flat] == pytest.approx(left**2, rel=1e-5)
        assert 1e12 * surface.densities[flat] == pytest.approx(best, rel=1e-4, abs=1e-4)
    held = 1.5e-12
    profile = min(
        nnls(1e-12 * columns[[0, 2], [k, k]].T, y - held * columns[1, k])[1] ** 2 for k in range(len(WIDTHS_RAD))
    )
    if common:
        assert surface.density_profile(1, held) == pytest.approx(profile, rel=1e-5)
    else:
        assert surface.density_profile(1, held) <= profile * (1 + 1e-5)
    assert surface.width_profile(0).min() == pytest.approx(surface.least)


def test_law_a_profile_is_least_at_the_fit_and_rises_from_it():
    r = fitted(widths="common")
    for s in r.sources:
        low, high = s.density_ci95_kgm3
        assert low <= s.jet.density_kgm3 <= high
        assert s.width_ci95_rad[0] <= s.jet.width_rad <= s.width_ci95_rad[1]
    widths = {s.jet.width_rad for s in r.sources}
    assert len(widths) == 1 and r.correlation.shape == (4, 4)
    assert np.diag(r.correlation) == pytest.approx(np.ones(4))


# ---- recovery -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1, 2])
def test_recovery_without_noise(exponent):
    """All six parameters, to the lattice of widths: 8 %."""
    r = fitted(exponent=exponent, noise="none")
    for s in r.sources[1:]:
        assert s.jet.density_kgm3 == pytest.approx(TRUTH[s.jet.name], rel=0.08)
        assert s.jet.width_rad == pytest.approx(0.36, rel=0.1)
    assert r.unit == "N m s" and r.rms < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize(("exponent", "at_s"), [(1, 39.3), (2, 33.1)])
def test_recovery_of_jets_and_of_the_peaks_time(exponent, at_s):
    """The time that smoothing moves by 3 s at a cusp is that of the jets' own curve."""
    for seed in (3, 4):
        r = fitted(seed, exponent)
        assert r.peak[1] == pytest.approx(at_s, abs=3.5)
        cairo, damascus = r.sources[1:]
        assert cairo.density_known and damascus.density_known
        for s in r.sources:
            low, high = s.density_ci95_kgm3
            assert 0.7 * low <= TRUTH[s.jet.name] <= 1.3 * high
        assert not r.sources[0].density_known and r.doubts.about(source="Alexandria").has(doubts.DENSITY_NOT_IDENTIFIED)


@pytest.mark.slow
@pytest.mark.parametrize("widths", ["own", "common"])
def test_recovery_intervals_hold(widths):
    within = []
    for seed in range(200, 280):
        r = fitted(seed, widths=widths)
        within.append([s.density_ci95_kgm3[0] <= TRUTH[s.jet.name] <= (s.density_ci95_kgm3[1] or 1) for s in r.sources]
                      + [(s.width_ci95_rad[0] or 0) <= 0.36 <= (s.width_ci95_rad[1] or 9) for s in r.sources])  # fmt: skip
    assert (np.mean(within, axis=0) > 0.87).all()  # 95 % less 3 sigma of 80


def test_evidence_prefers_what_the_data_carry():
    """004 publishes three equal widths: one common width, or two jets, says as much."""
    r = fitted()
    assert r.scores[0].bic == 0 and r.scores[0].free < 7 and len(r.scores) == 3 + 2 * 4
    assert r.doubts.has(doubts.FEWER_PARAMETERS)
    assert not any({"Cairo", "Damascus"} <= set(s.names) for s in r.scores[-3:])


# ---- through the loop, as printed, other sources ------------------------------------------------------------


@cache
def met(seed=3, exponent=1):
    return density(flown(seed, exponent), CASSINI, "E3", CLOSEST_S, cusps=False)


def test_law_a_density_at_the_nodes_gives_the_telemetry_it_would_have_given():
    """The true density explains the whitened telemetry to unit noise, and nothing does worse than half of it."""
    data = through_loop(met(), [as_passed(j, E3) for j in published_jets()])
    true = plume_density([as_passed(j, E3) for j in published_jets()], E3, data.nodes_s, power=1)
    n = len(data.y)
    left = data.y - data.A @ true
    assert left @ left == pytest.approx(n, abs=5 * np.sqrt(2 * n))
    assert np.sum((data.y - 0.5 * data.A @ true) ** 2) > 20 * n


def test_recovery_through_the_loop_knows_more():
    """Attitude error and rates beside momentum: every interval narrower, and the truth in it."""
    loop = jets(flown(), CASSINI, "E3", CLOSEST_S, widths="common", fit="forward")
    alone = fitted(widths="common")
    for s, m in zip(loop.sources[1:], alone.sources[1:], strict=True):
        assert np.diff(s.density_ci95_kgm3) < 0.8 * np.diff(m.density_ci95_kgm3)
        assert np.diff(s.width_ci95_rad) < 0.8 * np.diff(m.width_ci95_rad)
        low, high = s.density_ci95_kgm3
        assert 0.8 * low < TRUTH[s.jet.name] < 1.2 * high
    assert loop.unit == "sigma" and loop.rms == pytest.approx(1, abs=0.15) and loop.samples > 5 * alone.samples
    assert loop.peak[1] == pytest.approx(39.3, abs=0.8)


def test_a_loop_that_is_not_as_described_is_not_used():
    """A bandwidth 20 % off: the data contradict it, the actuators' action is taken as measured, and the result says so."""
    k = CASSINI.wheel_controller
    other = CASSINI.model_copy(update={"wheel_controller": k.model_copy(update={"bandwidth": 1.2 * k.bandwidth})})
    r = jets(flown(), other, "E3", CLOSEST_S, widths="common", fit="forward")
    assert r.doubts.has(LOOP_NOT_USED)
    for s in r.sources[1:]:
        assert s.jet.density_kgm3 == pytest.approx(TRUTH[s.jet.name], rel=0.15)


def test_recovery_through_the_loop_from_a_record_that_runs_on():
    """What is measured after the plume's reach is no part of the fit: cut there, the record says the same."""
    whole, cut = (
        jets(t, CASSINI, "E3", CLOSEST_S, widths="common", fit="forward")
        for t in (flown(4), flown(4).between(0, CLOSEST_S + 103))
    )
    for s, c in zip(whole.sources, cut.sources, strict=True):
        low, high = s.density_ci95_kgm3
        assert low <= TRUTH[s.jet.name] <= high
        assert abs(s.jet.density_kgm3 - c.jet.density_kgm3) < 0.5 * np.diff(c.density_ci95_kgm3)
    assert whole.rms == pytest.approx(1, abs=0.15) and not whole.doubts.has(
        doubts.NOT_EXPLAINED, doubts.RESIDUALS_CORRELATED
    )


def test_none_is_identified_where_jets_do_not_explain_the_telemetry():
    """Of three jets Alexandria alone is asked for."""
    r = jets(flown(), CASSINI, "E3", CLOSEST_S, names=["Alexandria"], fit="forward")
    assert r.doubts.has(doubts.NOT_EXPLAINED)
    assert not any(s.density_known or s.width_known for s in r.sources)


def test_the_printed_fit_is_a_simplex_without_intervals():
    r = fitted(fit="printed", widths="common")
    assert [s.density_ci95_kgm3 for s in r.sources] == [(None, None)] * 3 and r.scores == ()
    assert [d.numbers["starts"] for d in r.doubts.of(doubts.PRINTED_STARTS)] == [12] * 3 and "no interval" in str(r)
    assert r.rms_kgm3 <= fitted(widths="common").rms_kgm3  # it is this that the simplex makes least


def test_other_sources_take_the_place_of_those_published():
    own = tuple(replace(as_passed(j, E3), name=j.name[:1]) for j in published_jets())
    r, same = fitted(sources=own, widths="common"), fitted(widths="common")
    assert [s.jet.name for s in r.sources] == ["A", "C", "D"]
    assert [s.jet.density_kgm3 for s in r.sources] == [s.jet.density_kgm3 for s in same.sources]
    more = (*own, replace(own[0], name="E", tilt_rad=0.0))
    assert len(fitted(sources=more, widths="common").sources) == 4
    with pytest.raises(BadInput, match="more than the 3"):
        fitted(sources=more)


# ---- what it refuses ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("how", "words"), [
    ({"names": ["Baghdad"]}, "Alexandria, Cairo, Damascus"),
    ({"names": ["Cairo", "Cairo"]}, "not each one"),
    ({"widths": "wide"}, "own, common"),
    ({"power": 9}, "power"),
    ({"fit": "best"}, "momentum, forward, printed"),
    ({"fit": "forward"}, "fused"),
    ({"angle": "flat"}, "plane, space"),
    ({"axis": "x"}, "about z only"),
])  # fmt: skip
def test_what_it_refuses(how, words):
    with pytest.raises(BadInput, match=words):
        jets(flown(), CASSINI, "E3", CLOSEST_S, **({"method": "momentum"} | how))


def test_it_refuses_a_record_that_ends_before_the_plume_and_a_flyby_without_place():
    with pytest.raises(BadInput, match="too few"):
        jets(flown().between(0, CLOSEST_S + 10), CASSINI, "E3", CLOSEST_S, method="momentum")
    with pytest.raises(BadInput, match="E3, E4, E9"):
        jets(flown(), CASSINI, "E5", CLOSEST_S, method="momentum")


# ---- the verb -----------------------------------------------------------------------------------------------


def test_the_verb(tmp_path):
    words = ("jets", saved(flown(), tmp_path), "--flyby", "E3", "--closest-approach", "180", "--method", "momentum")
    done = run(*words, "--sources", "cairo,damascus", "--widths", "common", "--json", "--plot", tmp_path / "j.svg")
    assert done.code == 0
    record = done.record
    assert {"sources", "correlation", "rms_kgm3", "evidence", "doubts", "provenance"} <= set(record)
    assert [
        set(s) >= {"name", "density_kgm3", "density_ci95_kgm3", "width_rad", "width_ci95_rad", "ci95"}
        for s in record["sources"]
    ] == [True, True]
    assert [s["name"] for s in record["sources"]] == ["Cairo", "Damascus"] and len(record["correlation"]) == 3
    assert 0 < record["rms_kgm3"] < 1e-12 and (tmp_path / "j.svg").read_text().startswith("<?xml")
    text = run(*words)
    assert text.code == 0 and "not identified" in text.out and "DOUBT  Alexandria" in text.out


@pytest.mark.parametrize("words", [
    ["--sources", "Baghdad"], ["--source", "Baghdad"], ["--source", "B=5 deg,3"], ["--fit", "x"], ["--drag-table", "none.csv"], ["--widths", "x"], ["--power", "0"], ["--angle", "x"], ["--flyby", "E5"], ["--plot", "x.bmp"],
])  # fmt: skip
def test_the_verb_refuses(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    saved(flown(), tmp_path)
    complaint("jets", "t.csv", "--flyby", "E3", "--closest-approach", "180", *words)
