"""A flyby along a given trajectory: against the straight line of the tables, from tables and kernels, and what is refused."""

import sys

import numpy as np
import pytest

from asflown.cli.flyby_options import sources_from
from asflown.craft.load import load_craft
from asflown.dynamics.flyby import flyby_called
from asflown.dynamics.plume import as_passed, plume_density, published_jets, seen_from
from asflown.dynamics.trajectory import NEAREST_ELSEWHEN, STRAIGHT_BEYOND, Trajectory
from asflown.estimate.density.drag import CONSTANT_DRAG
from asflown.kit.errors import BadInput
from asflown.kit.timeline import et_to_tai_ns, utc_to_tai_ns
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.kernels import trajectory_from_kernels
from asflown.telemetry.trajectory import load_trajectory
from cli.program import complaint, run
from flights import saved

E3 = flyby_called("E3")
T = np.arange(-100.0, 161.0, 10.0)
CLOSEST = "2008-03-12T19:06:12"
HEAD = "time [s],position_x [km],position_y [km],position_z [km],velocity_x [km/s],velocity_y [km/s],velocity_z [km/s]"


def straight(t=T, flyby=E3):
    """E3's line in axes fixed to Enceladus: in the meridian 135 W, southwards."""
    out = np.array([np.cos(flyby.longitude_west_rad), -np.sin(flyby.longitude_west_rad), 0.0])
    plane = flyby.in_plane(t)
    r = plane[:, :1] * out + plane[:, 1:] * np.array([0.0, 0.0, -1.0])
    v = np.gradient(r, t, axis=0)
    return t, r, v


def table(t=0.0, scale=1.0, epoch=None):
    at, r, v = straight()
    rows = np.column_stack([at + t, r / 1e3 * scale, v / 1e3])
    head = "" if epoch is None else f"# epoch: {epoch}\n"
    return head + HEAD + "\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows) + "\n"


# ---- laws ---------------------------------------------------------------------------------------------------


def test_law_a_straight_trajectory_is_the_straight_flyby():
    path, fine = Trajectory.along(E3, *straight()), np.linspace(-150, 200, 701)  # beyond its ends too
    assert path.altitude(fine) == pytest.approx(E3.altitude(fine), abs=0.5)
    assert path.speed(fine) == pytest.approx(E3.speed(fine)) and path.speed_m_s == pytest.approx(14410)
    assert path.climb_rate(fine) == pytest.approx(E3.climb_rate(fine), abs=0.5)
    assert path.in_plane(fine) == pytest.approx(E3.in_plane(fine), abs=0.5)
    assert np.degrees([path.latitude_south_rad, path.longitude_west_rad]) == pytest.approx([20, 135], abs=1e-6)
    assert path.doubts == () and path.position(34.0, (0, 0, 2), (1, 0, 0)) == pytest.approx(
        E3.position(34.0, (0, 0, 2), (1, 0, 0)), abs=1.0)  # fmt: skip


def test_law_jets_are_seen_as_from_the_straight_line_but_for_their_lean_across_the_plane():
    """004 takes a jet's axis as lying in the flyby's plane; in space it leans out of it by offset over radius, up to 4 degrees."""
    path = Trajectory.along(E3, *straight())
    for jet in (as_passed(j, E3) for j in published_jets()):
        for angle, leans in (("plane", 0.6), ("space", 2.8)):
            (r, theta), (r0, theta0) = (seen_from(jet, f, T, angle=angle) for f in (path, E3))
            assert r == pytest.approx(r0, rel=0.014)
            assert np.degrees(np.abs(theta - theta0)).max() < leans
    jets = published_jets()
    assert plume_density(jets, path, T) == pytest.approx(plume_density(jets, E3, T), rel=0.03, abs=1e-14)


