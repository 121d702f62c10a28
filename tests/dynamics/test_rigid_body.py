"""Laws of the inertia tensor: six elements, what a body can have, and the nearest of those."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asflown.dynamics.environment import MU_EARTH, gravity_gradient, gravity_gradient_regressor
from asflown.dynamics.rigid_body import (
    BASIS,
    cholesky_of,
    elements_of,
    momentum_regressor,
    nearest_possible,
    second_moments,
    tensor_from_cholesky,
    tensor_of,
)

I_B = np.array([[7362.0, -164, -12], [-164, 6130, 149], [-12, 149, 3750]])


def test_law_elements_and_tensor_are_the_same_thing():
    assert tensor_of(elements_of(I_B)) == pytest.approx(I_B)
    assert np.tensordot(elements_of(I_B), BASIS, axes=1) == pytest.approx(I_B)
    w = np.random.default_rng(1).standard_normal((7, 3))
    assert momentum_regressor(w) @ elements_of(I_B) == pytest.approx(w @ I_B)


@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6))
def test_law_any_six_numbers_are_a_possible_body(x):
    possible = tensor_from_cholesky(np.array(x))
    moments = np.linalg.eigvalsh(possible)
    assert moments[0] >= -1e-9 and moments[0] + moments[1] >= moments[2] - 1e-9


def test_law_cholesky_there_and_back():
    assert tensor_from_cholesky(cholesky_of(I_B)) == pytest.approx(I_B)


def test_law_what_is_possible_stays_as_it_is():
    found, moved = nearest_possible(elements_of(I_B), np.eye(6))
    assert not moved and found == pytest.approx(elements_of(I_B))


@settings(max_examples=12, deadline=None)  # the first call of cvxpy takes seconds
@given(seed=st.integers(0, 10_000))
def test_law_the_nearest_possible_tensor_is_that_of_a_semidefinite_program(seed):
    """Against cvxpy, in which the constraint is a cone and not a parametrization."""
    cvxpy = pytest.importorskip("cvxpy")
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((6, 6))
    information = A @ A.T + 0.05 * np.eye(6)
    wanted = elements_of(np.diag([3.0, 1.2, 1.0])) + 0.7 * rng.standard_normal(6)  # a triangle that does not close
    found, moved = nearest_possible(wanted, information)
    X = cvxpy.Variable((3, 3), symmetric=True)
    off = cvxpy.hstack([X[i, j] for i in range(3) for j in range(i, 3)]) - wanted
    cost = cvxpy.sum_squares(np.linalg.cholesky(information).T @ off)
    cvxpy.Problem(cvxpy.Minimize(cost), [0.5 * cvxpy.trace(X) * np.eye(3) - X >> 0]).solve()
    best, ours = float(cost.value), float((found - wanted) @ information @ (found - wanted))
    assert np.linalg.eigvalsh(second_moments(tensor_of(found)))[0] > -1e-6
    assert ours <= best + 1e-3 * max(best, 1e-2)  # the cone solver is good to about that
    assert moved == (
        np.linalg.eigvalsh(second_moments(tensor_of(wanted)))[0] <= 1e-9 * abs(np.trace(tensor_of(wanted)))
    )


def test_law_gravity_does_not_turn_a_sphere_nor_a_body_that_is_aligned():
    r = 6.8e6 * np.array([[0.6, 0.0, 0.8], [1.0, 0.0, 0.0]])
    assert gravity_gradient(np.eye(3) * 1e8, r) == pytest.approx(np.zeros((2, 3)), abs=1e-9)
    aligned = gravity_gradient(np.diag([1e8, 2e8, 3e8]), r)
    assert aligned[1] == pytest.approx(np.zeros(3), abs=1e-9)
    n2 = MU_EARTH / 6.8e6**3
    assert aligned[0] == pytest.approx([0, 3 * n2 * (1e8 - 3e8) * 0.6 * 0.8, 0])  # 3 n^2 (Ixx - Izz) x z about y
    assert gravity_gradient_regressor(r) @ elements_of(I_B) == pytest.approx(gravity_gradient(I_B, r))
