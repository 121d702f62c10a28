"""Jets as the plume paper fits them: a simplex on the misfit (eq 28) between model and reconstructed density.

The simplex gives no intervals and stops in several places.  Those, from several starts, that fit equally well show how
poorly some parameters are known.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.plume import Jet, model_error
from .doubts import PRINTED_STARTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...kit.doubts import Doubt
    from ..density import DensityResult
    from .form import JetForm

STARTS, _SEED = 12, 2010
#: Ends whose misfit is within this share of the best count as equal.  Assumed.
ALIKE = 0.02


def simplex(
    met: DensityResult, sources: Sequence[Jet], form: JetForm, stop_s: float
) -> tuple[tuple[Jet, ...], list[Doubt]]:
    """The best of twelve starts, and as doubts how far apart the ends are that fit equally well.

    ``stop_s``: from closest approach, the end of what is fitted; it begins 120 s before."""
    inside = (met.time_s >= -120) & (met.time_s <= stop_s) & np.isfinite(met.density_kgm3)
    t, rho, n = met.time_s[inside], met.density_kgm3[inside], len(sources)
    size = float(np.max(rho))

    def jets(x):
        widths = np.repeat(np.exp(x[n:]), n if form.common else 1)
        return tuple(
            replace(j, density_kgm3=size * float(np.exp(k)), width_rad=float(w))
            for j, k, w in zip(sources, x[:n], widths, strict=True)
        )

    def misfit(x):
        return model_error(t, form.together(jets(np.clip(x, -30, 30)), met.flyby, t), rho) / size

    rng, ends = np.random.default_rng(_SEED), []
    for _ in range(STARTS):
        start = np.r_[np.log(rng.uniform(0.05, 3, n)), np.log(rng.uniform(0.1, 1.0, 1 if form.common else n))]
        ends.append(
            scipy.optimize.minimize(
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
            PRINTED_STARTS(
                starts=STARTS, alike=len(alike), share_percent=100 * ALIKE, source=jet.name, lowest_kgm3=min(K),
                highest_kgm3=max(K),
            )
        )  # fmt: skip
    return jets(np.clip(best.x, -30, 30)), doubts
