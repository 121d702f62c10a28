"""Density of the air in low orbit: NRLMSIS 2.1 as pymsis evaluates it, or an exponential one."""

from __future__ import annotations

import numpy as np

from .atmosphere import Exponential
from .frames import geodetic
from .nodes import through_nodes
from .orbit import check_above_earth

#: One sigma of the model as a share of the density, with the day's own F10.7 and Ap.  15 % of MSIS-86 (Hedin 1988); NRLMSIS 2.1
#: was 10 % below its forerunner beside GRACE and Swarm, and up to 50 % off in storms (Guo et al 2024, doi:10.1016/j.asr.2024.05.063).
SIGMA_SHARE = 0.2

#: Nodes along the orbit: the spline of log density errs by less than 1e-3. [s]
_STEP_S = 30.0
_J2000_DAY = np.datetime64("2000-01-01T00:00:00", "ns")


def density_at(position_N: np.ndarray, tai_s: np.ndarray, f107: float, f107_mean: float, ap: float) -> np.ndarray:
    """Mass density of the air at a craft.

    Parameters
    ----------
    position_N : ndarray, shape (N, 3)
        From the Earth's centre, inertial (GCRS). [m]
    tai_s : ndarray, shape (N,)
        TAI since 2000-01-01T00:00:00 TAI. [s]
    f107, f107_mean : float
        Solar flux at 10.7 cm of the day before, and its mean over 81 days. [1e-22 W / (m2 Hz)]
    ap : float
        Daily geomagnetic index Ap.  The three are given: nothing is downloaded.

    Returns
    -------
    ndarray, shape (N,)
        [kg/m3].  Interpolated to 0.1 % between nodes 30 s apart; the model itself is good to 20 % on a quiet day.

    Raises
    ------
    BadInput
        For a position below the surface.
    """
    r, t = np.atleast_2d(np.asarray(position_N, float)), np.atleast_1d(np.asarray(tai_s, float))
    check_above_earth(r)

    def log_density(at):
        from pymsis import Variable, calculate

        longitude, latitude, height = geodetic(r[at], t[at])
        dates = _J2000_DAY + np.rint(1e9 * t[at]).astype("timedelta64[ns]")  # TAI for UTC: 37 s, 0.15 deg of local time
        same = np.ones(len(at))
        answer = calculate(
            dates, np.degrees(longitude), np.degrees(latitude), height / 1e3,
            f107 * same, f107_mean * same, np.full((len(at), 7), float(ap)), version=2.1,
        )  # fmt: skip
        return np.log(answer[:, Variable.MASS_DENSITY])

    return np.exp(through_nodes(t, _STEP_S, log_density))


def exponential_density(height_m, density_kgm3: float, at_height_m: float, scale_height_m: float) -> np.ndarray:
    """Density that falls by e over each scale height: rho_0 exp(-(h - h_0) / H). [kg/m3], of the height's shape.

    For an orbit whose density at one height is known.  H: 50 to 70 km at 500 km; it has neither day nor night."""
    return Exponential(density_kgm3, at_height_m, scale_height_m).density(height_m)
