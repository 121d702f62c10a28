"""Density over time from the torque of the gas: every axis weighted by its noise, with draws where the torque has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .axes import agreement_of, drawn_densities, tells, weights
from .drag import PRINTED_SHAPE

if TYPE_CHECKING:
    from ..torque import TorqueResult
    from .drag import DragAlong
    from .gas_torque import GasTorque
    from .parts import Agreement


@dataclass(frozen=True)
class Drawn:
    """Densities (D, F) drawn from the torque's posterior, at instants (F,) from closest approach."""

    time_s: np.ndarray
    density_kgm3: np.ndarray


@dataclass(frozen=True)
class Curve:
    """Density (N,) over time from closest approach, its random sigma, and what torques left out can mimic at most.

    ``known`` (N,): where a plume can be looked for; ``drag``: with the sign found; ``drawn``: None where the torque has no
    draws."""

    time_s: np.ndarray
    density_kgm3: np.ndarray
    sigma_kgm3: np.ndarray | None
    left_out_kgm3: np.ndarray
    known: np.ndarray
    drag: DragAlong
    agreement: Agreement | None
    drawn: Drawn | None

    @property
    def top(self) -> int:
        """Where the known density is largest."""
        return int(np.flatnonzero(self.known)[np.argmax(self.density_kgm3[self.known])])


def curve_of(gas: GasTorque, drag: DragAlong, torque: TorqueResult, closest_s: float, without_body: float) -> Curve:
    """``without_body``: share of the density that counts as random error for a body whose own momentum is left out, or 0."""
    of_gas = gas.of_gas_Nm
    drag = drag.as_pushes(of_gas[gas.known, 0])
    K = drag.at(gas.time_s)[:, list(drag.axes)]
    known = gas.known & tells(K)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = of_gas / K
        of_each = None if gas.torque_sigma_Nm is None else gas.torque_sigma_Nm / np.abs(K)
        left_out = gas.bound_Nm / np.linalg.norm(K, axis=1)
    weight = weights(K, of_each)
    rho = np.where(weight.any(axis=1), np.sum(weight * np.where(weight > 0, each, 0.0), axis=1), np.nan)
    sigma: np.ndarray | None = None
    if torque.variant == "printed":
        sigma = PRINTED_SHAPE * np.abs(rho)
    elif of_each is not None:
        sigma = np.sqrt(np.sum((weight * np.where(weight > 0, of_each, 0.0)) ** 2, axis=1))
    if without_body and sigma is not None:
        sigma = np.hypot(sigma, without_body * np.abs(rho))
    near = gas.near
    agreement = agreement_of(each[near], None if of_each is None else of_each[near], rho[near], known[near])
    drawn = drawn_densities(torque, gas, drag, closest_s, weight)
    return Curve(gas.time_s, rho, sigma, left_out, known, drag, agreement, None if drawn is None else Drawn(*drawn))
