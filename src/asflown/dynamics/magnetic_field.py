"""The Earth's magnetic field along an orbit: IGRF-14 as ppigrf evaluates it.

IGRF (Alken et al 2021, doi:10.1186/s40623-020-01288-x, and its fourteenth generation, doi:10.5281/zenodo.14012302) is the field of
the core.  The crust and the currents above the atmosphere are not in it: tens of nT of 20,000 to 50,000 in low orbit on a quiet day,
several hundred in a magnetic storm.
"""

from __future__ import annotations

from datetime import datetime, timedelta
from functools import cache

import numpy as np

from ..kit.errors import BadInput
from .frames import earth_fixed
from .nodes import through_nodes
from .orbit import check_above_earth

#: One sigma of the model on a quiet day in low orbit, each component: assumed, for what it leaves out. [T]
SIGMA_T = 1e-7

#: Nodes along the orbit: degree 13 changes over 400 s and more, so that the spline errs by less than 0.5 nT. [s]
_STEP_S = 30.0
_TESLA_PER_NANOTESLA = 1e-9


def field_at(position_N: np.ndarray, tai_s: np.ndarray) -> np.ndarray:
    """Magnetic field of the Earth at a craft, inertial axes.

    Parameters
    ----------
    position_N : ndarray, shape (N, 3)
        From the Earth's centre, inertial (GCRS). [m]
    tai_s : ndarray, shape (N,)
        TAI since 2000-01-01T00:00:00 TAI. [s]

    Returns
    -------
    ndarray, shape (N, 3)
        [T], inertial axes.  IGRF to degree 13; interpolated to 0.5 nT between nodes 30 s apart in low orbit.

    Raises
    ------
    BadInput
        For a date outside the model's years, and for a position below the surface.
    """
    r, t = np.atleast_2d(np.asarray(position_N, float)), np.atleast_1d(np.asarray(tai_s, float))
    check_above_earth(r)
    first, last = _date(float(t.min())), _date(float(t.max()))
    to_earth = earth_fixed(t)
    r_E = np.einsum("nij,nj->ni", to_earth, r)
    share = (t - t.min()) / max(float(np.ptp(t)), 1.0)
    # Earth-fixed components change least along the orbit, and the rotation is exact at each instant
    field_E = through_nodes(t, _STEP_S, lambda at: _field_E(r_E[at], share[at], first, last))
    return np.einsum("nji,nj->ni", to_earth, field_E)


def _field_E(r_E: np.ndarray, share: np.ndarray, first: datetime, last: datetime) -> np.ndarray:
    """IGRF at Earth-fixed positions, Earth-fixed axes. (K, 3) [T]   ``share``: of the way from the first to the last date"""
    import ppigrf

    r = np.linalg.norm(r_E, axis=1)
    theta = np.arctan2(np.hypot(r_E[:, 0], r_E[:, 1]), r_E[:, 2]).clip(1e-8, np.pi - 1e-8)  # the pole divides by sin
    phi = np.arctan2(r_E[:, 1], r_E[:, 0])
    at_dates = ppigrf.igrf_gc(r / 1e3, np.degrees(theta), np.degrees(phi), [first, last])
    # IGRF is linear in time between its epochs
    B_r, B_theta, B_phi = (_TESLA_PER_NANOTESLA * ((1 - share) * b[0] + share * b[1]) for b in at_dates)
    sin_t, cos_t, sin_p, cos_p = np.sin(theta), np.cos(theta), np.sin(phi), np.cos(phi)
    level = B_r * sin_t + B_theta * cos_t
    return np.column_stack(
        [level * cos_p - B_phi * sin_p, level * sin_p + B_phi * cos_p, B_r * cos_t - B_theta * sin_t]
    )


@cache
def _years() -> tuple[datetime, datetime]:
    """First and last date of the coefficients that ppigrf ships."""
    from ppigrf.ppigrf import read_shc

    g, _ = read_shc()
    return g.index[0].to_pydatetime(), g.index[-1].to_pydatetime()


def _date(tai_s: float) -> datetime:
    """The date as ppigrf takes it.  Raises BadInput outside the model's years, where ppigrf only prints a line."""
    date = datetime(2000, 1, 1) + timedelta(seconds=tai_s)  # TAI for UTC: 37 s do not change the field
    first, last = _years()
    if not first <= date <= last:
        raise BadInput(
            f"IGRF gives the magnetic field from {first.year} to {last.year}, not on {date:%Y-%m-%d}",
            remedy="Check the telemetry's epoch, or add the measured field: channels magnetic_field_x, _y, _z.",
        )
    return date
