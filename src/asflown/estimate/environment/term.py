"""One torque of the surroundings: linear in a few constants of the craft, with what its file believes of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Term:
    """A torque about the centre of mass at N instants, body axes.

    Attributes
    ----------
    name : str
        'gravity-gradient', 'sunlight', 'dipole', 'drag' or 'rods'.
    labels : tuple of str
        Names of its p constants: 'x', 'y', 'z', or elements of the tensor.
    unit : str
        Of the constants.
    design : ndarray, shape (N, 3, p)
        Torque per unit of each constant. [N m / unit]
    source : str
        Where the vectors in it are from, in words.
    torque_Nm : ndarray, shape (N, 3), or None
        With the values that the craft file believes; None where it says nothing of them.
    errors_Nm : ndarray, shape (N, 3, q)
        How one sigma of each of q independent errors changes that torque: of the constants, of the density, ...
        The torque's variance is the sum of their squares.
    measured : bool
        Whether its vectors are from a channel, not from a model.
    """

    name: str
    labels: tuple[str, ...]
    unit: str
    design: np.ndarray
    source: str
    torque_Nm: np.ndarray | None = None
    errors_Nm: np.ndarray | None = None
    measured: bool = False

    @property
    def sigma_Nm(self) -> np.ndarray:
        """One sigma of the torque, (N, 3); unknown (NaN) where the craft file says nothing."""
        if self.errors_Nm is None:
            return np.full(self.design.shape[:2], np.nan)
        return np.sqrt(np.sum(self.errors_Nm**2, axis=2))


def levers(u: np.ndarray) -> np.ndarray:
    """C with p x u = C p. (N, 3) -> (N, 3, 3)"""
    return np.swapaxes(np.cross(np.eye(3)[None], np.asarray(u, float)[:, None, :]), 1, 2)
