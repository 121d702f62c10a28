"""Figures of a flyby: the set is whole, geometry is to scale and in its place, and axes hold what is shown."""

from functools import cache

import numpy as np
import pytest

from asflown.dynamics.flyby import flyby_called
from asflown.estimate.density.along_flyby import density
from asflown.estimate.jets.fit import jets
from asflown.plots.figure import new_figure, save_figures
from asflown.plots.flyby import flyby_figures
from asflown.plots.flyby_geometry import draw_from_pole, draw_geometry
from cli.program import complaint, run
from flights import CASSINI, flown

ALWAYS = {"attitude-error", "rate-error", "body-rate", "torque", "momentum", "density"}


@cache
def met(scenario="e3", closest_s=180.0, **how):
    f = flown(scenario, seed=3)
    return f.telemetry, density(f.telemetry, CASSINI, f.met.flyby.name, closest_s, method="momentum", **how)


def test_the_set_is_whole(tmp_path):
    telemetry, result = met()
    fitted = jets(telemetry, CASSINI, "E3", 180.0, widths="common", method="momentum")
    figures = flyby_figures(result, telemetry, fitted)
    assert set(figures) == ALWAYS | {"geometry", "geometry-pole", "components", "model"}
    for path in save_figures(figures, tmp_path):
        text = path.read_text()
        assert text.startswith("<?xml") and "E3" in text
        assert "time from closest approach" in text or path.stem.startswith("geometry")
    axes = figures["attitude-error"].axes[0]
    assert axes.get_xlim() == (-60, 180) and 0.15 < axes.get_ylim()[1] < 0.4  # mrad


def test_without_a_latitude_there_is_no_geometry():
    telemetry, result = met("titan", 420.0)
    figures = flyby_figures(result, telemetry)
    assert set(figures) == ALWAYS
    assert figures["density"].axes[0].get_xlim()[1] == pytest.approx(269.2, abs=0.1)  # s: six scale heights up


def test_law_geometry_is_to_scale_and_points_lie_where_the_altitudes_say():
    """004 Fig. 10: P, Q and R on the trajectory, jets at their colatitudes on the sphere."""
    _, result = met()
    _, (ax,) = new_figure()
    draw_geometry(result, ax)
    assert ax.get_aspect() == 1
    points = {t.get_text()[0]: np.array(t.xy) for t in ax.texts if t.get_text()[:2] in ("P,", "Q,", "R,")}
    e3 = flyby_called("E3")
    for name, at_s in (("P", 8.0), ("Q", result.peak.time_s), ("R", 112.0)):
        assert np.linalg.norm(points[name]) == pytest.approx(e3.distance(at_s) / 1e3, abs=0.1)  # km
    assert points["P"][0] > points["Q"][0] > 0 > points["R"][0] and points["R"][1] < points["Q"][1] < points["P"][1] < 0
    sources = [line.get_xydata()[0] for line in ax.lines if line.get_marker() == "o" and line.get_color() != "#D55E00"]
    colatitudes = np.degrees([np.arctan2(x, -y) for x, y in sources])
    assert sorted(colatitudes) == pytest.approx([-10.6, 7.9, 17.1], abs=0.01)
    assert [np.hypot(*s) for s in sources] == pytest.approx([252.3] * 3, abs=0.01)


def test_law_sources_and_path_from_the_pole():
    """Offsets of 004 Table 2 are distances from the path's line: Damascus 0.4 km, Alexandria 17.7 (its arc; the chord is 17.6)."""
    _, result = met()
    _, (ax,) = new_figure()
    draw_from_pole(result, ax)
    lines = {line.get_label(): line.get_xydata() for line in ax.lines}
    path = lines["trajectory E3"]
    along = (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0])
    off = {n: abs(float(np.linalg.det([along, lines[n][0] - path[0]]))) for n in ("Alexandria", "Cairo", "Damascus")}
    assert off == pytest.approx({"Alexandria": 17.57, "Cairo": 11.58, "Damascus": 0.41}, abs=0.02)  # km
    assert np.degrees(np.arctan2(path[0][1], path[0][0])) == pytest.approx(135, abs=1e-6)


def test_the_verb_writes_the_set_or_refuses(tmp_path):
    assert run("simulate", "e4", "--out", tmp_path).code == 0
    words = (
        "density",
        tmp_path / "telemetry.csv",
        "--flyby",
        "E4",
        "--closest-approach",
        "180",
        "--method",
        "momentum",
    )
    done = run(*words, "--plot-dir", tmp_path / "figures")
    assert done.code == 0 and done.err.count("wrote") == 8
    assert {p.stem for p in (tmp_path / "figures").iterdir()} == ALWAYS | {"geometry", "geometry-pole"}
    complaint(*words, "--plot-dir", tmp_path / "telemetry.csv")
