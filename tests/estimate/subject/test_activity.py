"""Whether a craft slews, by the change of its rate (studies/slew_threshold.py)."""

import numpy as np
import pytest

from asflown.estimate.subject import changes_as_in_a_slew, slews, turns
from flights import flown, with_values

N, NADIR = 600, np.array([0, -1.1e-3, 0])  # samples; a turn an orbit [rad/s]


def rates(noise: float = 1e-5, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, noise, (N, 3))


@pytest.mark.parametrize("noise", [0.0, 2e-6, 1e-5, 1e-4, 1e-3])
def test_noise_of_any_size_is_no_slew(noise):
    assert not changes_as_in_a_slew(rates(noise))


def test_a_steady_turn_is_no_slew_however_fast():
    assert not changes_as_in_a_slew(rates() + NADIR)
    assert not changes_as_in_a_slew(rates(1e-4) + np.array([0, 0, -7e-3]))


def test_a_spike_is_no_slew():
    w = rates()
    w[[100, 300]] += 0.1
    assert not changes_as_in_a_slew(w)


@pytest.mark.parametrize("noise", [0.0, 2e-6, 2e-5])
def test_a_turn_that_begins_and_ends_is_a_slew(noise):
    w = rates(noise)
    w[200:300, 1] += 1e-3
    assert changes_as_in_a_slew(w) and changes_as_in_a_slew(w + NADIR)


def test_one_count_of_a_coarse_gyro_is_no_slew():
    count = 1e-3
    w = np.zeros((N, 3))
    w[:, 0] = count * (np.arange(N) // 50 % 2)
    assert changes_as_in_a_slew(w) and not changes_as_in_a_slew(w, count_size=count)


def test_telemetry_that_slews_turns_or_holds():
    hold, slewing = flown("quiet").telemetry, flown("slews").telemetry
    assert slews(slewing) and not slews(hold) and not turns(hold)
    nadir = with_values(hold, "body_rate_y", hold.channel("body_rate_y").values - 1.1e-3)
    assert turns(nadir) and not slews(nadir)
