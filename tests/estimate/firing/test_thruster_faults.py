"""Faults in an event, flown and looked at by both verbs: the other branch fires, names are exchanged, a wheel is full, a counter wraps."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.estimate.firing.counters import COUNTER_FALLS
from asflown.estimate.firing.firings import BRANCH_NOT_DESCRIBED
from asflown.estimate.firing.priors import thrust_priors
from asflown.estimate.leak.doubts import BRANCH_CHANGES, LOSS_TOO_LARGE, OTHER_BRANCH, UNCOUNTED_PULSES
from asflown.estimate.leak.watch import leak
from asflown.estimate.subject.wheel_limits import AT_LIMIT, STANDS_STILL
from asflown.estimate.thrust.doubts import OFF_PREDICTION
from asflown.estimate.thrust.methods import thrust
from asflown.kit.errors import BadInput
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.telemetry import Telemetry
from flights import changed, flown, renamed, saved, with_values, without

EVENT, AMID, SEED = "wheel-bias-handover", 390.0, 3
CASSINI = load_craft("cassini", cm=(0.127, 0.021, 1.35))
RPM = np.pi / 30
FULL = [{"start": "330 s", "stop": "450 s", "rates": {"RWA1": "-2300 rpm", "RWA2": "-870 rpm", "RWA4": "-296 rpm"}}]


def clipped(tlm: Telemetry, wheel: str, rate: float) -> Telemetry:
    return changed(tlm, f"wheel_rate_{wheel}", lambda c: replace(c, values=np.clip(c.values, -rate, rate)))


@pytest.fixture
def sound():
    return flown(EVENT, seed=SEED).telemetry


@pytest.fixture
def uncounted():
    """Branch B fires and the file has the on-times of branch A."""
    return flown(EVENT, seed=SEED, thrusters={"branch": "B", "counted_branch": "A"}).telemetry


@pytest.fixture
def swapped():
    """The same from amid the biasing on."""
    swaps = [{"start": f"{AMID} s", "branch": "B"}]
    return flown(EVENT, seed=SEED, thrusters={"counted_branch": "A"}, branch_swaps=swaps).telemetry


@pytest.fixture(scope="module")
def full():
    """A wheel of a craft without limits goes where the craft file says that none does."""
    endless = tuple(w.model_copy(update={"rate_limit": None}) for w in CASSINI.wheels)
    return fly(
        EVENT, seed=SEED, craft=CASSINI.model_copy(update={"wheels": endless}), changes={"wheel_biases": FULL}
    ).telemetry


# ---- the other branch ---------------------------------------------------------------------------------------


def test_the_sound_event_has_no_fault(sound):
    result = thrust(sound, CASSINI)
    assert abs(result.mean_thrust_N - 0.699) < 2.5 * result.mean_thrust_sigma_N
    assert not result.doubts.has(BRANCH_NOT_DESCRIBED, OFF_PREDICTION, AT_LIMIT)
    assert not leak(sound, CASSINI, thrust_N=0.699).alarm


@pytest.mark.parametrize("method", ["joint", "printed"])
def test_branch_that_fires_uncounted_is_refused_by_thrust(uncounted, swapped, method):
    for tlm in (uncounted, without(uncounted, "thruster_branch"), without(swapped, "thruster_branch")):
        with pytest.raises(
            BadInput, match=r"while no on-time rises: thrusters fire that are not counted.*other branch"
        ):
            thrust(tlm, CASSINI, method=method)
    with pytest.raises(BadInput, match=r"branch changes in this record .from A to B by 400 s"):
        thrust(swapped, CASSINI, method=method)


def test_branch_that_fires_uncounted_is_told_by_leak(uncounted, swapped):
    for tlm in (without(uncounted, "thruster_branch"), without(swapped, "thruster_branch")):
        result = leak(tlm, CASSINI, thrust_N=0.699)
        assert result.alarm and result.doubts.has(UNCOUNTED_PULSES)
        assert result.alternative == f"{result.thruster} of branch B"
        assert {"Y1", "Y3"} <= set(result.together) and "momentum as of several thrusters" in str(result)
    (changes,) = leak(swapped, CASSINI, thrust_N=0.699).doubts.of(BRANCH_CHANGES)
    assert "from A to B by 400 s" in changes.about["change"]
    (other,) = leak(uncounted, CASSINI, thrust_N=0.699).doubts.of(OTHER_BRANCH)
    assert other.about["branches"] == "branch B is in use and the craft file describes branch A"


def test_branch_too_short_for_its_noise_is_told_by_leak(uncounted):
    with pytest.raises(BadInput, match="other branch"):
        leak(uncounted.between("320", "460"), CASSINI, thrust_N=0.699)


def test_branch_under_the_others_names_shows_in_the_thrust():
    """Places are the same: only a thrust unlike the one predicted tells, and the channel."""
    other = fly(EVENT, seed=SEED, changes={"thrusters": {"branch": "B", "thrust": "0.59 N"}}).telemetry
    assert thrust(other, CASSINI).doubts.of(BRANCH_NOT_DESCRIBED).about(branch="B")
    unlabelled = thrust(without(other, "thruster_branch"), CASSINI)
    assert unlabelled.doubts.has(OFF_PREDICTION)
    assert not leak(without(other, "thruster_branch"), CASSINI, thrust_N=0.699).alarm  # 16 % within 10 % of one sigma


def test_names_exchanged_two_and_two_are_refused(sound):
    exchanged = renamed(sound, {"Y1": "Y2", "Y2": "Y1", "Y3": "Y4", "Y4": "Y3"}, "on_time", "pulse_count")
    with pytest.raises(BadInput, match=r"contradict each other.*exchanging Y1 with Y2 and Y3 with Y4"):
        thrust(exchanged, CASSINI)


def test_the_alternative_is_always_named():
    """A thruster of the other branch sits in the same place: named for a leak, a weak one, and by the papers' monitor."""
    fault = [{"thruster": "Y4", "start": "600 s", "leak": "30 mN"}]
    tlm = fly("leak", seed=1, changes={"duration": "660 s", "thruster_faults": fault}).telemetry
    craft = load_craft("cassini", cm=(0, 0, 1.35))
    for method in ("likelihood", "threshold"):
        assert leak(tlm, craft, method=method).alternative == "Y4 of branch B"
    both = tuple(t.model_copy(update={"name": t.name + b, "branch": b}) for b in "AB" for t in craft.thrusters)
    sixteen = craft.model_copy(update={"thrusters": both, "thruster_controller": None})
    named = leak(without(tlm, "on_time", "pulse_count"), sixteen)
    assert {named.thruster, named.alternative.split()[0]} == {"Y4A", "Y4B"}
    unnamed = craft.model_copy(
        update={"thrusters": tuple(t.model_copy(update={"branch": ""}) for t in craft.thrusters)}
    )
    assert leak(tlm, unnamed).alternative is None


