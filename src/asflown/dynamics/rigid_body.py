"""The inertia tensor of a rigid body as six numbers, and which six numbers a body can have.

Elements are ordered as in 001 eq 10: Ixx Ixy Ixz Iyy Iyz Izz, tensor elements (not negated products of inertia).
"""

from __future__ import annotations

import numpy as np

ELEMENTS = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
_UPPER = np.triu_indices(3)
_LOWER = np.tril_indices(3)

#: BASIS[k] is the tensor whose k-th element is one. (6, 3, 3)
BASIS = np.zeros((6, 3, 3))
for _k, (_i, _j) in enumerate(zip(*_UPPER, strict=True)):
    BASIS[_k, _i, _j] = BASIS[_k, _j, _i] = 1.0


def elements_of(I_B: np.ndarray) -> np.ndarray:
    """(3, 3) -> (6,)"""
    return np.asarray(I_B, float)[_UPPER]


def tensor_of(elements: np.ndarray) -> np.ndarray:
    """(6,) -> (3, 3)"""
    return np.tensordot(np.asarray(elements, float), BASIS, axes=1)


def momentum_regressor(omega_B: np.ndarray) -> np.ndarray:
    """S of 001 eqs 10, 11: I w = S pi. (N, 3) [rad/s] -> (N, 3, 6)"""
    return np.einsum("kij,nj->nik", BASIS, np.asarray(omega_B, float))


def second_moments(I_B: np.ndarray) -> np.ndarray:
    """Sigma = tr(I)/2 1 - I, the integral of r r^T dm: positive definite for every body, and only then do the
    principal moments satisfy the triangle inequality. (3, 3) [kg m2]"""
    return 0.5 * np.trace(I_B) * np.eye(3) - np.asarray(I_B, float)


def tensor_from_cholesky(x: np.ndarray) -> np.ndarray:
    """A tensor a body can have, from any six numbers: Sigma = L L^T with L lower. (3, 3)

    x (6,): row by row of the lower triangle, L00 L10 L11 L20 L21 L22.  A zero on the diagonal is a flat or a thin body,
    the edge of what is possible, which is why the diagonal is not a logarithm."""
    L = np.zeros((3, 3))
    L[_LOWER] = x
    sigma = L @ L.T
    return np.trace(sigma) * np.eye(3) - sigma


def cholesky_of(I_B: np.ndarray) -> np.ndarray:
    """The six numbers of ``tensor_from_cholesky``.  Raises LinAlgError for a tensor no body can have."""
    return np.linalg.cholesky(second_moments(I_B))[_LOWER]


def nearest_possible(elements: np.ndarray, information: np.ndarray) -> tuple[np.ndarray, bool]:
    """Of all tensors a body can have, that of least (x - elements)^T information (x - elements). (6,), and whether it moved.

    Six free numbers of ``tensor_from_cholesky`` and least squares, which has one minimum where the constraint is a cone."""
    from scipy import optimize

    I_B = tensor_of(elements)
    scale = max(abs(np.trace(I_B)), 1e-300)
    if np.linalg.eigvalsh(second_moments(I_B))[0] > 1e-9 * scale:
        return np.asarray(elements, float), False
    size = scale * np.sqrt(np.maximum(np.linalg.eigvalsh(information)[-1], 1e-300))
    values, vectors = np.linalg.eigh(information)
    root = np.sqrt(np.maximum(values, 1e-12 * values[-1]))[:, None] * vectors.T / size
    w, v = np.linalg.eigh(second_moments(I_B))
    start = (v * np.maximum(w, 1e-3 * scale)) @ v.T
    start = np.trace(start) * np.eye(3) - start

    def misfit(x):
        return scale * root @ (elements_of(tensor_from_cholesky(x)) - elements)

    found = optimize.least_squares(misfit, cholesky_of(start), xtol=1e-12, ftol=1e-14, gtol=1e-14, max_nfev=2000)
    return elements_of(tensor_from_cholesky(found.x)), True
