"""The steady external torque: 001's Table A1, laws, recovery with white and coloured noise, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from asflown.craft.load import load_craft
from asflown.estimate.external import steady as doubt
from asflown.estimate.external.steady import external_torque
from asflown.estimate.subject import PER_SPIN_INERTIA
from asflown.estimate.subject.momentum import BODY_LEFT_OUT, GAPS_IN_MOMENTUM, SPLINED
from asflown.kit.errors import BadInput
from asflown.kit.rotations import quaternion
from asflown.kit.timeline import utc_to_tai_ns
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.telemetry import Telemetry
from cli.program import complaint, run
from conftest import flight_data
from flights import inspiresat1, saved, telemetry_of, with_channels, with_values, without

INERTIA = (7362, 6130, 3750, -164, -12, 149)  # kg m2, 001 Table 1 after the probe
CASSINI = load_craft("cassini", inertia=INERTIA)
EPOCH_NS = int(utc_to_tai_ns("2005-02-09T00:00:00"))
NOW = CASSINI.at(EPOCH_NS)
PER_RATE = np.array([np.array(w.axis) * w.spin_inertia for w in NOW.wheels])
NAMES = [w.name for w in NOW.wheels]
RPM = 2 * np.pi / 60
DAY = 86_400.0

#: 001 Table A1. [N m]
TOTAL, RTG, SOLAR = 1e-6 * np.array([[-0.53, -2.11, 1.83], [-2.36, -2.21, 1.83], [1.83, 0.10, 0.0]])


def telemetry(t, channels: dict) -> Telemetry:
    """Name -> values at the instants t [s]."""
    return telemetry_of(EPOCH_NS, **{n: (t, v) for n, v in channels.items()})


def wheels(rates) -> dict:
    return {f"wheel_rate_{n}": r for n, r in zip(NAMES, np.asarray(rates).T, strict=True)}


def held(T, hours=24.0, step=60.0, noise=None, turn=(0, 0, 0), rates=RPM * np.array([600, -450, 300])) -> Telemetry:
    """A hold whose body turns steadily: dh/dt = T - w x h, solved in space by the turn's own series."""
    t = np.arange(0.0, hours * 3600 + 1, step)
    R = Rotation.from_rotvec(np.outer(t, turn))
    body = np.eye(3) * t[:, None, None]  # what a small turn makes of int R dt
    cross = np.cross(np.array(turn, float), np.eye(3))
    body = body + 0.5 * t[:, None, None] ** 2 * cross.T
    h = R.inv().apply(np.asarray(rates) @ PER_RATE + body @ np.asarray(T))
    h = h + (0 if noise is None else noise(len(t)))
    parts = dict(zip((f"quaternion_{m}" for m in "wxyz"), quaternion(R).T, strict=True))
    return telemetry(t, wheels(h @ np.linalg.inv(PER_RATE)) | parts)


def coloured(seed: int, keep: float, size=0.01):
    """Noise whose neighbours correlate by ``keep``."""

    def noise(count):
        e = np.random.default_rng(seed).standard_normal((count, 3)) * size * np.sqrt(1 - keep**2)
        for k in range(1, count):
            e[k] += keep * e[k - 1]
        return e

    return noise


# ---- published ----------------------------------------------------------------------------------------------


def test_published_table_a1_is_a_drift_of_three_wheels():
    """The total, with the paper's 0.16 kg m2, is -3.44, +11.82 and +7.96 rpm a day."""
    drift = RPM * np.array([-3.44, 11.82, 7.96]) / DAY
    t = np.arange(0.0, DAY + 1, 60.0)
    result = external_torque(telemetry(t, wheels(np.outer(t, drift) + 50)), load_craft("cassini"), variant="printed")
    assert 1e6 * result.torque_Nm == pytest.approx(1e6 * TOTAL, abs=0.005)
    assert result.record()["wheel_drift_rpm_per_day"] == pytest.approx(
        dict(zip(NAMES, (-3.44, 11.82, 7.96), strict=True))
    )
    assert result.torque_sigma_Nm is None and result.settings["spin_inertia_kg_m2"] == [0.16] * 3
    assert result.doubts.has(doubt.PRINTED)


