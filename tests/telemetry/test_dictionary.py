"""Channel dictionaries: columns to house names, units and conventions."""

import numpy as np
import pytest

from asflown.kit.errors import BadInput
from asflown.kit.rotations import lvlh_to_inertial, quaternion, rotation
from asflown.telemetry.load import load_telemetry
from flights import written
from telemetry.signals import slew

TIME = '[time]\ncolumn = "T"\nformat = "gps s"\n'
WHEEL = '[[channel]]\ncolumn = "SPD"\nname = "wheel_rate_1"\nunit = "rpm"\n'


def loaded(tmp_path, table, toml):
    return load_telemetry(written(tmp_path, table), channels=written(tmp_path, toml, "d.toml"))


def csv_of(headings, *columns):
    rows = zip(*[np.asarray(c).tolist() for c in columns], strict=True)
    return "\n".join([",".join(headings), *(",".join(repr(v) for v in row) for row in rows)]) + "\n"


def test_scale_offset_count_and_ignored_columns(tmp_path):
    toml = TIME + WHEEL + 'scale = 2\noffset = 1\ncount = "0.4 rpm"\n'
    t = loaded(tmp_path, "T,SPD,OTHER\n1238630400,10,a\n1238630401,20,b\n", toml)
    c = t.channel("wheel_rate_1")
    assert c.values == pytest.approx(np.array([21, 41]) * 2 * np.pi / 60)
    assert c.count_size == pytest.approx(0.4 * 2 * np.pi / 60)
    assert [(f.what, f.count) for f in t.findings] == [("ignored", 1)] and "OTHER" in t.findings[0].detail
    assert t.epoch_label == "2019-04-06T23:59:42 UTC"


def test_cells_in_counts_take_the_size_of_one(tmp_path):
    toml = TIME + WHEEL.replace('"rpm"', '"count"') + 'offset = -5\ncount = "0.4 rpm"\n'
    t = loaded(tmp_path, "T,SPD\n1238630400,10\n1238630401,20\n", toml)
    assert t.channel("wheel_rate_1").values == pytest.approx(np.array([2.0, 6.0]) * 2 * np.pi / 60)


def test_wrap_in_counts_or_units(tmp_path):
    table = csv_of(["T", "N"], 1238630400 + np.arange(40.0), np.mod(np.arange(40) * 30.0, 256))
    entry = '[[channel]]\ncolumn = "N"\nname = "on_time_Z1"\nunit = "count"\ncount = "8 ms"\nwrap = "{}"\n'
    for wrap in ("256 count", "2048 ms"):
        t = loaded(tmp_path, table, TIME + entry.format(wrap))
        assert t.channel("on_time_Z1").values == pytest.approx(0.008 * 30 * np.arange(40))
        assert [f.count for f in t.findings if f.what == "wrap"] == [4]


@pytest.mark.parametrize("form", ["s", "utc", "unix s"])
def test_time_formats(tmp_path, form):
    cells = {"s": "0.5", "utc": "2017-01-01T00:00:00.5", "unix s": "1483228800.5"}[form]
    after = {"s": "2", "utc": "2017-01-01T00:00:02", "unix s": "1483228802"}[form]
    epoch = 'epoch = "2017-01-01T00:00:00"\n' if form == "s" else ""
    t = loaded(tmp_path, f"T,SPD\n{cells},1\n{after},2\n", f'[time]\ncolumn = "T"\nformat = "{form}"\n{epoch}' + WHEEL)
    assert t.epoch_label == "2017-01-01T00:00:00 UTC"
    assert t.seconds(t.channel("wheel_rate_1").tai_ns).tolist() == [0.5, 2.0]


def test_long_table_and_labels(tmp_path):
    toml = TIME + '[long]\nchannel = "MNEMONIC"\nvalue = "VALUE"\n' + WHEEL
    t = loaded(tmp_path, "T,MNEMONIC,VALUE\n1238630400,SPD,60\n1238630400,OTHER,x\n1238630404,SPD,120\n", toml)
    assert t.channel("wheel_rate_1").values == pytest.approx([2 * np.pi, 4 * np.pi])
    toml = TIME + 'labels = ["SCLK"]\n' + WHEEL
    t = loaded(tmp_path, "T,SCLK,SPD\n1238630401,1/2,60\n1238630402,1/3,60.4\n", toml)
    assert t.time_labels["SCLK"].tolist() == ["1/2", "1/3"]


