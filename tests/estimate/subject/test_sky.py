"""Field and Sun in other axes, other units, or under another attitude: each is one suspect doubt that names how it fits."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import orbiting
from asflown.craft.load import load_craft
from asflown.estimate.subject import sky_doubts, subject_of
from asflown.estimate.subject.sky import ATTITUDE_APART, FIELD_APART, FIELD_SIZE, SHADOW_APART, SUN_APART
from asflown.kit.doubts import Severity
from flights import conjugated, inspiresat1, iss, without
from orbiting import attitude_of, pointed, vectors_of, with_attitude, with_vectors

GOOD = pointed()
QUARTER = Rotation.from_euler("z", 90, degrees=True)


def _other(stem: str, change):
    return with_vectors(GOOD, stem, change(attitude_of(GOOD), vectors_of(GOOD, stem)))


def _inertial(q, v):
    return q.apply(v)


def _mounted(q, v):
    return QUARTER.apply(v)


@pytest.mark.parametrize("turn", [None, Rotation.from_euler("xyz", [20, 130, -70], degrees=True)])
def test_law_a_craft_of_any_axes_whose_sensors_agree_is_not_doubted(turn):
    assert not sky_doubts(pointed(turn=turn))


@pytest.mark.parametrize(
    ("telemetry", "kind", "said"),
    [
        (_other("magnetic_field", lambda _, v: 1e9 * v), FIELD_SIZE, "nT labelled T"),
        (_other("magnetic_field", lambda _, v: 1e-3 * v), FIELD_SIZE, "microtesla labelled nT"),
        (_other("magnetic_field", _inertial), FIELD_APART, "inertial axes"),
        (_other("magnetic_field", lambda _, v: -v), FIELD_APART, "opposite sign"),
        (_other("magnetic_field", _mounted), FIELD_APART, "90 deg about -z, (x, y, z) -> (y, -x, z). Is that the sensor's mounting?"),
        (_other("sun_direction", _inertial), SUN_APART, "inertial axes"),
        (_other("sun_direction", _mounted), SUN_APART, "90 deg about -z"),
        (_other("sun_direction", lambda _, v: 0 * v), SHADOW_APART, "dark where orbit and date give light"),
        (conjugated(GOOD), ATTITUDE_APART, "its conjugate"),
        (with_attitude(GOOD, attitude_of(GOOD) * QUARTER), ATTITUDE_APART, "another body frame"),
        (with_attitude(GOOD, Rotation.from_quat(attitude_of(GOOD).as_quat()[:, [1, 2, 3, 0]])), ATTITUDE_APART, "scalar-last"),
        (with_attitude(GOOD, orbiting.nadir(np.arange(0, 2400.0, 4)).inv() * attitude_of(GOOD)), ATTITUDE_APART, "LVLH"),
    ],
)  # fmt: skip
def test_trap_one_doubt_names_how_it_fits(telemetry, kind, said):
    doubts = sky_doubts(without(telemetry, "body_rate"))
    assert len(doubts) == 1 and doubts.has(kind), list(map(str, doubts))
    assert said in str(doubts[0]) and doubts[0].severity == Severity.SUSPECT


def test_trap_a_field_of_noise_fits_under_no_reading():
    noise = 3e-5 * np.random.default_rng(3).normal(size=(600, 3))
    assert "under no reading" in str(sky_doubts(with_vectors(GOOD, "magnetic_field", noise))[0])


def test_every_subject_carries_the_doubts_and_the_orbit_of_the_craft_file_serves(tmp_path):
    craft = load_craft(orbiting.craft_file(tmp_path))
    apart = _other("magnetic_field", _inertial)
    assert subject_of(apart, craft).doubts.has(FIELD_APART)
    begins = {
        "epoch": int(apart.channels["quaternion_w"].tai_ns[0])
    }  # of the record's day: months of an orbit take seconds
    of_file = craft.model_copy(update={"orbit": load_craft("pyramid").orbit.model_copy(update=begins)})
    bare = without(apart, "orbit_position", "orbit_velocity")
    assert not sky_doubts(bare, craft) and sky_doubts(bare, of_file)


def test_flight_data_are_not_doubted():
    assert not sky_doubts(inspiresat1()) and not sky_doubts(iss())
