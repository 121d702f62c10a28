"""Geometry, drag and density of the plume: 004's own figures, and laws."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from asflown.dynamics.drag import PRINTED_E3, arm, torque_per_density
from asflown.dynamics.environment import gravity_gradient, gravity_gradient_bound, magnetic_torque_bound
from asflown.dynamics.flyby import enceladus, flyby_called, flybys, published_peaks, tables
from asflown.dynamics.loop import error_per_torque
from asflown.dynamics.plume import (
    as_passed,
    density_by_altitude,
    jet_density,
    model_error,
    offset,
    plume_around_pole,
    plume_density,
    published_jets,
    seen_from,
    tilt,
)
from asflown.kit.errors import BadInput
from asflown.kit.quantities import quantity
from asflown.kit.timeline import utc_to_tai_ns
from flights import CASSINI

E3 = flyby_called("E3")
JETS = {j.name: j for j in published_jets()}
I_B = CASSINI.at(int(utc_to_tai_ns("2008-03-12T00:00:00"))).inertia_kgm2
T = np.arange(10, 130, 0.05)


# ---- published ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("flyby", "at_s", "km"), [
    ("E3", 34, 322.3), ("E3", 26, 227.8), ("E3", 50, 528.2), ("E4", 26, 298.0), ("E5", 20, 197.1), ("E5", 30, 346.6),
])  # fmt: skip
def test_published_altitudes(flyby, at_s, km):
    assert flyby_called(flyby).altitude(at_s) / 1e3 == pytest.approx(km, abs=0.05)


def test_published_table_4_is_shipped_and_its_altitudes_are_those_of_its_times():
    peaks = published_peaks()
    assert [(p.instrument, p.flyby) for p in peaks] == [
        ("AACS", "E3"), ("AACS", "E4"), ("AACS", "E5"), ("INMS", "E3"), ("INMS", "E5")]  # fmt: skip
    for p in peaks:
        assert flyby_called(p.flyby).altitude(p.time_s) / 1e3 == pytest.approx(p.altitude_m / 1e3, abs=1.0)  # km
    aacs, inms = peaks[0], peaks[3]
    assert aacs.density_kgm3 == pytest.approx((5.6e-12, 6.2e-12)) and inms.sigma_kgm3 == pytest.approx(0.2e-12)
    assert 5.96e-12 / np.array([1.8e-12, 2.0e-12, 1.6e-12]) == pytest.approx([3.31, 2.98, 3.72], abs=0.01)  # ">3"
    assert peaks[2].density_kgm3[0] / peaks[4].density_kgm3[0] == pytest.approx(1.51, abs=0.01)


def test_published_table_1_is_shipped():
    planned = {r["name"]: quantity(r["planned_altitude"], "m") for r in tables()["flyby"] if "planned_altitude" in r}
    assert planned == pytest.approx({"E3": 50e3, "E4": 50e3, "E9": 99e3})
    rows = {f.name: (f.latitude_south_rad, f.longitude_west_rad, f.speed_m_s) for f in flybys() if f.longitude_west_rad}
    assert {n: np.degrees(v[:2]).round(6).tolist() for n, v in rows.items()} == {
        "E3": [20, 135], "E4": [28, 98], "E9": [89, 147]}  # fmt: skip
    assert [v[2] for v in rows.values()] == pytest.approx([14410, 17700, 6510])


def test_published_torque_per_density_and_peak_densities():
    a = CASSINI.aerodynamics
    k = float(torque_per_density(a.drag_coefficient, E3.speed_m_s, a.projected_area, a.moment_arm))
    assert k == pytest.approx(3.4222e9, abs=5e4) and pytest.approx(k, rel=1e-4) == PRINTED_E3
    assert 0.0204 / PRINTED_E3 == pytest.approx(5.961e-12, abs=0.001e-12)
    assert 0.019 / PRINTED_E3 == pytest.approx(5.55e-12, abs=0.01e-12)  # printed 5.6


def test_published_gravity_gradient_and_its_size_at_closest_approach():
    """190 uN m at the peak, "less than 1 %"; 1326 uN m at closest approach, 6.5 % of the peak torque."""
    mu, r = enceladus().mu_m3_s2, E3.distance(np.array([34.0, 0.0]))
    assert 1e6 * gravity_gradient_bound(I_B, r, mu)[0] == pytest.approx(190.3, abs=0.1)  # uN m, principal moments
    diagonal = np.diag(np.diag(I_B))
    assert 1e6 * gravity_gradient_bound(diagonal, r, mu) == pytest.approx([189.0, 1325.5], abs=0.5)
    assert gravity_gradient_bound(diagonal, r, mu)[1] / 0.0204 == pytest.approx(0.065, abs=0.0005)


def test_published_magnetic_torque():
    assert 1e6 * magnetic_torque_bound(1.4, 320e-9, 0.1) == pytest.approx(0.493, abs=0.001)
    row = tables()["small_torques"]
    dipole = quantity(row["dipole"], "A m2")
    assert magnetic_torque_bound(dipole, enceladus().field_T, enceladus().field_change) == pytest.approx(0.4928e-6)


def test_published_table_2():
    printed = {n: offset(E3, j.latitude_south_rad, j.longitude_west_rad, "printed") for n, j in JETS.items()}
    assert {n: v / 1e3 for n, v in printed.items()} == pytest.approx(
        {"Alexandria": 17.74, "Cairo": 11.80, "Damascus": 146.2}, abs=0.01)  # fmt: skip
    for jet in JETS.values():  # modulo 180 degrees gives the table
        passed = as_passed(jet, E3)
        assert passed.offset_m / 1e3 == pytest.approx(jet.offset_m / 1e3, abs=0.07)  # km; Alexandria 17.74 for 17.8
        assert np.degrees(passed.tilt_rad) == pytest.approx(np.degrees(jet.tilt_rad), abs=1e-6)


def test_published_geometry_at_the_peak():
    """004: "CQ is about 322 km", and Q "very close to the Cairo plume axis"."""
    for name, km, degrees in (("Alexandria", 324.9, 9.96), ("Cairo", 323.4, 6.40), ("Damascus", 353.8, 37.66)):
        r, theta = seen_from(JETS[name], E3, 34.0)
        assert r / 1e3 == pytest.approx(km, abs=0.06) and np.degrees(theta) == pytest.approx(degrees, abs=0.01)
    theta = seen_from(JETS["Cairo"], E3, T)[1]
    assert T[np.argmin(theta)] == pytest.approx(39.3, abs=0.06) and theta.min() < 1e-3  # rad
    space = seen_from(JETS["Cairo"], E3, T, angle="space")[1]
    assert np.degrees(np.interp(34, T, space)) == pytest.approx(6.74, abs=0.01)
    assert np.degrees(space.min()) == pytest.approx(1.73, abs=0.01)


def test_published_arc_tangent_fails_at_point_p():
    both = [np.degrees(seen_from(JETS["Cairo"], E3, 8.0, variant=v)[1]) for v in ("printed", "corrected")]
    assert both == pytest.approx([87.3, 92.7], abs=0.05)
    t = np.arange(0, 20, 0.05)
    for name, until in (("Alexandria", 10.2), ("Cairo", 10.9), ("Damascus", 10.8)):
        wrong = ~np.isclose(*(seen_from(JETS[name], E3, t, variant=v)[1] for v in ("printed", "corrected")))
        assert t[wrong].max() == pytest.approx(until, abs=0.11)  # s, a step of 0.05 s and the rounding


@pytest.mark.parametrize(("how", "at_34", "peak", "at_s"), [
    ({}, 6.26, 6.475, 39.3), ({"power": 2}, 6.93, 6.954, 33.1), ({"angle": "space"}, None, 6.27, 36.7),
])  # fmt: skip
def test_published_density_of_table_3(how, at_34, peak, at_s):
    rho = 1e12 * plume_density(JETS.values(), E3, T, **how)
    assert rho.max() == pytest.approx(peak, abs=0.006) and T[np.argmax(rho)] == pytest.approx(at_s, abs=0.06)
    if at_34 is not None:
        assert np.interp(34, T, rho) == pytest.approx(at_34, abs=0.01)


def test_published_parts_of_the_jets_and_the_step_at_1400_km():
    parts = [1e12 * float(jet_density(j, E3, 34.0)) for j in JETS.values()]
    assert parts == pytest.approx([0.23, 5.20, 0.82], abs=0.01)
    assert parts[1] / sum(parts) == pytest.approx(0.83, abs=0.005)
    at_r = [float(plume_density(JETS.values(), E3, 112.0, variant=v)) for v in ("printed", "corrected")]
    assert 1e12 * at_r[0] == pytest.approx(0.616, abs=0.001)  # Damascus alone: the others are beyond 1400 km
    assert [float(seen_from(JETS[n], E3, 112.0)[0]) / 1e3 for n in JETS] == pytest.approx([1421, 1403, 1389], abs=0.6)
    assert at_r[1] > 1.4 * at_r[0]


def test_published_height_law_gives_a_tenth_of_the_peak():
    one = float(density_by_altitude(322.3e3))
    assert one == pytest.approx(5.98e-13, abs=0.01e-13) and 10 * one == pytest.approx(5.96e-12, rel=0.005)


def test_published_model_error_is_a_root():
    t = np.linspace(8, 112, 500)
    off = np.full_like(t, 0.435e-12)
    assert model_error(t, off, 0 * t) == pytest.approx(0.435e-12)
    assert model_error(t, off, 0 * t, "printed") == pytest.approx(0.435e-12**2)
    assert 0.435 / 5.96 == pytest.approx(0.073, abs=0.0005)  # printed 7.5 %


def test_published_peak_of_the_attitude_error_comes_too_late_for_that_of_the_torque():
    """004: torque +34 s, attitude error +54 s.  Its own loop is late by 18.4 s at most, by 2.4 s for Table 3's torque."""
    k = CASSINI.wheel_controller
    w, z = k.natural_frequency_rad_s, k.damping
    assert np.pi / (w * np.sqrt(1 - z**2)) == pytest.approx(18.4, abs=0.05)
    t = np.arange(0.0, 200.0, 0.1)  # nothing before closest approach: the jets are below the horizon there
    torque = -PRINTED_E3 * plume_density(JETS.values(), E3, t, variant="printed")
    torque = np.where(t > 0, torque, 0.0)
    _, error, _ = signal.lsim(error_per_torque(k, 3640.4), torque, t)
    lag = t[np.argmax(np.abs(error))] - t[np.argmax(np.abs(torque))]
    assert lag == pytest.approx(2.4, abs=0.25)  # s


