"""Axes of an Earth orbiter: along the orbit (LVLH), inertial (GCRS), Earth-fixed; and where above the Earth a position is.

Times are TAI seconds since 2000-01-01T00:00:00 TAI, the telemetry's own axis (``tai_ns / 1e9``).  The Earth's rotation is that of
the IAU (2006 precession, 2000A nutation) as ERFA computes it; nothing is downloaded.

UT1 is taken as UTC: they differ by less than 0.9 s by definition, 14 arcsec of the Earth's rotation or 0.5 km at 7000 km.  Polar
motion is left out: 0.5 arcsec.  The magnetic field changes by 1 nT over that.
"""

from __future__ import annotations

import warnings

import numpy as np

from ..kit.rotations import lvlh_to_inertial
from .nodes import through_nodes

_JD_ORIGIN = 2451544.5  # 2000-01-01T00:00:00 TAI
_DAY_S = 86_400.0
TT_MINUS_TAI_S = 32.184

#: Precession and nutation move the pole by 0.2 arcsec a day at most: nodes this far apart leave 0.001 arcsec.
_POLE_STEP_S = 6 * 3600.0


def lvlh_axes(position_N: np.ndarray, velocity_N: np.ndarray) -> np.ndarray:
    """Axes along the orbit: x along the track, y against the orbit normal, z to the nadir (the planet's centre).

    Parameters
    ----------
    position_N, velocity_N : ndarray, shape (N, 3)
        From the planet's centre, inertial axes; any one unit of length.

    Returns
    -------
    ndarray, shape (N, 3, 3)
        Rows are the axes x, y, z in inertial axes: ``axes @ v_N`` is v in LVLH.  Along a Kepler orbit they turn with
        (0, -|r x v| / r^2, 0) in their own axes. [rad/s]
    """
    return lvlh_to_inertial(position_N, velocity_N).inv().as_matrix()


def earth_fixed(tai_s: np.ndarray) -> np.ndarray:
    """Matrices from inertial (GCRS) to Earth-fixed axes (z the pole, x in the meridian of Greenwich).

    Parameters
    ----------
    tai_s : ndarray, shape (N,)
        TAI since 2000-01-01T00:00:00 TAI. [s]

    Returns
    -------
    ndarray, shape (N, 3, 3)
        R3(Earth rotation angle) x celestial-to-intermediate matrix (IERS Conventions 2010, eq 5.1, without polar motion).
        Good to 14 arcsec: UT1 taken as UTC (0.9 s at most).
    """
    import erfa

    tai_s = np.atleast_1d(np.asarray(tai_s, float))

    def pole(at):
        return erfa.c2i06a(*terrestrial_time(tai_s[at])).reshape(-1, 9)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)  # years beyond the last announced leap second
        utc = erfa.taiutc(_JD_ORIGIN, tai_s / _DAY_S)
        angle = erfa.era00(*erfa.utcut1(*utc, 0.0))
    celestial = through_nodes(tai_s, _POLE_STEP_S, pole).reshape(-1, 3, 3)
    return erfa.rz(angle, celestial)


def terrestrial_time(tai_s) -> tuple[float, np.ndarray]:
    """TT as a two-part Julian date, of TAI seconds since 2000-01-01T00:00:00 TAI."""
    return _JD_ORIGIN, (np.asarray(tai_s, float) + TT_MINUS_TAI_S) / _DAY_S


def geodetic(position_N: np.ndarray, tai_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where above the WGS84 ellipsoid the craft is.

    Parameters
    ----------
    position_N : ndarray, shape (N, 3)
        From the Earth's centre, inertial (GCRS). [m]
    tai_s : ndarray, shape (N,)
        As ``earth_fixed`` takes it. [s]

    Returns
    -------
    longitude, latitude, height : ndarray, shape (N,)
        East and north [rad], above the ellipsoid [m]; to 14 arcsec of longitude.
    """
    import erfa

    position_E = np.einsum("nij,nj->ni", earth_fixed(tai_s), np.asarray(position_N, float))
    return erfa.gc2gd(1, position_E)
