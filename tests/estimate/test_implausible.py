"""Inputs and results that cannot be, or hardly: thrust, leak, density and Gates models from telemetry and tables harmed in one way.

Each harm is refused, or the result says so with a doubt of its own; sound inputs say nothing of the kind."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.estimate.density import density
from asflown.estimate.gates import gates
from asflown.estimate.gates.patch import gates_patch
from asflown.estimate.leak import leak
from asflown.estimate.thrust import thrust
from asflown.kit.doubts import Severity
from asflown.kit.errors import BadInput
from asflown.maneuvers.history import past_model
from asflown.maneuvers.plausible import check_directions, engine_turns, implausible
from asflown.maneuvers.write import write_maneuvers
from asflown.sim.maneuver_sets import MAIN_ENGINE_SET, RCS_SET, execute
from asflown.telemetry.load import load_telemetry
from cli.program import run
from conftest import flight_data
from flights import changed, flown, past_e3, renamed, scaled

CASSINI = load_craft("cassini")


def craft_with(what: str, **new):
    """Cassini with other wheels or thrusters: name=function of one."""
    return CASSINI.model_copy(
        update={what: tuple(x.model_copy(update={n: f(x) for n, f in new.items()}) for x in getattr(CASSINI, what))}
    )


def slower(tlm, factor: float):
    """Time in another unit: all stamps ``factor`` times as far from the epoch."""
    return replace(
        tlm,
        channels={
            n: replace(c, tai_ns=tlm.epoch_ns + np.rint((c.tai_ns - tlm.epoch_ns) * factor).astype(np.int64))
            for n, c in tlm.channels.items()
        },
    )


def of_one(stem: str, thruster: str, factor: float):
    return lambda t: changed(t, f"{stem}_{thruster}", lambda c: replace(c, values=factor * c.values))


def zeros(*thrusters: str):
    def harm(t):
        for n in thrusters:
            for stem in ("on_time", "pulse_count"):
                t = changed(t, f"{stem}_{n}", lambda c: replace(c, values=0 * c.values))
        return t

    return harm


def turned(*names: str):
    """Thrusters' names one further in a circle."""
    return lambda t: renamed(t, dict(zip(names, (*names[1:], names[0]), strict=True)), "on_time", "pulse_count")


def ids_of(found) -> set[str]:
    return {d.kind.id for d in found.doubts if d.is_grave}


def assert_told(expected: str, estimate) -> None:
    """``expected``: the id of a suspect or void doubt, or with a leading '!' words of the refusal."""
    if expected.startswith("!"):
        with pytest.raises(BadInput, match=expected[1:]) as why:
            estimate()
        assert why.value.remedy
    else:
        assert expected in ids_of(estimate())


# ---- thrust -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fsds():
    return flown("wheel-bias-fsds").telemetry


THRUST = {
    "on-times in ms": (lambda t: scaled(t, "on_time", 1e3), None, "!faster than the clock"),
    "on-times in cycles": (lambda t: scaled(t, "on_time", 8.0), None, "!faster than the clock"),
    "on-times in s labelled ms": (lambda t: scaled(t, "on_time", 1e-3), None, "!shorter than the valve"),
    "on-times of one in ms": (of_one("on_time", "Y2", 1e3), None, "!faster than the clock"),
    "time in minutes": (lambda t: slower(t, 1 / 60), None, "!faster than the clock"),
    "no pulses": (lambda t: scaled(t, "pulse_count", 0), None, "!0 pulses are counted"),
    "pulses counted twice": (lambda t: scaled(t, "pulse_count", 2), None, "firing.more-pulses-than-cycles"),
    "on-times for counts": (lambda t: changed(t, "pulse_count", lambda c: replace(c, values=c.values * 0.125)), None,
                            "!no whole number"),
    "a column of zeros": (zeros("Y2"), None, "thrust.unlike-others"),
    "thrusters rotated": (turned("Z1", "Z2", "Z3", "Z4"), None, "thrust.misfit"),
    "all senses reversed": (lambda t: scaled(t, "wheel_rate", -1), None, "!a negative thrust"),
    "pairs rotated": (turned("Y1", "Y2", "Y3", "Y4"), None, "!contradict each other"),
    "directions reversed": (None, lambda: craft_with("thrusters", direction=lambda x: tuple(-v for v in x.direction)),
                            "!negative"),
    "places in mm": (None, lambda: craft_with("thrusters", position=lambda x: tuple(1e3 * v for v in x.position)),
                     "thrust.far-from-prediction"),
    "spin inertia doubled": (None, lambda: craft_with("wheels", spin_inertia=lambda w: 2 * w.spin_inertia),
                             "thrust.far-from-prediction"),
    "fall time in tens of ms": (None, lambda: craft_with("thrusters", fall=lambda x: 10 * x.fall),
                                "thrust.prior-contradicted"),
}  # fmt: skip