def test_law_a_bent_path_is_followed():
    """A hyperbola about a heavy point: energy gives the speed, and the cubic keeps it between rows 10 s apart."""
    mu, r0, v0 = 8978.1e9, 3.575e6, 6000.0
    from scipy.integrate import solve_ivp

    def fall(_, y):
        return np.r_[y[3:], -mu * y[:3] / np.linalg.norm(y[:3]) ** 3]

    t = np.arange(-400.0, 401.0, 10.0)
    ahead = solve_ivp(fall, (0, 400), [r0, 0, 0, 0, v0, 0], t_eval=t[t >= 0], rtol=1e-10, atol=1e-3).y.T
    back = solve_ivp(fall, (0, -400), [r0, 0, 0, 0, v0, 0], t_eval=t[t <= 0][::-1], rtol=1e-10, atol=1e-3).y.T
    states = np.vstack([back[:0:-1], ahead])
    path = Trajectory.along(flyby_called("Titan"), t, states[:, :3], states[:, 3:])
    fine = np.linspace(-399, 399, 97)
    energy = 0.5 * path.speed(fine) ** 2 - mu / path.distance(fine)
    assert energy == pytest.approx(np.full(97, 0.5 * v0**2 - mu / r0), rel=2e-4)
    assert abs(path.closest_s) < 0.01 and path.altitude_m == pytest.approx(1e6, abs=1)
    kepler = flyby_called("Titan")  # the same in closed form
    assert path.altitude(fine) == pytest.approx(kepler.altitude(fine), abs=2)  # m
    assert path.speed(fine) == pytest.approx(kepler.speed(fine), rel=2e-5)
    assert path.climb_rate(fine) == pytest.approx(kepler.climb_rate(fine), abs=1)
    assert path.position(fine, (0, 1, 0), (0, 0, 3)) == pytest.approx(
        kepler.position(fine, (0, 1, 0), (0, 0, 3)), abs=5
    )
    straight_m = np.hypot(r0, v0 * 250) - 2575e3
    assert straight_m - kepler.altitude(250.0) == pytest.approx(
        20.56e3, abs=0.05e3
    )  # gravity bends it towards the body


# ---- from tables --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("text", "closest_ns"), [
    (table(), 0), (table(t=180, epoch="2008-03-12T19:03:12"), int(utc_to_tai_ns(CLOSEST))),
])  # fmt: skip
def test_a_table_is_read_with_its_units_and_its_time(tmp_path, text, closest_ns):
    (tmp_path / "t.csv").write_text(text)
    read = load_trajectory(tmp_path / "t.csv")
    assert (read.tai_ns - closest_ns) / 1e9 == pytest.approx(T) and read.dated is bool(closest_ns)
    assert read.position_m == pytest.approx(straight()[1], abs=0.01)  # nine digits of a kilometre


@pytest.mark.parametrize(("text", "words"), [
    (table().replace("velocity_z [km/s]", "speed [km/s]"), "velocity_z"),
    (table().replace("position_y [km]", "position_y [kg]"), "kg"),
    (table(scale=1e3), "do not match the change of the positions"),
    ("\n".join(table().split("\n")[:3]), "too few"),
    (table().replace("\n-90,", "\n-100,"), "do not increase"),
    (table().replace("-90,", "x,", 1), "x"),
    ("", "empty"),
])  # fmt: skip
def test_what_a_table_is_refused_for(tmp_path, text, words):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(BadInput, match=words):
        load_trajectory(tmp_path / "t.csv")


def test_what_a_path_is_refused_for():
    t, r, v = straight()
    with pytest.raises(BadInput, match="does not hold it"):
        Trajectory.along(E3, t + 500, r, v)
    with pytest.raises(BadInput, match="less than its radius"):
        Trajectory.along(E3, t, 0.5 * r, 0.5 * v)
    late = Trajectory.along(E3, t + 5, r, v)
    (doubt,) = late.doubts.of(NEAREST_ELSEWHEN)
    assert doubt.numbers["apart_s"] == pytest.approx(5.0, abs=0.05) and doubt.about["when"] == "after"


def test_the_verbs_follow_a_trajectory(tmp_path):
    flight = fly("e3", noise="half", seed=2)
    saved(flight.telemetry, tmp_path, "e3.csv")
    (tmp_path / "t.csv").write_text(table())
    words = (
        "density",
        tmp_path / "e3.csv",
        "--flyby",
        "E3",
        "--closest-approach",
        CLOSEST,
        "--method",
        "momentum",
        "--json",
    )
    plain, along = run(*words).record, run(*words, "--trajectory", tmp_path / "t.csv").record
    assert along["peak"]["density_kgm3"] == pytest.approx(plain["peak"]["density_kgm3"], rel=1e-6)
    assert along["altitude_m"] == pytest.approx(plain["altitude_m"], rel=1e-3)
    (drag,) = [d for d in along["doubts_detail"] if d["kind"] == CONSTANT_DRAG.id]
    assert drag["about"]["what"] == "area and arm"
    assert str(tmp_path / "t.csv") in {i["file"] for i in along["provenance"]["inputs"]}
    fitted = run("jets", *words[1:], "--trajectory", tmp_path / "t.csv", "--widths", "common")
    assert fitted.code == 0 and fitted.record["sources"][1]["name"] == "Cairo"
    complaint(*words[:-1], "--trajectory", tmp_path / "none.csv")
    complaint(*words[:-1], "--trajectory", tmp_path / "t.csv", "--kernels", tmp_path / "t.csv")
    complaint(*words[:-1], "--kernels", tmp_path / "none.tm")


