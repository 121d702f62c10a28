"""Positions that contradict themselves are refused by name, before field, Sun and air are asked for at a place that is none."""

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.dynamics.environment import MU_EARTH
from asflown.dynamics.frames import earth_fixed
from asflown.dynamics.orbit import flown
from asflown.estimate.environment import environment_of
from asflown.estimate.environment.orbits import CARRIED, NO_FIX
from asflown.estimate.subject import subject_of
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS
from flights import telemetry_of

CRAFT = load_craft("pyramid")
T = np.arange(0.0, 1800, 2.0)


def environment(change):
    """Of half an hour along the craft's orbit with other positions: ``change`` takes times [TAI s] and positions (N, 3)."""
    tai_s = CRAFT.orbit.epoch / NS + T
    r = change(tai_s, flown(CRAFT.orbit, tai_s)[0])
    channels = {f"orbit_position_{a}": (T, r[:, j]) for j, a in enumerate("xyz")}
    channels |= {f"quaternion_{a}": (T, np.full(len(T), 0.5)) for a in "wxyz"}
    telemetry = telemetry_of(CRAFT.orbit.epoch, **channels)
    at = telemetry.channel("quaternion_w").tai_ns[::10]
    return environment_of(subject_of(telemetry, CRAFT), at, ("gravity-gradient", "drag"))


def test_positions_as_they_should_be_are_taken():
    found = environment(lambda t, r: r)
    assert [term.name for term in found.terms] == ["gravity-gradient", "drag"] and not found.doubts


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t, r: r / 1e3, "only if its values are in kilometres, labelled metres"),
        (lambda t, r: r * 1e3, "only if its values are in metres, labelled kilometres"),
        (lambda t, r: np.einsum("nij,nj->ni", earth_fixed(t), r), "only if its values are in Earth-fixed axes"),
        (lambda t, r: np.einsum("nij,nj->ni", earth_fixed(t), r) / 1e3, "Earth-fixed axes and in kilometres"),
        (lambda t, r: r / 1e3 + np.random.default_rng(1).normal(0, 300, r.shape), "too coarse to tell"),
    ],
)
def test_trap_positions_in_another_unit_or_frame_are_one_error(change, said):
    with pytest.raises(BadInput) as why:
        environment(change)
    assert said in str(why.value) or "below its surface" in str(why.value)
    assert why.value.channel == "orbit_position" and "unit" in why.value.remedy


def test_trap_an_orbit_below_the_surface_is_one_error():
    """A free fall about the Earth's mass, 5900 km from its centre."""

    def under(t, r):
        n = np.sqrt(MU_EARTH / 5.9e6**3)
        return 5.9e6 * np.column_stack([np.cos(n * (t - t[0])), np.sin(n * (t - t[0])), 0 * t])

    with pytest.raises(BadInput, match=r"passes 5900 km from the centre of the Earth, below its surface"):
        environment(under)


@pytest.mark.parametrize(("days", "said"), [(0.5, False), (9.0, True)])
def test_trap_elements_of_another_day_are_doubted(days, said):
    channels = {f"quaternion_{a}": (T, np.full(len(T), 0.5)) for a in "wxyz"}
    telemetry = telemetry_of(CRAFT.orbit.epoch + round(days * 86_400 * NS), **channels)
    at = telemetry.channel("quaternion_w").tai_ns[::10]
    found = environment_of(subject_of(telemetry, CRAFT), at, ("gravity-gradient",))
    assert len(found.terms) == 1 and found.doubts.has(CARRIED) == said


def test_positions_of_a_receiver_without_a_fix_are_left_out():
    found = environment(lambda t, r: np.where(np.arange(len(t))[:, None] // 20 == 10, 0.0, r))
    assert len(found.terms) == 2 and found.doubts.of(NO_FIX)[0].numbers["count"] == 20
