"""The sources of a torque: found again, honest where they look alike, and said in words."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from asflown.estimate.environment import WHEELS_MISREAD
from asflown.estimate.external import external_torque
from asflown.estimate.sources import SOURCES, sources
from asflown.estimate.sources.doubts import NO_CONSTANT, NOT_EXPLAINED, SHORT
from asflown.kit.errors import BadInput
from flights import changed, iss, without
from leo import craft, said, slews
from orbiter import drawn, fly

TRUE = {"dipole": "dipole", "sunlight": "sunlight", "drag": "drag", "constant": "constant"}


@cache
def flown(seed=3, **changes):
    return drawn(seed, **dict(changes)), *fly(drawn(seed, **dict(changes)))


@cache
def found(seed=3, which=None):
    _, tlm, craft_, _ = flown(seed)
    return sources(tlm, craft_, which=which)


def within(result, flight):
    return {
        n: [bool(low <= t <= high) for (low, high), t in zip(of.ci95, getattr(flight, TRUE[n]), strict=True)]
        for n, of in result.found.items()
    }


@pytest.mark.parametrize("seed", [3, 8])
def test_recovery_of_dipole_and_levers(seed):
    result, flight = found(seed), flown(seed)[0]
    assert result.constant_chance < 0.3 and result.doubts.has(NO_CONSTANT)
    assert all(all(axes) for axes in within(result, flight).values())
    half = 0.5 * np.diff(result.found["dipole"].ci95, axis=1)
    assert half.max() < 0.15
    assert abs(result.swing["amplitude"] - flight.swing) < 4 * result.swing["amplitude_sigma"]


def test_recovery_of_a_constant_torque_that_is_there():
    flight = replace(drawn(5), constant=np.array([6e-6, 0.0, 0.0]))
    tlm, craft_, _ = fly(flight)
    result = sources(tlm, craft_)
    assert result.constant_chance > 0.5 and not result.doubts.has(NO_CONSTANT)
    assert all(all(axes) for axes in within(result, flight).values())


def test_law_what_looks_alike_is_said_and_its_interval_is_wide():
    result = found(which=SOURCES)
    assert any("drag lever along y from a constant torque about z" in s for s in result.untold)
    wide, narrow = result.found["drag"].ci95, found().found["drag"].ci95
    assert np.diff(wide[1])[0] > 20 * np.diff(narrow[1])[0]
    assert all(all(axes) for axes in within(result, flown()[0]).values())


def test_law_the_lever_along_the_velocity_spoils_nothing():
    drag = found().found["drag"]
    assert not drag.told[0] and drag.told[1:].all()
    assert any("drag lever along x" in s for s in found().untold)
    assert found().record()["drag_lever_Nm"][0] is None or np.isnan(found().record()["drag_lever_Nm"][0])


def test_law_contributions_and_residual_make_the_torque():
    result, acting = found(), flown()[3]
    whole = sum(result.contributions.values())
    assert np.allclose(result.explained_Nm, whole)
    t = np.arange(0.0, 3600.25, 0.5)
    true = sum(acting.values())
    at = np.stack([np.interp(result.time_s, t, c) for c in true.T], axis=1)
    assert np.sqrt(np.mean((whole - at) ** 2)) < 0.02 * result.size_Nm
    assert result.residual_rms_Nm < 1.5 * np.linalg.norm(result.residual.noise_Nm)


def test_law_the_true_set_of_sources_is_the_best():
    best = found().models[0]
    assert set(best.sources) == {"dipole", "sunlight", "drag"} and best.bic_above_best == 0
    full = next(m for m in found().models if len(m.sources) == 4)
    assert full.bic_above_best > 10
    assert len(found().models) == 16


def test_keys_are_those_agreed_upon_and_null_where_not_fitted():
    record = sources(flown()[1], flown()[2], which=("dipole",)).record()
    for key in ("sunlight_lever", "drag_lever", "constant"):
        assert record[f"{key}_Nm"] is None and record[f"{key}_ci95_Nm"] is None
    assert len(record["dipole_ci95_Am2"]) == 3 and record["residual_rms_Nm"] > 0
    assert np.shape(record["contributions"]["dipole"]) == (len(record["time_s"]), 3)


def test_trap_what_no_source_explains_is_suspect():
    _, tlm, craft_, _ = flown()

    def dragged(c):
        t = (c.tai_ns - c.tai_ns[0]) / 1e9
        return replace(c, values=c.values + 20 * np.sin(t / 90) ** 3)

    result = sources(changed(tlm, "wheel_rate_RW1", dragged), craft_)
    assert result.doubts.has(NOT_EXPLAINED)


def _exchanged(tlm, a, b):
    c = dict(tlm.channels)
    one, other = c[f"wheel_rate_{a}"], c[f"wheel_rate_{b}"]
    c[f"wheel_rate_{a}"], c[f"wheel_rate_{b}"] = replace(one, values=other.values), replace(other, values=one.values)
    return replace(tlm, channels=c)


def test_trap_wheels_that_are_misread_are_named():
    _, tlm, craft_, _ = flown(8)
    assert not found(8).doubts.has(WHEELS_MISREAD)
    assert not external_torque(tlm, craft_, method="momentum").doubts.has(WHEELS_MISREAD)
    flipped = changed(tlm, "wheel_rate_RW3", lambda c: replace(c, values=-c.values))
    (one,) = sources(flipped, craft_).doubts.of(WHEELS_MISREAD)
    (other,) = external_torque(_exchanged(tlm, "RW1", "RW2"), craft_, method="momentum").doubts.of(WHEELS_MISREAD)
    assert one.is_grave and "RW3 turning" in str(one) and "RW1 and RW2 exchanged" in str(other)


def test_law_a_sun_that_stands_still_is_of_another_date():
    kinds = {d.kind.id for d in found().doubts}
    assert "environment.sun-of-another-date" in kinds
    assert not any(d.is_grave for d in found().doubts)


def test_trap_a_short_arc_says_so_and_stays_honest():
    flight = replace(drawn(3), span_s=900.0)
    tlm, craft_, _ = fly(flight)
    result = sources(tlm, craft_)
    assert result.doubts.has(SHORT) and result.untold
    assert all(all(axes) for axes in within(result, flight).values())


def test_bad_input_is_refused_in_words():
    _, tlm, craft_, _ = flown()
    with pytest.raises(BadInput, match="source"):
        sources(tlm, craft_, which=("wind",))
    bare = without(tlm, "magnetic_field", "sun_direction", "orbit_position", "orbit_velocity")
    with pytest.raises(BadInput, match="magnetic_field"):
        sources(bare, craft_, which=("dipole",))
    with pytest.raises(BadInput, match="body rates"):
        sources(without(tlm, "body_rate"), craft_)


def test_recovery_of_the_low_orbit_recording(tmp_path):
    result = sources(slews("nadir-eclipse"), craft(tmp_path, inertia="predicted"))
    acting = said("nadir-eclipse")["truth"]["acting"]
    for name, key in (("dipole", "dipole_Am2"), ("sunlight", "sunlight_lever_Nm"), ("drag", "drag_lever_Nm")):
        ci = result.found[name].ci95
        assert np.all((ci[:, 0] <= acting[key]) & (acting[key] <= ci[:, 1])), name
    assert 0.5 * np.diff(result.found["dipole"].ci95, axis=1).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("span", [("4360", "10010"), (None, None)], ids=["an orbit", "twelve hours"])
def test_the_space_station_is_not_explained_beyond_doubt(span):
    from asflown.craft.load import load_craft

    result = sources(iss().between(*span), load_craft("iss"))
    assert "IGRF" in result.where_from["dipole"]
    assert {"sources.left-over", "sources.not-explained"} & {d.kind.id for d in result.doubts}
    assert result.residual_rms_Nm < 0.5 * result.size_Nm
