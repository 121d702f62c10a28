"""An orbit flown: energy, node drift, axes along it; and what cannot be an orbit."""

import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.dynamics.environment import MU_EARTH
from asflown.dynamics.frames import earth_fixed, geodetic, lvlh_axes
from asflown.dynamics.orbit import (
    EARTH_RADIUS_M,
    J2_EARTH,
    Orbit,
    bridged,
    check_above_earth,
    flown,
    gravity_at,
    propagate,
    state_of,
)
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, utc_to_tai_ns
from conftest import flight_data

ORBIT = load_craft("pyramid").orbit
DAY_S = 86_400.0


def potential(r):
    size = np.linalg.norm(r, axis=-1)
    sin2 = (r[..., 2] / size) ** 2
    return -MU_EARTH / size * (1 - J2_EARTH * (EARTH_RADIUS_M / size) ** 2 * (3 * sin2 - 1) / 2)


def test_law_gravity_is_the_slope_of_its_potential():
    r = np.array([[6.9e6, 1e5, -2e6], [-3e6, 5e6, 4e6]])
    step = 10.0 * np.eye(3)
    slope = np.stack([(potential(r + d) - potential(r - d)) / 20 for d in step], axis=-1)
    assert np.allclose(gravity_at(r), -slope, rtol=0, atol=1e-7)  # m/s2


def test_law_energy_and_polar_momentum_stay():
    r, v = flown(ORBIT, ORBIT.epoch / NS + np.linspace(-DAY_S / 2, DAY_S / 2, 1001))
    energy = 0.5 * np.sum(v**2, axis=1) + potential(r)
    polar = np.cross(r, v)[:, 2]
    assert np.ptp(energy) < 1e-9 * abs(energy[0]) and np.ptp(polar) < 1e-9 * abs(polar[0])


def test_law_elements_give_their_own_kepler_orbit():
    eccentric = ORBIT.model_copy(update={"eccentricity": 0.4, "semi_major_axis": 1.3e7, "mean_anomaly": 1.0})
    r, v = state_of(eccentric)
    a, e = eccentric.semi_major_axis, eccentric.eccentricity
    assert 1 / (2 / np.linalg.norm(r) - v @ v / MU_EARTH) == pytest.approx(a, rel=1e-12)
    h = np.cross(r, v)
    to_perigee = np.cross(v, h) / MU_EARTH - r / np.linalg.norm(r)
    assert np.linalg.norm(to_perigee) == pytest.approx(e, rel=1e-12)
    assert np.arccos(h[2] / np.linalg.norm(h)) == pytest.approx(eccentric.inclination, rel=1e-12)
    assert np.arctan2(h[0], -h[1]) == pytest.approx(eccentric.ascending_node, rel=1e-12)
    assert to_perigee[2] / e == pytest.approx(np.sin(eccentric.argument_of_perigee) * np.sin(eccentric.inclination))
    since_perigee = eccentric.mean_anomaly / np.sqrt(MU_EARTH / a**3)
    there, _ = propagate(r, v, [-since_perigee, 2 * np.pi * np.sqrt(a**3 / MU_EARTH)], j2=0.0)
    assert np.linalg.norm(there[0]) == pytest.approx(a * (1 - e), abs=0.1)  # m
    assert np.allclose(there[1], r, rtol=0, atol=0.1)  # m, once around


@pytest.mark.parametrize("inclination_deg", [51.6, 97.4])
def test_law_the_node_drifts_at_the_secular_rate(inclination_deg):
    orbit = ORBIT.model_copy(update={"inclination": np.radians(inclination_deg)})
    t = np.linspace(0, 3 * DAY_S, 3001)
    r, v = flown(orbit, orbit.epoch / NS + t)
    h = np.cross(r, v)
    node = np.unwrap(np.arctan2(h[:, 0], -h[:, 1]))
    rate = np.polyfit(t, node, 1)[0]
    # the elements of the formula are means over an orbit: those of the state differ from them by J2 of themselves
    a = 1 / np.mean(2 / np.linalg.norm(r, axis=1) - np.sum(v**2, axis=1) / MU_EARTH)
    secular = -1.5 * np.sqrt(MU_EARTH / a**3) * J2_EARTH * (EARTH_RADIUS_M / a) ** 2 * np.cos(orbit.inclination)
    assert rate == pytest.approx(secular, rel=0.005)


