"""One density from the torque about several axes, each weighed by its noise, and whether they agree (plume paper eq 21 as a vector)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.regression import memory
from .parts import Agreement

if TYPE_CHECKING:
    from ..torque import TorqueResult
    from .drag import DragAlong
    from .gas_torque import GasTorque

#: The torque tells the density where the torque per density is at least this share of its largest along the flyby.  Assumed.
_LEAST_ARM = 0.1
#: Where no axis sees more than this, there is assumed to be no gas. [sigma]  Assumed.
_SEEN = 3.0


def tells(K: np.ndarray) -> np.ndarray:
    """Where torques per density (..., n) are large enough to tell the density: not where an arm passes through zero."""
    size = np.linalg.norm(K, axis=-1)
    return size >= _LEAST_ARM * size.max()


def weights(K: np.ndarray, sigma) -> np.ndarray:
    """Of each axis's density at each instant, together 1. (N, n)

    By its noise; by the square of its torque per density where that is not known.  Zero where an arm is."""
    precision = np.square(K) if sigma is None else 1 / np.square(sigma)
    precision = np.where(np.isfinite(precision) & (K != 0), precision, 0.0)
    return precision / np.maximum(precision.sum(axis=1, keepdims=True), 1e-300)


def agreement_of(each, sigma, rho, known) -> Agreement | None:
    """Whether several axes tell one density: chi-square of the residuals of each where gas is looked for, in independent instants.

    The correlation of neighbouring residuals is taken where no gas is seen: within it, a disagreement would itself correlate them."""
    if sigma is None or each.shape[1] < 2:
        return None
    told = np.isfinite(each) & np.isfinite(sigma) & (sigma > 0)  # an axis without an arm tells nothing
    sigma = np.where(told, sigma, np.inf)
    each, common = np.where(told, each, 0.0), np.nan_to_num(rho)[:, None]
    left = (each - common) / sigma
    quiet = np.abs(each / sigma).max(axis=1) < _SEEN
    alike = max(memory(column[quiet if quiet.sum() > 50 else slice(None)]) for column in left.T)
    beside = int(np.maximum(told[known].sum(axis=1) - 1, 0).sum())
    return Agreement(float(np.sum(left[known] ** 2)) / alike, beside / alike) if beside else None


def drawn_densities(torque: TorqueResult, gas: GasTorque, drag: DragAlong, closest_s: float, weight):
    """Instants from closest approach and densities (D, F) drawn from the torque's posterior; None where there is none."""
    if torque.paths_Nm is None:
        return None
    t = torque.paths_time_s - closest_s
    K = drag.at(gas.time_s)
    drawn = np.zeros(torque.paths_Nm.shape[:2])
    for i, j in enumerate(drag.axes):
        k, w = np.interp(t, gas.time_s, K[:, j]), np.interp(t, gas.time_s, weight[:, i])
        off = torque.paths_Nm[:, :, j] - gas.gravity_at(t, i)
        drawn += np.where(w > 0, w * off / np.where(k == 0, np.inf, k), 0.0)
    return t, drawn
