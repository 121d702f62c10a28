"""The fused torque of a craft that turns all the time: the modelled loop about its commanded motion."""

import numpy as np
import pytest

import asflown
import leo
from asflown.dynamics.loop import denominator, filtered_rate
from asflown.estimate.fused.body import AxisData
from asflown.estimate.fused.held_body import HeldBody, LoopLevels
from asflown.estimate.fused.series import Series
from asflown.estimate.fused.turning import COMMAND_SMOOTHED
from flights import CASSINI

FILTERED = leo.CONTROLLER + 'period = "0.25 s"\nrate_filter = { natural_frequency = "20 rad/s", damping = 0.7 }\n'
#: Turns an orbit of 6871 km radius.
_ORBITAL = np.sqrt(3.986004418e14 / 6871e3**3)


def _nadir(time_s):
    return np.tile([0.0, -_ORBITAL, 0.0], (len(time_s), 1))


def _held(result):
    inside = leo.coverage(result)
    assert inside.min() > 0.8, inside
    assert inside.mean() > 0.88, inside
    assert np.nanmax(result.torque_sigma_Nm) < 1e-6  # of torques of 1e-5 N m


@pytest.mark.parametrize("controller", [leo.CONTROLLER, FILTERED], ids=["no rate filter", "filtered"])
def test_recovery_nadir_hold_with_the_controller_described(tmp_path, controller):
    """Its own turning is 2e-5 N m of w x H, a hundred sigma."""
    r = asflown.torque(leo.record(tmp_path, stop_s=600), leo.craft(tmp_path, controller=controller))
    assert r.settings["loop"] == "modelled"
    assert r.settings["feed_forward"]["gyroscopic"]  # found from the data: the file does not say
    assert r.doubts.has(COMMAND_SMOOTHED)
    _held(r)


def test_recovery_nadir_hold_with_the_commanded_rate(tmp_path):
    r = asflown.torque(
        leo.record(tmp_path, stop_s=600, commanded=_nadir), leo.craft(tmp_path, controller=leo.CONTROLLER)
    )
    assert r.settings["command"] == "commanded rate"
    assert not r.doubts.has(COMMAND_SMOOTHED)
    _held(r)


@pytest.mark.parametrize("without", [(), ("attitude_error",)], ids=["attitude error", "star tracker alone"])
def test_recovery_nadir_hold_by_its_orbit(tmp_path, without):
    """Held to LVLH axes: positions and velocities say what is commanded, and where attitude errors are missing these too."""
    flown = leo.record(tmp_path, stop_s=500, orbit=True, without=without)
    r = asflown.torque(flown, leo.craft(tmp_path, controller=leo.CONTROLLER))
    assert r.settings["loop"] == "modelled" and r.settings["command"] == "LVLH of the orbit"
    assert not r.doubts.has(COMMAND_SMOOTHED)
    _held(r)


def test_recovery_shadow_edge_in_a_long_record(tmp_path):
    """Twenty-three minutes with a penumbra of 10 s: found, and covered within 15 s of it."""
    r = asflown.torque(
        leo.record(tmp_path, start_s=500, stop_s=1900), leo.craft(tmp_path, controller=leo.CONTROLLER), axis="x"
    )
    found = r.settings["torque"]["x"]
    assert min(abs(t + 500 - 900) for t in found["edges_found_s"]) < 5
    assert found["r_hat"] < 1.1 and found["effective_bulk"] > 100
    near = np.abs(r.time_s - 900) <= 15
    off = r.torque_Nm[:, 0] - leo.truth("nadir-eclipse", r.time_s)[:, 0]
    assert np.mean(np.abs(off[near]) <= 1.96 * r.torque_sigma_Nm[near, 0]) >= 0.8
    assert np.mean(np.abs(off) <= 1.96 * r.torque_sigma_Nm[:, 0]) > 0.9


def test_recovery_nadir_hold_without_the_controller(tmp_path):
    r = asflown.torque(leo.record(tmp_path, stop_s=600), leo.craft(tmp_path, controller=""))
    assert r.settings["loop"] == "measured"
    _held(r)


def test_law_a_craft_file_needs_no_rate_filter(tmp_path):
    law = leo.craft(tmp_path, controller=leo.CONTROLLER).wheel_controller
    assert law.rate_filter is None
    assert law.period is None
    assert denominator(law) == pytest.approx([1, law.kd_per_s, law.kp_per_s * law.kd_per_s])
    assert filtered_rate(law, np.arange(5.0), 0.5) == pytest.approx(np.arange(5.0))


def test_law_no_rate_filter_is_the_limit_of_a_fast_one():
    law = CASSINI.wheel_controller
    fast = law.model_copy(update={"rate_filter": law.rate_filter.model_copy(update={"natural_frequency": 1e4})})
    none = law.model_copy(update={"rate_filter": None})
    t = np.arange(0, 60, 0.5)
    levels = LoopLevels(0.01, 15, 2e-6, 1e-3, 5e-6, 8e-6, 15, 3e-4)
    series = [Series(row, t, np.zeros(len(t))) for row in range(3)]
    a, b = (
        AxisData.of(HeldBody.under(k, 5226.0), levels, series, t).response(np.sin(2 * np.pi * t / 60))
        for k in (fast, none)
    )
    assert a == pytest.approx(b, abs=2e-3 * np.abs(b).max())