def test_published_table_a1_adds_up_and_exceeds_what_the_text_says():
    assert 1e6 * (RTG + SOLAR) == pytest.approx(1e6 * TOTAL, abs=1e-9)
    assert np.abs(TOTAL).max() > 2e-6  # "has dropped to < 2 uN m per-axis"


def test_published_turn_of_an_earth_pointed_craft_is_not_small():
    """Three wheels at 500 to 1000 rpm, and the 2.2e-8 rad/s of Earth as seen from Saturn near opposition."""
    sizes = []
    for rpm in (500, 1000):
        tlm = held(TOTAL, turn=(0, 2.2e-8, 0), rates=RPM * np.array([rpm, rpm, rpm]))
        printed, corrected = (external_torque(tlm, CASSINI, variant=v) for v in ("printed", "corrected"))
        assert 1e6 * corrected.torque_Nm == pytest.approx(1e6 * TOTAL, abs=1e-3)
        assert 1e6 * (printed.torque_Nm - TOTAL) == pytest.approx(
            -1e6 * corrected.gyroscopic_Nm, abs=0.03
        )  # and 0.16 kg m2
        sizes.append(1e6 * float(np.abs(corrected.gyroscopic_Nm).max()))
    assert sizes == pytest.approx([0.33, 0.65], abs=0.01)  # uN m that 001 Appendix A leaves out


# ---- laws ---------------------------------------------------------------------------------------------------


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.floats(-5e-6, 5e-6), min_size=3, max_size=3), st.lists(st.floats(-3e-8, 3e-8), min_size=3, max_size=3)
)
def test_property_a_hold_without_noise_gives_its_torque(torque, turn):
    tlm = held(torque, turn=turn)
    for result in (
        external_torque(tlm, CASSINI),
        external_torque(without(tlm, "quaternion"), CASSINI, turn_rad_s=turn),
    ):
        assert 1e6 * result.torque_Nm == pytest.approx(1e6 * np.array(torque), abs=1e-4)  # uN m
        assert result.method == "drift" and result.gyroscopic_Nm == pytest.approx(
            np.cross(turn, result.momentum_Nms), abs=1e-12
        )


def test_law_both_methods_agree_in_a_hold():
    f = fly("quiet", craft=CASSINI, seed=3, changes={"duration": "3600 s", "epoch": "2005-02-09T00:00:00"})
    drift, momentum = (external_torque(f.telemetry, CASSINI, method=m) for m in ("drift", "momentum"))
    assert drift.torque_Nm == pytest.approx(momentum.torque_Nm, abs=0.02 * momentum.torque_sigma_Nm.min())
    assert drift.torque_sigma_Nm == pytest.approx(momentum.torque_sigma_Nm, rel=1e-3)


def test_law_the_inertial_frame_is_the_quaternions():
    """Turning the inertial frame turns a torque fixed in it, and leaves one fixed in the body."""
    f = fly("slews", craft=CASSINI, seed=2)
    names = [f"quaternion_{m}" for m in "wxyz"]
    q = np.stack([f.telemetry.channel(n).values for n in names], axis=1)
    other = Rotation.from_rotvec([0.4, -1.0, 0.7])
    turned = quaternion(other * Rotation.from_quat(q, scalar_first=True))
    columns = [replace(f.telemetry.channel(n), values=v) for n, v in zip(names, turned.T, strict=True)]
    moved = with_channels(f.telemetry, *columns)
    a, b = (external_torque(x, CASSINI, frame="inertial").torque_Nm for x in (f.telemetry, moved))
    assert b == pytest.approx(other.apply(a), abs=1e-12)
    a, b = (external_torque(x, CASSINI).torque_Nm for x in (f.telemetry, moved))
    assert b == pytest.approx(a, abs=1e-12)