# ---- from kernels -------------------------------------------------------------------------------------------


def test_without_spiceypy_kernels_are_refused_in_words(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "spiceypy", None)
    with pytest.raises(BadInput, match=r"spiceypy, which is not installed\n.*asflown\[spice\]"):
        trajectory_from_kernels([tmp_path / "a.tm"], "CASSINI", "Enceladus", 0)


def test_kernels_give_the_path_they_hold(tmp_path):
    """Real kernels, written here: a line in J2000 past Enceladus, whose axes turn about J2000's z."""
    spice = pytest.importorskip("spiceypy")
    closest_ns = int(utc_to_tai_ns(CLOSEST))
    et = (closest_ns - int(et_to_tai_ns(0.0)[0])) / 1e9
    (tmp_path / "axes.tpc").write_text(
        "KPL/PCK\n\\begindata\nBODY602_POLE_RA = ( 0. 0. 0. )\nBODY602_POLE_DEC = ( 90. 0. 0. )\n"
        "BODY602_PM = ( 10. 262.7318996 0. )\nBODY602_RADII = ( 252.3 252.3 252.3 )\n\\begintext\n"
    )
    t = np.arange(-1000.0, 1001.0, 10.0)
    states = np.column_stack([np.full_like(t, 300.2), 14.41 * t, 0 * t, 0 * t, np.full_like(t, 14.41), 0 * t])
    spk = spice.spkopn(str(tmp_path / "craft.bsp"), "line", 0)
    spice.spkw09(spk, -82, 602, "J2000", et - 1000, et + 1000, "line", 3, len(t), states, et + t)
    spice.spkcls(spk)
    kernels = [tmp_path / "axes.tpc", tmp_path / "craft.bsp"]
    got = trajectory_from_kernels(kernels, "CASSINI", "Enceladus", closest_ns)
    path = Trajectory.along(E3, (got.tai_ns - closest_ns) / 1e9, got.position_m, got.velocity_m_s)
    assert abs(path.closest_s) < 0.01 and path.altitude_m == pytest.approx(47.9e3, abs=1)
    assert path.altitude(34.0) == pytest.approx(322.3e3, abs=100)
    # the prime meridian has turned by W = 90 + 10 + rate x days from J2000's x towards y
    meridian = np.radians(100 + 262.7318996 * et / 86_400)
    assert np.cos(path.longitude_west_rad - meridian) == pytest.approx(1, abs=1e-6)
    assert got.velocity_m_s[0] != pytest.approx([0, 14410, 0])  # seen from axes that turn
    with pytest.raises(BadInput, match="do not provide GALILEO ORBITER"):
        trajectory_from_kernels(kernels, "GALILEO ORBITER", "Enceladus", closest_ns)
    with pytest.raises(BadInput, match="do not provide CASSINI"):
        trajectory_from_kernels(kernels, "CASSINI", "Enceladus", closest_ns + 10**13)
    assert load_craft("cassini").name.upper() == "CASSINI"


def test_a_speed_too_low_to_pass_is_refused():
    from dataclasses import replace

    with pytest.raises(BadInput, match="stays with it"):
        replace(flyby_called("Titan"), speed_m_s=2000.0).altitude(0.0)


def test_one_wrong_row_is_named_and_a_wrong_unit_is_not_the_telemetrys_fault(tmp_path):
    lines = table().splitlines()
    at = len(lines) // 2
    cells = lines[at].split(",")
    lines[at] = ",".join([cells[0], str(float(cells[1]) + 50), *cells[2:]])
    (tmp_path / "t.csv").write_text("\n".join(lines))
    with pytest.raises(BadInput, match="another velocity"):
        load_trajectory(tmp_path / "t.csv")
    t, r, v = straight()
    with pytest.raises(BadInput, match="gas is looked for within"):
        Trajectory.along(E3, t, 1e3 * r, 1e3 * v)
    near = np.abs(t) <= 20
    (doubt,) = Trajectory.along(E3, t[near], r[near], v[near]).doubts
    assert doubt.kind == STRAIGHT_BEYOND and doubt.numbers == {"start_s": -20.0, "stop_s": 20.0}


def test_a_source_by_tilt_and_offset_has_no_place_along_a_trajectory():
    path = Trajectory.along(E3, *straight())
    with pytest.raises(BadInput, match="follows a trajectory"):
        sources_from(["X=5 deg,3 km"], path)
    with pytest.raises(BadInput, match="beyond 90 degrees"):
        sources_from(["X=120 deg,30 deg"], E3)
    assert len(sources_from(["X=80 deg,30 deg"], path)) == 1
