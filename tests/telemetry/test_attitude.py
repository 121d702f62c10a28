"""The quaternion against the body rates: refused only where the reverse fits significantly better."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.kit.doubts import Doubts
from asflown.kit.errors import BadInput
from asflown.telemetry.attitude import check_attitude
from asflown.telemetry.findings import ERROR_TOO_FAST, NEVER_TOGETHER, RATE_SCALE, TURNS_TOO_LITTLE
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.screening import screen
from conftest import flight_data
from flights import conjugated, scaled, telemetry_of
from telemetry.signals import noise, slewing


def test_right_direction_in_a_slew_is_confirmed_and_the_wrong_one_refused():
    t = slewing()
    assert check_attitude(t).doubts == ()
    with pytest.raises(BadInput, match="turns against the body rates"):
        check_attitude(conjugated(t))


def test_a_change_of_sign_is_no_change_of_direction():
    t = scaled(slewing(), "quaternion", np.where(np.arange(240) % 7 < 3, -1.0, 1.0))
    assert check_attitude(t).doubts == ()
    with pytest.raises(BadInput):
        check_attitude(conjugated(t))


def test_inertial_hold_is_not_testable_whichever_way():
    at = np.arange(400.0)
    q = np.tile([0.5, 0.5, -0.5, 0.5], (400, 1)) + noise(1600, 3e-6).reshape(400, 4)
    columns = {f"body_rate_{a}": (at, noise(400, 2e-6, k)) for k, a in enumerate("xyz")}
    t = telemetry_of(**columns, **{f"quaternion_{m}": (at, q[:, k]) for k, m in enumerate("wxyz")})
    for either in (t, conjugated(t)):
        assert len(check_attitude(either).doubts) == 1
        assert check_attitude(either).doubts.has(TURNS_TOO_LITTLE, NEVER_TOGETHER)


@pytest.mark.parametrize(("scale", "unit"), [(180 / np.pi, "deg/s"), (1e3, "mrad/s"), (1e-3, "labelled mrad/s")])
def test_rates_in_another_unit_are_doubted_and_the_direction_still_told(scale, unit):
    doubts = check_attitude(slewing(rate_scale=scale)).doubts
    assert len(doubts) == 1 and doubts.has(RATE_SCALE) and unit in str(doubts[0])
    with pytest.raises(BadInput, match="turns against"):
        check_attitude(conjugated(slewing(rate_scale=scale)))


def test_telemetry_without_attitude_or_rates_passes():
    t = telemetry_of(body_rate_x=(np.arange(9.0), np.zeros(9)))
    assert check_attitude(t) is t


@pytest.mark.parametrize(
    "run", ["torque1", "torque2", "torque1_flex", "cover", "slew", "slew_ext", "bias", "bias_fsds"]
)
def test_runs_of_another_simulator_pass_unharmed(run):
    t = load_telemetry(flight_data(f"simulated/{run}.csv.gz"))
    assert t.findings == () and all(c.valid.all() for c in t.channels.values())
    assert not t.doubts.without(TURNS_TOO_LITTLE, NEVER_TOGETHER)
    if run.startswith("slew"):
        assert t.doubts == ()
        with pytest.raises(BadInput, match="turns against"):
            check_attitude(screen(conjugated(t)))


@pytest.mark.parametrize("run", ["torque1", "cover", "bias"])
def test_attitude_error_in_mrad_labelled_rad_is_doubted(run):
    t = load_telemetry(flight_data(f"simulated/{run}.csv.gz"))
    for factor, doubted in ((1.0, False), (180 / np.pi, True), (1e3, True)):
        doubts = check_attitude(replace(scaled(t, "attitude_error", factor), doubts=Doubts())).doubts
        assert doubts.has(ERROR_TOO_FAST) == doubted