# ---- a wheel that is full -----------------------------------------------------------------------------------


def test_wheel_that_saturates_is_told_and_left_out():
    """The wheel stops at its limit and thrusters hold the attitude on: nothing is missing but what the reading might hide."""
    flight = fly(
        EVENT, seed=SEED, changes={"wheel_biases": FULL, "thruster_control": [{"start": "300 s", "stop": "900 s"}]}
    )
    assert flight.truth.wheel_rate_rad_s[-1, 0] == pytest.approx(-2020 * RPM, rel=2e-3)
    result = thrust(flight.telemetry, CASSINI)
    (limit,) = result.doubts.of(AT_LIMIT)
    assert limit.about["wheel"] == "RWA1" and "436 s" in limit.about["first"]
    assert abs(result.mean_thrust_N - 0.699) < 2.5 * result.mean_thrust_sigma_N
    found = leak(flight.telemetry, CASSINI, thrust_N=0.699)
    assert not found.alarm and found.doubts.of(AT_LIMIT).about(wheel="RWA1")


def test_reading_that_stops_at_the_limit_does_not_count(full):
    tlm = clipped(full, "RWA1", 2020 * RPM)
    joint = thrust(tlm, CASSINI)
    assert joint.doubts.of(AT_LIMIT).about(wheel="RWA1")
    assert abs(joint.mean_thrust_N - 0.699) < 2.5 * joint.mean_thrust_sigma_N
    forty = thrust_priors(CASSINI, fall_s=0.040)
    assert thrust(tlm, CASSINI, method="printed", priors=forty).mean_thrust_N == pytest.approx(0.699, rel=0.04)
    assert not leak(tlm, CASSINI, thrust_N=0.699).alarm
    stuck = tlm.channel("wheel_rate_RWA1")
    always = with_values(tlm, stuck.name, np.full_like(stuck.values, -2020 * RPM))
    with pytest.raises(BadInput, match="RWA1 is at its rate limit"):
        thrust(always, CASSINI)


