"""Flat plates in sunlight and in the stream: forces known in closed form, closed bodies, levers."""

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.craft.surroundings import Aerodynamics, Facet, Sunlight
from asflown.dynamics.surfaces import SUN_PRESSURE_PA, drag_torque, sunlight_torque

BARE = load_craft("pyramid").model_copy(update={"sunlight": None, "aerodynamics": None})
ARM = np.array([0.3, -0.2, 0.5])
SPEED = 7600.0


def plate(normal, center=ARM, area=2.0, **optics):
    return Facet.model_validate(
        {"area": f"{area} m2", "normal": _text(normal), "center": f"{_text(center)} m"} | optics
    )


def _text(vector):
    return " ".join(f"{v:.15g}" for v in vector)


def in_light(*facets, cm=None):
    return BARE.model_copy(update={"sunlight": Sunlight(facets=facets), "center_of_mass": cm})


def in_air(*facets):
    return BARE.model_copy(update={"aerodynamics": Aerodynamics(facets=facets, drag_coefficient=2.2)})


@pytest.mark.parametrize(
    ("optics", "along"),
    [({}, 1.0), ({"specular": 1.0}, 2.0), ({"diffuse": 1.0}, 5 / 3)],  # absorbed, sent back, scattered by Lambert's law
)
def test_law_light_at_right_angles_pushes_a_plate_by_its_optics(optics, along):
    s = np.array([[0.0, 0, 1]])
    expected = np.cross(ARM, -along * SUN_PRESSURE_PA * 2.0 * s[0])
    assert np.allclose(sunlight_torque(in_light(plate([0, 0, 1], **optics)), s)[0], expected)


def test_law_a_mirror_is_pushed_along_its_normal_and_a_plate_in_its_own_shadow_not_at_all():
    s = np.array([[np.sin(1.0), 0, np.cos(1.0)], [0.0, 0, -1]])
    torque = sunlight_torque(in_light(plate([0, 0, 1], specular=1.0)), s)
    assert np.allclose(torque[0], np.cross(ARM, -2 * SUN_PRESSURE_PA * 2.0 * np.cos(1.0) ** 2 * np.array([0, 0, 1])))
    assert not torque[1].any()


def box(half, middle, **optics):
    """Six plates around a box."""
    for axis in range(3):
        area = 4 * np.prod(np.delete(half, axis))
        for side in (1, -1):
            out = side * np.eye(3)[axis]
            yield plate(out, middle + out * half[axis], area, **optics)


@pytest.mark.parametrize("optics", [{}, {"specular": 0.6, "diffuse": 0.3}])
def test_law_a_closed_box_about_its_middle_feels_no_torque(optics):
    u = np.random.default_rng(2).normal(size=(50, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    half, middle = np.array([0.4, 0.3, 0.6]), np.array([0.1, 0.2, -0.1])
    light = in_light(*box(half, middle, **optics), cm=tuple(middle))
    air = in_air(*box(half, np.zeros(3)))
    assert np.abs(sunlight_torque(light, u)).max() < 1e-18
    assert np.abs(drag_torque(air, SPEED * u, np.full(50, 1e-12))).max() < 1e-18


def test_law_a_plate_in_the_stream():
    v = SPEED * np.array([[np.cos(0.5), np.sin(0.5), 0]])
    force = -0.5 * 1e-12 * 2.2 * 2.0 * np.cos(0.5) * SPEED * v[0]
    assert np.allclose(drag_torque(in_air(plate([1, 0, 0])), v, [1e-12])[0], np.cross(ARM, force))


def test_law_levers_act_by_the_stated_signs():
    craft = load_craft("pyramid")
    s, v = np.array([[0.6, 0, 0.8]]), np.array([[0, SPEED, 0]])
    assert np.allclose(sunlight_torque(craft, s), np.cross(craft.sunlight.lever_Nm, s))
    assert np.allclose(drag_torque(craft, v, [1e-12]), np.cross(craft.aerodynamics.lever_Nm, [[0, -1, 0]]) * 2)
    assert not sunlight_torque(craft, np.zeros((1, 3))).any()
    assert not drag_torque(BARE, v, [1e-12]).any() and not sunlight_torque(BARE, s).any()