# ---- recovery -----------------------------------------------------------------------------------------------


def flown_pulls(scenario: str, seeds, **changes):
    pulls, within = [], []
    for seed in seeds:
        T = np.random.default_rng(7000 + seed).uniform(-4e-6, 4e-6, 3)
        torques = [{"shape": "constant", "torque": " ".join(map(str, T)) + " N m"}]
        f = fly(
            scenario, craft=CASSINI, seed=seed, changes={"torques": torques, "epoch": "2005-02-09T00:00:00", **changes}
        )
        r = external_torque(f.telemetry, CASSINI)
        pulls.append((r.torque_Nm - T) / r.torque_sigma_Nm)
        within.append((r.torque_ci95_Nm[:, 0] < T) & (r.torque_ci95_Nm[:, 1] > T))
    return np.array(pulls), np.array(within)


@pytest.mark.slow
@pytest.mark.parametrize("scenario, duration", [("quiet", "480 s"), ("slews", "2400 s")])
def test_recovery_pulls_of_short_flights(scenario, duration):
    pulls, within = flown_pulls(scenario, range(20), duration=duration)
    assert np.abs(pulls.mean()) < 0.4 and pulls.std() == pytest.approx(1.0, abs=0.27)  # 3 sigma of 60
    assert within.mean() > 0.86


@pytest.mark.slow
@pytest.mark.parametrize("scenario, changes", [
    ("quiet", {"duration": "1200 s"}),
    ("slews", {}),
    ("slews", {"flexible": True, "friction": True}),
    ("slews", {"telemetry": {"dropout": 0.05, "random_phases": True}}),
])  # fmt: skip
def test_recovery_pulls_are_unit_normal(scenario, changes):
    pulls, within = flown_pulls(scenario, range(100, 200), **changes)
    assert np.abs(pulls.mean(axis=0)).max() < 0.35  # 3.5 sigma of 100
    assert pulls.std(axis=0) == pytest.approx([1, 1, 1], abs=0.25)
    assert within.mean() == pytest.approx(0.95, abs=0.04)


@pytest.mark.parametrize("keep", [0.0, 0.6, 0.9])
def test_recovery_pulls_with_noise_that_has_a_memory(keep):
    pulls, within = [], []
    for seed in range(30):
        r = external_torque(held(TOTAL, hours=8, noise=coloured(seed, keep)), CASSINI)
        pulls.append((r.torque_Nm - TOTAL) / r.torque_sigma_Nm)
        within.append((r.torque_ci95_Nm[:, 0] < TOTAL) & (r.torque_ci95_Nm[:, 1] > TOTAL))
    pulls = np.array(pulls)
    assert np.abs(pulls.mean()) < 0.25 and pulls.std() == pytest.approx(1.0, abs=0.2)
    assert np.mean(within) > 0.90