@pytest.mark.parametrize("harm", THRUST)
def test_a_thrust_that_cannot_be_is_told(harm, fsds):
    harmed, craft, expected = THRUST[harm]
    assert_told(expected, lambda: thrust(harmed(fsds) if harmed else fsds, craft() if craft else CASSINI))


def test_law_a_sound_biasing_is_not_doubted(fsds):
    assert ids_of(thrust(fsds, CASSINI)) == set()


def test_a_prediction_that_is_old_or_only_nominal_still_tells_a_wrong_unit(fsds):
    """The ratio, and the unit that would make it, whatever the record's date."""
    places = craft_with("thrusters", position=lambda x: tuple(3.28 * v for v in x.position))
    nominal = places.model_copy(update={"thrust_history": ()})
    (doubt,) = [d for d in thrust(fsds, nominal).doubts if d.kind.id == "thrust.beyond-the-craft-file"]
    assert doubt.numbers["ratio"] == pytest.approx(1 / 3.28, rel=0.03) and "in ft" in str(doubt)


def test_published_on_times_in_ms_are_refused_by_their_channel():
    path = flight_data("silent/fsds-ontime-ms.csv")
    with pytest.raises(BadInput, match="faster than the clock") as why:
        thrust(load_telemetry(path, craft=CASSINI), CASSINI)
    assert why.value.channel.startswith("on_time_") and str(path) in str(why.value)


# ---- leak ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def leaking():
    fault = {"thruster": "Z3", "start": "900 s", "leak": "2 mN"}
    return flown("leak", seed=6, duration="1800 s", thruster_faults=[fault]).telemetry


LEAK = {
    "all senses reversed": (lambda t: scaled(t, "wheel_rate", -1), None, "leak.attitude-contradicts"),
    "one sense reversed": (lambda t: scaled(t, "wheel_rate_RWA2", -1), None, "leak.attitude-contradicts"),
    "rates in rev/s": (lambda t: scaled(t, "wheel_rate", 1 / (2 * np.pi)), None, "leak.attitude-contradicts"),
    "time in minutes": (lambda t: slower(t, 1 / 60), None, "leak.attitude-contradicts"),
    "attitude error reversed": (lambda t: scaled(t, "attitude_error", -1), None, "leak.attitude-contradicts"),
    "spin inertia x1.3": (None, lambda: craft_with("wheels", spin_inertia=lambda w: 1.3 * w.spin_inertia),
                          "leak.attitude-contradicts"),
}  # fmt: skip
FIRING = {
    "on-times in ms": (lambda t: scaled(t, "on_time", 1e3), None, "!faster than the clock"),
    "on-times twice": (lambda t: scaled(t, "on_time", 2.0), None, "leak.not-as-ordered"),
    "places in ft": (None, lambda: craft_with("thrusters", position=lambda x: tuple(3.28 * v for v in x.position)),
                     "leak.not-as-ordered"),
    "a column of zeros": (zeros("Y1"), None, "leak.never-ordered"),
    "pairs exchanged": (lambda t: renamed(t, {"Y1": "Y2", "Y2": "Y1"}, "on_time", "pulse_count"), None,
                        "leak.only-while-firing"),
}  # fmt: skip