def test_law_axes_along_the_orbit_are_orthonormal_and_turn_at_its_rate():
    t = np.arange(-2.0, 6000.0, 1.0)
    r, v = propagate(*state_of(ORBIT), t, j2=0.0)
    axes = lvlh_axes(r, v)
    assert np.allclose(axes @ np.swapaxes(axes, 1, 2), np.eye(3), atol=1e-13)
    assert np.allclose(np.linalg.det(axes), 1)
    assert np.allclose(np.einsum("nij,nj->ni", axes, r), np.linalg.norm(r, axis=1)[:, None] * [0, 0, -1], atol=1e-6)
    along = np.einsum("nij,nj->ni", axes, v)
    assert (along[:, 0] > 0).all() and np.allclose(along[:, 1], 0, atol=1e-8)
    turning = np.einsum("nij,nkj->nik", (axes[2:] - axes[:-2]) / 2, axes[1:-1])  # dA/dt A^T = -[w x], w in its own axes
    w = np.stack([turning[:, 1, 2], turning[:, 2, 0], turning[:, 0, 1]], axis=1)
    size = np.linalg.norm(np.cross(r, v), axis=1) / np.sum(r**2, axis=1)
    assert np.allclose(w, -size[1:-1, None] * [0, 1, 0], rtol=0, atol=1e-8)  # rad/s, of 1.1e-3


def test_law_there_and_back_again():
    r, v = state_of(ORBIT)
    there, speed = propagate(r, v, [DAY_S])
    back, _ = propagate(there[0], speed[0], [-DAY_S])
    assert np.allclose(back[0], r, rtol=0, atol=0.05)  # m


def test_an_orbit_long_after_its_epoch_is_refused():
    with pytest.raises(BadInput, match="100 days from the time asked for"):
        flown(ORBIT, [ORBIT.epoch / NS + 100 * DAY_S])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("span_s", [1200.0, 6000.0])
def test_law_positions_in_another_unit_or_in_turning_axes_are_told_by_their_own_acceleration(scale, turning, span_s):
    tai_s = ORBIT.epoch / NS + np.arange(0, span_s, 5.0)
    r, _ = flown(ORBIT, tai_s)
    seen = np.einsum("nij,nj->ni", earth_fixed(tai_s), r) if turning else r
    noisy = scale * (seen + np.random.default_rng(4).normal(0, 3.0, r.shape))  # m, as a receiver's
    words = Orbit(tai_s - tai_s[0], noisy).misreading()
    unit = {1e-3: "in kilometres", 1.0: "", 1e3: "in metres"}[scale]
    assert ("Earth-fixed" in words) == turning and unit in words and bool(words) == (turning or scale != 1.0)


def test_recovery_the_station_flies_where_the_model_says():
    """Two hours of the ISS as an instrument received it; its clock steps by 1 s (7.5 km) twice before row 100."""
    with flight_data("real/iss-tsis1/ephemeris.csv").open() as f:
        rows = list(csv.DictReader(f))[100:]
    tai_s = utc_to_tai_ns([row["UTC"].replace(" ", "T") for row in rows]) / NS
    r, v = (
        0.3048 * np.array([[float(row[f"{what}_{a}"]) for a in "xyz"] for row in rows])
        for what in ("position", "velocity")
    )
    foretold, _ = propagate(r[0], v[0], tai_s - tai_s[0])
    assert np.linalg.norm(foretold - r, axis=1).max() < 2000  # m, after 1 h 43 min
    assert np.all((geodetic(r, tai_s)[2] > 410e3) & (geodetic(r, tai_s)[2] < 445e3))  # m
    as_seen = Orbit(tai_s - tai_s[0], r)
    assert as_seen.misreading() == ""
    assert replace(as_seen, position_N=r / 0.3048).misreading() == "in feet, labelled metres"
    turning = np.einsum("nij,nj->ni", earth_fixed(tai_s), r)
    assert replace(as_seen, position_N=turning).misreading() == "in Earth-fixed axes"


def test_law_positions_that_nothing_makes_an_orbit_have_no_other_reading():
    t = np.arange(0.0, 1200, 5.0)
    straight = np.array([7e6, 0, 0]) + t[:, None] * np.array([0, 7e3, 0])
    assert Orbit(t, straight).misreading() == ""
    still = Orbit(t, np.tile([5e6, 5e6, 0], (len(t), 1)))
    assert still.misreading() == ""


@pytest.mark.parametrize("position", [[6878.0, 0, 0], [6.2e6, 0, 0], [np.nan, 0, 0]])
def test_below_the_surface_is_refused(position):
    with pytest.raises(BadInput, match="below its surface"):
        check_above_earth(np.array([[7e6, 0, 0], position]))


def test_times_may_come_in_any_order_and_twice():
    r, _ = propagate(*state_of(SimpleNamespace(**ORBIT.model_dump())), [60.0, 0.0, -60.0, 60.0])
    assert np.array_equal(r[0], r[3]) and np.array_equal(r[1], state_of(ORBIT)[0])


def test_recovery_of_the_way_through_a_gap():
    t = np.arange(0.0, 5600.0, 10.0)
    r, _ = propagate([6.878e6, 0, 0], [0, 950.0, 7553.0], t)
    there = (t < 1000) | (t > 2500)
    whole, lengths = bridged(Orbit(t[there], np.round(r[there])), 3000.0)
    assert lengths == [1520.0]
    assert np.linalg.norm(whole.at(t) - r, axis=1).max() < 10.0
    assert bridged(Orbit(t[there], r[there]), 1000.0)[1] == []
