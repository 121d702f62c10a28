"""Text tables as people write them: form told from the first lines, and the same numbers whoever reads the cells."""

import datetime
import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asflown import load_telemetry
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, utc_to_tai_ns
from asflown.telemetry import text
from asflown.telemetry.text import read_text
from asflown.telemetry.times import scale_called

ZERO = int(utc_to_tai_ns("2023-08-11T10:00:00"))


def loaded(tmp_path: Path, content: str, dictionary: str = "", name: str = "t.csv"):
    path = tmp_path / name
    path.write_text(content)
    if not dictionary:
        return load_telemetry(path)
    (tmp_path / "d.toml").write_text(dictionary)
    return load_telemetry(path, channels=tmp_path / "d.toml")


def notes(telemetry) -> list[str]:
    return [f.detail for f in telemetry.findings if f.what == "form"]


FORMS = {
    "semicolons": "time [s];body_rate_y [rad/s]\n0;0.5\n1;1.5\n2;2.5\n",
    "semicolons with decimal commas": "time [s];body_rate_y [rad/s]\n0,0;0,5\n1,0;1,5\n2,0;2,5\n",
    "tabs": "time [s]\tbody_rate_y [rad/s]\n0\t0.5\n1\t1.5\n2\t2.5\n",
    "bars": "time [s]|body_rate_y [rad/s]\n0|0.5\n1|1.5\n2|2.5\n",
    "sep line": "sep=;\ntime [s];body_rate_y [rad/s]\n0;0.5\n1;1.5\n2;2.5\n",
    "preamble": "Export of pass 12\nstation;Kiruna\ntime [s];body_rate_y [rad/s]\n0;0.5\n1;1.5\n2;2.5\n",
    "row of units": "time,body_rate_y\n[s],[rad/s]\n0,0.5\n1,1.5\n2,2.5\n",
    "bare row of units": "time,body_rate_y\ns,rad/s\n0,0.5\n1,1.5\n2,2.5\n",
    "units in parentheses": "time (s),body_rate_y (rad/s)\n0,0.5\n1,1.5\n2,2.5\n",
    "header behind a number sign": "# time [s],body_rate_y [rad/s]\n0,0.5\n1,1.5\n2,2.5\n",
    "comma at the end of the header": "time [s],body_rate_y [rad/s],\n0,0.5\n1,1.5\n2,2.5\n",
    "comma at every end": "time [s],body_rate_y [rad/s],\n0,0.5,\n1,1.5,\n2,2.5,\n",
    "quoted": 'time [s],body_rate_y [rad/s]\n"0","0.5"\n"1","1.5"\n"2","2.5"\n',
    "windows": "time [s],body_rate_y [rad/s]\r\n0,0.5\r\n1,1.5\r\n2,2.5\r\n",
    "old mac": "time [s],body_rate_y [rad/s]\r0,0.5\r1,1.5\r2,2.5\r",
    "byte order mark": "\ufefftime [s],body_rate_y [rad/s]\n0,0.5\n1,1.5\n2,2.5\n",
    "comments among rows": "time [s],body_rate_y [rad/s]\n0,0.5\n# pass 2\n1,1.5\n\n2,2.5\n",
    "blanks around": "time [s], body_rate_y [rad/s]\n 0, 0.5\n 1, 1.5\n 2, 2.5\n",
    "milliseconds": "time [ms],body_rate_y [rad/s]\n0,0.5\n1000,1.5\n2000,2.5\n",
    "minutes": "time [min],body_rate_y [deg/sec]\n0,28.64788975654116\n0.016666666666666666667,85.94366926962348\n0.033333333333333333333,143.2394487827058\n",
}


@pytest.mark.parametrize("content", FORMS.values(), ids=FORMS)
def test_law_every_form_of_a_table_gives_the_same_numbers(tmp_path, content):
    t = loaded(tmp_path, content)
    c = t.channels["body_rate_y"]
    assert (c.tai_ns == np.arange(3) * NS).all()
    assert c.values == pytest.approx([0.5, 1.5, 2.5], rel=1e-15)


def test_law_what_was_told_of_the_form_is_a_finding(tmp_path):
    t = loaded(tmp_path, "pass 12\ntime;body_rate_y\ns;rad/s\n0,5;0,5\n1,5;1,5\n")
    said = " ".join(notes(t))
    assert all(w in said for w in ("semicolons", "above the header", "units", "decimal sign is a comma"))