@pytest.mark.parametrize("harm", LEAK)
def test_a_leak_that_the_attitude_error_contradicts_is_told(harm, leaking):
    harmed, craft, expected = LEAK[harm]
    assert_told(expected, lambda: leak(harmed(leaking) if harmed else leaking, craft() if craft else CASSINI))


@pytest.mark.parametrize("harm", FIRING)
def test_what_orders_do_not_explain_is_told(harm, fsds):
    harmed, craft, expected = FIRING[harm]
    assert_told(expected, lambda: leak(harmed(fsds) if harmed else fsds, craft() if craft else CASSINI))


def test_law_a_sound_leak_and_a_record_without_one_are_not_doubted(leaking, fsds):
    found = leak(leaking, CASSINI)
    assert found.thruster == "Z3" and ids_of(found) == set()
    assert ids_of(leak(fsds, CASSINI)) == set()


# ---- density ------------------------------------------------------------------------------------------------

DENSITY = {
    "area x10": ({"area_m2": 184.0}, "density.area-far"),
    "arm x10": ({"arm_m": 8.5}, "density.arm-far"),
    "density -90 %": ({"area_m2": 50.0, "arm_m": 3.2}, "density.far-from-known"),
    "a minute early": ({"closest_approach": "120"}, "density.peak-elsewhen"),
    "a minute late": ({"closest_approach": "240"}, "density.peak-elsewhen"),
}


@pytest.mark.parametrize("harm", DENSITY)
def test_a_density_far_from_what_is_known_is_told(harm):
    how, expected = DENSITY[harm]
    given = {"closest_approach": "180", "method": "momentum", "cusps": False} | how
    assert_told(expected, lambda: density(past_e3().telemetry, CASSINI, "E3", **given))


def test_law_a_sound_flyby_is_not_doubted():
    found = density(past_e3().telemetry, CASSINI, "E3", "180", method="momentum", cusps=False)
    assert ids_of(found) == set()


# ---- maneuvers ----------------------------------------------------------------------------------------------

MAIN = execute(past_model("main-engine/2012-1").model, MAIN_ENGINE_SET, 3)
RCS = execute(past_model("rcs/2012-1").model, RCS_SET, 4)


def times(m, magnitude=1.0, sigma=1.0, pointing=1.0, across=1.0, dv=1.0):
    return replace(
        m,
        dv_mps=dv * m.dv_mps,
        magnitude_error_mps=magnitude * m.magnitude_error_mps,
        sigma_magnitude_mps=sigma * m.sigma_magnitude_mps,
        pointing_error_mps=pointing * m.pointing_error_mps,
        pointing_covariance=across**2 * m.pointing_covariance,
    )


def twice(m, digits=None):
    both = m.take([*range(len(m)), *range(len(m))])
    if digits is None:
        return both
    rounded = [np.array([float(f"{x:.{digits}g}") for x in v]) for v in (m.dv_mps, m.magnitude_error_mps)]
    pointing = np.vectorize(lambda x: float(f"{x:.{digits}g}"))(m.pointing_error_mps)
    return replace(
        both,
        dv_mps=np.r_[m.dv_mps, rounded[0]],
        magnitude_error_mps=np.r_[m.magnitude_error_mps, rounded[1]],
        pointing_error_mps=np.vstack([m.pointing_error_mps, pointing]),
    )


TABLES = {
    "errors 1000 times too small": (lambda m: times(m, 1e-3, 1e-3), "maneuvers.small-errors"),
    "errors in mm/s": (lambda m: times(m, 1e3, 1e3), "maneuvers.large-errors"),
    "all in mm/s": (lambda m: times(m, 1e3, 1e3, 1e3, 1e3, 1e3), "maneuvers.sigma-too-large"),
    "sigmas as variances": (lambda m: replace(m, sigma_magnitude_mps=m.sigma_magnitude_mps**2), "maneuvers.sigma-too-small"),
    "pointing in mm/s": (lambda m: times(m, pointing=1e3), "maneuvers.large-pointing"),
    "pointing in km/s": (lambda m: times(m, pointing=1e-3), "maneuvers.pointing-against-magnitude"),
    "pointing in mrad": (lambda m: replace(m, pointing_error_mps=1e3 * m.pointing_error_mps / m.dv_mps[:, None]),
                         "maneuvers.large-pointing"),
    "rows twice": (twice, "maneuvers.repeated-rows"),
    "rows twice, rounded": (lambda m: twice(m, 4), "maneuvers.repeated-rows"),
    "one column twice": (lambda m: replace(m, pointing_error_mps=np.stack([m.magnitude_error_mps] * 2, axis=1)),
                         "maneuvers.same-columns"),
}  # fmt: skip