@pytest.mark.slow
def test_recovery_of_a_quiet_day():
    """A whole day in the loop, slowly turning: 0.01 to 0.02 uN m, and the printed method is off by what w x H is."""
    w = 2e-8
    f = fly(
        "quiet",
        craft=CASSINI,
        changes={
            "epoch": "2005-02-09T00:00:00",
            "duration": "86400 s",
            "torques": [{"shape": "constant", "torque": " ".join(map(str, TOTAL)) + " N m"}],
            "slews": [
                {
                    "start": "0 s",
                    "axis": "1 0 0",
                    "angle": f"{w * 86402} rad",
                    "rate": f"{w} rad/s",
                    "acceleration": "1e-6 rad/s2",
                }
            ],
            "telemetry": {"wheel_rate": "60 s", "body_rate": "60 s", "attitude_error": "0 s", "quaternion": "60 s"},
        },
    )
    r = external_torque(f.telemetry, CASSINI)
    assert np.abs((r.torque_Nm - TOTAL) / r.torque_sigma_Nm).max() < 3.5 and r.torque_sigma_Nm.max() < 0.02e-6
    gyroscopic = np.cross([w, 0, 0], f.truth.wheel_momentum_Nms.mean(axis=0))
    assert r.gyroscopic_Nm == pytest.approx(gyroscopic, abs=1e-9)
    printed = external_torque(f.telemetry, CASSINI, variant="printed")
    assert 1e6 * (printed.torque_Nm - TOTAL) == pytest.approx(-1e6 * gyroscopic, abs=0.25)  # two noisy readings
    blind = external_torque(without(f.telemetry, "quaternion"), CASSINI)
    assert blind.turn_from == "nothing" and blind.doubts.has(doubt.TURN_UNKNOWN)
    assert (np.abs(blind.torque_Nm - TOTAL) < 3 * np.hypot(blind.torque_sigma_Nm, blind.torque_systematic_Nm)).all()


def test_flights_of_another_simulator():
    """Truth: no torque in slew, Table A1's in slew_ext."""
    for name, truth in (("slew", np.zeros(3)), ("slew_ext", TOTAL)):
        r = external_torque(load_telemetry(flight_data(f"simulated/{name}.csv.gz")), CASSINI)
        assert r.method == "momentum" and np.abs((r.torque_Nm - truth) / r.torque_sigma_Nm).max() < 3
        assert (r.torque_sigma_Nm < 1.2e-6).all() and r.doubts.has(doubt.SYSTEMATIC)


def test_a_wrong_inertia_shows_in_what_is_left():
    f = fly("slews", craft=CASSINI, seed=1, changes={"epoch": "2005-02-09T00:00:00"})
    wrong = load_craft("cassini", inertia=(6510, 5333, 3519, -124.8, -38.7, 133.0))
    r = external_torque(f.telemetry, wrong)
    assert r.doubts.has(doubt.OUTLIERS, doubt.FEW_EFFECTIVE_SAMPLES)
    assert (np.abs(r.torque_Nm) < 4 * r.torque_sigma_Nm).all()


def test_inspiresat1_is_relative_and_says_that_its_torque_is_not_constant():
    r = external_torque(inspiresat1(), load_craft("inspiresat1"))
    assert r.method == "momentum" and r.turn_from == "body rates" and r.relative
    record = r.record()
    assert record["torque_Nm"] is None and record["sigma_systematic_Nm"] is None and record["momentum_Nms"] is None
    assert (
        len(record["torque_per_spin_inertia_rad_s2"]) == 3 and len(record["interval_95_per_spin_inertia_rad_s2"]) == 3
    )
    assert r.effective_samples < 20 and r.doubts.has(doubt.FEW_EFFECTIVE_SAMPLES) and r.doubts.has(PER_SPIN_INERTIA)
    assert "per unit spin inertia" in str(r)


# ---- what the record allows ----------------------------------------------------------------------------------


def test_gaps_outliers_and_channels_at_other_instants():
    f = fly(
        "slews",
        craft=CASSINI,
        seed=4,
        changes={
            "epoch": "2005-02-09T00:00:00",
            "telemetry": {
                "random_phases": True,
                "gaps": [{"channel": "wheel_rate", "start": "600 s", "stop": "700 s"}],
            },
        },
    )
    r = external_torque(f.telemetry, CASSINI)
    assert r.doubts.has(SPLINED) and r.doubts.has(GAPS_IN_MOMENTUM)
    assert (np.abs(r.torque_Nm) < 4 * r.torque_sigma_Nm).all()

    tlm = held(TOTAL, noise=coloured(1, 0.0))
    values = tlm.channel("wheel_rate_RWA1").values.copy()
    values[::40] += 30.0
    r = external_torque(with_values(tlm, "wheel_rate_RWA1", values), CASSINI)
    assert (~r.used).sum() == len(values[::40]) and r.doubts.has(doubt.OUTLIERS)
    assert (np.abs(r.torque_Nm - TOTAL) < 4 * r.torque_sigma_Nm).all()