@pytest.mark.parametrize(("power", "percent", "correlation"), [
    (1, [343.4, 23.7, 18.5, 181.3, 40.3, 54.6], -0.88), (2, [266.0, 9.0, 21.9, 76.3, 17.1, 11.6], -0.89),
])  # fmt: skip
def test_published_parameters_are_not_all_identified(power, percent, correlation):
    """The Cramér-Rao bound of Table 3's six parameters under 004's own misfit, 0.435e-12 kg/m3 a second: the text has no sigma."""
    t = np.arange(8, 113, 1.0)
    reached = {n: seen_from(j, E3, t)[0] <= 1400e3 for n, j in JETS.items()}  # as 004 cuts its jets off

    def model(x):
        jets = [replace(j, density_kgm3=j.density_kgm3 * a, width_rad=j.width_rad * b)
                for j, a, b in zip(JETS.values(), x[:3], x[3:], strict=True)]  # fmt: skip
        return sum(np.where(reached[j.name], jet_density(j, E3, t, power=power), 0) for j in jets) / 0.435e-12

    jacobian = np.stack([(model(1 + 1e-4 * e) - model(1 - 1e-4 * e)) / 2e-4 for e in np.eye(6)], axis=1)
    C = np.linalg.inv(jacobian.T @ jacobian)
    sigma = np.sqrt(np.diag(C))
    assert 100 * sigma == pytest.approx(percent, abs=0.15)  # of K, then K_theta, of Alexandria, Cairo, Damascus
    assert C[0, 1] / sigma[0] / sigma[1] == pytest.approx(correlation, abs=0.006)


