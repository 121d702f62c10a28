"""Torque rods that pulse are told; steady ones are not."""

import numpy as np
import pytest

from asflown.estimate.torque.rods import RODS_PULSE, rods_doubt
from flights import telemetry_of

T = np.arange(0, 1200, 0.5)


@pytest.mark.parametrize(("dipole", "told"), [(0.5 * (T % 5 < 4), True), (0.5 + 1e-4 * T, False), (0 * T, False)])
def test_law_pulses_of_torque_rods_are_told(dipole, told):
    tlm = telemetry_of(**{f"torque_rod_dipole_{a}": (T, dipole) for a in "xyz"})
    doubt = rods_doubt(tlm, np.full((100, 3), 1e-6))
    assert (doubt is not None and doubt.kind is RODS_PULSE) == told
    if told:  # half an ampere square metre for four fifths of the time, in 40 microtesla
        assert doubt.numbers["size_Nm"] == pytest.approx(4e-5 * np.sqrt(2) * 0.2, rel=0.1)