def test_a_torque_that_changes_is_doubted():
    tlm = held(TOTAL, noise=coloured(2, 0.0))
    later = held(-3 * TOTAL, noise=coloured(3, 0.0))
    half = len(tlm.channel("wheel_rate_RWA1").values) // 2
    joined = {}
    for n in (f"wheel_rate_{w}" for w in NAMES):
        a, b = tlm.channel(n).values, later.channel(n).values
        joined[n] = np.r_[a[:half], a[half - 1] + b[: len(a) - half] - b[0]]
    t = np.arange(len(joined["wheel_rate_RWA1"])) * 60.0
    assert external_torque(telemetry(t, joined), CASSINI).doubts.has(doubt.NOT_CONSTANT, doubt.FEW_EFFECTIVE_SAMPLES)


def test_stored_momentum_stands_in_for_wheel_rates():
    tlm = held(TOTAL)
    h = np.stack([tlm.channel(f"wheel_rate_{n}").values for n in NAMES], axis=1) @ PER_RATE
    t = tlm.seconds(tlm.channel("wheel_rate_RWA1").tai_ns)
    r = external_torque(telemetry(t, {f"wheel_momentum_{a}": h[:, j] for j, a in enumerate("xyz")}), CASSINI)
    assert 1e6 * r.torque_Nm == pytest.approx(1e6 * TOTAL, abs=1e-3) and not r.wheel_drift_rad_s2
    assert r.turn_from == "nothing" and r.doubts.has(BODY_LEFT_OUT)


def test_what_it_refuses():
    hold, slewing = held(TOTAL), fly("slews", craft=CASSINI, changes={"duration": "600 s"}).telemetry
    t = hold.seconds(hold.channel("wheel_rate_RWA1").tai_ns)
    fired = with_channels(hold, *telemetry(t, {"on_time_Z1": np.floor(t / 3e4)}).channels.values())
    with pytest.raises(BadInput, match=r"thrusters fire .*Z1.*\n.*--start"):
        external_torque(fired, CASSINI)
    assert external_torque(fired.between(0, 29_000), CASSINI).method == "drift"
    for tlm, how, words in (
        (slewing, {"method": "drift"}, "slews"),
        (slewing, {"variant": "printed"}, "slews"),
        (hold, {"method": "drift", "frame": "inertial"}, "body axes"),
        (hold, {"method": "momentum", "variant": "printed"}, "no printed variant"),
        (slewing, {"turn_rad_s": (0, 0, 0)}, "takes the turn from the attitude"),
        (hold, {"method": "momentum"}, "body rates"),
        (without(slewing, "quaternion"), {"frame": "inertial"}, "no quaternion"),
        (without(hold, "wheel_rate"), {}, "RWA1|wheel"),
        (hold.between(0, 300), {}, "too few"),
        (hold.between(0, 30), {"variant": "printed"}, "fewer than two"),
        (hold, {"frame": "moon"}, "body, inertial"),
        (hold, {"method": "magic"}, "drift, momentum"),
        (hold, {"variant": "best"}, "corrected, printed"),
    ):
        with pytest.raises(BadInput, match=words):
            external_torque(tlm, CASSINI, **how)
    unknown = CASSINI.model_copy(update={"mass_properties": ()})
    with pytest.raises(BadInput, match="inertia"):
        external_torque(slewing, unknown)
    assert external_torque(slewing.between(0, 50), unknown).doubts.has(BODY_LEFT_OUT)


