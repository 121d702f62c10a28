"""Attitudes and rates: laws."""

import numpy as np
from scipy.spatial.transform import Rotation

from asflown.kit.rotations import turned_by


def test_law_attitude_from_rates_alone_is_that_of_a_steady_turn():
    t = np.arange(0.0, 500.0, 0.5)
    w = np.outer(np.ones(len(t)), [1e-3, -2e-3, 5e-4])
    assert (Rotation.from_rotvec(np.outer(t, w[0])).inv() * turned_by(t, w)).magnitude().max() < 1e-12
    coning = 1e-3 * np.stack([np.cos(0.02 * t), np.sin(0.02 * t), np.full(len(t), 0.7)], axis=1)
    by_hand = Rotation.identity()
    for k in range(len(t) - 1):
        by_hand = by_hand * Rotation.from_rotvec(0.25 * (coning[k] + coning[k + 1]))
    assert (by_hand.inv() * turned_by(t, coning)[-1]).magnitude() < 1e-12
