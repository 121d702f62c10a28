"""Maneuvers executed by a Gates model, as an orbit determination would reconstruct them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..maneuvers.table import Maneuvers

if TYPE_CHECKING:
    from ..maneuvers.model import Gates


@dataclass(frozen=True)
class Tracking:
    """How well an orbit determination sees a burn of size v: one sigma of its magnitude, sqrt(floor^2 + share^2 v^2) times a
    factor of its own for each burn, log-uniform between 1/scatter and scatter; of its pointing ``across`` times as much,
    on an ellipse turned at random with axes as 1 to up to ``oblong``.

    None of the papers gives numbers.  That large burns are seen worse than small ones is theirs, the rest is assumed."""

    floor_mps: float
    share: float
    scatter: float = 2.0
    across: float = 2.0
    oblong: float = 3.0


@dataclass(frozen=True)
class BurnSet:
    """How many burns of which sizes (log-uniform), and how they are tracked."""

    engine: str
    count: int
    smallest_mps: float
    largest_mps: float
    tracking: Tracking


#: As many burns as the 2012-1 models were made of, over the sizes they are valid for (Wagner 2014, Table 1).
MAIN_ENGINE_SET = BurnSet("main-engine", 48, 0.3, 13.0, Tracking(0.5e-3, 1e-4))
RCS_SET = BurnSet("rcs", 49, 0.01, 0.3, Tracking(0.1e-3, 2e-3))


def execute(gates: Gates, burns: BurnSet, seed, *, dv_mps=None, weaker=None, ids=None) -> Maneuvers:
    """Executed and reconstructed burns.

    ``seed``: a number or a numpy Generator.  ``dv_mps`` (N,): sizes in place of drawn ones.  ``weaker`` (N,): share by which
    each burn falls short, as a degraded thruster makes it.  Errors are drawn component by component; the simulator
    shares no code with the estimator."""
    rng = np.random.default_rng(seed)
    v = (
        np.exp(rng.uniform(np.log(burns.smallest_mps), np.log(burns.largest_mps), burns.count))
        if dv_mps is None
        else np.asarray(dv_mps, float)
    )
    n, t = len(v), burns.tracking
    size = np.sqrt(t.floor_mps**2 + (t.share * v) ** 2) * t.scatter ** rng.uniform(-1, 1, n)
    axes_mps = t.across * size[:, None] * np.stack([np.ones(n), 1 / rng.uniform(1, t.oblong, n)], axis=1)
    turn = rng.uniform(0, np.pi, n)
    c, s = np.cos(turn), np.sin(turn)
    ellipse = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], axis=1)  # columns: its axes

    fixed, shares = rng.standard_normal((n, 3)), rng.standard_normal((n, 3))  # X, Y, magnitude
    sigma_fixed = np.array([gates.pointing_fixed_mps] * 2 + [gates.magnitude_fixed_mps])
    sigma_share = np.array([gates.pointing_proportional_rad] * 2 + [gates.magnitude_proportional])
    bias_fixed = np.array([*gates.pointing_bias_fixed_mps, gates.bias_fixed_mps])
    bias_share = np.array([*gates.pointing_bias_proportional_rad, gates.bias_proportional])
    executed = bias_fixed + sigma_fixed * fixed + v[:, None] * (bias_share + sigma_share * shares)
    if weaker is not None:
        executed[:, 2] -= np.asarray(weaker, float) * v
    seen = np.einsum("nij,nj->ni", ellipse, axes_mps * rng.standard_normal((n, 2)))
    return Maneuvers(
        tuple(ids) if ids is not None else tuple(f"{burns.engine}-{k + 1}" for k in range(n)), (burns.engine,) * n, v,
        executed[:, 2] + size * rng.standard_normal(n), size, executed[:, :2] + seen,
        np.einsum("nij,nj,nkj->nik", ellipse, axes_mps**2, ellipse), source="simulated",
    )  # fmt: skip


#: Burns of the A branch's last months, sizes assumed but for the last (Wagner 2014, Figure 12): the third is too small to show anything.
A_BRANCH_END = {"OTM-160": 0.12, "OTM-166": 0.015, "OTM-169": 0.23}
#: RCS burns before them.
A_BRANCH_BEFORE = 37


def a_branch(gates: Gates, weaker: float, seed) -> Maneuvers:
    """RCS burns up to OTM-156, then three by thrusters that fall short by a share ``weaker``."""
    rng = np.random.default_rng(seed)
    burns = replace(RCS_SET, count=A_BRANCH_BEFORE)
    before = np.exp(rng.uniform(np.log(burns.smallest_mps), np.log(burns.largest_mps), burns.count))
    ids = [f"A-{k + 1}" for k in range(burns.count - 1)] + ["OTM-156", *A_BRANCH_END]
    dv = [*before, *A_BRANCH_END.values()]
    short = [0.0] * burns.count + [weaker] * len(A_BRANCH_END)
    return execute(gates, burns, rng, dv_mps=dv, weaker=short, ids=ids)