TIMES = {
    "offset": ("time [utc]", ["2023-08-11T12:00:00+02:00", "2023-08-11T12:00:01+02:00"]),
    "zero offset": ("time [utc]", ["2023-08-11T10:00:00+00:00", "2023-08-11T10:00:01+00:00"]),
    "slashes": ("time [utc]", ["2023/08/11 10:00:00", "2023/08/11 10:00:01"]),
    "day of year": ("time [utc]", ["2023-223T10:00:00", "2023-223T10:00:01.000"]),
    "zulu": ("time [utc]", ["2023-08-11T10:00:00.000Z", "2023-08-11T10:00:01.000Z"]),
    "unix": ("time [unix s]", ["1691748000", "1691748001"]),
    "unix milliseconds": ("time [unix ms]", ["1691748000000", "1691748001000"]),
    "modified Julian day": ("time [mjd]", ["60167.41666666666666667", "60167.41667824074074074"]),
    "Julian day": ("time [jd]", ["2460167.91666666666666667", "2460167.91667824074074074"]),
    "gps": ("time [gps s]", ["1375783218", "1375783219"]),
}


@pytest.mark.parametrize(("heading", "cells"), TIMES.values(), ids=TIMES)
def test_law_every_way_of_writing_a_time_gives_the_same_instant(tmp_path, heading, cells):
    t = loaded(tmp_path, f"{heading},body_rate_y [rad/s]\n" + "".join(f"{c},{i}.5\n" for i, c in enumerate(cells)))
    assert (t.channels["body_rate_y"].tai_ns == ZERO + np.arange(2) * NS).all()


def test_law_midnight_may_be_written_as_24_hours(tmp_path):
    t = loaded(
        tmp_path,
        "time [utc],body_rate_y [rad/s]\n2023-08-11T23:59:59,1\n2023-08-11T24:00:00,2\n2023-08-12T00:00:01,3\n",
    )
    assert (np.diff(t.channels["body_rate_y"].tai_ns) == NS).all()


@pytest.mark.parametrize(
    "cell",
    ["2023-02-30T00:00:00", "2023-366T00:00:00", "2015-09-29T23:59:60", "2023-08-11T25:00:00", "0001-01-01T00:00:00",
     "11.08.2023 10:00:00", "２０23-08-11T10:00:00", "1_000", "", "1e400"],
)  # fmt: skip
def test_law_what_is_no_time_is_refused_with_its_line(tmp_path, cell):
    with pytest.raises(BadInput) as why:
        loaded(tmp_path, f"time [utc],body_rate_y [rad/s]\n2023-08-11T09:59:58,1\n{cell},2\n2023-08-11T10:00:02,3\n")
    assert why.value.line == 3


DICTIONARIES = {
    "pattern": ("D;T;W\n11.08.2023;10:00:00;0,5\n11.08.2023;10:00:01;1,5\n", 'columns = ["D", "T"]\nformat = "%d.%m.%Y %H:%M:%S"'),
    "week and seconds": ("WEEK,TOW,W\n2274,468018,0.5\n2274,468019,1.5\n", 'columns = ["WEEK", "TOW"]\nunits = ["week", "s"]\nformat = "gps s"'),
    "seconds and fraction": ("SEC,US,W\n1691748000,0,0.5\n1691748000,1000000,1.5\n", 'columns = ["SEC", "US"]\nunits = ["s", "us"]\nformat = "unix s"'),
    "scale": ("T,W\n0,0.5\n1000,1.5\n", 'column = "T"\nscale = 0.001\nepoch = "2023-08-11T10:00:00"'),
    "milliseconds": ("tow(msec),W\n0,0.5\n1000,1.5\n", 'column = "tow(msec)"\nformat = "ms"\nepoch = "2023-08-11T10:00:00"'),
    "rate": ("W\n0.5\n1.5\n", 'rate = "1 Hz"\nepoch = "2023-08-11T10:00:00"'),
    "cadence": ("T,W\n2023-08-11T10:00:00,0.5\n2023-08-11T10:00:00,1.5\n", 'column = "T"\nformat = "utc"\ncadence = "1 s"'),
}  # fmt: skip


@pytest.mark.parametrize(("content", "time"), DICTIONARIES.values(), ids=DICTIONARIES)
def test_law_a_dictionary_says_how_times_are_written(tmp_path, content, time):
    t = loaded(tmp_path, content, f'[time]\n{time}\n[[channel]]\ncolumn = "W"\nname = "wheel_rate_A"\nunit = "rad/s"\n')
    c = t.channels["wheel_rate_A"]
    assert (c.tai_ns == ZERO + np.arange(2) * NS).all() and c.values.tolist() == [0.5, 1.5]


def test_law_seconds_of_week_need_their_week(tmp_path):
    with pytest.raises(BadInput, match="within a week"):
        loaded(tmp_path, "time [gps s],body_rate_y [rad/s]\n468018,1\n468019,2\n")


