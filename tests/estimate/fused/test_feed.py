"""Torques known beforehand are an input of the fit: what is found is the rest."""

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.estimate.fused import fused
from asflown.estimate.subject import subject_of
from asflown.kit.timeline import NS
from asflown.sim.flight import fly
from asflown.sim.scenario import load_scenario

AT = np.sort([t + d for t in range(20, 220, 10) for d in (0, 0.01, 4, 4.01)])
PULSES = np.tile([0, 0.02, 0.02, 0], 20)


def test_recovery_pulses_known_beforehand_are_not_averaged_out():
    flight = fly(
        load_scenario("quiet").changed(
            duration="240 s",
            torques=[
                {"shape": "table", "axis": "y", "times": " ".join(f"{t:.2f}" for t in AT) + " s",
                 "torques": " ".join(f"{v:g}" for v in PULSES) + " N m"},
                {"shape": "table", "axis": "y", "times": "60 90 120 s", "torques": "0 0.01 0 N m"},
            ],
        ),
        seed=5,
    )  # fmt: skip
    telemetry = flight.telemetry

    def known(tai_ns):
        t = (tai_ns - telemetry.epoch_ns) / NS
        torque = np.zeros((len(t), 3))
        torque[:, 1] = np.interp(t, AT, PULSES)
        return torque, 0.01 * torque[:, :, None]

    subject = subject_of(telemetry, load_craft("cassini"))
    found = fused(subject, (1,), foreknown=known)
    t = found.grid.from_epoch(telemetry)
    true = np.interp(t, [60, 90, 120], [0, 0.01, 0])
    off = found.torque_Nm[:, 1] - true
    assert np.sqrt(np.mean(off**2)) < 5e-4
    assert np.mean(np.abs(off) < 1.96 * found.sigma_Nm[:, 1]) > 0.85
    assert found.paths_Nm[:, :, 1].mean(axis=0).max() == pytest.approx(0.01, rel=0.15)
