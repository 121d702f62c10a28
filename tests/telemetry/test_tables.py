"""The self-describing table: read, written, and every way it can be wrong."""

import gzip
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, utc_to_tai_ns
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.write import write_table
from flights import EPOCH, telemetry_of, written
from telemetry.signals import noise

GOOD = """# epoch: 2015-09-29T00:00:00 UTC
time [s],sclk [],ert [utc],wheel_rate_RWA1 [rpm],body_rate_x [mrad/s],control_mode
0,1/100.000,2015-09-29T01:00:00,600.5,0.25,RWA
1,1/101.000,2015-09-29T01:00:01,,0.26,RWA
2.5,1/102.128,2015-09-29T01:00:02.5,601,0.27,
4,1/104.000,2015-09-29T01:00:04,nan,0.28,RCS
"""


def test_table_says_names_units_blanks_and_clocks(tmp_path):
    t = load_telemetry(written(tmp_path, GOOD))
    wheel = t.channel("wheel_rate_RWA1")
    assert t.epoch_label == "2015-09-29T00:00:00 UTC" and t.dated
    assert t.seconds(wheel.tai_ns).tolist() == [0.0, 2.5]
    assert wheel.values == pytest.approx(np.array([600.5, 601]) * 2 * np.pi / 60, rel=1e-15)
    assert wheel.unit_given == "rpm"
    assert t.channel("body_rate_x").values == pytest.approx([2.5e-4, 2.6e-4, 2.7e-4, 2.8e-4])
    assert t.channel("control_mode").values.tolist() == ["RWA", "RWA", "RCS"]
    assert t.time_labels["sclk []"].tolist()[2] == "1/102.128"
    assert list(t.time_labels) == ["sclk []", "ert [utc]"]
    assert [(f.channel, f.what, f.count) for f in t.findings if f.what == "nan"] == [("wheel_rate_RWA1", "nan", 1)]
    assert len(t.sha256) == 64 and t.source.endswith("t.csv")


@pytest.mark.parametrize(
    ("heading", "first", "second"),
    [
        ("time [utc]", "2016-12-31T23:59:59", "2017-01-01T00:00:01"),  # a leap second between
        ("time [utc]", "2016-366T23:59:59Z", "2017-001T00:00:01Z"),
        ("time [gps s]", "1167264016", "1167264018"),
        ("time [et s]", "536500867.184", "536500869.184"),
    ],
)
def test_published_time_scales_agree_at_the_leap_second_of_2016(tmp_path, heading, first, second):
    # IERS Bulletin C 52: TAI-UTC becomes 37 s on 2017-01-01; GPS = TAI - 19 s; ET = TAI + 32.184 s
    t = load_telemetry(written(tmp_path, f"{heading},body_rate_x [rad/s]\n{first},0.01\n{second},0.02\n"))
    c = t.channel("body_rate_x")
    if heading == "time [utc]":
        assert int(c.tai_ns[1] - c.tai_ns[0]) == 3 * NS
    assert int(c.tai_ns[1] - c.tai_ns[0]) in (2 * NS, 3 * NS) or "et" in heading
    shift = 0 if "utc" in heading or "gps" in heading else 2_000_000  # ET - TAI varies by 1.7 ms in a year
    end = utc_to_tai_ns("2017-01-01T00:00:01") if "utc" in heading else int(c.tai_ns[1])
    assert abs(int(c.tai_ns[1]) - end) <= shift
    assert t.epoch_ns % NS == 0 and 0 <= int(c.tai_ns[0]) - t.epoch_ns < NS


def test_published_gps_seconds_of_a_known_instant(tmp_path):
    # the GPS week rollover: week 2048 begins 2019-04-06T23:59:42 UTC, 2048 x 604800 s after the GPS epoch
    t = load_telemetry(written(tmp_path, "time [gps s],body_rate_x [rad/s]\n1238630400,0.01\n1238630401,0.02\n"))
    assert t.epoch_label == "2019-04-06T23:59:42 UTC"


def test_seconds_keep_nanoseconds_far_from_the_epoch(tmp_path):
    t = load_telemetry(written(tmp_path, "time [s],body_rate_x [rad/s]\n31536000.123456789,1e-3\n31536001,1e-3\n"))
    assert int(t.channel("body_rate_x").tai_ns[0]) == 31_536_000_123_456_789 and not t.dated


