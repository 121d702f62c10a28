"""What an Earth orbiter flies through, against the libraries themselves, astropy, and plane geometry."""

import socket
from datetime import datetime

import astropy.units as u
import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.dynamics.frames import earth_fixed, geodetic
from asflown.dynamics.magnetic_field import field_at
from asflown.dynamics.nodes import through_nodes
from asflown.dynamics.orbit import EARTH_POLAR_RADIUS_M, EARTH_RADIUS_M, flown
from asflown.dynamics.sun import ASTRONOMICAL_UNIT_M, SUN_RADIUS_M, sun_direction, sunlit
from asflown.dynamics.thermosphere import density_at, exponential_density
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, utc_to_tai_ns

ORBIT = load_craft("pyramid").orbit
ARCSEC = np.radians(1 / 3600)
STATED_ROTATION = 14 * ARCSEC  # of earth_fixed


@pytest.fixture(autouse=True)
def no_network(monkeypatch):
    def refuse(*_):
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket.socket, "connect", refuse)


@pytest.fixture(scope="module")
def hour():
    """An hour at 2 Hz: times, positions."""
    t = ORBIT.epoch / NS + np.arange(0, 3600, 0.5)
    return t, flown(ORBIT, t)[0]


def tai_time(tai_s):
    """astropy's time of seconds on the TAI axis."""
    from astropy.time import Time

    return Time("2000-01-01T00:00:00", scale="tai") + np.asarray(tai_s) / 86_400.0 * u.day


def of_years(count=40):
    return utc_to_tai_ns("2000-02-01") / NS + np.linspace(0, 29 * 365.25 * 86_400, count)


# ---- nodes ----------------------------------------------------------------------------------------------------


def test_law_a_cubic_comes_back_exactly_from_few_nodes_in_any_order_with_gaps():
    t = np.concatenate([np.arange(0, 1000, 1.0), np.arange(5000, 6000, 1.0), [9000.0]])
    np.random.default_rng(1).shuffle(t)
    asked = []

    def cubic(at):
        asked.append(len(at))
        assert at.max() < len(t)
        return np.column_stack([(t[at] / 1000) ** 3, 2 - t[at] / 1000])

    assert np.allclose(through_nodes(t, 30.0, cubic), np.column_stack([(t / 1000) ** 3, 2 - t / 1000]), atol=1e-10)
    assert asked[0] < 80


def test_samples_further_apart_than_the_nodes_are_evaluated_each():
    t = np.arange(0, 6000, 60.0)
    assert np.array_equal(through_nodes(t, 30.0, lambda at: t[at] ** 5), t**5)


def test_several_places_at_one_instant_are_several_values():
    place = np.arange(20.0)
    assert np.array_equal(through_nodes(np.zeros(20), 30.0, lambda at: place[at]), place)


# ---- axes -----------------------------------------------------------------------------------------------------


def test_law_earth_fixed_axes_agree_with_astropy_within_the_stated_error():
    from astropy import units as u
    from astropy.coordinates import GCRS, ITRS, CartesianRepresentation, SkyCoord

    tai_s = of_years(30)[:24]  # the years of astropy's table
    r = 7e6 * np.column_stack([np.cos(tai_s), np.sin(tai_s), np.full(len(tai_s), 0.5)])
    when = tai_time(tai_s)
    theirs = SkyCoord(CartesianRepresentation(r.T * u.m), frame=GCRS(obstime=when)).transform_to(ITRS(obstime=when))
    ours = np.einsum("nij,nj->ni", earth_fixed(tai_s), r)
    off = np.linalg.norm(ours - theirs.cartesian.xyz.to_value(u.m).T, axis=1) / np.linalg.norm(r, axis=1)
    assert off.max() < STATED_ROTATION
    far_apart = earth_fixed(tai_s)[5]
    assert np.allclose(far_apart @ far_apart.T, np.eye(3), atol=1e-14)


def test_law_between_nodes_the_pole_is_as_at_them():
    t = of_years(2)[0] + np.arange(0, 5 * 86_400, 60.0)
    each = np.concatenate([earth_fixed(t[k : k + 1]) for k in range(0, len(t), 411)])
    assert np.abs(earth_fixed(t)[::411] - each).max() < 0.001 * ARCSEC


