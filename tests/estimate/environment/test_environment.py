"""The environment's torques as terms, against laws written out for an orbiter of the tests' own."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.dynamics.rigid_body import elements_of
from asflown.estimate.environment import NAMES, Air, environment_of
from asflown.estimate.subject import subject_of
from asflown.kit.errors import BadInput
from flights import without
from orbiter import INERTIA, Flight, craft_of, fly

BELIEFS = """
[magnetics]
residual_dipole = "0.2 -0.3 0.25 A m2"
sigma = "0.05 A m2"

[sunlight]
lever = "3e-6 -2e-6 1.2e-5 N m"
sigma = "2e-6 N m"

[aerodynamics]
lever = "1e-6 7e-6 -8e-6 N m"
sigma = "1e-6 N m"
reference_density = "5e-13 kg/m3"
"""


def of(change=lambda tlm: tlm, which=NAMES, air=None):
    flight = Flight(span_s=1200.0, swing=0.0, gyro=0.0)
    tlm, _, acting = fly(flight)
    subject = subject_of(change(tlm), craft_of(INERTIA, BELIEFS))
    return environment_of(subject, tlm.channel("quaternion_w").tai_ns, which, air), acting


def test_law_every_term_is_the_torque_that_acts():
    around, acting = of()
    assert set(around.left_out) == {"rods"}
    for term in around.terms:
        off = np.abs(term.torque_Nm - acting[term.name])
        if term.name == "sunlight":  # at the edges of the shadow the penumbra is another
            off = off[(around.lit > 0.99) | (around.lit < 0.01)]
        assert np.median(off) < 0.01 * np.abs(acting[term.name]).max(), term.name
        assert np.allclose(term.sigma_Nm, np.sqrt(np.sum(term.errors_Nm**2, axis=2)))


def test_law_the_gravity_gradient_is_linear_in_the_tensor():
    around, acting = of(which=("gravity-gradient",))
    (term,) = around.terms
    assert np.allclose(term.design @ elements_of(INERTIA), acting["gravity-gradient"], atol=2e-9)


def test_without_channels_the_models_serve_and_say_so():
    around, _ = of(lambda tlm: without(tlm, "magnetic_field", "sun_direction"), air=Air(150, 150, 10))
    said = {t.name: t.source for t in around.terms}
    assert "IGRF" in said["dipole"] and "ephemeris" in said["sunlight"] and "NRLMSIS" in said["drag"]
    field = np.linalg.norm(around.term("dipole").design, axis=(1, 2)) / np.sqrt(2)
    assert np.all((field > 1.5e-5) & (field < 6e-5))


def test_what_is_missing_is_named():
    around, _ = of(lambda tlm: without(tlm, "quaternion", "orbit_position"))
    assert [t.name for t in around.terms] == ["sunlight", "dipole"]
    assert set(around.left_out) == {"gravity-gradient", "drag", "rods"}
    with pytest.raises(BadInput, match="albedo"):
        of(which=("albedo",))


def test_trap_a_sun_sensor_in_other_axes_is_doubted():
    def turned(tlm):
        swapped = {"sun_direction_x": "sun_direction_z", "sun_direction_z": "sun_direction_x"}
        return replace(
            tlm,
            channels={n: replace(tlm.channels[swapped.get(n, n)], name=n) for n in tlm.channels},
        )

    around, _ = of(turned)
    assert "environment.sun-turns" in [d.kind.id for d in around.doubts]