BAD = {
    "empty": (b"", "empty"),
    "blank": (b"\n \n", "empty"),
    "header only": (b"time [s],body_rate_x [rad/s]\n", "no rows"),
    "comments only": (b"# nothing\n", "no header"),
    "no time column": (b"body_rate_x [rad/s],body_rate_y [rad/s]\n1,2\n", "no time column"),
    "unknown time scale": (b"time [fortnight],body_rate_x [rad/s]\n1,2\n", "time scale [fortnight]"),
    "no unit": (b"time [s],body_rate_x\n1,2\n", "has no unit"),
    "unknown unit": (b"time [s],body_rate_x [furlong]\n1,2\n", "[furlong]"),
    "wrong unit": (b"time [s],body_rate_x [kg]\n1,2\n", "[kg]"),
    "unknown channel": (b"time [s],body_rat_x [rad/s]\n1,2\n", "body_rate_x"),
    "ragged": (b"time [s],body_rate_x [rad/s]\n0,1e-3\n# note\n1\n", "line 4: the row has 1 cells, the header 2"),
    "not a number": (b"time [s],body_rate_x [rad/s]\n0,1e-3\n1,12_3\n", "line 3, channel body_rate_x: '12_3'"),
    "words": (b"time [s],body_rate_x [rad/s]\n0,1e-3\n1,high\n", "line 3, channel body_rate_x: 'high'"),
    "all blank": (b"time [s],body_rate_x [rad/s],body_rate_y [rad/s]\n0,1e-3,\n1,1e-3, \n", "has no values"),
    "infinite": (b"time [s],body_rate_x [rad/s]\n0,inf\n1,0\n", "line 2, channel body_rate_x: 'inf' is not finite"),
    "too large": (b"time [s],orbit_position_x [km]\n0,1e307\n1,0\n", "too large"),
    "twice": (b"time [s],body_rate_x [rad/s],body_rate_x [rad/s]\n0,1,1\n", "twice"),
    "twice, two units": (b"time [s],body_rate_x [rad/s],body_rate_x [deg/s]\n0,1,1\n", "two columns"),
    "only time": (b"time [s]\n0\n1\n", "no channel other than time"),
    "blank time": (b"time [s],body_rate_x [rad/s]\n,1\n", "line 2"),
    "odd time": (b"time [s],body_rate_x [rad/s]\nnan,1\n", "is not a time"),
    "far time": (b"time [s],body_rate_x [rad/s]\n1e300,1\n", "is not a time"),
    "odd date": (b"time [utc],body_rate_x [rad/s]\n2015-13-45T00:00:00,1\n", "line 2"),
    "far date": (b"time [utc],body_rate_x [rad/s]\n9999-01-01T00:00:00,1\n", "line 2"),
    "odd epoch": (b"# epoch: yesterday\ntime [s],body_rate_x [rad/s]\n0,1\n", "epoch"),
    "cut gzip": (gzip.compress(GOOD.encode())[:-20], "gzip"),
    "damaged gzip": (b"\x1f\x8b\x08" + bytes(60), "gzip"),
    "junk": (bytes(range(256)) * 9, "not a text table"),
    "latin-1 name": ("time [s],temp °\n".encode("latin-1"), "has no unit"),
    "open quote": (b'time [s],control_mode\n0,"RWA\n1,RCS\n', "cannot be read"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_table_is_one_clear_complaint(tmp_path, case):
    content, words = BAD[case]
    with pytest.raises(BadInput) as told:
        load_telemetry(written(tmp_path, content))
    assert words in str(told.value) and "t.csv" in str(told.value)
    assert len(str(told.value)) <= BadInput.LONGEST


def test_bad_paths(tmp_path):
    for path, words in ((tmp_path / "none.csv", "no such file"), (tmp_path, "directory"), ("a\0b", "cannot be opened")):
        with pytest.raises(BadInput, match=words):
            load_telemetry(path)
    with pytest.raises(BadInput, match="the content is not"):
        load_telemetry(written(tmp_path, GOOD, "t.parquet"))
    for magic, name in ((b"PAR1", "t.parquet"), (b"\x89HDF\r\n\x1a\n", "t.nc"), (b"CDF\x01", "t.nc")):
        with pytest.raises(BadInput, match="cannot be read"):
            load_telemetry(written(tmp_path, magic + b"junk" * 50, name))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=300))
def test_any_bytes_load_or_complain(tmp_path, content):
    _loads_or_complains(written(tmp_path, content))


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_mutated_table_loads_or_complains(tmp_path, data):
    good = bytearray(GOOD.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(good) - 1))
        length = data.draw(st.integers(0, 6))
        new = data.draw(
            st.binary(max_size=3) | st.sampled_from([b",", b"\n", b'"', b"1e400", b"-", b"#", b"[", b"9" * 12])
        )
        good[at : at + length] = new
    packed = data.draw(st.booleans())
    _loads_or_complains(written(tmp_path, gzip.compress(bytes(good)) if packed else bytes(good)))


def _loads_or_complains(path):
    try:
        assert load_telemetry(path).channels
    except BadInput as why:
        assert len(str(why)) <= BadInput.LONGEST


