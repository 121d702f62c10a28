"""Attitudes in other axes than they are said to be in, at the door: named, with the turn that mends them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import orbiting
from asflown.kit.errors import BadInput
from asflown.telemetry.attitude import check_attitude
from asflown.telemetry.findings import COMMAND_APART, IMPLAUSIBLE, NO_READING, NOT_UNIT, OTHER_FRAME
from asflown.telemetry.screening import needs_a_look, screen
from flights import telemetry_of, with_channels, without
from orbiting import attitude_of, pointed, vectors_of, with_attitude, with_vectors
from telemetry.signals import slewing

GOOD = without(pointed(), "magnetic_field", "sun_direction")
QUARTER = Rotation.from_euler("x", 90, degrees=True)


def _orders(q: Rotation, order) -> Rotation:
    return Rotation.from_quat(q.as_quat()[:, order])


@pytest.mark.parametrize("telemetry", [GOOD, slewing(), pointed(turn=QUARTER)])
def test_attitudes_as_they_should_be_are_not_doubted(telemetry):
    assert not check_attitude(telemetry).doubts


def test_trap_a_quaternion_of_another_body_frame_is_doubted_with_the_turn_that_mends_it():
    doubts = check_attitude(with_attitude(GOOD, attitude_of(GOOD) * QUARTER)).doubts
    assert len(doubts) == 1 and doubts.has(OTHER_FRAME) and doubts[0].is_grave
    assert "90 deg about +x, (x, y, z) -> (x, -z, y)" in str(doubts[0]) and "mounting" in str(doubts[0])


def test_trap_in_a_steady_hold_the_turn_about_the_one_axis_stays_open():
    hold = pointed(duration_s=400.0, yawing=False)
    doubts = check_attitude(with_attitude(hold, attitude_of(hold) * QUARTER)).doubts
    assert doubts.has(OTHER_FRAME) and "any turn more about that axis" in str(doubts[0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda q: q.inv(), "conjugate"),
        (lambda q: _orders(q, [1, 2, 3, 0]), "scalar-last"),
        (lambda q: _orders(q, [3, 0, 1, 2]), "scalar-first"),
        (lambda q: orbiting.nadir(np.arange(0, 2400.0, 4)).inv() * q, "relative to the orbit's axes"),
    ],
)
def test_trap_a_quaternion_that_means_another_attitude_is_refused_by_name(change, said):
    with pytest.raises(BadInput, match=said):
        check_attitude(with_attitude(GOOD, change(attitude_of(GOOD))))


def test_trap_an_attitude_that_stands_still_while_the_body_turns_fits_under_no_reading():
    still = with_attitude(without(GOOD, "orbit_position", "orbit_velocity"), Rotation.identity(600))
    assert check_attitude(still).doubts.has(NO_READING)


def _commanded(change, telemetry=GOOD):
    q = change(attitude_of(telemetry)).as_quat()
    at = np.arange(0, 4.0 * len(q), 4)
    made = telemetry_of(orbiting.EPOCH, **{f"commanded_quaternion_{m}": (at, q[:, k]) for k, m in enumerate("xyzw")})
    return with_channels(telemetry, *made.channels.values())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda q: q.inv(), "conjugate"),
        (lambda q: _orders(q, [1, 2, 3, 0]), "scalar-last"),
        (lambda q: q * QUARTER, "90 deg about -x"),
        (lambda q: orbiting.nadir(np.arange(0, 2400.0, 4)).inv() * q, "LVLH"),
        (lambda q: Rotation.random(len(q), random_state=4), "no reading"),
    ],
)
def test_trap_a_commanded_attitude_that_contradicts_the_one_held(change, said):
    doubts = check_attitude(_commanded(change)).doubts
    assert len(doubts) == 1 and doubts.has(COMMAND_APART) and said in str(doubts[0])


def test_a_commanded_attitude_that_is_followed_is_not_doubted():
    assert not check_attitude(_commanded(lambda q: q * Rotation.from_rotvec([0.01, -0.02, 0.0]))).doubts


def test_trap_attitude_errors_opposite_to_the_two_quaternions():
    off = np.array([0.01, -0.02, 0.005])
    at = np.arange(0, 2400.0, 4)
    for sign, doubted in ((1, False), (-1, True)):
        errors = telemetry_of(orbiting.EPOCH, **{f"attitude_error_{a}": (at, np.full(600, sign * v)) for a, v in zip("xyz", off, strict=True)})  # fmt: skip
        both = with_channels(_commanded(lambda q: q * Rotation.from_rotvec(off)), *errors.channels.values())
        assert check_attitude(both).doubts.has(COMMAND_APART) == doubted


def test_trap_vectors_of_a_size_that_cannot_be():
    whole = pointed()
    t = screen(with_vectors(whole, "sun_direction", 0.7 * vectors_of(whole, "sun_direction")))
    assert t.doubts.has(NOT_UNIT) and needs_a_look(t)
    t = screen(with_vectors(whole, "magnetic_field", 1e9 * vectors_of(whole, "magnetic_field")))
    assert t.doubts.has(IMPLAUSIBLE) and "nT" in str(t.doubts[0])
    assert not screen(whole).doubts