def test_a_craft_that_turns_steadily_needs_the_momentum_method():
    t = np.arange(0.0, 3000.0, 10.0)
    R = Rotation.from_rotvec(np.outer(t, [0, -1e-3, 0]))
    w = np.outer(np.ones(len(t)), [0, -1e-3, 0])
    h = R.inv().apply(np.array([3.0, 1.0, 2.0])) - w @ NOW.inertia_kgm2
    channels = wheels(h @ np.linalg.inv(PER_RATE)) | {f"body_rate_{a}": w[:, j] for j, a in enumerate("xyz")}
    for attitude in ({}, dict(zip((f"quaternion_{m}" for m in "wxyz"), quaternion(R).T, strict=True))):
        r = external_torque(telemetry(t, channels | attitude), CASSINI)
        assert r.method == "momentum" and 1e6 * r.torque_Nm == pytest.approx([0, 0, 0], abs=1e-3)


# ---- the verb ------------------------------------------------------------------------------------------------


def test_the_verb(tmp_path):
    path = saved(held(TOTAL, noise=coloured(1, 0.0), turn=(0, 2e-8, 0)), tmp_path)
    inertia = ",".join(map(str, INERTIA))
    done = run("external-torque", path, "--inertia", inertia, "--json", "--plot", tmp_path / "x.svg")
    assert done.code == 0 and done.err == f"wrote {tmp_path / 'x.svg'}\n"
    record = done.record
    assert record["command"] == "external-torque" and (record["method"], record["variant"], record["frame"]) == (
        "drift",
        "corrected",
        "body",
    )
    assert 1e6 * np.array(record["torque_Nm"]) == pytest.approx(1e6 * TOTAL, abs=0.1)
    assert np.array(record["interval_95_Nm"]).shape == (3, 2) and record["duration_s"] == DAY
    assert (
        record["turn_rad_s"] == pytest.approx([0, 2e-8, 0], abs=1e-12)
        and len(record["provenance"]["inputs"][0]["sha256"]) == 64
    )
    assert (tmp_path / "x.svg").read_text().startswith("<?xml")
    text = run("external-torque", path, "--variant", "printed", "--plot", tmp_path / "y.svg")
    assert text.code == 0 and "two readings" in text.out and "rpm/day" in text.out
    assert run("external-torque", path, "--turn-rate", "0 2e-8 0 rad/s").out.count("from the user") == 1


@pytest.mark.parametrize("words", [
    ["--turn-rate", "1 2"], ["--turn-rate", "0 0 0"], ["--frame", "moon"], ["--method", "x"], ["--variant", "x"], ["--plot", "x.bmp"],
    ["--inertia", "1,1,5,0,0,0"], ["--craft", "iss"], ["--start", "80000", "--stop", "80100"],
])  # fmt: skip
def test_the_verb_refuses(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    saved(held(TOTAL), tmp_path)
    complaint("external-torque", "t.csv", *words)


def test_law_known_torques_that_are_taken_off_leave_nothing(tmp_path):
    from asflown.craft.surroundings import Magnetics
    from orbiter import drawn, fly

    flight = drawn(3, sunlight=np.zeros(3), drag=np.zeros(3))
    tlm, craft, _ = fly(flight)
    dipole = Magnetics(residual_dipole=" ".join(map(str, flight.dipole)) + " A m2", sigma="0.01 A m2")
    craft = craft.model_copy(update={"magnetics": dipole})
    whole = external_torque(tlm, craft)
    left = external_torque(tlm, craft, known=("gravity-gradient", "dipole"))
    assert set(left.known) == {"gravity-gradient", "dipole"} and not whole.known
    assert np.linalg.norm(left.torque_Nm) < 0.1 * np.linalg.norm(whole.torque_Nm)
    assert np.all(np.abs(left.torque_Nm) < 3 * np.hypot(left.torque_sigma_Nm, left.torque_systematic_Nm))
    assert np.all(left.torque_systematic_Nm > whole.torque_systematic_Nm)
    with pytest.raises(BadInput, match="aerodynamics"):
        external_torque(tlm, craft, known=("drag",))