def multi_rate():
    t4, t2 = np.arange(0, 400, 4.0) + 0.125, np.arange(0, 400, 2.0)
    t = telemetry_of(
        wheel_rate_RWA1=(t4, 60 + noise(100, 0.1)),
        body_rate_x=(t2, noise(200, 1e-5, 2) / 3),
        control_mode=(t4[::10], np.array(["RWA", "RCS"] * 5)),
    )
    return replace(
        t,
        time_labels={"sclk []": np.array([f"1/{k}" for k in range(100)])},
        label_tai_ns=t.channels["wheel_rate_RWA1"].tai_ns,
    )


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.parquet"])
@pytest.mark.parametrize("dated", [True, False])
def test_round_trip_is_exact(tmp_path, name, dated):
    t = multi_rate()
    if not dated:
        t = replace(t, dated=False)
    write_table(t, tmp_path / name)
    back = load_telemetry(tmp_path / name)
    assert back.dated == dated and list(back.channels) == list(t.channels)
    assert back.epoch_ns == (EPOCH if dated else 0)
    for k, c in t.channels.items():
        assert (back.channels[k].tai_ns - back.epoch_ns == c.tai_ns - t.epoch_ns).all()
        assert (back.channels[k].values == c.values).all()
    assert [v for v in back.time_labels["sclk []"] if v] == t.time_labels["sclk []"].tolist()
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_writing_leaves_nothing_half_written(tmp_path):
    with pytest.raises(BadInput, match="cannot be written"):
        write_table(multi_rate(), tmp_path / "no" / "such" / "a.csv")
    (tmp_path / "d.csv").mkdir()
    with pytest.raises(BadInput, match="cannot be written"):
        write_table(multi_rate(), tmp_path / "d.csv")
    assert [p.name for p in tmp_path.iterdir()] == ["d.csv"]


def test_written_bytes_are_the_same_each_time(tmp_path):
    write_table(multi_rate(), tmp_path / "a.csv.gz")
    first = (tmp_path / "a.csv.gz").read_bytes()
    write_table(multi_rate(), tmp_path / "a.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == first


def test_long_table(tmp_path):
    text = "# epoch: 2015-09-29T00:00:00 UTC\ntime [s],channel,value\n0,body_rate_x [mrad/s],1\n0,control_mode [],RWA\n2,body_rate_x [mrad/s],2\n"
    t = load_telemetry(written(tmp_path, text))
    assert t.channel("body_rate_x").values.tolist() == [1e-3, 2e-3]
    assert t.channel("control_mode").values.tolist() == ["RWA"]
    text = "time [utc],channel,value,unit\n2015-09-29T00:00:00,body_rate_x,1,mrad/s\n2015-09-29T00:00:02,body_rate_x,x,mrad/s\n"
    with pytest.raises(BadInput, match="line 3, channel body_rate_x"):
        load_telemetry(written(tmp_path, text))


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_netcdf_channels_keep_their_own_times(tmp_path, engine):
    import xarray

    if engine == "h5netcdf":
        pytest.importorskip("h5py")
    data = xarray.Dataset(
        {
            "wheel_rate_RWA1": ("time", [60.0, 61.0, 62.0], {"units": "rad s-1"}),
            "attitude_error_x": ("time_fast", [1.0, np.nan, 3.0, 4.0], {"units": "mrad"}),
        },
        {
            "time": ("time", [0, 4, 8], {"units": "seconds since 2015-09-29 00:00:00"}),
            "time_fast": (
                "time_fast",
                [0.0, 2000.0, 4000.0, 6000.0],
                {"units": "milliseconds since 2015-09-29T00:00:01Z"},
            ),
        },
    )
    data.to_netcdf(tmp_path / "t.nc", engine=engine)
    t = load_telemetry(tmp_path / "t.nc")
    assert t.epoch_label == "2015-09-29T00:00:00 UTC"
    assert t.seconds(t.channel("wheel_rate_RWA1").tai_ns).tolist() == [0, 4, 8]
    assert t.seconds(t.channel("attitude_error_x").tai_ns).tolist() == [1, 5, 7]
    assert t.channel("attitude_error_x").values == pytest.approx([1e-3, 3e-3, 4e-3])


def test_exclusions_mark_and_say_why(tmp_path):
    table = tmp_path / "t.csv"
    write_table(multi_rate(), table)
    spans = written(
        tmp_path,
        "start,stop,channel,reason\n10,20,body_rate_x,star tracker blinded\n2015-09-29T00:01:00,70,*,venting\n",
        "x.csv",
    )
    t = load_telemetry(table, exclude=spans)
    assert int((~t.channel("body_rate_x").valid).sum()) == 6 + 6
    assert {x.reason for x in t.exclusions} == {"star tracker blinded", "venting"}
    for row, words in (
        ("20,10,*,late", "ends before"),
        ("1,2,*,", "no reason"),
        ("1,2,body_rate_q,why", "not in the telemetry"),
        ("a,2,*,why", "is not a time"),
    ):
        with pytest.raises(BadInput, match=words):
            load_telemetry(table, exclude=written(tmp_path, f"start,stop,channel,reason\n{row}\n", "x.csv"))
    with pytest.raises(BadInput, match="missing: reason"):
        load_telemetry(table, exclude=written(tmp_path, "start,stop,channel\n1,2,*\n", "x.csv"))
