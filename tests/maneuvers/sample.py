"""Small tables of maneuvers."""

import numpy as np

from asflown.maneuvers.table import Maneuvers

HEAD = (
    "id,time,engine,dv [m/s],magnitude_error [mm/s],pointing_error_x [mm/s],pointing_error_y [mm/s],"
    "sigma_magnitude [mm/s],sigma_pointing_x [mm/s],sigma_pointing_y [mm/s],correlation_xy []"
)


def maneuvers(gates, dv, sigma_od=0.0, seed=1, engine="rcs") -> Maneuvers:
    """Burns of these sizes by a model, orbit-determination errors of ``sigma_od`` [m/s] on each component."""
    rng = np.random.default_rng(seed)
    dv = np.asarray(dv, float)
    n = len(dv)
    magnitude = gates.mean_magnitude(dv) + np.hypot(gates.sigma_magnitude(dv), sigma_od) * rng.standard_normal(n)
    across = np.hypot(gates.sigma_pointing(dv), sigma_od)[:, None] * rng.standard_normal((n, 2))
    od = np.full(n, sigma_od)
    return Maneuvers(
        tuple(f"M{k + 1}" for k in range(n)), (engine,) * n, dv, magnitude, od, gates.mean_pointing(dv) + across,
        od[:, None, None] ** 2 * np.eye(2),
    )  # fmt: skip