def test_law_a_cadence_that_contradicts_the_stamps_is_refused(tmp_path):
    rows = "".join(f"{i // 4},{i}\n" for i in range(40))
    with pytest.raises(BadInput, match="cadence"):
        loaded(
            tmp_path,
            "T,W\n" + rows,
            '[time]\ncolumn = "T"\ncadence = "2 s"\n[[channel]]\ncolumn = "W"\nname = "wheel_rate_A"\nunit = "rad/s"\n',
        )
    t = loaded(
        tmp_path,
        "T,W\n" + rows,
        '[time]\ncolumn = "T"\ncadence = "0.25 s"\n[[channel]]\ncolumn = "W"\nname = "wheel_rate_A"\nunit = "rad/s"\n',
    )
    assert (np.diff(t.channels["wheel_rate_A"].tai_ns) == NS // 4).all()


def test_law_headings_that_contradict_the_dictionary_are_doubted(tmp_path):
    t = loaded(tmp_path, "t (msec),W [rpm]\n0,100\n1,101\n2,102\n",
               '[time]\ncolumn = "t (msec)"\n[[channel]]\ncolumn = "W [rpm]"\nname = "wheel_rate_A"\nunit = "rad/s"\n')  # fmt: skip
    assert sum(f.what == "unit" for f in t.findings) == 2
    assert t.found_in(["wheel_rate_A"]).has(
        *[d.kind for d in t.found_in(["wheel_rate_A"]) if d.kind.id == "telemetry.unit-contradiction"]
    )


def test_law_euler_angles_and_a_scaled_quaternion_are_the_same_attitude(tmp_path):
    # a yaw of 90 degrees takes body x to the frame's y
    rows = "".join(f"{i},90,0,0,0,0,1414213562,1414213562\n" for i in range(5))
    head = "T,YAW,PITCH,ROLL,QX,QY,QZ,QW\n"
    euler = loaded(
        tmp_path,
        head + rows,
        '[time]\ncolumn = "T"\n[euler]\ncolumns = ["YAW", "PITCH", "ROLL"]\norder = "ZYX"\nunit = "deg"\ndirection = "body-to-frame"\n',
    )
    q = loaded(
        tmp_path,
        head + rows,
        '[time]\ncolumn = "T"\n[quaternion]\ncolumns = ["QX", "QY", "QZ", "QW"]\norder = "scalar-last"\ndirection = "body-to-frame"\nscale = 5e-10\n',
    )
    for m, want in zip("wxyz", (0.5**0.5, 0, 0, 0.5**0.5), strict=True):
        assert euler.channels[f"quaternion_{m}"].values[0] == pytest.approx(want, abs=1e-9)
        assert q.channels[f"quaternion_{m}"].values[0] == pytest.approx(want, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    numbers=st.lists(st.floats(allow_nan=False, allow_infinity=False, width=64).filter(lambda x: abs(x) < 1e50), min_size=2, max_size=8),
    ns=st.lists(st.integers(-(10**17), 10**17), min_size=2, max_size=8, unique=True),
    blank=st.booleans(),
)  # fmt: skip
def test_law_both_readers_give_the_same_to_the_last_digit(tmp_path_factory, numbers, ns, blank):
    count = min(len(numbers), len(ns))
    path = tmp_path_factory.mktemp("t") / "a[1]*.csv"  # names are not patterns
    cells = [f"{'-' if n < 0 else ''}{abs(n) // NS}.{abs(n) % NS:09d},{'' if blank and k == 1 else repr(x)},{k}_a"
             for k, (n, x) in enumerate(zip(ns[:count], numbers[:count], strict=True))]  # fmt: skip
    path.write_text("time [s],x [rad],mode\n" + "\n".join(cells) + "\n")
    file = read_text(path)
    fast, slow = text._by_duckdb(file, 0, scale_called("s"), (1,), (2,)), file.whole()
    assert fast is not None
    assert fast.instants[0].tolist() == ns[:count]
    read = [np.nan if c == "" else float(c) for c in slow.columns[1]]
    assert np.array_equal(np.ma.filled(fast.columns[1], np.nan), read, equal_nan=True)
    assert list(fast.columns[2]) == list(slow.columns[2])


def test_law_a_usual_table_takes_the_fast_way(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "_cell_by_cell", None)
    monkeypatch.setattr(text, "SMALL", 0)
    stamps = [(datetime.datetime(2023, 8, 11) + datetime.timedelta(seconds=i)).isoformat() for i in range(50)]
    for head, cells in (
        ("time [s]", range(50)),
        ("time [utc]", stamps),
        ("time [mjd]", [60000 + i for i in range(50)]),
    ):
        t = loaded(
            tmp_path,
            f"{head};body_rate_y [rad/s];control_mode\n"
            + "".join(f"{c};{i},5;SUN_POINT\n" for i, c in enumerate(cells)),
        )
        assert len(t.channels["body_rate_y"].values) == 50 and t.channels["control_mode"].values[0] == "SUN_POINT"


def test_law_a_packed_table_is_read_and_a_bomb_is_not(tmp_path, monkeypatch):
    rows = "time [s],body_rate_y [rad/s]\n" + "".join(f"{i},{i}.5\n" for i in range(100))
    path = tmp_path / "t.csv.gz"
    path.write_bytes(gzip.compress(rows.encode()))
    assert len(load_telemetry(path).channels["body_rate_y"].values) == 100
    monkeypatch.setattr(text, "UNPACKED_LIMIT", 500)
    with pytest.raises(BadInput, match="unpacks to more"):
        load_telemetry(path)


def test_law_a_text_too_large_for_the_slow_way_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "SLOW_LIMIT", 50)
    with pytest.raises(BadInput, match="cell by cell"):
        loaded(tmp_path, 'time [s],body_rate_y [rad/s]\n"0",1\n"1",2\n"2",3\n"3",4\n')