# ---- laws ---------------------------------------------------------------------------------------------------


def test_law_a_plume_around_the_pole_is_its_base_density_there_and_falls():
    assert plume_around_pole(2.0, 252e3, 252e3, 0.0, 0.2, 1e5) == 2.0
    assert plume_around_pole(2.0, 252e3, 352e3, 0.2, 0.2, 1e5) == pytest.approx(2 * (252 / 352) ** 2 * np.exp(-2))


def test_law_drag_torque_is_force_times_arm():
    """About the centre of mass, of a force -1/2 C_D rho V^2 A u at the centre of pressure."""
    rng = np.random.default_rng(1)
    u, pressure, mass = rng.normal(size=(3, 3))
    u /= np.linalg.norm(u)
    force = -0.5 * 2.1 * 3e-12 * 14e3**2 * 18 * u
    k = torque_per_density(2.1, 14e3, 18, arm(3 * u, pressure, mass))
    assert 3e-12 * k == pytest.approx(np.cross(pressure - mass, force), rel=1e-12)
    over_time = torque_per_density(2.1, np.array([14e3, 7e3]), 18, arm(u, pressure, mass))
    assert over_time[1] == pytest.approx(k / 4)


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_property_no_attitude_has_more_gravity_gradient_than_the_bound(direction):
    r = 3e5 * np.array(direction) / np.linalg.norm(direction)
    T_B = gravity_gradient(I_B, r[None, :], enceladus().mu_m3_s2)
    assert np.linalg.norm(T_B) <= gravity_gradient_bound(I_B, 3e5, enceladus().mu_m3_s2) * (1 + 1e-9)


