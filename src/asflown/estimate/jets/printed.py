"""Jets as 004 fits them: a simplex on the misfit (eq 28) between model and reconstructed density.

The simplex has no intervals and stops in more than one place; from several starts the places that fit as well show how
little some parameters mean.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize

from ...dynamics.plume import Jet, model_error, plume_density

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..density import DensityResult

STARTS, _SEED = 12, 2010
#: Ends whose misfit is within this share of the best count as equal.
ALIKE = 0.02


def simplex(
    met: DensityResult, sources: Sequence[Jet], common: bool, stop_s: float, **how
) -> tuple[list[Jet], list[str]]:
    """The best of twelve starts, and in words how far the ends that fit as well are apart.

    ``stop_s``: from closest approach, the end of what is fitted, from its beginning 120 s before; ``how``: power, angle."""
    inside = (met.time_s >= -120) & (met.time_s <= stop_s) & np.isfinite(met.density_kgm3)
    t, rho, n = met.time_s[inside], met.density_kgm3[inside], len(sources)
    size = float(np.max(rho))

    def jets(x):
        widths = np.repeat(np.exp(x[n:]), n if common else 1)
        return [
            replace(j, density_kgm3=size * float(np.exp(k)), width_rad=float(w))
            for j, k, w in zip(sources, x[:n], widths, strict=True)
        ]

    def misfit(x):
        return model_error(t, plume_density(jets(np.clip(x, -30, 30)), met.flyby, t, **how), rho) / size

    rng, ends = np.random.default_rng(_SEED), []
    for _ in range(STARTS):
        start = np.r_[np.log(rng.uniform(0.05, 3, n)), np.log(rng.uniform(0.1, 1.0, 1 if common else n))]
        ends.append(
            minimize(
                misfit,
                start,
                method="Nelder-Mead",
                options={"maxiter": 4000, "maxfev": 4000, "xatol": 1e-4, "fatol": 1e-7},
            )
        )
    best = min(ends, key=lambda e: e.fun)
    alike = [jets(np.clip(e.x, -30, 30)) for e in ends if e.fun <= (1 + ALIKE) * best.fun]
    doubts = []
    for i, jet in enumerate(sources):
        K = [found[i].density_kgm3 for found in alike]
        doubts.append(
            f"printed fit, no intervals: of {STARTS} starts {len(alike)} end within {100 * ALIKE:.0f} % of the best misfit, with {jet.name}'s density from {min(K):.2g} to {max(K):.2g} kg/m3"
        )
    return jets(np.clip(best.x, -30, 30)), doubts