def test_reading_that_stops_below_the_limit_is_suspected(sound):
    tlm = clipped(sound, "RWA1", 600 * RPM)
    (still,) = thrust(tlm, CASSINI).doubts.of(STANDS_STILL)
    assert still.about["wheel"] == "RWA1" and still.numbers["largest_rpm"] == pytest.approx(600)
    found = leak(tlm, CASSINI, thrust_N=0.699)
    assert found.alarm and found.doubts.of(STANDS_STILL).about(wheel="RWA1")
    assert found.doubts.has(LOSS_TOO_LARGE) or found.kind == "leak"


# ---- counters -----------------------------------------------------------------------------------------------


def test_declared_wraps_are_taken_up(sound, tmp_path):
    """On-times in counts of 1/8 s that wrap at 64, pulses at 32: with the wraps declared nothing changes, without them it is told."""
    counted = changed(sound, "on_time", lambda c: replace(c, values=np.mod(np.round(c.values / 0.125), 64)))
    counted = changed(counted, "pulse_count", lambda c: replace(c, values=np.mod(c.values, 32)))
    assert all(np.diff(counted.channel(n).values).min() < 0 for n in ("on_time_Y1", "pulse_count_Y1"))
    file, words = saved(counted, tmp_path), tmp_path / "c.toml"
    head = next(line for line in file.read_text().splitlines() if line.startswith("time"))
    entries = []
    for column in head.split(",")[1:]:
        name, _, unit = column.partition(" [")
        stem, unit = name.rsplit("_", 1)[0], unit.rstrip("]")
        if stem.startswith("quaternion"):
            unit = ""
        how = f'unit = "{unit}"'
        if stem == "on_time":
            how = 'unit = "count"\ncount = "0.125 s"\nWRAP64'
        elif stem == "pulse_count":
            how = 'unit = ""\nWRAP32'
        entries.append(f'[[channel]]\ncolumn = "{column}"\nname = "{name}"\n{how}\n')
    text = '[time]\ncolumn = "time"\nformat = "s"\nepoch = "2005-01-28T00:00:00"\n\n' + "\n".join(entries)
    found = {}
    for declared in (True, False):
        wraps = (
            {"WRAP64": 'wrap = "64 count"', "WRAP32": 'wrap = "32 count"'} if declared else {"WRAP64": "", "WRAP32": ""}
        )
        out = text
        for key, value in wraps.items():
            out = out.replace(key, value)
        words.write_text(out)
        found[declared] = thrust(load_telemetry(file, channels=words, craft=CASSINI), CASSINI)
    plain = thrust(sound, CASSINI)
    assert found[True].on_time_s == plain.on_time_s and found[True].pulses == plain.pulses
    assert found[True].mean_thrust_N == pytest.approx(plain.mean_thrust_N, rel=1e-6)
    assert not found[True].doubts.has(COUNTER_FALLS)
    assert found[False].doubts.has(COUNTER_FALLS)


def test_slews_on_wheels_are_not_taken_for_firing():
    """Nothing fires and wheels turn the craft, with an inertia 5 % off: no thruster fires, that is all."""
    flight = fly(
        "slews-axes", changes={"duration": "900 s", "thrusters": {"control": False, "center_of_mass": "0 0 1.35 m"}}
    )
    larger = tuple(1.05 * v for v in (6510, 5333, 3519, -124.8, -38.7, 133.0))
    for tlm in (flight.telemetry, without(flight.telemetry, "body_rate")):
        with pytest.raises(BadInput, match="no thruster fires"):
            thrust(tlm, load_craft("cassini", cm=(0, 0, 1.35), inertia=larger))