@pytest.mark.parametrize(
    "pattern",
    [
        "%Y-%j/%H:%M:%S", "%Y %j %H:%M:%S", "%Y/%j-%H:%M:%S", "%Y%m%dT%H%M%SZ", "%d-%b-%Y %H:%M:%S", "%Y %b %d %H:%M:%S", "%d %B %Y %H:%M:%S",
        "%Y-%m-%d_%H:%M:%S", "%Y-%m-%d %H:%M:%S GMT", "%Y-%m-%dT%H:%M:%S.%f+0000",
    ],
)  # fmt: skip
@pytest.mark.parametrize("heading", ["time [utc]", "Timestamp", "UTC", "time_utc", "datetime [iso8601]"])
def test_law_dates_as_programs_write_them(tmp_path, pattern, heading):
    stamps = [(datetime.datetime(2023, 8, 11, 10) + datetime.timedelta(seconds=k)).strftime(pattern) for k in range(3)]
    t = loaded(tmp_path, f"{heading},body_rate_x [deg/sec]\n" + "".join(f"{s},{k}\n" for k, s in enumerate(stamps)))
    assert (t.channels["body_rate_x"].tai_ns == ZERO + np.arange(3) * NS).all()


@pytest.mark.parametrize(
    "stamp", ["08/11/2023 10:00:00", "20230811", "2023-08-11+02:00", "11-Xyz-2023 10:00:00", "2023-13-01T00:00:00"]
)
def test_dates_that_may_mean_two_things_are_refused(tmp_path, stamp):
    with pytest.raises(BadInput):
        loaded(tmp_path, f"time [utc],body_rate_x [rad/s]\n{stamp},1\n")


@pytest.mark.parametrize("word", ["N/A", "-", "#N/A", "null", "None", "#DIV/0!", "<NA>", "1.#QNAN", "nan"])
def test_law_words_for_no_value_are_blanks_and_told(tmp_path, word):
    t = loaded(tmp_path, f"time [s],body_rate_x [rad/s]\n0,1\n1,{word}\n2,3\n")
    assert t.channels["body_rate_x"].values.tolist() == [1, 3] and [f.what for f in t.findings][:1] == ["nan"]


def test_law_forms_of_spreadsheets_and_programs(tmp_path):
    rows = [(0, 1.5), (1, -2.5), (2, 3.5)]
    plain = "time [s],body_rate_x [deg/s]\n" + "".join(f"{t},{v}\n" for t, v in rows)
    said = loaded(tmp_path, plain).channels["body_rate_x"].values
    forms = {
        "index": ",time [s],body_rate_x [deg/s]\n" + "".join(f"{k},{t},{v}\n" for k, (t, v) in enumerate(rows)),
        "blanks": "  time [s]   body_rate_x [deg/s]\n" + "".join(f"   {t}     {v}\n" for t, v in rows),
        "spare": "time [s],body_rate_x [deg/s]\n" + "".join(f"{t},{v},\n" for t, v in rows),
        "minus": plain.replace("-", "\N{MINUS SIGN}"),
        "fortran": plain.replace("1.5", "1.5D+00").replace("3.5", "0.35d1"),
        "degree sign": plain.replace("deg", "°"),
    }
    for name, content in forms.items():
        assert loaded(tmp_path, content, name=f"{name}.csv").channels["body_rate_x"].values == pytest.approx(said, rel=1e-15), name  # fmt: skip
    for encoding in ("latin-1", "utf-16", "utf-16-le"):
        (tmp_path / "e.csv").write_bytes((forms["degree sign"] + "3,1\n" * (encoding == "x")).encode(encoding))
        assert load_telemetry(tmp_path / "e.csv").channels["body_rate_x"].values == pytest.approx(said, rel=1e-15), (
            encoding
        )