@pytest.mark.parametrize("engine", ["main engine", "rcs"])
@pytest.mark.parametrize("harm", TABLES)
def test_a_table_of_maneuvers_that_cannot_be_is_told(harm, engine):
    harmed, expected = TABLES[harm]
    assert expected in {d.kind.id for d in implausible(harmed(MAIN if engine == "main engine" else RCS))}


def test_signs_that_are_lost_or_turn_are_told():
    signs = replace(RCS, magnitude_error_mps=np.abs(RCS.magnitude_error_mps))
    assert "gates.one-sign" in ids_of(gates(signs))
    turned_at = np.where(np.arange(len(MAIN)) < 24, 1, -1)
    (doubt,) = [
        d
        for d in gates(replace(MAIN, magnitude_error_mps=turned_at * MAIN.magnitude_error_mps)).doubts
        if d.kind.id == "gates.bias-changes"
    ]
    assert abs(MAIN.id.index(doubt.about["burn"]) - 24) <= 6


def test_two_frames_and_a_sign_of_vectors_are_told():
    rng = np.random.default_rng(5)
    ids, expected = tuple("ABCDEFGH"), rng.standard_normal((8, 3))
    check_directions(expected * 1.01, expected, ids)
    with pytest.raises(BadInput, match="against the expected"):
        check_directions(-expected, expected, ids)
    across = np.cross(expected, rng.standard_normal((8, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    assert list(engine_turns(expected, across, ("main",) * 8)) == []
    (doubt,) = engine_turns(expected, rng.standard_normal((8, 3)), ("main",) * 8)
    assert doubt.severity is Severity.CAUTION


def test_a_bias_taken_out_twice_is_refused_or_told():
    bias = (-4.4e-3, 3e-4)
    change = bias[0] + bias[1] * MAIN.dv_mps
    as_flown = replace(
        MAIN,
        magnitude_error_mps=np.where(np.arange(48) < 24, MAIN.magnitude_error_mps, MAIN.magnitude_error_mps - change),
    )
    first, how = MAIN.id[24], {"removed_fixed_mps": bias[0], "removed_proportional": bias[1]}
    assert ids_of(gates_patch(as_flown, first, **how)) == set()
    out = as_flown.with_bias_removed(24, *bias, "tail-off patch")
    with pytest.raises(BadInput, match="made already"):
        gates_patch(out, first, **how)
    assert ids_of(gates_patch(out, first)) == set()
    unsaid = gates_patch(replace(out, ledger=()), first, **how)
    assert "gates.bias-out-already" in ids_of(unsaid)


def test_law_sound_sets_of_every_model_are_not_doubted():
    """Of 440 sets, 40 of each model of the history, none is; here one of each."""
    for name, burns in (
        ("main-engine/2012-1", MAIN_ENGINE_SET),
        ("rcs/2012-1", RCS_SET),
        ("main-engine/2008-01", MAIN_ENGINE_SET),
    ):
        assert list(implausible(execute(past_model(name).model, burns, 17))) == []


def test_the_verb_tells_of_errors_a_thousand_times_too_small(tmp_path):
    write_maneuvers(times(RCS, 1e-3, 1e-3), tmp_path / "m.csv")
    done = run("gates", tmp_path / "m.csv", "--json")
    assert done.code == 0 and any(d["kind"] == "maneuvers.small-errors" for d in done.record["doubts_detail"])
