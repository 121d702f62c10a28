"""Inertia in orbit: gravity gradient, slow torques, and positions that cannot be believed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asflown.dynamics.environment import MU_EARTH
from asflown.dynamics.orbit import Orbit
from asflown.dynamics.rigid_body import elements_of
from asflown.estimate.environment import BODY_UNKNOWN, NOT_FREE_FALL
from asflown.estimate.inertia import consistent, gather, gravity, prediction, record, tensor
from asflown.estimate.inertia.linear import _slow_torque
from asflown.estimate.inertia.plan import slew_plan
from asflown.estimate.inertia.tensor import inertia
from asflown.kit.errors import BadInput
from flights import changed, conjugated, scaled, with_channels, with_values, without
from leo import craft, said, slews


def of(name, tmp_path, method="consistent", change=lambda tlm: tlm):
    result = inertia(change(slews(name)), craft(tmp_path, name, inertia="predicted"), method=method)
    return result, elements_of(result.inertia_kgm2 - np.array(said(name)["truth"]["inertia_kgm2"]))


def flown(mu, radius_m, span_s=1200.0, scale=1.0):
    t = np.arange(0.0, span_s, 10.0)
    n = np.sqrt(mu / radius_m**3)
    return Orbit(t, scale * radius_m * np.stack([np.cos(n * t), np.sin(n * t), 0 * t], axis=1))


def test_law_the_acceleration_tells_the_central_body():
    for mu, radius, name in (
        (MU_EARTH, 7e6, "the Earth"),
        (4.9028e12, 1.9e6, "the Moon"),
        (3.7931206e16, 2e8, "Saturn"),
    ):
        found = flown(mu, radius).acceleration()
        assert found.told and found.free_fall and found.body.name == name
        assert found.mu == pytest.approx(mu, rel=1e-5)


def test_law_kilometres_labelled_metres_are_no_known_body_and_turning_axes_no_orbit():
    found = flown(MU_EARTH, 7e6, scale=1e-3).acceleration()
    assert found.free_fall and found.body is None
    still = Orbit(np.arange(0.0, 1200, 10.0), np.tile([4.2e7, 0, 0], (120, 1)))
    assert not still.acceleration().free_fall


def test_law_a_slow_torque_over_two_steps_is_that_over_one():
    half, whole = (_slow_torque(np.array([dt]), 6, slice(0, 3), slice(3, 6), 300.0) for dt in (2.0, 4.0))
    A = np.eye(6)
    A[3:, 3:] *= half[0][0]
    A[:3, 3:] = np.eye(3) * 300.0 * (1 - half[0][0])
    assert A @ half[1][0] @ A.T + half[1][0] == pytest.approx(whole[1][0], rel=1e-6, abs=1e-12)


def test_recovery_with_gravity_alone_by_every_method(tmp_path):
    result, error = of("slews-gravity-only", tmp_path)
    assert np.abs(error).max() < 0.003 and result.doubts.has(gravity.GRAVITY)
    assert np.all(np.abs(error) < 3.5 * elements_of(result.inertia_sigma_random_kgm2))
    assert not result.doubts.has(record.MOMENTUM_STEPS)
    for method in ("gls", "all", "axis"):
        result, error = of("slews-gravity-only", tmp_path, method)
        assert np.all(np.abs(error) < 3.5 * elements_of(result.inertia_sigma_random_kgm2))


@pytest.mark.slow
def test_recovery_with_field_sunlight_and_drag(tmp_path):
    result, error = of("slews", tmp_path)
    sigma = elements_of(result.inertia_sigma_random_kgm2)
    assert np.abs(error).max() < 0.001 and np.all(np.abs(error) < 3 * sigma)
    assert result.doubts.has(consistent.SLOW_TORQUE) and not result.doubts.has(record.MOMENTUM_STEPS)
    gls, error = of("slews", tmp_path, "gls")
    assert np.all(np.abs(error) < 3 * elements_of(gls.inertia_sigma_random_kgm2))
    (said,) = of("slews", tmp_path, "all")[0].doubts.of(tensor.SLOW_BY_SAMPLES)
    assert said.numbers["off"] == pytest.approx(0.15, abs=0.05)
    plan = slew_plan(craft(tmp_path, "slews", inertia="predicted"), slews("slews"))
    assert plan.inertia_sigma_before_kgm2 == pytest.approx(sigma, rel=1e-6)


@pytest.mark.slow
def test_recovery_of_slow_slews_and_without_field_and_sun(tmp_path):
    _, error = of("slews-slow", tmp_path)
    assert np.abs(error).max() < 0.0124  # 0.1 % of a moment
    bare = lambda tlm: without(tlm, "magnetic_field", "sun_direction")  # noqa: E731
    assert np.abs(of("slews", tmp_path, change=bare)[1]).max() < 0.0124


def test_trap_positions_that_no_orbit_has_are_left_out_and_said(tmp_path):
    def turning(tlm):
        return changed(tlm, "orbit_position", lambda c: replace(c, values=np.full(len(c.values), 4e6)))

    result, _ = of("slews-gravity-only", tmp_path, "all", turning)
    (said,) = result.doubts.of(NOT_FREE_FALL)
    assert "N m" in said.about["left_out"] and not result.doubts.has(gravity.GRAVITY)
    km = lambda tlm: changed(tlm, "orbit_position", lambda c: replace(c, values=c.values / 1e3))  # noqa: E731
    result, error = of("slews-gravity-only", tmp_path, "all", km)
    assert result.doubts.has(BODY_UNKNOWN)
    assert np.all(np.abs(error) < 3.5 * elements_of(result.inertia_sigma_random_kgm2))


def test_trap_an_orbit_without_attitude_is_said_with_its_size(tmp_path):
    result, _ = of("slews-gravity-only", tmp_path, "all", lambda tlm: without(tlm, "quaternion"))
    assert "N m s over the record" in result.doubts.of(gravity.NO_ATTITUDE_FOR_GRAVITY)[0].about["left_out"]


def test_law_no_random_sigma_of_a_fit_that_has_not_settled(tmp_path):
    result, _ = of("slews-gravity-only", tmp_path, "all")
    loose = replace(
        result, settings={"converged": False}, inertia_sigma_random_kgm2=np.full((3, 3), np.nan),
        external_torque_sigma_Nm=np.full(3, np.nan),
    )  # fmt: skip
    told = loose.record()
    assert told["inertia_sigma_random_kgm2"] is None and told["inertia_sigma_kgm2"] is None
    assert "nan" not in str(loose).lower()


# ---- traps of a craft with four wheels ------------------------------------------------------------------------


def exchanged(tlm):
    one, other = tlm.channel("wheel_rate_RW1"), tlm.channel("wheel_rate_RW2")
    return with_channels(tlm, replace(one, values=other.values), replace(other, values=one.values))


def turned(tlm, degrees, *, inertial):
    """The attitude of body axes, or in inertial axes, that are turned by so much."""
    by = Rotation.from_euler("x" if inertial else "z", degrees, degrees=True)
    q = Rotation.from_quat(np.stack([tlm.channel(f"quaternion_{m}").values for m in "xyzw"], axis=1))
    for m, values in zip("xyzw", (by * q if inertial else q * by).as_quat().T, strict=True):
        tlm = with_values(tlm, f"quaternion_{m}", values)
    return tlm


@pytest.mark.parametrize(
    "mistake, words",
    [
        (exchanged, "RW1 and RW2 were mistaken"),
        (lambda tlm: scaled(tlm, "wheel_rate_RW2", -1.0), "RW2 turned the other way"),
        (lambda tlm: scaled(tlm, "wheel_rate", -1.0), "all of them turned the other way"),
        (conjugated, "conjugate"),
        (lambda tlm: scaled(tlm, "body_rate", np.degrees(1.0)), "deg/s labelled rad/s"),
    ],
)
def test_trap_a_mistake_of_four_wheels_is_named(tmp_path, mistake, words):
    with pytest.raises(BadInput, match=words):
        of("slews", tmp_path, change=mistake)


@pytest.mark.parametrize(
    "mistake, kind",
    [
        (lambda tlm: turned(tlm, 5.0, inertial=False), gather.TILTED),
        (lambda tlm: scaled(tlm, "wheel_rate", 0.5), prediction.OFF_SCALE),
    ],
)
def test_trap_another_body_frame_and_a_wrong_scale_are_suspect(tmp_path, mistake, kind):
    assert of("slews", tmp_path, "gls", mistake)[0].doubts.has(kind)


def test_trap_an_attitude_in_other_inertial_axes_is_suspect(tmp_path):
    """Field and orbit tell it: 90 degrees move an element by 0.03 % only, by the gravity gradient."""
    result, _ = of("slews", tmp_path, "gls", lambda tlm: turned(tlm, 90.0, inertial=True))
    assert any(d.kind.id == "environment.field-apart" or "field" in d.kind.id for d in result.doubts)


def test_law_a_craft_without_wheels_is_refused_in_one_sentence(tmp_path):
    bare = craft(tmp_path, "slews", inertia="predicted").model_copy(update={"wheels": ()})
    for ask in (lambda: inertia(slews("slews"), bare), lambda: slew_plan(bare, slews("slews"))):
        with pytest.raises(BadInput, match="has no wheels"):
            ask()
