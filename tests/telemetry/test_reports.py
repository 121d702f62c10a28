"""Public reports of faults, as small inputs: what came out wrong once gives what is right.

Each case is a folder of ../shared/data/reports with its input and what to expect of it; skipped where the folder is not there."""

import json
from pathlib import Path

import pytest

from asflown import gates, inertia, leak, load_craft, load_maneuvers, load_telemetry, slew_plan, thrust, torque, wheels
from asflown.estimate.gates.fit_doubts import VARIANCES
from asflown.kit.errors import BadInput
from asflown.kit.quantities import parse_unit
from asflown.kit.timeline import NS, utc_to_tai_ns
from asflown.telemetry.findings import NO_READING, OTHER_FRAME
from asflown.telemetry.screening import needs_a_look
from conftest import flight_data

START = "2023-08-11T10:00:00"
RATES = ("wheel_rate_1", "wheel_rate_2", "wheel_rate_3", "body_rate_x", "body_rate_y", "body_rate_z")


@pytest.fixture
def case(request):
    """The folder of one case by its number."""
    root = flight_data("reports")
    number = request.param
    return next(p for p in sorted(root.iterdir()) if p.name.split("-")[0] == number)


def of(number: str):
    return pytest.mark.parametrize("case", [number], indirect=True)


def found(telemetry) -> dict[str, int]:
    counts: dict[str, int] = {}
    for f in telemetry.findings:
        counts[f.what] = counts.get(f.what, 0) + f.count
    return counts


@of("01")
def test_recovery_unsigned_speeds_with_a_declared_wrap(case):
    for name in ("raw", "raw_late", "raw_gap"):
        t = load_telemetry(case / f"{name}.csv", channels=case / "raw.toml")
        assert abs(t.channels["wheel_rate_2"].values).max() < 14
    t = load_telemetry(case / "rates.csv")
    assert needs_a_look(t) and t.found_in(["wheel_rate_2"]).worst is not None


@of("03")
def test_recovery_a_held_tachometer_is_left_out(case):
    result = wheels(load_telemetry(case / "coast.csv"), load_craft(case / "micro.toml"), run_down=["2"])
    record = next(w for w in result.record()["wheels"] if w["name"] == "2")
    assert record["coulomb_Nm"] == pytest.approx(2.0e-4, rel=0.02) and record["viscous_Nms"] == pytest.approx(
        4.0e-6, rel=0.05
    )


@of("05")
def test_recovery_fill_values_do_not_make_a_torque(case):
    t, craft = load_telemetry(case / "fill.csv"), load_craft(case / "micro.toml")
    assert found(t)["fill"] == 60
    assert abs(torque(t, craft, axis="y", method="momentum").torque_Nm).max() < 4e-4


@of("06")
def test_recovery_declared_fill_values_do_not_make_a_torque(case):
    t = load_telemetry(case / "f.nc")
    assert found(t)["declared"] == 9
    assert max(abs(t.channels[f"body_rate_{a}"].values).max() for a in "xyz") < 1


@of("07")
def test_recovery_packed_integers(case):
    assert abs(load_telemetry(case / "f.h5").channels["wheel_rate_1"].values - 120).max() < 5


@of("08")
def test_recovery_samples_lost_to_single_precision_times_are_counted(case):
    t = load_telemetry(case / "f.nc")
    finding = next(f for f in t.findings if f.what == "conflict")
    assert finding.count == 593 and "84" in finding.detail and needs_a_look(t)


@of("09")
def test_recovery_seconds_since_1970_of_a_cf_calendar(case):
    t = load_telemetry(case / "f.nc").between(START, "2023-08-11T10:10:00")
    assert len(t.channels["body_rate_x"].values) == 601


@of("10")
def test_recovery_times_with_zones_in_parquet(case):
    for name in ("tz", "ns"):
        assert load_telemetry(case / f"{name}.parquet").span()[0] == utc_to_tai_ns(START)


@pytest.mark.parametrize("case", ["11", "12", "13", "16", "22", "29", "69"], indirect=True)
def test_recovery_what_is_ambiguous_is_refused(case):
    with pytest.raises(BadInput) as why:
        load_telemetry(case / "in.csv")
    assert why.value.remedy


