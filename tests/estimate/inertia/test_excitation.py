"""Which components of the inertia tensor body rates can tell: known ranks, laws, and flown slews."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from asflown.dynamics.rigid_body import ELEMENTS, elements_of, tensor_of
from asflown.estimate.inertia.excitation import excitation, normal_matrix
from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.attitude import together
from asflown.telemetry.load import load_telemetry
from conftest import flight_data

X, Y, Z = np.eye(3)
NOISE = 2e-6  # rad/s


def turns(*directions, rate=2e-3, samples=75, jitter=0.0):
    """Rates (N, 3) of one turn about each direction after the other."""
    w = np.vstack([rate * np.outer(np.ones(samples), np.array(d, float) / np.linalg.norm(d)) for d in directions])
    return w + jitter * np.random.default_rng(1).standard_normal(w.shape)


def stacked(w):
    """S (3N, 6) as 001 eq 11 writes it."""
    x, y, z = w.T
    o = np.zeros_like(x)
    return np.stack([[x, y, z, o, o, o], [o, x, o, y, z, o], [o, o, x, o, y, z]]).transpose(2, 0, 1).reshape(-1, 6)


@pytest.mark.parametrize("jitter", [0.0, NOISE, 2 * NOISE])
@pytest.mark.parametrize("directions, rank, untold", [
    ([X], 3, {"Iyy", "Iyz", "Izz"}),
    ([Z], 3, {"Ixx", "Ixy", "Iyy"}),
    ([(1, 1, 1)], 3, None),
    ([X, Y], 5, {"Izz"}),
    ([Y, Z], 5, {"Ixx"}),
    ([X, Y, (1, 1, 0)], 5, {"Izz"}),
    ([X, (0, 1, 1)], 5, None),
    ([X, Y, Z], 6, set()),
    ([X, Y, (1, 1, 1)], 6, set()),
    ([X, Y, Z, (1, 1, 1)], 6, set()),
])  # fmt: skip
def test_published_ranks_by_direction(directions, rank, untold, jitter):
    """001 section IV: slews about three axes, or multi-axis ones; not every multi-axis slew does."""
    e = excitation(turns(*directions, jitter=jitter), jitter)
    assert e.rank == rank
    if untold is not None:
        assert set(e.not_identifiable) == untold and set(e.identifiable) == set(ELEMENTS) - untold


def test_skew_directions_are_told_in_words():
    one = excitation(turns((1, 1, 1)))
    assert one.identifiable == ("the moment about (0.58, 0.58, 0.58) and its products with the axes across",)
    assert one.not_identifiable[0].startswith("both moments and the product across (0.58, 0.58, 0.58)")
    assert one.counted == "one direction"
    two = excitation(turns(X, (0, 1, 1)))
    assert two.identifiable == ("Ixx", "Ixy", "Ixz")
    (words,) = two.not_identifiable
    assert "0.71" in words and words.endswith("which mixes Iyy, Iyz, Izz")
    assert excitation(turns(X, Y, Z)).counted == "three directions"
    assert excitation(np.zeros((5, 3))).counted == "no direction"


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 200))
def test_law_singular_values_are_those_of_the_stacked_matrix(seed, samples):
    w = np.random.default_rng(seed).standard_normal((samples, 3)) * 1e-3
    expected = np.linalg.svd(stacked(w) / np.sqrt(samples), compute_uv=False)
    expected = np.r_[expected, np.zeros(6 - len(expected))]
    assert excitation(w).singular_values == pytest.approx(expected, abs=1e-10)
    assert normal_matrix(w.T @ w) == pytest.approx(stacked(w).T @ stacked(w), abs=1e-15)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([[X], [X, Y], [X, Y, Z]]))
def test_law_the_rank_does_not_depend_on_the_axes(seed, directions):
    turn = Rotation.random(rng=np.random.default_rng(seed))
    assert excitation(turn.apply(turns(*directions, jitter=NOISE))).rank == excitation(turns(*directions)).rank


def test_law_what_is_not_told_leaves_the_momentum_alone():
    """Another tensor that differs only in what is not told gives the same momentum."""
    w = turns(X, Y, (1, 1, 0))
    other = np.diag([7000.0, 6000.0, 3000.0])
    assert excitation(w).not_identifiable == ("Izz",)
    assert w @ (other + np.diag([0, 0, 500.0])) == pytest.approx(w @ other, abs=1e-12)
    assert tensor_of(elements_of(other)) == pytest.approx(other)


def test_noise_alone_and_a_quiet_hold_tell_nothing():
    w = NOISE * np.random.default_rng(3).standard_normal((120, 3))
    assert excitation(w).rank == 6  # without its noise known, noise is turning
    assert excitation(w, NOISE).rank == 0 and excitation(w, NOISE).not_identifiable == ELEMENTS
    assert excitation(turns(X, jitter=NOISE), NOISE).rank == 3


def test_samples_that_are_not_numbers_do_not_count_and_none_are_refused():
    w = turns(X, Y, Z)
    holed = np.vstack([w, np.full((4, 3), np.nan)])
    assert excitation(holed).singular_values == pytest.approx(excitation(w).singular_values)
    for nothing in (np.empty((0, 3)), np.full((3, 3), np.nan)):
        with pytest.raises(BadInput, match="no sample"):
            excitation(nothing)


def rates(telemetry, start=None, stop=None):
    return together(telemetry.between(start, stop), [f"body_rate_{a}" for a in "xyz"])[1]


@pytest.mark.parametrize("changes", [{}, {"noise": "double"}, {"flexible": True, "friction": True}])
def test_recovery_jitter_in_a_flown_slew_is_not_excitation(changes):
    telemetry = fly("slews", changes=changes).telemetry
    ends = (60, 620, 1180, 1740, 2300)
    for k in range(4):
        one = excitation(rates(telemetry, ends[k], ends[k + 1]))
        assert one.rank == 3 and one.rate_rms_rad_s[1] < 0.0045 * one.rate_rms_rad_s[0]  # against 0.025
    assert excitation(rates(telemetry, 60, 1180)).not_identifiable == ("Izz",)
    assert excitation(rates(telemetry)).rank == 6


def test_flights_of_another_simulator():
    telemetry = load_telemetry(flight_data("simulated/slew.csv.gz"))
    assert excitation(rates(telemetry)).rank == 6
    first = excitation(rates(telemetry, 0, 540))
    assert first.rank == 3 and first.rate_rms_rad_s[1] < 0.002 * first.rate_rms_rad_s[0]