BAD = {
    "unknown key": (TIME + WHEEL + "colour = 3\n", "unknown key"),
    "no time": (WHEEL, "time"),
    "not toml": ("[time\n", "not a TOML file"),
    "absent column": (TIME + WHEEL.replace("SPD", "SPEED"), "not in the file: SPEED"),
    "column twice": (TIME + WHEEL + WHEEL.replace("_1", "_2"), "a column is mapped twice: SPD"),
    "name twice": (TIME + WHEEL + WHEEL.replace("SPD", "X"), "a channel is mapped twice: wheel_rate_1"),
    "unknown name": (TIME + WHEEL.replace("wheel_rate", "wheelrate"), "'wheelrate_1'"),
    "unknown unit": (TIME + WHEEL.replace("rpm", "rmp"), "[rmp]"),
    "no size of a count": (TIME + WHEEL.replace("rpm", "count"), "size of one"),
    "no modulus": (TIME + WHEEL + 'wrap = "0 count"\n', "must be positive"),
    "nothing": (TIME, "maps no column"),
    "lvlh without orbit": (
        TIME
        + '[quaternion]\ncolumns=["T","SPD","a","b"]\norder="scalar-first"\ndirection="body-to-frame"\nframe="lvlh"\n',
        "needs the orbit",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_dictionary_is_one_clear_complaint(tmp_path, case):
    toml, words = BAD[case]
    with pytest.raises(BadInput) as told:
        loaded(tmp_path, "T,SPD\n1238630400,10\n1238630401,20\n", toml)
    assert words in str(told.value) and len(str(told.value)) <= BadInput.LONGEST
    with pytest.raises(BadInput, match="no such channel dictionary"):
        load_telemetry(written(tmp_path, "T,SPD\n1,1\n"), channels=tmp_path / "none.toml")


RATES = "".join(f'[[channel]]\ncolumn = "w{a}"\nname = "body_rate_{a}"\nunit = "rad/s"\n' for a in "xyz")


def quaternion_toml(order, handedness, direction, frame="inertial"):
    return (
        TIME + f'[quaternion]\ncolumns = ["q0", "q1", "q2", "q3"]\norder = "{order}"\nhandedness = "{handedness}"\n'
        f'direction = "{direction}"\nframe = "{frame}"\n'
    )


def as_written(q, order, handedness, direction):
    """What a spacecraft of the given convention would send for the house quaternion q."""
    if (direction == "frame-to-body") != (handedness == "jpl"):
        q = q * [1, -1, -1, -1]
    return np.roll(q, -1, axis=1) if order == "scalar-last" else q


CONVENTIONS = [
    (o, h, d)
    for o in ("scalar-first", "scalar-last")
    for h in ("hamilton", "jpl")
    for d in ("body-to-frame", "frame-to-body")
]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_quaternion_convention_becomes_the_houses(tmp_path, convention):
    t, w, q = slew()
    sent = as_written(q, *convention)
    table = csv_of(["T", "wx", "wy", "wz", "q0", "q1", "q2", "q3"], 1238630400 + t, *w.T, *sent.T)
    found = loaded(tmp_path, table, quaternion_toml(*convention) + RATES)
    got = np.stack([found.channel(f"quaternion_{m}").values for m in "wxyz"], axis=1)
    assert got == pytest.approx(q, abs=1e-15)
    order, handedness, direction = convention
    other = "body-to-frame" if direction == "frame-to-body" else "frame-to-body"
    with pytest.raises(BadInput, match=f'direction = "{direction}" leaves'):
        loaded(tmp_path, table, quaternion_toml(order, handedness, other) + RATES)
    other = "scalar-first" if order == "scalar-last" else "scalar-last"
    with pytest.raises(BadInput, match="turns against"):
        loaded(tmp_path, table, quaternion_toml(other, handedness, direction) + RATES)


def test_jpl_matrix_is_the_transpose_of_hamiltons():
    # Trawny and Roumeliotis 2005, eq 62: C = (2 q4^2 - 1) 1 - 2 q4 [v x] + 2 v v^T
    from asflown.telemetry.dictionary import QuaternionEntry

    v, s = np.array([0.1, -0.5, 0.3]), np.sqrt(1 - 0.35)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    C = (2 * s**2 - 1) * np.eye(3) - 2 * s * cross + 2 * np.outer(v, v)
    said = QuaternionEntry(
        columns=("a", "b", "c", "d"), order="scalar-last", handedness="jpl", direction="frame-to-body"
    )
    house = said.house(np.array([[*v, s]]))
    assert rotation(house)[0].as_matrix() == pytest.approx(C.T, abs=1e-12)  # body to frame


def test_lvlh_quaternion_has_the_orbits_turning_removed(tmp_path):
    t = np.arange(0, 1200.0)
    rate = 1.13e-3
    r = 6.78e6 * np.stack([np.cos(rate * t), np.sin(rate * t) * 0.6, np.sin(rate * t) * 0.8], axis=1)
    v = 6.78e6 * rate * np.stack([-np.sin(rate * t), np.cos(rate * t) * 0.6, np.cos(rate * t) * 0.8], axis=1)
    tilt = rotation([0.8, 0.36, 0.48, 0.0])
    q = quaternion(tilt) * np.ones((len(t), 4))  # a body at rest in LVLH
    w = tilt.inv().apply([0, -rate, 0]) + 1e-7 * np.random.default_rng(0).standard_normal((len(t), 3))
    r_sent = r.copy()
    r_sent[500:505] = r_sent[499]  # held positions are not believed
    names = ["T", "wx", "wy", "wz", "q0", "q1", "q2", "q3", "rx", "ry", "rz", "vx", "vy", "vz"]
    table = csv_of(names, 1238630400 + t, *w.T, *q.T, *(r_sent / 1e3).T, *v.T)
    orbit = '[orbit]\nposition = ["rx", "ry", "rz"]\nposition_unit = "km"\nvelocity = ["vx", "vy", "vz"]\nvelocity_unit = "m/s"\n'
    toml = quaternion_toml("scalar-first", "hamilton", "{}", "lvlh") + orbit + RATES
    found = loaded(tmp_path, table, toml.format("body-to-frame"))
    got = np.stack([found.channel(f"quaternion_{m}").values for m in "wxyz"], axis=1)
    truth = lvlh_to_inertial(r, v) * tilt
    assert np.max((truth.inv() * rotation(got)).magnitude()) < 1e-7  # rad
    assert not found.doubts
    with pytest.raises(BadInput, match='direction = "body-to-frame"'):
        loaded(tmp_path, table, toml.format("frame-to-body"))
    with pytest.raises(BadInput, match="does not change as its velocity predicts"):
        loaded(tmp_path, table, toml.format("body-to-frame").replace('"m/s"', '"km/s"'))