@pytest.mark.parametrize("case", ["14", "15", "17b", "18", "19"], indirect=True)
def test_recovery_forms_of_time_and_header(case):
    t = load_telemetry(case / "in.csv")
    tai_ns = t.channels["wheel_rate_1"].tai_ns
    assert len(tai_ns) == 60 and ((tai_ns[1:] - tai_ns[:-1]) == NS).all() and not needs_a_look(t)


@of("21")
def test_recovery_milliseconds(case):
    assert load_telemetry(case / "in.csv").span()[1] - utc_to_tai_ns(START) == 59 * NS
    for name in ("d2", "d3"):
        t = load_telemetry(case / "raw.csv", channels=case / f"{name}.toml")
        assert t.span()[1] - t.span()[0] == 59 * NS
    assert needs_a_look(load_telemetry(case / "raw.csv", channels=case / "d.toml"))


@of("23")
def test_recovery_samples_a_week_off_are_left_out(case):
    t = load_telemetry(case / "in.csv")
    assert found(t)["stray"] == 4 and needs_a_look(t) and t.span()[1] - t.span()[0] == 600 * NS


@pytest.mark.parametrize("case", ["25", "30"], indirect=True)
def test_recovery_arrival_times(case):
    t, craft = load_telemetry(case / "in.csv"), load_craft(case / "micro.toml")
    assert abs(torque(t, craft, axis="y", method="momentum").torque_Nm).max() < 3e-4


@of("28")
def test_recovery_the_same_stamp_twice(case):
    t = load_telemetry(case / "in.csv")
    assert found(t)["conflict"] + found(t)["duplicate"] >= 600 and needs_a_look(t)


@of("32")
def test_recovery_a_quaternion_of_changing_sign(case):
    t = load_telemetry(case / "in.csv")
    assert not needs_a_look(t) and all(c.valid.all() for c in t.channels.values())


@of("31")
def test_recovery_a_quaternion_of_the_sensor_frame_is_named(case):
    t = load_telemetry(case / "in.csv")
    told = t.doubts.of(OTHER_FRAME, NO_READING)
    assert (
        told and "135 deg about (0.30, 0.80, -0.52)" in str(told[0]) and "mounting" in str(told[0]) and needs_a_look(t)
    )


@of("34")
def test_recovery_degrees_labelled_radians_in_a_hold(case):
    doubts = torque(
        load_telemetry(case / "in.csv"), load_craft(case / "micro.toml"), axis="y", method="momentum"
    ).doubts
    assert any(d.is_grave and "deg/s labelled rad/s" in str(d) for d in doubts)


@of("36")
def test_recovery_wheels_of_the_other_sense_in_a_hold(case):
    doubts = torque(
        load_telemetry(case / "in.csv"), load_craft(case / "micro.toml"), axis="y", method="momentum"
    ).doubts
    assert any(d.is_grave and "all wheels turned the other way" in str(d) for d in doubts)


@pytest.mark.parametrize("case", ["34b", "36b", "37"], indirect=True)
def test_recovery_contradicting_slews_are_refused(case):
    with pytest.raises(BadInput) as why:
        inertia(load_telemetry(case / "in.csv"), load_craft(case / "micro.toml"))
    assert {"34b": "deg/s", "36b": "other way", "37": "mistaken for each other"}[
        case.name.split("-")[0]
    ] in why.value.what


@of("39")
def test_recovery_two_dimensional_arrays(case):
    assert set(RATES) <= set(load_telemetry(case / "f.nc").channels)


@of("40")
def test_recovery_a_quaternion_in_counts(case, tmp_path):
    said = (case / "d.toml").read_text().replace("[quaternion]", "[quaternion]\nscale = 5e-10")
    (tmp_path / "d.toml").write_text(said)
    t = load_telemetry(case / "in.csv", channels=tmp_path / "d.toml")
    assert t.channels["quaternion_w"].valid.all() and not needs_a_look(t)
    assert needs_a_look(load_telemetry(case / "in.csv", channels=case / "d.toml"))