def test_law_place_above_the_ellipsoid():
    t = of_years(3)
    up = 7.0e6 * np.array([[0, 0, 1.0]] * 3)
    _, latitude, height = geodetic(up, t)
    assert np.allclose(latitude, np.pi / 2, atol=0.01)  # the pole of date is not that of J2000
    assert np.allclose(height, 7.0e6 - 6356752.3, atol=5)  # m


# ---- the Sun and the shadow -----------------------------------------------------------------------------------


def test_law_the_sun_stands_where_astropy_sees_it():
    from astropy.coordinates import get_sun

    tai_s = of_years(25)[:22]
    theirs = get_sun(tai_time(tai_s)).cartesian.xyz.value.T
    theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
    assert np.linalg.norm(sun_direction(tai_s) - theirs, axis=1).max() < 1 * ARCSEC
    dense = tai_s[0] + np.arange(0, 10 * 86_400, 300.0)
    each = np.concatenate([sun_direction(dense[k : k + 1]) for k in range(0, len(dense), 97)])
    assert np.abs(sun_direction(dense)[::97] - each).max() < 0.001 * ARCSEC


def around(radius_m, angle):
    """Positions in the plane of the Sun, which stands along x; the angle counts from the middle of the shadow."""
    return radius_m * np.column_stack([-np.cos(angle), np.sin(angle), np.zeros_like(angle)])


@pytest.mark.parametrize("radius_m", [6.8e6, 7.4e6, 4.2e7])
def test_law_the_shadow_begins_where_plane_geometry_says(radius_m):
    angle = np.linspace(0, np.pi / 2, 400_001)
    lit = sunlit(around(radius_m, angle), np.array([1.0, 0, 0]))
    edge = np.arcsin(EARTH_RADIUS_M / radius_m)  # of the shadow of a point of light at infinity: a cylinder
    disc = np.arcsin(SUN_RADIUS_M / ASTRONOMICAL_UNIT_M)
    assert np.all(np.diff(lit) >= -1e-12)
    assert angle[np.searchsorted(lit, 0.5)] == pytest.approx(edge, abs=0.01 * disc)
    begins, ends = angle[np.argmax(lit > 0)], angle[np.argmax(lit >= 1)]
    assert begins == pytest.approx(edge - disc, abs=2e-5)  # rad: umbra and penumbra are tangents to both spheres
    assert ends == pytest.approx(edge + disc, abs=2e-5)


def test_law_the_penumbra_of_a_low_orbit_lasts_eight_seconds(hour):
    t, r = hour
    lit = sunlit(around(6.878e6, 1.1085e-3 * np.arange(-1500, 1500, 0.1)), np.array([1.0, 0, 0]))
    assert 0.1 * np.sum((lit > 0) & (lit < 1)) / 2 == pytest.approx(2 * 0.004650 / 1.1085e-3, abs=0.1)  # s
    share = sunlit(r, sun_direction(t))
    assert share.min() == 0 and share.max() == 1  # half past ten at the node: a third of the orbit is dark


def test_law_over_the_pole_the_shadow_begins_at_the_flattened_limb():
    angle = np.linspace(0, np.pi / 2, 400_001)
    r = around(6.878e6, angle)[:, [0, 2, 1]]  # in the meridian
    lit = sunlit(r, np.array([1.0, 0, 0]))
    limb = np.arcsin(EARTH_POLAR_RADIUS_M / 6.878e6)
    assert angle[np.searchsorted(lit, 0.5)] == pytest.approx(limb, abs=5e-5)  # rad: 0.05 s
    tilted = np.array(
        [np.cos(0.4), 0, np.sin(0.4)]
    )  # and where the sun is not in the equator: the line to it just grazes
    r = 6.878e6 * np.column_stack([-np.cos(angle), 0 * angle, np.sin(angle)])
    edge = r[np.searchsorted(sunlit(r, tilted), 0.5)]
    a2, b2 = EARTH_RADIUS_M**2, EARTH_POLAR_RADIUS_M**2
    weights = np.array([1 / a2, 1 / a2, 1 / b2])
    rr, rs, ss = (edge**2 @ weights, (edge * tilted) @ weights, tilted**2 @ weights)
    assert rr - rs**2 / ss == pytest.approx(1, abs=5e-5)