def test_law_a_flyby_is_a_straight_line():
    at = E3.position(np.array([-50.0, 0.0, 50.0]), (0, 0, 2.0), (5.0, 0, 0))
    assert np.linalg.norm(at, axis=1) == pytest.approx(E3.distance(np.array([-50, 0, 50])))
    assert np.linalg.norm(E3.in_plane(np.array([-50.0, 50])), axis=1) == pytest.approx(E3.distance([-50, 50]))
    step = (E3.altitude(34.001) - E3.altitude(33.999)) / 0.002
    assert E3.climb_rate(34.0) == pytest.approx(step, rel=1e-6)


def test_law_a_jet_on_the_far_side_tilts_the_other_way():
    assert tilt(E3, np.radians(80), np.radians(135)) == pytest.approx(np.radians(10))
    assert tilt(E3, np.radians(80), np.radians(315)) == pytest.approx(np.radians(-10))
    assert offset(E3, np.radians(80), np.radians(315)) == pytest.approx(0, abs=1e-6)


def test_law_density_stays_finite_at_the_source_and_continues_beyond():
    t = np.arange(-200.0, 400.0, 0.5)
    for jet in JETS.values():
        for variant in ("printed", "corrected"):
            assert np.isfinite(jet_density(jet, E3, t, variant=variant)).all()
    late = plume_density(JETS.values(), E3, np.arange(100.0, 130.0))
    assert (np.diff(late) < 0).all() and (late > 0).all()


def test_what_it_refuses():
    with pytest.raises(BadInput, match="E3, E4, E5, E9"):
        flyby_called("E21")
    for what in (
        lambda: seen_from(JETS["Cairo"], flyby_called("E5"), 0.0),
        lambda: offset(flyby_called("E5"), 1.0, 1.0),
        lambda: seen_from(JETS["Cairo"], E3, 0.0, variant="best"),
        lambda: seen_from(JETS["Cairo"], E3, 0.0, angle="flat"),
        lambda: E3.position(0.0, (0, 0, 1), (0, 1, 1)),
        lambda: E3.position(0.0, (0, 0, 0), (0, 1, 1)),
    ):
        with pytest.raises(BadInput):
            what()
    assert flyby_called("enceladus-3") is E3 and E3.noticed_s == (8, 112)