@pytest.mark.parametrize("case", ["44", "45"], indirect=True)
def test_recovery_what_needs_a_look(case):
    channels = case / "d.toml"
    assert needs_a_look(load_telemetry(case / "in.csv", channels=channels if channels.exists() else None))


@of("42")
def test_recovery_units_as_people_write_them(case):
    load_telemetry(case / "u.csv")
    for unit in ("RPM", "deg/sec", "Nms", "Nm", "psi", "furlong", "DEGS/SEC", "newton-meters"):
        try:
            parse_unit(unit)
        except BadInput as why:
            assert unit == "furlong" and why.remedy


@of("48")
def test_recovery_fits_and_excel_are_read(case, tmp_path):
    pytest.importorskip("openpyxl")
    for name in ("in.fits", "in.xlsx"):
        with pytest.raises(BadInput) as why:  # neither describes itself; a dictionary does
            load_telemetry(case / name)
        assert "channel dictionary" in why.value.remedy


@of("46")
def test_recovery_variances_under_the_name_of_sigmas(case):
    assert gates(load_maneuvers(case / "set.csv")).doubts.of(VARIANCES)
    assert not gates(load_maneuvers(case.parent / "zz-reference" / "set.csv")).doubts.of(VARIANCES)


@pytest.mark.parametrize("case", ["49", "49b"], indirect=True)
def test_recovery_shares_and_angles_are_refused_with_the_conversion(case):
    with pytest.raises(BadInput) as why:
        load_maneuvers(case / "set.csv")
    assert why.value.remedy


@of("49c")
def test_recovery_centimetres_a_second(case):
    assert len(load_maneuvers(case / "set.csv")) > 40


@of("53")
def test_recovery_counters_that_begin_anew(case):
    t, craft = load_telemetry(case / "in.csv"), load_craft("cassini", cm=(0, 0, 1.35))
    assert thrust(t, craft).record()["mean_thrust_N"] == pytest.approx(0.747, abs=0.01)
    assert not any(d.is_grave for d in leak(t, craft).doubts) and "no alarm" in str(leak(t, craft))


@of("50")
def test_recovery_an_engine_spelled_in_three_ways(case):
    m = load_maneuvers(case / "set.csv")
    assert len(m.of("rcs")) == 49 and len(m.engines) == 1


@of("51")
def test_recovery_cancelled_maneuvers_are_listed(case):
    m = load_maneuvers(case / "set.csv")
    assert len(m) == 47 and len(m.excluded) == 2


@of("61")
def test_recovery_a_dictionary_of_a_quaternion_alone(case):
    assert len(load_telemetry(case / "in.csv", channels=case / "d.toml").channels) == 4


@of("62")
def test_recovery_a_craft_without_wheels(case):
    t, craft = load_telemetry(case / "in.csv"), load_craft(case / "bare.toml")
    for refused in (lambda: inertia(t, craft), lambda: slew_plan(craft)):
        with pytest.raises(BadInput) as why:
            refused()
        assert "no wheels" in why.value.what
    assert any("no wheels" in str(d) for d in torque(t, craft, axis="y").doubts)


@of("64")
def test_recovery_a_declared_wrap_calls_no_sample_stale(case):
    t = load_telemetry(case / "unsigned.csv", channels=case / "wrap.toml")
    assert all(c.valid.all() for c in t.channels.values())


@of("68")
def test_recovery_times_as_byte_strings(case):
    assert load_telemetry(case / "f.h5").span()[0] == utc_to_tai_ns(START)


@of("70")
def test_recovery_counts_with_an_offset_at_rest(case):
    t = load_telemetry(case / "in.csv", channels=case / "d.toml")
    assert all(c.valid.all() for c in t.channels.values())


@of("zz")
def test_recovery_the_unharmed_record(case):
    t = load_telemetry(case / "hold.csv")
    assert not needs_a_look(t) and found(t) == {}


def test_recovery_every_case_is_tried_here():
    source = Path(__file__).read_text()
    for folder in flight_data("reports").iterdir():
        assert json.loads((folder / "case.json").read_text()).get("expect") or folder.name.startswith("zz")
        assert f'"{folder.name.split("-")[0]}"' in source or folder.name.startswith("67"), (
            folder.name
        )  # long: benchmarks/door.py
