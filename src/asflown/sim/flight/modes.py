"""What swings on the craft, booms and propellant, as modes in hybrid coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput

if TYPE_CHECKING:
    from ...craft.model import CraftAt, Pendulum
    from ..scenario import Scenario


def swinging(scenario: Scenario, now: CraftAt) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every mode the scenario lets swing: couplings delta (m, 3) [kg(1/2) m], natural frequencies (m,) [rad/s],
    damping ratios (m,).

    Raises BadInput where propellant would swing in a craft of unknown mass, and where the modes carry more inertia
    than there is."""
    modes = [(m.coupling, m.frequency, m.damping) for m in now.craft.flexible_modes if scenario.flexible]
    for p in now.craft.slosh if scenario.slosh else ():
        modes += [
            (row, p.frequency, p.damping) for row in pendulum_coupling(p, scenario.known_mass("propellant slosh"))
        ]
    coupling = np.array([m[0] for m in modes], float).reshape(-1, 3)
    if np.linalg.eigvalsh(now.inertia_kgm2 - coupling.T @ coupling)[0] <= 0:
        raise BadInput(
            "the flexible modes and the propellant carry more inertia than the craft has",
            remedy="Lower couplings or sloshing mass: the sum of delta delta^T must stay below the inertia tensor.",
        )
    return coupling, 2 * np.pi * np.array([m[1] for m in modes]), np.array([m[2] for m in modes], float)


def pendulum_coupling(p: Pendulum, craft_mass: float) -> np.ndarray:
    """The two rows delta of small swings across the pendulum, (2, 3). [kg(1/2) m]

    With m the pendulum's mass, M the craft's, mu = m (M - m) / M, r from the rest's centre of mass to the pendulum's
    mass hanging still, and e across it, displacement s = eta / sqrt(mu):  delta = sqrt(mu) r x e.  That is momentum and
    force about the common centre of mass to first order in s; second order are I(s), Coriolis and centrifugal
    force, s/r and (w/W)^2 of what is kept."""
    rest = craft_mass - p.mass
    if rest <= 0:
        raise BadInput(
            f"the craft ({craft_mass:g} kg) weighs less than what sloshes in its {p.name} ({p.mass:g} kg)",
            remedy="craft_mass is the mass of the whole craft, propellant included.",
        )
    down = np.array(p.direction) / np.linalg.norm(p.direction)
    r = (np.array(p.pivot) + p.length * down) * craft_mass / rest
    # any two directions across the rod do: both swing at one frequency
    across = np.linalg.svd(down[None])[2][1:]
    return np.sqrt(p.mass * rest / craft_mass) * np.cross(r, across)
