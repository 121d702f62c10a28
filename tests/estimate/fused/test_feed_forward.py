"""A nadir-pointing craft under laws of several kinds, as its file describes them: none leaves its attitude error in the torque."""

import numpy as np
import pytest

import asflown
import orbiting
from asflown.estimate.fused.command import FED_OTHERWISE
from orbiting import Law

_OTHER = 1.2 * np.diag(np.diag(orbiting.INERTIA))


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (Law(gyroscopic=False), ("gyroscopic",)),
        (Law(tracking=False, gyroscopic=False), ("gyroscopic", "tracking")),
        (Law(inertia=_OTHER), ("gyroscopic", "inertia")),
    ],
    ids=["w x H not fed forward", "not tracking", "another inertia on board"],
)
def test_recovery_torque_under_a_law_as_described(tmp_path, law, said):
    """w x H is 4e-5 N m here, and the error of the craft that does not track 14 mrad."""
    telemetry, at, torque = orbiting.fly(290.0, law)
    r = asflown.torque(telemetry, orbiting.craft(tmp_path, law.described(*said)), prior="matern")
    assert r.settings["loop"] == "modelled"
    assert not r.doubts.has(FED_OTHERWISE)
    assert r.settings["feed_forward"]["gyroscopic"] == law.gyroscopic
    assert orbiting.coverage(r, at, torque).min() > 0.85


def test_recovery_a_file_that_says_otherwise_is_doubted(tmp_path):
    law = Law(gyroscopic=False)
    telemetry, at, torque = orbiting.fly(300.0, law)
    described = law.described("gyroscopic").replace("gyroscopic = false", "gyroscopic = true")
    r = asflown.torque(telemetry, orbiting.craft(tmp_path, described), prior="matern")
    assert r.doubts.has(FED_OTHERWISE)
    assert orbiting.coverage(r, at, torque).min() > 0.8


@pytest.mark.parametrize(
    "law", [Law(gyroscopic=False), Law(tracking=False)], ids=["w x H not fed forward", "not tracking"]
)
def test_recovery_transfer_takes_the_turn_off(tmp_path, law):
    telemetry, at, torque = orbiting.fly(300.0, law)
    r = asflown.torque(telemetry, orbiting.craft(tmp_path, law.described("gyroscopic", "tracking")), method="transfer")
    true = np.column_stack([np.interp(r.time_s, at, torque[:, j]) for j in range(3)])
    assert np.abs(np.nanmean(r.torque_Nm - true, axis=0)).max() < 2e-6  # of 4e-5 and 3e-3 N m
