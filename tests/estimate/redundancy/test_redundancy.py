"""Telemetry against telemetry: what contradicts itself is said, with its cause; what does not is left in peace."""

from dataclasses import replace

import numpy as np
import pytest

import orbiting
from asflown.craft.load import load_craft
from asflown.estimate.redundancy import redundancy
from asflown.estimate.subject import subject_of
from asflown.kit.timeline import NS
from asflown.telemetry.load import load_telemetry
from conftest import flight_data
from flights import CASSINI, changed, flown, without

WHEELS, ERROR, GYRO, QUATERNION = "wheel_rate", "attitude_error", "body_rate", "quaternion"


def times(factor):
    return lambda c: replace(c, values=factor * c.values)


def later(seconds):
    return lambda c: replace(c, tai_ns=c.tai_ns + round(seconds * NS))


def exchanged(tlm, first, second):
    a, b = tlm.channels[first], tlm.channels[second]
    return replace(tlm, channels=tlm.channels | {first: replace(b, name=first), second: replace(a, name=second)})


def found(tlm, craft=CASSINI):
    return redundancy(subject_of(tlm, craft))


@pytest.fixture(scope="module")
def hold():
    """Three wheels, an inertial hold under triangles of torque."""
    return flown("profile-1").telemetry


@pytest.fixture(scope="module")
def nadir(tmp_path_factory):
    """Four wheels, pointed to nadir: telemetry and craft."""
    law = orbiting.Law()
    craft = orbiting.craft(tmp_path_factory.mktemp("orbiter"), law.described("gyroscopic", "inertia"))
    return orbiting.fly(600.0, law)[0], craft


# ---- sound flights ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scenario", ["profile-1", "quiet"])
def test_recovery_nothing_is_said_of_a_sound_flight(scenario):
    assert not found(flown(scenario).telemetry)


def test_recovery_nothing_is_said_of_a_sound_flight_to_nadir(nadir):
    assert not found(*nadir)


@pytest.mark.slow
def test_recovery_false_alarms_on_sound_flights():
    """Scenarios of every kind under which the wheels hold the craft, four seeds each at nominal, doubled and halved noise: none."""
    from asflown.sim.flight.closed_loop import fly

    scenarios = [
        "cover-deploy",
        "cover-stow",
        "e3",
        "e4",
        "e5",
        "e9",
        "leak",
        "leo-nadir",
        "leo-run-downs",
        "leo-slews",
        "leo-unloading",
        "profile-1",
        "profile-2",
        "quiet",
        "rcs-burn",
        "slews-axes",
        "slews-multi",
        "slews",
        "titan",
        "wheel-bias-day28",
        "wheel-bias-fsds",
        "wheel-bias-handover",
    ]
    said = []
    for scenario in scenarios:
        for seed, noise in enumerate(("nominal", "double", "half", "nominal")):
            flight = fly(scenario, seed=seed, noise=noise)
            said += [(scenario, seed, str(d)) for d in found(flight.telemetry, flight.craft)]
    assert not said


@pytest.mark.parametrize("run", ["torque1", "torque2", "torque1_flex", "cover", "slew", "slew_ext"])
def test_recovery_nothing_is_said_of_flights_on_another_simulator(run):
    assert not found(load_telemetry(flight_data(f"simulated/{run}.csv.gz")))


# ---- faults of a hold ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stem", "change", "kind", "words"),
    [
        ("wheel_rate_RWA2", times(-1), "wheels", "wheel RWA2 turned the other way"),
        (WHEELS, times(-1), "wheels", "all wheels turned the other way"),
        (WHEELS, later(8), "wheels", "8 s earlier"),
        (WHEELS, later(-8), "wheels", "8 s later"),
        (WHEELS, times(1.5), "wheels", "spin inertia"),
        (WHEELS, times(30 / np.pi), "wheels", "rpm labelled rad/s"),
        (GYRO, times(180 / np.pi), "ratio", "deg/s labelled rad/s"),
        (GYRO, times(1e3), "ratio", "mrad/s labelled rad/s"),
        ("body_rate_y", times(180 / np.pi), "one-axis-unit", "deg/s labelled rad/s"),
        (ERROR, times(2), "ratio", "a wrong scale of the attitude error"),
        (ERROR, times(648_000 / np.pi), "ratio", "arcsec labelled rad"),
        (ERROR, times(-1), "ratio", "a reversed sign of the attitude error"),
        (ERROR, later(8), "stamped-apart", "attitude error comes 8"),
    ],
)
def test_recovery_a_fault_in_a_hold_is_named(hold, stem, change, kind, words):
    doubts = found(changed(hold, stem, change))
    assert f"redundancy.{kind}" in {d.kind.id for d in doubts}
    assert words in " ".join(map(str, doubts))


def test_recovery_exchanged_axes_of_the_attitude_error_are_named(hold):
    assert "redundancy.axes-exchanged" in {
        d.kind.id for d in found(exchanged(hold, "attitude_error_x", "attitude_error_y"))
    }


def test_recovery_gyros_alone_are_set_against_the_controllers_law(hold):
    alone = without(hold, ERROR, QUATERNION)
    assert not found(alone)
    (doubt,) = found(changed(alone, GYRO, times(180 / np.pi)))
    assert "deg/s labelled rad/s" in str(doubt)


def test_recovery_a_frozen_axis_is_named(hold):
    frozen = changed(hold, "body_rate_y", lambda c: replace(c, values=np.full_like(c.values, c.values[0])))
    assert "redundancy.frozen" in {d.kind.id for d in found(frozen)}


# ---- faults of a craft that turns with its orbit ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stem", "change", "words"),
    [
        ("wheel_rate_W2", times(-1), "wheel W2 turned the other way"),
        ("wheel_rate_W4", times(-1), "wheel W4 turned the other way"),
        (WHEELS, times(-1), "all wheels turned the other way"),
    ],
)
def test_recovery_a_fault_on_the_way_round_the_earth_is_named(nadir, stem, change, words):
    tlm, craft = nadir
    assert words in " ".join(map(str, found(changed(tlm, stem, change), craft)))


def test_recovery_gyros_in_another_unit_contradict_the_turn_of_the_wheels_momentum(nadir):
    tlm, craft = nadir
    (doubt,) = found(changed(without(tlm, QUATERNION), GYRO, times(180 / np.pi)), craft)
    assert "deg/s labelled rad/s" in str(doubt)


# ---- craft without a controller in its file -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("34-degrees-labelled-radians", "deg/s labelled rad/s"),
        ("36-wheel-signs-reversed-hold", "all wheels turned the other way"),
    ],
)
def test_recovery_a_craft_without_a_controller(case, words):
    folder = flight_data(f"reports/{case}")
    (doubt,) = found(load_telemetry(folder / "in.csv"), load_craft(str(folder / "micro.toml")))
    assert words in str(doubt)
