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


def csv_of(m: Maneuvers) -> str:
    """The maneuvers as a table of resolved errors."""
    lines = [HEAD.replace("time,", "")]
    for k in range(len(m)):
        c = m.pointing_covariance[k]
        sx, sy = np.sqrt(np.diag(c))
        r = c[0, 1] / (sx * sy) if sx * sy > 0 else 0.0
        cells = [
            m.dv_mps[k],
            *(1e3 * x for x in (m.magnitude_error_mps[k], *m.pointing_error_mps[k], m.sigma_magnitude_mps[k], sx, sy)),
            r,
        ]
        lines.append(",".join([m.id[k], m.engine[k], *(repr(float(x)) for x in cells)]))
    return "\n".join(lines) + "\n"
