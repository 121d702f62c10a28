"""Drawn crafts of three to six wheels on skew axes, held by those that do not coast; flown by benchmarks/wheels_accuracy.py."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from asflown.estimate.wheels import wheels
from asflown.estimate.wheels.doubts import REVERSED, TORQUE_ZERO
from flights import scaled

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))
from wheels_accuracy import fly

NAMES = {3: ["A", "roll-2", "RWX"], 4: ["north", "east", "south", "west"]}
COUNTS = (3, 4, 5, 6)


@cache
def flown(seed, n, *, motion=0.0, current=False):
    return fly(seed, n, motion=motion, current=current, names=NAMES.get(n))


def most_together(result) -> int:
    spans = [(r.start_s, r.stop_s) for w in result.wheels for r in w.run_downs]
    return max((sum(a <= start < b for a, b in spans) for start, _ in spans), default=0)


@pytest.mark.parametrize("n", COUNTS)
def test_property_at_most_n_less_three_coast_and_no_follower_is_a_bearing(n):
    flight = flown(23, n)
    result = wheels(flight.telemetry, flight.craft)
    # of three wheels one may coast while thrusters hold the body
    assert most_together(result) <= max(n - 3, 1)
    for w in result.wheels:
        for r in w.run_downs:
            start, stop = flight.idle[w.name]
            assert start - 5 <= r.start_s < r.stop_s <= stop + 5


@pytest.mark.parametrize("n", COUNTS)
def test_recovery_of_named_run_downs_on_a_turning_body(n):
    """The wheel turns against the body: without the body's rate along its axis the drag would be off."""
    pulls = []
    for seed in (21, 22):
        flight = flown(seed, n, motion=30.0)
        result = wheels(flight.telemetry, flight.craft, run_down=flight.words)
        assert not result.doubts.has(REVERSED)
        for name in flight.coasts:
            f, k = result.wheel(name).fit, flight.names.index(name)
            total = flight.coulomb[k] + flight.viscous[k] * f.mean_rate_rad_s
            pulls.append((f.drag_at_mean_Nm - total) / f.drag_at_mean_sigma_Nm)
    assert np.abs(pulls).max() < 3.5


@pytest.mark.parametrize("n", COUNTS)
def test_recovery_of_drag_from_motor_current_whose_zero_is_off(n):
    """No wheel's run-down is used: those in which the motor is off are in the loop's data like all else."""
    flight = flown(31, n, current=True)
    result = wheels(flight.telemetry, flight.craft)
    for k, w in enumerate(result.wheels):
        (f,) = (f for f in w.fits if f.basis == "motor current")
        total = flight.coulomb[k] + flight.viscous[k] * f.mean_rate_rad_s
        assert abs(f.drag_at_mean_Nm - total) < 3.5 * f.drag_at_mean_sigma_Nm
    told = {d.about["wheel"] for d in result.doubts.of(TORQUE_ZERO)}
    assert told and not told & {w.name for w in result.wheels if w.run_downs}  # a coast shows the zero


@pytest.mark.parametrize("n", [4, 5, 6])
def test_a_reversed_wheel_is_doubted_where_the_body_moves(n):
    flight = flown(22, n, motion=30.0)
    one, two = flight.names[1], flight.names[2]
    for turned in ((one,), (one, two)):
        changed = flight.telemetry
        for name in turned:
            changed = scaled(changed, f"wheel_rate_{name}", -1)
        (doubt,) = wheels(changed, flight.craft, run_down=flight.words).doubts.of(REVERSED)
        assert doubt.about["wheels"] == ", ".join(turned)
    held = flown(23, n)  # little tells: that is said rightly, or not at all
    told = wheels(scaled(held.telemetry, f"wheel_rate_{one}", -1), held.craft, run_down=held.words).doubts.of(REVERSED)
    assert [d.about["wheels"] for d in told] in ([], [held.names[1]])
