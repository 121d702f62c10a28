"""Known torques of the surroundings, taken off."""

import numpy as np
import pytest

import asflown
import leo
from asflown.kit.errors import BadInput

DIPOLE = """
[magnetics]
residual_dipole = "0.3 -0.2 0.3 A m2"
sigma = "0.05 A m2"
"""


def test_law_what_is_taken_off_is_in_the_result_and_its_sigma_in_the_band(tmp_path):
    flown = leo.record(tmp_path, stop_s=300, orbit=True)
    craft = leo.craft(tmp_path, controller=leo.CONTROLLER + DIPOLE)
    whole = asflown.torque(flown, craft, prior="matern")
    less = asflown.torque(flown, craft, prior="matern", known=("dipole", "gravity-gradient"))
    assert [k.name for k in less.known] == ["gravity-gradient", "dipole"]
    total = sum(k.torque_Nm for k in less.known)
    variance = whole.torque_sigma_Nm**2 + sum(k.torque_sigma_Nm**2 for k in less.known)
    off = (less.torque_Nm + total - whole.torque_Nm) / np.sqrt(variance)
    assert np.sqrt(np.mean(off**2)) < 0.3
    assert np.median(less.torque_sigma_Nm / np.sqrt(variance), axis=0) == pytest.approx(1.0, abs=0.25)
    low, high = less.band(0.95)
    assert np.median((high - low) / less.torque_sigma_Nm) == pytest.approx(2 * 1.96, rel=0.15)
    record = less.record()
    assert record["known"][1]["name"] == "dipole" and np.shape(record["known"][1]["torque_Nm"]) == (301, 3)
    assert "taken off: dipole" in str(less)


def test_a_known_torque_that_cannot_be_computed_is_refused(tmp_path):
    flown = leo.record(tmp_path, stop_s=120)
    craft = leo.craft(tmp_path, controller="")
    for names, why in ((("drag",), "drag needs"), (("moon",), "no known torque"), (("dipole",), "dipole needs")):
        with pytest.raises(BadInput, match=why):
            asflown.torque(flown, craft, method="momentum", known=names)