def test_law_far_behind_the_earth_a_ring_of_the_sun_is_left():
    far = np.array([[-2.5e9, 0, 0]])
    b, a = np.arcsin(EARTH_RADIUS_M / 2.5e9), np.arcsin(SUN_RADIUS_M / ASTRONOMICAL_UNIT_M)
    assert sunlit(far, np.array([1.0, 0, 0]))[0] == pytest.approx(1 - (b / a) ** 2, rel=1e-9)
    assert sunlit(-far, np.array([1.0, 0, 0]))[0] == 1


# ---- field and air --------------------------------------------------------------------------------------------


def test_law_the_field_is_ppigrf_s_at_that_place(hour):
    import ppigrf

    t, r = hour[0][::60], hour[1][::60]
    longitude, latitude, height = geodetic(r, t)
    east, north, up = (
        b[0] for b in ppigrf.igrf(np.degrees(longitude), np.degrees(latitude), height / 1e3, datetime(2026, 6, 1))
    )
    sl, cl, sb, cb = np.sin(longitude), np.cos(longitude), np.sin(latitude), np.cos(latitude)
    local = np.stack(
        [
            np.column_stack([-sl, cl, 0 * sl]),
            np.column_stack([-sb * cl, -sb * sl, cb]),
            np.column_stack([cb * cl, cb * sl, sb]),
        ],
        axis=1,
    )
    field_E = np.einsum("nji,nj->ni", local, np.column_stack([east, north, up]))
    theirs = 1e-9 * np.einsum("nji,nj->ni", earth_fixed(t), field_E)
    assert np.abs(field_at(r, t) - theirs).max() < 0.5e-9  # T


def test_law_between_nodes_the_field_errs_by_less_than_half_a_nanotesla(hour):
    t, r = hour
    pick = np.arange(7, len(t), 311)
    each = np.concatenate([field_at(r[k : k + 1], t[k : k + 1]) for k in pick])
    assert np.abs(field_at(r, t)[pick] - each).max() < 0.5e-9  # T


def test_law_the_field_is_that_of_a_dipole_to_a_quarter():
    """At twice the Earth's radius little but the dipole is left: 29.6 uT at its equator on the surface, twice that at its poles."""
    rng = np.random.default_rng(3)
    u = rng.normal(size=(200, 3))
    r = 2 * 6.3712e6 * u / np.linalg.norm(u, axis=1, keepdims=True)
    size = np.linalg.norm(field_at(r, np.full(200, ORBIT.epoch / NS)), axis=1)
    assert 29.6e-6 / 8 * 0.75 < size.min() and size.max() < 2 * 29.6e-6 / 8 * 1.25  # T
    assert size.max() / size.min() == pytest.approx(2, rel=0.25)


@pytest.mark.parametrize("date", ["2045-01-01", "2100-01-01"])
def test_a_date_outside_the_field_s_years_is_refused(date, capsys):
    with pytest.raises(BadInput, match="from 1900 to 20"):
        field_at(np.array([[7e6, 0, 0]]), np.array([utc_to_tai_ns(date) / NS]))
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("world", [field_at, lambda r, t: density_at(r, t, 150, 150, 10)])
def test_kilometres_taken_for_metres_are_refused(world):
    with pytest.raises(BadInput, match="km labelled m"):
        world(np.array([[6878.0, 0, 0]]), np.array([8e8]))


def test_law_the_density_is_pymsis_s_at_that_place(hour):
    from pymsis import Variable, calculate

    t, r = hour
    ours = density_at(r, t, 150.0, 140.0, 12.0)
    pick = np.arange(3, len(t), 173)
    longitude, latitude, height = geodetic(r[pick], t[pick])
    dates = np.datetime64("2026-06-01T00:00:00") + np.rint(1e3 * (t[pick] - t[0])).astype("timedelta64[ms]")
    same = np.ones(len(pick))
    theirs = calculate(dates, np.degrees(longitude), np.degrees(latitude), height / 1e3,
                       150 * same, 140 * same, np.full((len(pick), 7), 12.0))[:, Variable.MASS_DENSITY]  # fmt: skip
    assert np.allclose(ours[pick], theirs, rtol=1e-3)
    assert ours.max() / ours.min() > 1.5  # day and night


def test_law_an_exponential_density_falls_by_e():
    assert exponential_density(560e3, 5e-13, 500e3, 60e3) == pytest.approx(5e-13 / np.e)
